#include "client/app/frame_budget.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/app/light_map_scene.h"
#include "common/base/log.h"

namespace umbriel {

Result<FrameBudget> FrameBudget::begin(const SceneArguments& arguments, Aspect& scene, Ref<Window> window) {
    const double budget = arguments.frameBudget.value_or(0.0);
    if (!(budget > 0.0)) return badInput(fmt::format("--frame-budget {}: expected more than 0 milliseconds", budget));
    const auto path = tradeFileOf(arguments.scene);
    auto stored = readTrade(path);
    if (!stored) return stored.error();
    if (!*stored || (*stored)->front.empty())
        return badInput(
            fmt::format("--frame-budget: there is no measured front in {}; run umbriel trade {} --store first",
                        path.string(), arguments.scene));
    std::vector<StoredTrade::Point> front = std::move((*stored)->front);
    if (!hasLightMap(arguments)) {
        const std::size_t left =
            std::erase_if(front, [](const StoredTrade::Point& point) { return isLightMap(point.setting); });
        if (front.empty())
            return badInput(
                fmt::format("--frame-budget: all of the front in {} are light maps, and there is none; make "
                            "it with umbriel bake {} --light-map N",
                            path.string(), arguments.scene));
        if (left > 0)
            log::warning(
                fmt::format("{}: without a light map, {} settings of the front are left out; umbriel bake {} "
                            "--light-map N makes one",
                            path.string(), left, arguments.scene));
    }
    std::stable_sort(front.begin(), front.end(),
                     [](const auto& a, const auto& b) { return a.wallMilliseconds < b.wallMilliseconds; });
    std::vector<double> costs;
    for (const StoredTrade::Point& point : front) costs.push_back(point.wallMilliseconds);
    FrameGovernor::Options options;
    options.budgetMilliseconds = budget;
    FrameBudget made(scene, window, std::move(front), FrameGovernor(std::move(costs), options));
    if (const auto applied = made._settings.apply(made.setting()); !applied)
        return badInput(fmt::format("{}: {}", path.string(), applied.error().message));
    return made;
}

Result<void> FrameBudget::follow(const FrameReport& report) {
    double slowest = 0.0;
    for (const ServerReport& server : report.servers)
        if (server.shown) slowest = std::max(slowest, server.drawMilliseconds);
    if (!(slowest > 0.0) || !_governor.observe(slowest)) return {};
    log::info(fmt::format("frame {}: {:.1f} ms, from now on {}", report.frame, slowest, labelOf(setting())));
    return _settings.apply(setting());
}

}  // namespace umbriel
