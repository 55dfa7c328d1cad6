// What shadows cost: Hempe 2005, 4.2, 10 and 11; Ganster 2002, 1.3.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "client/app/trade_preset.h"

namespace umbriel {
namespace {

constexpr std::array<const char*, 5> kTable2 = {"none", "planar", "planar-stencil", "zpass", "zfail"};
// Frames per second there, without shadows first.
constexpr std::array<double, 5> kTable2Rates = {378.0, 192.0, 192.0, 74.0, 56.0};

std::vector<PresetRun> table2(const TradeArguments& arguments) {
    PresetRun run{.title = "2602 triangles, 1024 x 768 (Ganster table 2)",
                  .scene = arguments.scene,
                  .camera = "far",
                  .frames = arguments.frames};
    if (run.scene.scene.empty()) run.scene.scene = "demo:palms?triangles=2602";
    run.scene.size = "1024x768";
    for (const char* technique : kTable2) run.settings.push_back(presetSetting(technique, 1024));
    run.settings.push_back(presetSetting("std", 1024));
    return {run};
}
void judgeTable2(const PresetOutcome& outcome, Expectations& expect) {
    const auto of = [&](const char* technique) {
        return outcome.figure(0, labelOf(presetSetting(technique, 1024)), ratioOf);
    };
    for (std::size_t i = 1; i < kTable2.size(); ++i) {
        const bool planar = i < 3;
        expect.atMost(fmt::format("{} costs at most as many times no shadows as there", kTable2[i]), of(kTable2[i]),
                      kTable2Rates[0] / kTable2Rates[i], kTimes, {},
                      planar ? "there the casters were drawn twice, darkened; here the plane is lit without the light, "
                               "from positions that are drawn first, and on processors every pixel of it counts"
                             : "here a processor fills what there the card did: pixels of volumes outweigh triangles");
    }
    expect.less("planar costs less than volumes", of("planar"), of("zpass"), kTimes);
    expect.less("the stencil costs planar shadows less than 10 %", of("planar-stencil"), timesAtMost(1.1, of("planar")),
                kTimes);
    expect.less("z-pass costs less than z-fail", of("zpass"), of("zfail"), kTimes, "caps and both sides of the eye");
    expect.less("a map (not in the table) costs less than volumes", of("std"), of("zpass"), kTimes);
    const auto wrong = [&](const char* technique) {
        return outcome.figure(0, labelOf(presetSetting(technique, 1024)), errorOf);
    };
    for (const char* technique : {"planar", "planar-stencil", "zpass", "zfail"})
        expect.less(fmt::format("{} has less error than a map of 1024", technique), wrong(technique), wrong("std"),
                    kPercent, "exact but for the picture's own pixels");
}

constexpr std::array<int, 4> kTriangles = {2000, 10000, 100000, 1000000};

std::vector<PresetRun> triangles(const TradeArguments& arguments) {
    std::vector<PresetRun> runs;
    for (const int count : kTriangles) {
        PresetRun run{.title = fmt::format("cost over triangles (Hempe 4.2): {}", count),
                      .scene = arguments.scene,
                      .camera = "far",
                      .errors = false,
                      // Volumes of a million triangles fill a processor for a minute a frame.
                      .frames = count >= 1000000 ? 1 : std::min(arguments.frames, 4)};
        run.scene.scene = fmt::format("demo:palms?triangles={}", count);
        for (const char* technique : {"none", "std", "planar", "zpass", "zfail"})
            run.settings.push_back(presetSetting(technique, 1024));
        runs.push_back(run);
    }
    return runs;
}
void judgeTriangles(const PresetOutcome& outcome, Expectations& expect) {
    const auto cost = [&](std::size_t run, const char* technique) {
        return outcome.figure(run, labelOf(presetSetting(technique, 1024)), cpuOf);
    };
    for (std::size_t run = 0; run < kTriangles.size(); ++run) {
        expect.less(fmt::format("{} triangles: a map costs less than volumes", kTriangles[run]), cost(run, "std"),
                    cost(run, "zfail"), kMilliseconds);
        expect.less(fmt::format("{} triangles: planar costs less than volumes", kTriangles[run]), cost(run, "planar"),
                    cost(run, "zfail"), kMilliseconds);
    }
    // What shadows add to a frame without.
    const auto growth = [&](const char* technique) -> std::optional<double> {
        const auto few = cost(0, technique), many = cost(2, technique), bareFew = cost(0, "none"),
                   bareMany = cost(2, "none");
        if (!few || !many || !bareFew || !bareMany) return std::nullopt;
        return (*many - *bareMany) / std::max(*few - *bareFew, 1e-3);
    };
    for (const char* technique : {"std", "planar"})
        expect.less(fmt::format("from 2000 to 100000 triangles {} grows less than volumes", technique),
                    growth(technique), growth("zfail"), kTimes,
                    "a caster's volume covers many more pixels than it does");
}

constexpr std::array<int, 5> kLights = {1, 4, 16, 64, 256};

std::vector<PresetRun> lights(const TradeArguments& arguments) {
    std::vector<PresetRun> runs;
    for (const int count : kLights) {
        PresetRun run{.title = fmt::format("{} lights by maps and volumes (Ganster 1.3.5)", count),
                      .scene = arguments.scene,
                      .camera = "far",
                      .errors = false,
                      .frames = count > 16 ? 1 : 4};
        // Few casters: volumes of 256 lights take seconds a frame even so.
        if (run.scene.scene.empty()) run.scene.scene = "demo:palms?triangles=2602";
        for (int i = 0; i < count; ++i) {
            const double angle = 2.399963 * i;  // the golden angle
            run.scene.lights.push_back(fmt::format("dir:{},-1,{}@{},{},{}", 0.6 * std::cos(angle),
                                                   0.6 * std::sin(angle), 3.0 / count, 3.0 / count, 3.0 / count));
        }
        for (const char* technique : {"none", "std", "zfail"}) run.settings.push_back(presetSetting(technique, 256));
        runs.push_back(run);
    }
    return runs;
}
void judgeLights(const PresetOutcome& outcome, Expectations& expect) {
    const auto cost = [&](std::size_t run, const char* technique) {
        return outcome.figure(run, labelOf(presetSetting(technique, 256)), cpuOf);
    };
    for (std::size_t run = 0; run < kLights.size(); ++run)
        expect.less(fmt::format("{} lights: maps cost less than volumes", kLights[run]), cost(run, "std"),
                    cost(run, "zfail"), kMilliseconds);
    for (const char* technique : {"std", "zfail"})
        expect.less(fmt::format("{}: 256 lights cost at most 300 times one (proportional, Ganster 1.3.5)", technique),
                    ratio(cost(4, technique), cost(0, technique)), std::optional(300.0), kTimes,
                    "a penumbra imitated by many lights costs each of them whole");
}

// Without a light's extent PPCF is one comparison: a sun that is seen under nine times the true one's angle.
const SettingFields& softSun() {
    static const SettingFields fields = {{"lightSize", "0.08"}};
    return fields;
}

constexpr std::array<const char*, 3> kGrids = {"1x1", "2x1", "2x2"};
constexpr std::array<double, 3> kServers = {1.0, 2.0, 4.0};

std::vector<PresetRun> cluster(const TradeArguments& arguments) {
    std::vector<PresetRun> runs;
    for (const char* grid : kGrids) {
        PresetRun run{.title = fmt::format("soft shadows on {} servers (Hempe 11)", grid),
                      .scene = presetScene(arguments),
                      .camera = "main",
                      .errors = false,
                      .frames = arguments.frames};
        run.scene.grid = grid;
        for (const char* technique : {"none", "std", "pcf"}) run.settings.push_back(presetSetting(technique, 1024));
        run.settings.push_back(presetSetting("ppcf", 1024, softSun()));
        runs.push_back(run);
    }
    return runs;
}
void judgeCluster(const PresetOutcome& outcome, Expectations& expect) {
    const auto each = [&](std::size_t run, const char* technique) -> std::optional<double> {
        const bool soft = std::string_view(technique) == "ppcf";
        const auto cost =
            outcome.figure(run, labelOf(presetSetting(technique, 1024, soft ? softSun() : SettingFields())), cpuOf);
        return cost ? std::optional(*cost / kServers[run]) : std::nullopt;
    };
    for (const char* technique : {"std", "pcf", "ppcf"})
        for (std::size_t run = 1; run < kServers.size(); ++run)
            expect.less(fmt::format("{}: processor time of each of {} servers falls", technique, kServers[run]),
                        each(run, technique), each(run - 1, technique), kMilliseconds);
    // What a server of four still does of what one did.
    const auto share = [&](const char* technique) { return ratio(each(2, technique), each(0, technique)); };
    expect.less("clustering pays more for soft shadows than for hard ones: share of a frame left on each of 4",
                share("ppcf"), share("std"), kTimes,
                "filters are divided with the pixels, the map is drawn by every server");
    expect.atMost("of PPCF each of 4 servers has at most half of one's work", share("ppcf"), 0.5, kTimes);
}

std::vector<PresetRun> cost(const TradeArguments& arguments) {
    PresetRun run{.title = "cost at the same map size, paired frames; the second STD is the noise",
                  .scene = presetScene(arguments),
                  .errors = false,
                  .frames = std::max(200, arguments.frames)};
    for (const char* technique : {"std", "std:union", "psm", "lisp", "trapez", "pcf"})
        run.settings.push_back(presetSetting(technique, 1024));
    run.settings.push_back(presetSetting("ppcf", 1024, softSun()));
    run.settings.push_back(presetSetting("pcf", 1024, {{"hardwareFilter", "true"}}));
    run.settings.push_back(presetSetting("pcf", 1024, {{"skipUniform", "false"}}));
    run.settings.push_back(presetSetting("ppcf", 1024, {softSun().front(), {"skipUniform", "false"}}));
    return {run};
}
void judgeCost(const PresetOutcome& outcome, Expectations& expect) {
    const auto of = [&](const char* label) { return outcome.figure(0, label, ratioOf); };
    expect.atMost("STD against itself (the noise)", of("std:union 1024"), 1.02, kTimes);
    expect.atMost("LISP", of("lisp 1024"), 1.08, kTimes);
    expect.atMost("TRAPEZ", of("trapez 1024"), 1.15, kTimes);
    expect.atMost("PCF with 36 samples", of("pcf 1024"), 2.0, kTimes, {},
                  "on demo:palms fronds are everywhere: few blocks of the map let samples be skipped");
    expect.atMost("PPCF with 36 + 64", of("ppcf 1024 lightSize=0.08"), 3.0, kTimes, {},
                  "on demo:palms fronds are everywhere: few blocks of the map let samples be skipped");
    expect.atMost("PCF with 36 samples and the hardware's filter: 77 over 24 frames a second there (Hempe 10.2.1)",
                  of("pcf 1024 hardwareFilter=true"), 77.0 / 24.0, kTimes);
    expect.atMost("PPCF: 25 % of STD's frame rate there (Hempe 10.2.1)", of("ppcf 1024 lightSize=0.08"), 4.0, kTimes);
    for (const std::string technique : {"pcf 1024", "ppcf 1024 lightSize=0.08"})
        expect.less(technique + " costs at most 0.7 of its plain loop", of(technique.c_str()),
                    timesAtMost(0.7, of((technique + " skipUniform=false").c_str())), kTimes, {},
                    "on demo:palms fronds are everywhere: few blocks of the map let samples be skipped");
}

}  // namespace

std::vector<TradePreset> shadowCostPresets() {
    return {
        {"table2", "none, planar, planar-stencil, zpass, zfail on 2602 triangles (Ganster table 2)", table2,
         judgeTable2},
        {"triangles", "cost over 2e3 to 1e6 triangles by maps, volumes and planes (Hempe 4.2)", triangles,
         judgeTriangles},
        {"lights", "cost of 1 to 256 lights by maps and volumes (Ganster 1.3.5)", lights, judgeLights},
        {"cluster", "soft shadows on 1, 2 and 4 servers (Hempe 11)", cluster, judgeCluster},
        {"cost", "paired frames of every technique at one map size, STD against itself as the noise", cost, judgeCost}};
}

}  // namespace umbriel
