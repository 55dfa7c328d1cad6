#include "client/app/trade_presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <ostream>
#include <set>

#include "client/app/trade_bench.h"
#include "client/session/field_text.h"
#include "client/trade/trade_report.h"
#include "common/base/log.h"

namespace umbriel {
namespace {

struct Run {
    std::string title;
    SceneArguments scene = {};
    std::string camera = {};  // of the scene; empty: its first
    std::vector<TradeSetting> settings = {};
    std::string judge = {};
    bool bothSides = false;
    std::optional<double> lightSize = {};
    double scale = 1.0;   // of everything, the camera's near plane with it
    double offset = 0.0;  // metres along each axis, after that
    bool errors = true;   // false: cost only
    int frames = 12;
};

struct Finished {
    std::vector<Run> runs;
    std::vector<TradeResult> results;
    std::set<std::string> missing;  // techniques and fields that are not in this version
};

// A figure of a row, when there is one.
using Figure = std::function<double(const TradeRow&)>;
std::optional<double> figure(const Finished& finished, std::size_t run, const std::string& label, const Figure& of) {
    if (run >= finished.results.size()) return std::nullopt;
    for (const TradeRow& row : finished.results[run].rows)
        if (labelOf(row.setting) == label) return of(row);
    return std::nullopt;
}
double errorOf(const TradeRow& row) {
    return row.errors.error.error();
}
Figure zoneOf(std::size_t zone) {
    return [zone](const TradeRow& row) { return row.errors.zoneErrors[zone]; };
}
double cpuOf(const TradeRow& row) {
    return row.cost.cpuMilliseconds;
}
double ratioOf(const TradeRow& row) {
    return row.cost.cpuRatio;
}

// "text": a < b, with both figures; open when one of them is missing.
struct Verdicts {
    const Finished& finished;
    std::ostream& out;

