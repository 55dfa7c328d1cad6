// Hempe 2005, 10.2: soft shadows.

#include <fmt/format.h>

#include "client/app/trade_preset.h"

namespace umbriel {
namespace {

const std::vector<std::pair<std::string, TradeSetting>>& filterRows() {
    static const std::vector<std::pair<std::string, TradeSetting>> rows = {
        {"hard", presetSetting("std", 1024)},
        {"64", presetSetting("pcf", 1024, {{"samplesPerRow", "8"}})},
        {"36", presetSetting("pcf", 1024, {{"samplesPerRow", "6"}})},
        {"36+hardware", presetSetting("pcf", 1024, {{"samplesPerRow", "6"}, {"hardwareFilter", "true"}})},
        {"36+gauss", presetSetting("pcf", 1024, {{"samplesPerRow", "6"}, {"gauss", "4"}})},
        {"36+gauss, no edges",
         presetSetting("pcf", 1024, {{"samplesPerRow", "6"}, {"gauss", "4"}, {"edgeThreshold", "0"}})},
        {"36 at 512", presetSetting("pcf", 512, {{"samplesPerRow", "6"}})},
        {"36+hardware at 512", presetSetting("pcf", 512, {{"samplesPerRow", "6"}, {"hardwareFilter", "true"}})},
        {"36 at 2048", presetSetting("pcf", 2048, {{"samplesPerRow", "6"}})},
        {"ppcf", presetSetting("ppcf", 1024)},
        {"ppcf+hardware", presetSetting("ppcf", 1024, {{"hardwareFilter", "true"}})},
        {"ppcf+gauss", presetSetting("ppcf", 1024, {{"gauss", "4"}})},
        {"ppcf+gauss, no edges", presetSetting("ppcf", 1024, {{"gauss", "4"}, {"edgeThreshold", "0"}})}};
    return rows;
}

std::vector<PresetRun> soft(const TradeArguments& arguments) {
    std::vector<PresetRun> runs;
    // Radii: twenty times the sun's are 0.09.
    for (const auto& [title, size] : {std::pair("a small light", 0.01), std::pair("a large light", 0.04)}) {
        PresetRun run{.title = fmt::format("soft shadows, {} (Hempe 10.2)", title),
                      .scene = presetScene(arguments),
                      .camera = "main",
                      .lightSize = size,
                      .frames = arguments.frames};
        for (const auto& [name, setting] : filterRows()) run.settings.push_back(setting);
        runs.push_back(run);
    }
    return runs;
}
void judgeSoft(const PresetOutcome& outcome, Expectations& expect) {
    for (std::size_t run = 0; run < outcome.runs.size(); ++run) {
        const std::string light = run == 0 ? "small light: " : "large light: ";
        const auto of = [&](std::string_view name, const Figure& figure) -> std::optional<double> {
            for (const auto& [known, setting] : filterRows())
                if (known == name) return outcome.figure(run, labelOf(setting), figure);
            return std::nullopt;
        };
        const auto rmse = [&](std::string_view name) {
            return of(name, [](const TradeRow& row) { return std::optional(row.errors.error.rmse); });
        };
        const auto e = [&](std::string_view name) { return of(name, errorOf); };
        expect.less(light + "PPCF is nearer to the truth than PCF", e("ppcf"), e("36"));
        expect.less(light + "PPCF is nearer to the truth than a hard shadow", e("ppcf"), e("hard"));
        expect.less(light + "64 samples before 36, RMSE", rmse("64"), rmse("36"), kPlain);
        expect.less(light + "the hardware's filter on 36 samples before 36 alone, RMSE", rmse("36+hardware"),
                    rmse("36"), kPlain);
        expect.less(light + "and before 64 without it, RMSE", rmse("36+hardware"), rmse("64"), kPlain);
        expect.less(light + "at 512 the hardware's filter does not make up for the map", rmse("36+hardware"),
                    rmse("36+hardware at 512"), kPlain);
        expect.less(light + "PCF's edges blur more the coarser the map: 8 texels in metres, 1024 against 512",
                    of("36", texelOf), of("36 at 512", texelOf), kMetres, "the width is given in texels");
        const std::string narrow = "4 pixels are wider than the penumbrae here, and than the fronds' shadows";
        expect.less(light + "Gauss helps PCF, RMSE", rmse("36+gauss"), rmse("36"), kPlain, {}, narrow);
        expect.less(light + "Gauss helps PPCF, RMSE", rmse("ppcf+gauss"), rmse("ppcf"), kPlain, {}, narrow);
        expect.less(light + "with edges there is no halo: less error than without, PPCF and Gauss", e("ppcf+gauss"),
                    e("ppcf+gauss, no edges"));
        expect.less(light + "the same of PCF and Gauss", e("36+gauss"), e("36+gauss, no edges"));
    }
    const auto width = [&](std::size_t run) { return outcome.figure(run, "ppcf 1024", errorOf); };
    expect.less("the hard shadow is farther from the truth under the large light than under the small one",
                outcome.figure(0, "std 1024", errorOf), outcome.figure(1, "std 1024", errorOf));
    expect.less("PPCF follows the light: at most 1.1 times as far off under the large one", width(1),
                timesAtMost(1.1, width(0)));
}

// Where a palm's shadow and the aeroplane's meet.
std::vector<PresetRun> overlap(const TradeArguments& arguments) {
    std::vector<PresetRun> runs;
    for (const auto& [title, camera] :
         {std::pair("palms and aeroplane", "main"), std::pair("fronds over fronds", "oblique")}) {
        PresetRun run{.title = fmt::format("overlapping shadows (Hempe 8.2.1, 10.2): {}", title),
                      .scene = presetScene(arguments),
                      .camera = camera,
                      .lightSize = 0.04,
                      .frames = 4};
        run.settings = {presetSetting("ppcf", 1024), presetSetting("ppcf", 1024, {{"nearestBlocker", "true"}})};
        runs.push_back(run);
    }
    return runs;
}
void judgeOverlap(const PresetOutcome& outcome, Expectations& expect) {
    for (std::size_t run = 0; run < outcome.runs.size(); ++run)
        expect.less(outcome.runs[run].camera + ": the mean of the blockers before the nearest to the light",
                    outcome.figure(run, "ppcf 1024", errorOf),
                    outcome.figure(run, "ppcf 1024 nearestBlocker=true", errorOf), kPercent,
                    "the nearest makes the penumbra of what is far above where something low casts the shadow");
}

}  // namespace

std::vector<TradePreset> softShadowPresets() {
    return {{"soft", "PCF with 64, 36 and 36 samples + hardware, Gauss, PPCF; a small and a large light (Hempe 10.2)",
             soft, judgeSoft},
            {"overlap", "PPCF by the mean and by the nearest blocker where shadows overlap (Hempe 8.2.1)", overlap,
             judgeOverlap}};
}

}  // namespace umbriel
