#include "client/app/trade_presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <ostream>

#include "client/app/trade_bench.h"
#include "client/app/trade_preset.h"
#include "client/session/field_text.h"
#include "client/trade/trade_report.h"
#include "common/base/log.h"

namespace umbriel {
namespace {

std::vector<TradePreset> allPresets() {
    std::vector<TradePreset> all = hardShadowPresets();
    for (const auto& more : {softShadowPresets(), shadowCostPresets(), shadowLimitPresets()})
        all.insert(all.end(), more.begin(), more.end());
    return all;
}

// Everything below a new root that scales and moves it, the near planes of cameras with it.
void placeAnew(TradeBench& bench, double scale, double offset) {
    if (scale == 1.0 && offset == 0.0) return;
    Aspect& scene = bench.scene();
    const Ref<Transform> transform = scene.create<Transform>("elsewhere");
    scene.edit(transform)
        .set<&Transform::linear>(glm::mat3(static_cast<float>(scale)))
        .set<&Transform::translation>(glm::dvec3(offset));
    const Ref<Node> root = scene.create<Node>("elsewhere");
    const Ref<Viewport> viewport = bench.stage().viewport;
    scene.edit(root).set<&Node::core>(Ref<Container>(transform.id)).append<&Node::children>(scene.get(viewport).root);
    scene.edit(viewport).set<&Viewport::root>(root);
    for (const ContainerId id : scene.ids())
        if (const auto* camera = scene.findAs<PerspectiveCamera>(id))
            scene.edit(Ref<PerspectiveCamera>(id)).set<&PerspectiveCamera::nearDistance>(camera->nearDistance * scale);
}

Result<TradeResult> perform(const PresetRun& run, const std::filesystem::path& serverProgram,
                            std::set<std::string>& missing) {
    TradeBenchOptions options;
    options.judgeNode = run.judge;
    options.bothSides = run.bothSides;
    options.lightSize = run.lightSize;
    auto bench = TradeBench::open(run.scene, serverProgram, options);
    if (!bench) return bench.error();
    if (!run.camera.empty() && run.scene.camera.empty() && run.scene.eye.empty())
        if (const auto used = (*bench)->useCamera(run.camera); !used) log::warning(used.error().message);
    placeAnew(**bench, run.scale, run.offset);
    if (run.errors)
        if (const auto looked = (*bench)->look(); !looked) return looked.error();
    std::vector<TradeRow> rows;
    for (const TradeSetting& one : run.settings) {
        bool drawn = true;
        if (const auto technique = parseTechnique(one.technique); !technique) {
            missing.insert(one.technique);
            drawn = false;
        }
        for (const auto& [field, value] : one.fields)
            if (!hasField((*bench)->scene(), (*bench)->stage().viewport, field)) {
                missing.insert(field);
                drawn = false;
            }
        if (!drawn) continue;
        TradeRow row;
        row.setting = one;
        if (run.errors)
            if (const auto measured = (*bench)->measure(row); !measured) return measured.error();
        rows.push_back(std::move(row));
    }
    if (const auto timed = (*bench)->time(rows, run.frames); !timed) return timed.error();
    TradeResult result = (*bench)->describe();
    result.scene += ": " + run.title;
    result.rows = std::move(rows);
    if (run.errors)
        for (const std::size_t i : paretoFront(result.rows)) result.rows[i].onFront = true;
    return result;
}

}  // namespace

std::string tradePresets() {
    std::string text;
    for (const TradePreset& preset : allPresets()) text += fmt::format("  {:<12} {}\n", preset.name, preset.about);
    return text;
}

int runTradePreset(const TradeArguments& arguments, const std::filesystem::path& serverProgram, std::ostream& out) {
    const auto presets = allPresets();
    const auto preset =
        std::find_if(presets.begin(), presets.end(), [&](const TradePreset& p) { return p.name == arguments.preset; });
    if (preset == presets.end())
        return exitCodeOf(badInput(fmt::format("--preset '{}': there are\n{}", arguments.preset, tradePresets())));
    const bool prints = !arguments.scene.quiet && !arguments.json;
    PresetOutcome outcome;
    outcome.runs = preset->runs(arguments);
    for (const PresetRun& run : outcome.runs) {
        auto result = perform(run, serverProgram, outcome.missing);
        if (!result) return exitCodeOf(result.error());
        if (prints) {
            if (run.errors) {
                printTrade(*result, out);
                printZones(*result, out);
            } else {
                printCosts(*result, out);
            }
            out.flush();
        }
        outcome.results.push_back(std::move(*result));
    }
    Expectations expect;
    preset->judge(outcome, expect);
    const std::vector<Expectation> expected = expect.take();
    if (const auto written = writeTradeReports(arguments.out, outcome.results, expected, preset->name); !written)
        return exitCodeOf(written.error());
    if (arguments.json) {
        out << tradeJson(preset->name, outcome.results, expected);
        return out.good() ? 0 : 1;
    }
    if (!outcome.missing.empty()) {
        out << "not in this version:";
        for (const std::string& name : outcome.missing) out << ' ' << name;
        out << '\n';
    }
    printExpectations(expected, out);
    return out.good() ? 0 : 1;
}

}  // namespace umbriel
