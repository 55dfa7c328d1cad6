#include "client/app/trade_preset.h"

#include <gtest/gtest.h>

#include <set>

#include "client/app/trade_presets.h"

namespace umbriel {
namespace {

std::vector<TradePreset> all() {
    std::vector<TradePreset> presets = hardShadowPresets();
    for (const auto& more : {softShadowPresets(), shadowCostPresets(), shadowLimitPresets()})
        presets.insert(presets.end(), more.begin(), more.end());
    return presets;
}

TEST(TradePresets, SayThatNothingIsKnownWhereNothingWasMeasured) {
    for (const TradePreset& preset : all()) {
        PresetOutcome outcome;
        outcome.runs = preset.runs({});
        EXPECT_FALSE(outcome.runs.empty());
        Expectations expect;
        preset.judge(outcome, expect);
        for (const Expectation& one : expect.take())
            EXPECT_EQ(one.state, Expectation::State::Open) << preset.name << ": " << one.text;
    }
}

// Every figure that an expectation asks for is one of a row that its runs draw.
TEST(TradePresets, HaveARowForEveryFigureThatIsAskedFor) {
    for (const TradePreset& preset : all()) {
        PresetOutcome outcome;
        outcome.runs = preset.runs({});
        for (std::size_t run = 0; run < outcome.runs.size(); ++run) {
            outcome.results.emplace_back();
            for (std::size_t i = 0; i < outcome.runs[run].settings.size(); ++i) {
                TradeRow row;
                row.setting = outcome.runs[run].settings[i];
                // All different, so that none counts as unchanged.
                const double figure = 1.0 + 0.01 * static_cast<double>(i) + 0.1 * static_cast<double>(run);
                row.errors.error.leak = figure;
                row.errors.zoneErrors = {figure, figure, figure};
                row.errors.zoneTexels = {figure, figure, figure};
                row.errors.zoneMissing = {figure, figure, figure};
                row.errors.texelMetres = figure;
                row.errors.leakBeyondTexel = row.errors.acneBeyondTexel = figure;
                row.cost.cpuMilliseconds = row.cost.cpuRatio = figure;
                outcome.results.back().rows.push_back(std::move(row));
            }
        }
        Expectations expect;
        preset.judge(outcome, expect);
        const auto said = expect.take();
        EXPECT_FALSE(said.empty()) << preset.name;
        std::set<std::string> texts;
        for (const Expectation& one : said) {
            EXPECT_NE(one.state, Expectation::State::Open) << preset.name << ": " << one.text;
            EXPECT_TRUE(texts.insert(one.text).second) << preset.name << ": twice: " << one.text;
        }
    }
}

TEST(TradePresets, WithoutASceneTheyAreOnThePalmsAndTheCommandLinesSceneGoesFirst) {
    TradeArguments arguments;
    EXPECT_EQ(presetScene(arguments).scene, "demo:palms");
    arguments.scene.scene = "scene.gltf";
    EXPECT_EQ(presetScene(arguments).scene, "scene.gltf");
}

TEST(TradeExpectations, AreMetByWhatIsLessAndSayWhyWhenTheyAreNot) {
    Expectations expect;
    expect.less("a", 0.01, 0.02, kPercent, "because", "whereas");
    expect.less("b", 0.02, 0.01, kPercent, "because", "whereas");
    expect.less("c", std::nullopt, 0.01);
    expect.atMost("d", 1.0, 1.0, kTimes);
    expect.atLeast("e", 0.5, 1.0, kTimes, {}, "whereas");
    const auto said = expect.take();
    ASSERT_EQ(said.size(), 5u);
    EXPECT_EQ(said[0].state, Expectation::State::Met);
    EXPECT_EQ(said[0].figures, "1 % against 2 %");
    EXPECT_EQ(said[0].why, "because");
    EXPECT_EQ(said[1].state, Expectation::State::NotMet);
    EXPECT_EQ(said[1].why, "because; whereas");
    EXPECT_EQ(said[2].state, Expectation::State::Open);
    EXPECT_EQ(said[3].state, Expectation::State::Met);
    EXPECT_EQ(said[4].state, Expectation::State::NotMet);
    EXPECT_EQ(said[4].why, "whereas");
}

}  // namespace
}  // namespace umbriel
