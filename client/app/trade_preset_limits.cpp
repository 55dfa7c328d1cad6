// Our own checks: how errors fall with the map's size, and what holds at every scale and place.

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "client/app/trade_preset.h"

namespace umbriel {
namespace {

constexpr std::array<std::uint32_t, 4> kSizes = {512, 1024, 2048, 4096};
// Among the palms, above the dinosaur.
constexpr const char* kLamp = "point:1,7,-3";

struct Convergence {
    std::size_t run;
    const char* technique;
    SettingFields fields;
    bool halves;  // errors fall by 0.7 or more with each doubling, down to 0.1 %; else they only do not grow
};
const std::vector<Convergence>& convergent() {
    static const std::vector<Convergence> all = {{0, "std:scene", {}, true},
                                                 {0, "std", {}, true},
                                                 {0, "psm", {}, true},
                                                 {0, "lisp", {}, true},
                                                 {0, "trapez", {}, true},
                                                 {0, "pcf", {}, false},
                                                 {0, "pcf", {{"filterMetres", "0.2"}}, false},
                                                 {0, "ppcf", {}, true},
                                                 {1, "cube", {}, true},
                                                 {1, "dual-paraboloid", {}, false},
                                                 {2, "ppcf", {}, false}};
    return all;
}

std::vector<PresetRun> convergence(const TradeArguments& arguments) {
    std::vector<PresetRun> runs = {
        {.title = "convergence, 512 to 4096", .scene = presetScene(arguments), .frames = 1},
        {.title = "convergence around a lamp, 512 to 4096", .scene = presetScene(arguments), .frames = 1},
        {.title = "convergence, soft sun, 512 to 4096",
         .scene = presetScene(arguments),
         .lightSize = 0.02,
         .frames = 1}};
    if (arguments.scene.lights.empty()) runs[1].scene.lights = {kLamp};
    for (const Convergence& one : convergent())
        for (const std::uint32_t size : kSizes)
            runs[one.run].settings.push_back(presetSetting(one.technique, size, one.fields));
    return runs;
}
void judgeConvergence(const PresetOutcome& outcome, Expectations& expect) {
    for (const Convergence& one : convergent())
        for (std::size_t i = 0; i + 1 < kSizes.size(); ++i) {
            const auto e = [&](std::uint32_t size) {
                return outcome.figure(one.run, labelOf(presetSetting(one.technique, size, one.fields)), errorOf);
            };
            const auto before = e(kSizes[i]);
            const auto limit = !before      ? std::nullopt
                               : one.halves ? std::optional(std::max(0.7 * *before, 1e-3) + 1e-12)
                                            : std::optional(*before + 5e-4 + 1e-12);
            const std::string name = one.fields.empty() ? one.technique : std::string(one.technique) + " 0.2 m wide";
            expect.less(
                fmt::format("{}{}: {} to {}, {}", one.run == 2 ? "soft sun, " : "", name, kSizes[i], kSizes[i + 1],
                            one.halves ? "0.7 of the error before, down to 0.1 %" : "not 0.05 points more"),
                e(kSizes[i + 1]), limit, kPercent, {},
                i == 0 ? "leaflets are 6 cm wide, texels of a uniform map of 512 some 25 cm: what is thinner than a "
                         "texel is drawn or missed by chance"
                       : "");
        }
}

struct Place {
    double scale, offset;
};
constexpr std::array<Place, 9> kPlaces = {
    {{1, 0}, {1, 1e3}, {1, 1e6}, {1e-3, 0}, {1e-2, 0}, {1e2, 0}, {1e4, 0}, {1e-3, 1e6}, {1e4, 1e6}}};

std::vector<PresetRun> extremes(const TradeArguments& arguments) {
    std::vector<std::string> sun = {"std:scene", "std",   "psm",   "lisp",   "trapez",        "pcf",
                                    "ppcf",      "zpass", "zfail", "planar", "planar-stencil"};
    std::vector<std::string> lamp = {"std", "cube", "dual-paraboloid", "zpass", "zfail"};
    if (!arguments.techniques.empty()) {
        sun.clear();
        lamp.clear();
        for (std::size_t begin = 0; begin <= arguments.techniques.size();) {
            const std::size_t end = std::min(arguments.techniques.find(',', begin), arguments.techniques.size());
            sun.push_back(arguments.techniques.substr(begin, end - begin));
            begin = end + 1;
        }
    }
    std::vector<PresetRun> runs;
    for (const Place& place : kPlaces)
        for (const bool isLamp : {false, true}) {
            if (isLamp && lamp.empty()) continue;
            PresetRun run{.title = fmt::format("scale {:g}, {:g} m from the origin, {}", place.scale, place.offset,
                                               isLamp ? "a lamp" : "the sun"),
                          .scene = presetScene(arguments),
                          .scale = place.scale,
                          .offset = place.offset,
                          .frames = 1};
            if (isLamp) run.scene.lights = {kLamp};
            for (const std::string& technique : isLamp ? lamp : sun)
                run.settings.push_back(presetSetting(technique, 1024));
            runs.push_back(run);
        }
    return runs;
}
void judgeExtremes(const PresetOutcome& outcome, Expectations& expect) {
    for (std::size_t run = 0; run < outcome.results.size(); ++run)
        for (const TradeRow& row : outcome.results[run].rows) {
            const std::string where = fmt::format("{}, {}", labelOf(row.setting), outcome.runs[run].title);
            // Without a map there is no texel: away from an edge is two pixels of the picture.
            const TradeErrors& e = row.errors;
            const bool map = e.leakBeyondTexel.has_value();
            expect.atMost(where + (map ? ": leaks beyond a texel" : ": leaks beyond two pixels"),
                          map ? *e.leakBeyondTexel : e.error.leakAway, 1e-3);
            expect.atMost(where + (map ? ": acne beyond a texel" : ": acne beyond two pixels"),
                          map ? *e.acneBeyondTexel : e.error.acneAway, 1e-3);
        }
}

}  // namespace

std::vector<TradePreset> shadowLimitPresets() {
    return {{"convergence", "every technique at 512 to 4096, under the sun, a lamp and a soft sun", convergence,
             judgeConvergence},
            {"extremes",
             "leaks and acne of every technique at scales 1e-3 to 1e4 and up to 1e6 m from the origin; --techniques",
             extremes, judgeExtremes}};
}

}  // namespace umbriel