    // why: what is known about its not being met.
    void less(const std::string& text, std::optional<double> a, std::optional<double> b, double scale = 100.0,
              std::string_view unit = " %", std::string_view why = {}) const {
        if (!a || !b) {
            out << fmt::format("  open     {}: needs a technique that this version does not draw\n", text);
            return;
        }
        out << fmt::format("  {} {}: {:.4g}{} against {:.4g}{}\n", *a < *b ? "met     " : "NOT MET ", text, *a * scale,
                           unit, *b * scale, unit);
        if (!(*a < *b) && !why.empty()) out << fmt::format("           {}\n", why);
    }
    void atMost(const std::string& text, std::optional<double> a, double limit, double scale = 100.0,
                std::string_view unit = " %") const {
        if (!a) {
            out << fmt::format("  open     {}: needs a technique that this version does not draw\n", text);
            return;
        }
        out << fmt::format("  {} {}: {:.4g}{}, limit {:.4g}{}\n", *a <= limit ? "met     " : "NOT MET ", text,
                           *a * scale, unit, limit * scale, unit);
    }
};

TradeSetting setting(std::string technique, std::uint32_t mapSize) {
    return {std::move(technique), mapSize, {}, {}, {}};
}

struct Preset {
    std::string_view name;
    std::string_view about;
    std::vector<Run> (*runs)(const TradeArguments& arguments);
    void (*judge)(const Verdicts& verdicts);
};

SceneArguments palms(const TradeArguments& arguments) {
    SceneArguments scene = arguments.scene;
    if (scene.scene.empty()) scene.scene = "demo:palms";
    return scene;
}

constexpr std::array<const char*, 5> kHard = {"std:scene", "std", "psm", "lisp", "trapez"};

// Shorthand for verdicts.
auto errorIn(const Verdicts& v, std::size_t run) {
    return [&v, run](const std::string& label) { return figure(v.finished, run, label, errorOf); };
}

std::vector<Run> mapSizes(const TradeArguments& arguments) {
    Run run{.title = "map sizes (Hempe 10.1.1)", .scene = palms(arguments), .frames = arguments.frames};
    for (const std::uint32_t size : {512u, 1024u, 2048u})
        for (const char* technique : kHard) run.settings.push_back(setting(technique, size));
    return {run};
}
void judgeMapSizes(const Verdicts& v) {
    const auto e = errorIn(v, 0);
    v.less("LISP at 512 has less error than the thesis' standard at 1024", e("lisp 512"), e("std:scene 1024"));
    v.less("TRAPEZ at 512 has less error than the thesis' standard at 1024", e("trapez 512"), e("std:scene 1024"));
    v.less("LISP at 512 has less error than the camera-fitted standard at 1024 (reported beside)", e("lisp 512"),
           e("std 1024"));
    v.less("TRAPEZ at 512 has less error than the camera-fitted standard at 1024 (reported beside)", e("trapez 512"),
           e("std 1024"));
    v.less("LISP is a little better than TRAPEZ at 512", e("lisp 512"), e("trapez 512"));
    v.less("PSM is worse than the standard at 512: nothing stands right before the eye", e("std:scene 512"),
           e("psm 512"));
}

std::vector<Run> zones(const TradeArguments& arguments) {
    std::vector<Run> runs;
    for (const auto& [camera, title] :
         {std::pair("main", "nothing right before the eye"), std::pair("near", "a post right before the eye")}) {
        Run run{.title = fmt::format("zones at 512 (Hempe 10.1.2), {}", title),
                .scene = palms(arguments),
                .camera = camera,
                .frames = arguments.frames};
        for (const char* technique : kHard) run.settings.push_back(setting(technique, 512));
        runs.push_back(run);
    }
    return runs;
}
void judgeZones(const Verdicts& v) {
    const auto in = [&](std::size_t run, std::size_t zone, const char* technique) {
        return figure(v.finished, run, fmt::format("{} 512", technique), zoneOf(zone));
    };
    v.less("near: LISP before TRAPEZ", in(0, 0, "lisp"), in(0, 0, "trapez"));
    v.less("near: TRAPEZ before STD", in(0, 0, "trapez"), in(0, 0, "std:scene"));
    v.less("middle: TRAPEZ before STD", in(0, 1, "trapez"), in(0, 1, "std:scene"));
    v.less("middle: TRAPEZ before LISP", in(0, 1, "trapez"), in(0, 1, "lisp"));
    v.less("far: STD before TRAPEZ", in(0, 2, "std:scene"), in(0, 2, "trapez"));
    v.less("far: TRAPEZ before LISP", in(0, 2, "trapez"), in(0, 2, "lisp"));
    v.less("far: PSM is worst", in(0, 2, "lisp"), in(0, 2, "psm"));
    v.less("with a post right before the eye PSM beats STD there", in(1, 0, "psm"), in(1, 0, "std:scene"));
}

std::vector<Run> views(const TradeArguments& arguments) {
    std::vector<Run> runs;
    for (const char* camera : {"main", "oblique", "along", "against"}) {
        // From below the floor's shadows are seen through it, as in the thesis.
        const bool below = std::string_view(camera) == "against";
        Run run{.title = fmt::format("views (Hempe 10.1.3): {}", camera),
                .scene = palms(arguments),
                .camera = camera,
                .judge = below ? "floor" : "",
                .bothSides = below,
                .frames = arguments.frames};
        for (const char* technique : kHard) run.settings.push_back(setting(technique, 1024));
        runs.push_back(run);
    }
    return runs;
}
void judgeViews(const Verdicts& v) {
    constexpr std::array<const char*, 4> kNames = {"across", "oblique", "along the light", "against it, from below"};
    for (std::size_t run = 0; run < 4; ++run) {
        const auto e = errorIn(v, run);
        const auto fitted = e("std 1024");
        v.less(fmt::format("{}: LISP is not worse than the camera-fitted standard by more than 5 %", kNames[run]),
               e("lisp 1024"), fitted ? std::optional(*fitted * 1.05 + 1e-9) : std::nullopt);
        v.less(fmt::format("{}: TRAPEZ is not worse than the camera-fitted standard by more than 5 %", kNames[run]),
               e("trapez 1024"), fitted ? std::optional(*fitted * 1.05 + 1e-9) : std::nullopt);
    }
}

std::vector<Run> angles(const TradeArguments& arguments) {
    std::vector<Run> runs;
    for (int degrees = 10; degrees <= 170; degrees += 20) {
        // The sun turns from the view's direction over straight down towards the viewer of "main".
        const double angle = degrees * std::numbers::pi / 180.0;
        Run run{.title = fmt::format("{} degrees between view and light (Hempe 10.1.3)", degrees),
                .scene = palms(arguments),
                .camera = "main",
                .frames = 4};
        run.scene.lights = {fmt::format("dir:0.05,{},{}", -std::sin(angle), -std::cos(angle))};
        for (const char* technique : kHard) run.settings.push_back(setting(technique, 1024));
        runs.push_back(run);
    }
    return runs;
}
void judgeAngles(const Verdicts& v) {
    for (std::size_t run = 0; run < v.finished.runs.size(); ++run) {
        const auto e = errorIn(v, run);
        const auto fitted = e("std 1024");
        v.less(v.finished.runs[run].title + ": LISP at most 1.05 of STD", e("lisp 1024"),
               fitted ? std::optional(*fitted * 1.05 + 1e-9) : std::nullopt);
    }
}

std::vector<Run> trapez(const TradeArguments& arguments) {
    std::vector<Run> runs;
    for (const char* camera : {"main", "oblique", "far"}) {
        Run run{.title = fmt::format("corrections of TRAPEZ at 512 (Hempe 10.1.4): {}", camera),
                .scene = palms(arguments),
                .camera = camera,
                .frames = arguments.frames};
        run.settings = {setting("std", 512), setting("trapez", 512)};
        for (const auto& [field, value] :
             {std::pair("maxSideAngle", "3.1"), std::pair("maxSideAngle", "1.0"), std::pair("qualityMode", "1")}) {
            run.settings.push_back(setting("trapez", 512));
            run.settings.back().fields = {{field, value}};
        }
        runs.push_back(run);
    }
    return runs;
}
void judgeTrapez(const Verdicts& v) {
    for (std::size_t run = 0; run < v.finished.runs.size(); ++run) {
        const auto e = errorIn(v, run);
        const auto far = [&](const char* label) { return figure(v.finished, run, label, zoneOf(2)); };
        v.less(v.finished.runs[run].camera + ": the angle correction helps far away",
               far("trapez 512 maxSideAngle=1.0"), far("trapez 512 maxSideAngle=3.1"));
        v.less(v.finished.runs[run].camera + ": fitting base and top to what is seen helps",
               e("trapez 512 qualityMode=1"), e("trapez 512"));
    }
}

std::vector<Run> focus(const TradeArguments& arguments) {
    Run run{.title = "focus region of TRAPEZ at 512 (Hempe 10.1.5)",
            .scene = palms(arguments),
            .camera = "main",
            .settings = {setting("std", 512)},
            .frames = arguments.frames};
    for (const char* range : {"0.1", "0.2", "0.3", "0.5", "0.7", "0.79"}) {
        run.settings.push_back(setting("trapez", 512));
        run.settings.back().fields = {{"range", range}};
    }
    return {run};
}
void judgeFocus(const Verdicts& v) {
    const auto in = [&](std::size_t zone, const char* range) {
        return figure(v.finished, 0, fmt::format("trapez 512 range={}", range), zoneOf(zone));
    };
    v.less("a small region sharpens what is near", in(0, "0.1"), in(0, "0.79"));
    v.less("a large one what is far", in(2, "0.79"), in(2, "0.1"));
}

std::vector<Run> soft(const TradeArguments& arguments) {
    std::vector<Run> runs;
    for (const auto& [title, size] : {std::pair("a small light", 0.01), std::pair("a large light", 0.04)}) {
        Run run{.title = fmt::format("soft shadows, {} (Hempe 10.2)", title),
                .scene = palms(arguments),
                .camera = "main",
                .lightSize = size,
                .frames = arguments.frames};
        run.settings = {setting("std", 1024), setting("pcf", 1024), setting("ppcf", 1024)};
        for (const auto& [field, value] : {std::pair("samplesPerRow", "8"), std::pair("samplesPerRow", "6"),
                                           std::pair("hardwareFilter", "true"), std::pair("gauss", "4")}) {
            run.settings.push_back(setting("pcf", 1024));
            run.settings.back().fields = {{field, value}};
        }
        run.settings.push_back(setting("ppcf", 1024));
        run.settings.back().fields = {{"gauss", "4"}};
        runs.push_back(run);
    }
    return runs;
}
void judgeSoft(const Verdicts& v) {
    for (std::size_t run = 0; run < v.finished.runs.size(); ++run) {
        const auto e = errorIn(v, run);
        const std::string light = run == 0 ? "small light" : "large light";
        v.less(light + ": PPCF is nearer to the truth than PCF", e("ppcf 1024"), e("pcf 1024"));
        v.less(light + ": PPCF is nearer to the truth than a hard shadow", e("ppcf 1024"), e("std 1024"));
        v.less(light + ": the hardware's filter helps PCF", e("pcf 1024 hardwareFilter=true"),
               e("pcf 1024 samplesPerRow=6"));
        v.less(light + ": 64 samples are better than 36", e("pcf 1024 samplesPerRow=8"), e("pcf 1024 samplesPerRow=6"));
    }
}

std::vector<Run> triangles(const TradeArguments& arguments) {
    std::vector<Run> runs;
    for (const int count : {1, 8, 80, 800}) {
        Run run{.title = fmt::format("cost over triangles (Hempe 4.2, Ganster table 2): {} palms", count),
                .scene = arguments.scene,
                .camera = "far",
                .errors = false,
                .frames = arguments.frames};
        run.scene.scene = fmt::format("demo:palms?n={}", count);
        for (const char* technique : {"none", "std", "planar", "planar-stencil", "zpass", "zfail"})
            run.settings.push_back(setting(technique, 1024));
        runs.push_back(run);
    }
    return runs;
}
void judgeTriangles(const Verdicts& v) {
    const auto cost = [&](std::size_t run, const char* label) { return figure(v.finished, run, label, cpuOf); };
    for (std::size_t run = 0; run < v.finished.runs.size(); ++run) {
        v.less(fmt::format("{}: planar costs less than volumes", v.finished.runs[run].scene.scene),
               cost(run, "planar 1024"), cost(run, "zpass 1024"), 1.0, " ms");
        v.less(fmt::format("{}: z-pass costs less than z-fail", v.finished.runs[run].scene.scene),
               cost(run, "zpass 1024"), cost(run, "zfail 1024"), 1.0, " ms");
    }
    v.less("maps grow less with triangles than volumes", cost(3, "std 1024"), cost(3, "zfail 1024"), 1.0, " ms");
}

std::vector<Run> lights(const TradeArguments& arguments) {
    std::vector<Run> runs;
    for (const int count : {1, 4, 16, 64, 256}) {
        Run run{.title = fmt::format("{} lights by maps and volumes (Ganster 1.3.5)", count),
                .scene = palms(arguments),
                .camera = "far",
                .errors = false,
                .frames = 4};
        for (int i = 0; i < count; ++i) {
            const double angle = 2.399963 * i;
            run.scene.lights.push_back(fmt::format("dir:{},-1,{}@{},{},{}", 0.6 * std::cos(angle),
                                                   0.6 * std::sin(angle), 3.0 / count, 3.0 / count, 3.0 / count));
        }
        for (const char* technique : {"none", "std", "zfail"}) run.settings.push_back(setting(technique, 256));
        runs.push_back(run);
    }
    return runs;
}
void judgeLights(const Verdicts& v) {
    for (std::size_t run = 0; run < v.finished.runs.size(); ++run)
        v.less(v.finished.runs[run].title + ": maps cost less", figure(v.finished, run, "std 256", cpuOf),
               figure(v.finished, run, "zfail 256", cpuOf), 1.0, " ms");
}

std::vector<Run> cluster(const TradeArguments& arguments) {
    std::vector<Run> runs;
    for (const char* grid : {"1x1", "2x1", "2x2"}) {
        Run run{.title = fmt::format("soft shadows on {} servers (Hempe 11)", grid),
                .scene = palms(arguments),
                .camera = "main",
                .errors = false,
                .frames = arguments.frames};
        run.scene.grid = grid;
        for (const char* technique : {"none", "std", "pcf", "ppcf"}) run.settings.push_back(setting(technique, 1024));
        runs.push_back(run);
    }
    return runs;
}
void judgeCluster(const Verdicts& v) {
    constexpr std::array<double, 3> kServers = {1.0, 2.0, 4.0};
    for (const char* label : {"std 1024", "pcf 1024", "ppcf 1024"})
        for (std::size_t run = 1; run < 3; ++run) {
            const auto each = [&](std::size_t r) -> std::optional<double> {
                const auto cost = figure(v.finished, r, label, cpuOf);
                return cost ? std::optional(*cost / kServers[r]) : std::nullopt;
            };
            v.less(fmt::format("{}: processor time of each of {} servers falls", label, kServers[run]), each(run),
                   each(run - 1), 1.0, " ms");
        }
}

std::vector<Run> cost(const TradeArguments& arguments) {
    Run run{.title = "cost at the same map size, paired frames; the second STD is the noise",
            .scene = palms(arguments),
            .errors = false,
            .frames = std::max(200, arguments.frames)};
    for (const char* technique : {"std", "std:union", "psm", "lisp", "trapez", "pcf", "ppcf"})
        run.settings.push_back(setting(technique, 1024));
    return {run};
}
void judgeCost(const Verdicts& v) {
    const auto ratio = [&](const char* label) { return figure(v.finished, 0, label, ratioOf); };
    v.atMost("STD against itself (the noise)", ratio("std:union 1024"), 1.02, 1.0, " x");
    v.atMost("LISP costs at most 1.08 of STD", ratio("lisp 1024"), 1.08, 1.0, " x");
    v.atMost("TRAPEZ costs at most 1.15 of STD", ratio("trapez 1024"), 1.15, 1.0, " x");
    v.atMost("PCF with 36 samples costs at most 2.0 of STD", ratio("pcf 1024"), 2.0, 1.0, " x");
    v.atMost("PPCF with 36 + 64 costs at most 3.0 of STD", ratio("ppcf 1024"), 3.0, 1.0, " x");
}

std::vector<Run> convergence(const TradeArguments& arguments) {
    Run run{.title = "convergence, 512 to 4096", .scene = palms(arguments), .frames = 4};
    for (const char* technique :
         {"std:scene", "std", "psm", "lisp", "trapez", "cube", "pcf", "ppcf", "dual-paraboloid"})
        for (const std::uint32_t size : {512u, 1024u, 2048u, 4096u}) run.settings.push_back(setting(technique, size));
    return {run};
}
void judgeConvergence(const Verdicts& v) {
    for (const char* technique :
         {"std:scene", "std", "psm", "lisp", "trapez", "cube", "pcf", "ppcf", "dual-paraboloid"}) {
        const bool filtered = std::string_view(technique) == "pcf" || std::string_view(technique) == "ppcf" ||
                              std::string_view(technique) == "dual-paraboloid";
        for (const std::uint32_t size : {512u, 1024u, 2048u}) {
            const auto one = figure(v.finished, 0, fmt::format("{} {}", technique, size), errorOf);
            const auto two = figure(v.finished, 0, fmt::format("{} {}", technique, 2 * size), errorOf);
            const auto limit = one ? std::optional(filtered ? *one + 5e-4 : std::max(0.7 * *one, 1e-3)) : std::nullopt;
            v.less(fmt::format("{}: {} to {}", technique, size, 2 * size), two,
                   limit ? std::optional(*limit + 1e-12) : std::nullopt, 100.0, " %",
                   size < 1024 ? "leaflets are 6 cm wide, texels of this map 13 to 25 cm: what is thinner than a texel "
                                 "is drawn or missed by chance"
                               : "");
        }
    }
}

std::vector<Run> extremes(const TradeArguments& arguments) {
    std::vector<Run> runs;
    std::string techniques = arguments.techniques.empty() ? "std" : arguments.techniques;
    const auto add = [&](double scale, double offset) {
        Run run{.title = fmt::format("scale {:g}, {:g} m from the origin", scale, offset),
                .scene = palms(arguments),
                .scale = scale,
                .offset = offset,
                .frames = 4};
        for (std::size_t begin = 0; begin <= techniques.size();) {
            const std::size_t end = std::min(techniques.find(',', begin), techniques.size());
            run.settings.push_back(setting(techniques.substr(begin, end - begin), 1024));
            begin = end + 1;
        }
        runs.push_back(run);
    };
    for (const double offset : {0.0, 1e3, 1e6}) add(1.0, offset);
    for (const double scale : {1e-3, 1e-2, 1e2, 1e4}) add(scale, 0.0);
    for (const double scale : {1e-3, 1e4}) add(scale, 1e6);
    return runs;
}
void judgeExtremes(const Verdicts& v) {
    for (std::size_t run = 0; run < v.finished.results.size(); ++run)
        for (const TradeRow& row : v.finished.results[run].rows) {
            const std::string where = fmt::format("{}, {}", labelOf(row.setting), v.finished.runs[run].title);
            v.atMost(where + ": leaks beyond a texel", row.errors.leakBeyondTexel, 1e-3);
            v.atMost(where + ": acne beyond a texel", row.errors.acneBeyondTexel, 1e-3);
        }
}

constexpr std::array kPresets{
    Preset{"map-sizes", "hard shadows at 512, 1024, 2048 (Hempe 10.1.1)", mapSizes, judgeMapSizes},
    Preset{"zones", "near, middle and far at 512 (Hempe 10.1.2)", zones, judgeZones},
    Preset{"views", "across, oblique, along the light, against it from below (Hempe 10.1.3)", views, judgeViews},
    Preset{"angles", "10 to 170 degrees between view and light (Hempe 10.1.3)", angles, judgeAngles},
    Preset{"trapez", "angle correction, and base and top fitted to what is seen (Hempe 10.1.4)", trapez, judgeTrapez},
    Preset{"focus", "the trapezoid's focus region, 0.1 to 0.79 (Hempe 10.1.5)", focus, judgeFocus},
    Preset{"soft", "PCF and PPCF under a small and a large light (Hempe 10.2)", soft, judgeSoft},
    Preset{"triangles", "cost over triangles by maps, volumes and planes (Hempe 4.2, Ganster table 2)", triangles,
           judgeTriangles},
    Preset{"lights", "cost of 1 to 256 lights by maps and volumes (Ganster 1.3.5)", lights, judgeLights},
    Preset{"cluster", "soft shadows on 1, 2 and 4 servers (Hempe 11)", cluster, judgeCluster},
    Preset{"cost", "paired frames of every technique at one map size, STD against itself as the noise", cost,
           judgeCost},
    Preset{"convergence", "every technique at 512 to 4096", convergence, judgeConvergence},
    Preset{"extremes", "leaks and acne at scales 1e-3 to 1e4 and up to 1e6 m from the origin; --techniques", extremes,
           judgeExtremes},
};

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

Result<TradeResult> perform(Run& run, const std::filesystem::path& serverProgram, std::set<std::string>& missing) {
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
    for (const std::size_t i : paretoFront(result.rows)) result.rows[i].onFront = run.errors;
    return result;
}

void printZones(const TradeResult& result, std::ostream& out) {
    out << fmt::format("  {:<28} {:>9} {:>9} {:>9} {:>11} {:>11} {:>8}\n", "setting", "near %", "middle %", "far %",
                       "leak>1tx %", "acne>1tx %", "x cost");
    for (const TradeRow& row : result.rows) {
        const auto percent = [](const std::optional<double>& value) {
            return value ? fmt::format("{:.4f}", 100.0 * *value) : std::string("-");
        };
        out << fmt::format("  {:<28} {:>9.3f} {:>9.3f} {:>9.3f} {:>11} {:>11} {:>8.3f}\n", labelOf(row.setting),
                           100 * row.errors.zoneErrors[0], 100 * row.errors.zoneErrors[1],
                           100 * row.errors.zoneErrors[2], percent(row.errors.leakBeyondTexel),
                           percent(row.errors.acneBeyondTexel), row.cost.cpuRatio);
    }
}

}  // namespace

std::string tradePresets() {
    std::string text;
    for (const Preset& preset : kPresets) text += fmt::format("  {:<12} {}\n", preset.name, preset.about);
    return text;
}

int runTradePreset(const TradeArguments& arguments, const std::filesystem::path& serverProgram, std::ostream& out) {
    const auto preset =
        std::find_if(kPresets.begin(), kPresets.end(), [&](const Preset& p) { return p.name == arguments.preset; });
    if (preset == kPresets.end())
        return exitCodeOf(badInput(fmt::format("--preset '{}': there are\n{}", arguments.preset, tradePresets())));
    Finished finished;
    finished.runs = preset->runs(arguments);
    for (Run& run : finished.runs) {
        auto result = perform(run, serverProgram, finished.missing);
        if (!result) return exitCodeOf(result.error());
        if (!arguments.scene.quiet && !arguments.json) {
            printTrade(*result, out);
            printZones(*result, out);
            out.flush();
        }
        finished.results.push_back(std::move(*result));
    }
    if (arguments.json) {
        out << "[";
        for (std::size_t i = 0; i < finished.results.size(); ++i)
            out << (i == 0 ? "" : ",") << tradeJson(finished.results[i]);
        out << "]\n";
        return out.good() ? 0 : 1;
    }
    if (!finished.missing.empty()) {
        out << "not in this version:";
        for (const std::string& name : finished.missing) out << ' ' << name;
        out << '\n';
    }
    out << "expected orderings:\n";
    preset->judge({finished, out});
    return out.good() ? 0 : 1;
}

}  // namespace umbriel
