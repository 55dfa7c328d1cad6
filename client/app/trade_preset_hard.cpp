// Hempe 2005, 10.1: hard shadows.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "client/app/trade_preset.h"
#include "common/math/glm.h"

namespace umbriel {
namespace {

constexpr std::array<const char*, 5> kHard = {"std:scene", "std", "psm", "lisp", "trapez"};

// The thesis takes the near distance of its perspective from the camera's near plane, we from what is seen
// (docs/shadows.md). With these factors LISP warps as strongly as the thesis' LISP and PSM do.
constexpr const char* kThesisLisp = "0.25";
constexpr const char* kThesisPsm = "0.03";
const std::string kOursIsWeaker =
    "ours takes the near distance from what is seen, not from the camera's near plane, and so warps less; with "
    "lispFactor=0.25, as strongly as the thesis, see below";

PresetRun hardRun(const TradeArguments& arguments, const std::string& title, const char* camera) {
    return {.title = title, .scene = presetScene(arguments), .camera = camera, .frames = arguments.frames};
}

std::vector<PresetRun> mapSizes(const TradeArguments& arguments) {
    PresetRun run = hardRun(arguments, "map sizes (Hempe 10.1.1)", "");
    for (const std::uint32_t size : {512u, 1024u, 2048u}) {
        for (const char* technique : kHard) run.settings.push_back(presetSetting(technique, size));
        run.settings.push_back(presetSetting("lisp", size, {{"lispFactor", kThesisPsm}}));
    }
    return {run};
}
void judgeMapSizes(const PresetOutcome& outcome, Expectations& expect) {
    const auto e = [&](const std::string& label) { return outcome.figure(0, label, errorOf); };
    for (const char* technique : kHard)
        for (const int size : {512, 1024})
            expect.less(fmt::format("{}: less error at {} than at {}", technique, 2 * size, size),
                        e(fmt::format("{} {}", technique, 2 * size)), e(fmt::format("{} {}", technique, size)));
    for (const char* technique : {"lisp", "trapez"}) {
        const auto at512 = e(fmt::format("{} 512", technique));
        expect.less(fmt::format("{} at 512 has less error than the thesis' standard (std:scene) at 1024", technique),
                    at512, e("std:scene 1024"));
        expect.less(fmt::format("{} at 512 does not reach the thesis' standard at 2048", technique),
                    e("std:scene 2048"), at512);
    }
    const auto texels = [&](const char* label) { return outcome.figure(0, label, zoneTexelOf(0)); };
    expect.less("lisp is a little better than trapez at 512", e("lisp 512"), e("trapez 512"), kPercent,
                texels("lisp 512") && texels("trapez 512")
                    ? fmt::format("texels near the eye: {:.2f} px against {:.2f} px", *texels("lisp 512"),
                                  *texels("trapez 512"))
                    : std::string(),
                "LISP's optimum keeps the worst ratio over the whole view small, range = 0.3 of TRAPEZ favours what is "
                "near, where this view has its shadows");
    for (const int size : {512, 1024, 2048}) {
        const auto plain = e(fmt::format("std:scene {}", size));
        expect.less(fmt::format("psm is worse than the standard at {}: nothing stands right before the eye", size),
                    plain, e(fmt::format("psm {}", size)), kPercent, {},
                    "our virtual camera is slid back until w varies by 32 at most, the remedy of Stamminger & "
                    "Drettakis; without it, see the next line");
        expect.less(fmt::format("a perspective as strong as the thesis' PSM is worse than the standard at {}", size),
                    plain, e(fmt::format("lisp {} lispFactor={}", size, kThesisPsm)), kPercent,
                    "a sliver right before the eye gets the map");
    }
}

std::vector<PresetRun> zones(const TradeArguments& arguments) {
    std::vector<PresetRun> runs;
    for (const auto& [camera, title] :
         {std::pair("main", "nothing right before the eye"), std::pair("near", "a post right before the eye")}) {
        PresetRun run = hardRun(arguments, fmt::format("zones at 512 (Hempe 10.1.2), {}", title), camera);
        for (const char* technique : kHard) run.settings.push_back(presetSetting(technique, 512));
        for (const char* factor : {kThesisLisp, kThesisPsm})
            run.settings.push_back(presetSetting("lisp", 512, {{"lispFactor", factor}}));
        runs.push_back(run);
    }
    return runs;
}
void judgeZones(const PresetOutcome& outcome, Expectations& expect) {
    const std::string strong = fmt::format("lisp 512 lispFactor={}", kThesisLisp);
    const std::string psm = fmt::format("lisp 512 lispFactor={}", kThesisPsm);
    struct Claim {
        const char* text;
        std::size_t zone;
        const char* better;
        const char* worse;
    };
    constexpr Claim kClaims[] = {{"near: LISP before TRAPEZ", 0, "lisp", "trapez 512"},
                                 {"near: TRAPEZ before STD", 0, "trapez 512", "std:scene 512"},
                                 {"middle: TRAPEZ before STD", 1, "trapez 512", "std:scene 512"},
                                 {"middle: TRAPEZ before LISP", 1, "trapez 512", "lisp"},
                                 {"far: STD before TRAPEZ", 2, "std:scene 512", "trapez 512"},
                                 {"far: TRAPEZ before LISP", 2, "trapez 512", "lisp"}};
    for (const std::string& lisp : {std::string("lisp 512"), strong})
        for (const Claim& claim : kClaims) {
            const bool hasLisp = std::string_view(claim.better) == "lisp" || std::string_view(claim.worse) == "lisp";
            if (lisp == strong && !hasLisp) continue;
            const auto label = [&](const char* name) { return std::string_view(name) == "lisp" ? lisp : name; };
            const auto texels = [&](const char* name) {
                return outcome.figure(0, label(name), zoneTexelOf(claim.zone));
            };
            const auto error = [&](const char* name) {
                return outcome.figure(0, label(name), zoneErrorOf(claim.zone));
            };
            const std::string suffix = lisp == strong && hasLisp ? " (as strong as the thesis)" : "";
            expect.less(std::string(claim.text) + suffix + ", texels on the picture", texels(claim.better),
                        texels(claim.worse), kPixels, {}, hasLisp && lisp != strong ? kOursIsWeaker : std::string());
            const auto a = texels(claim.better), b = texels(claim.worse);
            const std::string why = a && b ? fmt::format("texels of {:.2f} px against {:.2f} px", *a, *b) : "";
            expect.less(std::string(claim.text) + suffix + ", error", error(claim.better), error(claim.worse), kPercent,
                        why,
                        a && b && std::min(*a, *b) > 0.67 * std::max(*a, *b)
                            ? "less than a factor of 1.5 apart: which leaflet hits a texel's centre decides"
                        : hasLisp && lisp != strong ? "the zone's shadows are a few pixels, thinner than texels"
                                                    : "what is thinner than a texel is drawn or missed by chance");
        }
    const auto missing = [&](std::size_t run, const std::string& label) {
        return outcome.figure(run, label, zoneMissingOf(2));
    };
    expect.atLeast("far: the shadows of PSM vanish (of dark pixels, lit)", missing(0, "psm 512"), 0.9, kPercent, {},
                   "our virtual camera is slid back (Stamminger & Drettakis); without it, see the next line");
    expect.atLeast("far: those of a perspective as strong as the thesis' PSM vanish", missing(0, psm), 0.75, kPercent,
                   "texels there are several pixels wide");
    expect.less("with a post right before the eye PSM beats STD there, error",
                outcome.figure(1, "psm 512", zoneErrorOf(0)), outcome.figure(1, "std:scene 512", zoneErrorOf(0)));
    expect.less("with a post right before the eye PSM beats STD there, texels",
                outcome.figure(1, "psm 512", zoneTexelOf(0)), outcome.figure(1, "std:scene 512", zoneTexelOf(0)),
                kPixels);
}

// What does not depend on the view: the texels of the thesis' standard over all runs.
void expectConstantStandard(const PresetOutcome& outcome, std::uint32_t size, Expectations& expect) {
    for (const char* technique : {"std:scene", "lisp", "trapez"}) {
        double smallest = 1e300, largest = 0.0;
        std::size_t known = 0;
        for (std::size_t run = 0; run < outcome.results.size(); ++run)
            if (const auto texel = outcome.figure(run, fmt::format("{} {}", technique, size), texelOf)) {
                smallest = std::min(smallest, *texel);
                largest = std::max(largest, *texel);
                ++known;
            }
        const auto spread =
            known == outcome.runs.size() && known > 0 ? std::optional(largest / smallest) : std::nullopt;
        if (std::string_view(technique) == "std:scene")
            expect.atMost("STD is constant: largest over smallest texel (median of a view, seen along the light)",
                          spread, 1.001, kTimes, "its map does not know the view");
        else
            expect.atLeast(fmt::format("{} is not", technique), spread, 1.2, kTimes);
    }
}

std::vector<PresetRun> views(const TradeArguments& arguments) {
    std::vector<PresetRun> runs;
    for (const char* camera : {"main", "oblique", "along", "against"}) {
        // From below the floor's shadows are seen through it, as in the thesis.
        const bool below = std::string_view(camera) == "against";
        PresetRun run = hardRun(arguments, fmt::format("views (Hempe 10.1.3): {}", camera), camera);
        run.judge = below ? "floor" : "";
        run.bothSides = below;
        for (const char* technique : kHard) run.settings.push_back(presetSetting(technique, 1024));
        runs.push_back(run);
    }
    return runs;
}
void judgeViews(const PresetOutcome& outcome, Expectations& expect) {
    constexpr std::array<const char*, 4> kNames = {"across", "oblique", "along the light", "against it, from below"};
    for (std::size_t run = 0; run < 4; ++run) {
        const auto e = [&](const char* label) { return outcome.figure(run, label, errorOf); };
        for (const char* technique : {"lisp", "trapez"})
            expect.less(fmt::format("{}: {} is not worse than the camera-fitted standard by more than 5 %", kNames[run],
                                    technique),
                        e(fmt::format("{} 1024", technique).c_str()), timesAtMost(1.05, e("std 1024")));
    }
    const auto gain = [&](std::size_t run, const std::string& technique) {
        return ratio(outcome.figure(run, technique + " 1024", texelOf), outcome.figure(run, "std 1024", texelOf));
    };
    for (const char* technique : {"lisp", "trapez"}) {
        expect.less(fmt::format("{}: texels against STD's are smaller across than oblique", technique),
                    gain(0, technique), gain(1, technique), kTimes);
        for (const std::size_t run : {2u, 3u})
            expect.atLeast(fmt::format("{}: {} nothing is left of the warp: texels over STD's", technique, kNames[run]),
                           gain(run, technique), 0.95, kTimes,
                           "seen along the light no direction across it is nearer to the eye");
    }
    expectConstantStandard(outcome, 1024, expect);
}

// The camera circles around the middle of demo:palms, at these angles between its direction and the sun's.
constexpr std::array<int, 12> kAngles = {0, 15, 30, 45, 60, 75, 90, 105, 135, 150, 165, 180};
// Where the circle passes below the floor: its shadows are seen through it.
constexpr int kBelow = 120;

std::vector<PresetRun> angles(const TradeArguments& arguments) {
    const glm::dvec3 sun = glm::normalize(glm::dvec3(0.72, -0.66, 0.02)), middle(0.0, 0.0, -8.0);
    // A quarter turn from the sun the camera looks ahead (-z) and 18 degrees down.
    const glm::dvec3 ahead = glm::normalize(glm::dvec3(0, 0, -1) - sun * glm::dot(glm::dvec3(0, 0, -1), sun));
    const glm::dvec3 down = glm::cross(ahead, sun).y < 0.0 ? glm::cross(ahead, sun) : glm::cross(sun, ahead);
    const double tilt = 25.0 * std::numbers::pi / 180.0;
    const glm::dvec3 side = std::cos(tilt) * ahead + std::sin(tilt) * down;
    std::vector<PresetRun> runs;
    for (const int degrees : kAngles) {
        const double angle = degrees * std::numbers::pi / 180.0;
        const glm::dvec3 eye = middle - 24.0 * (std::cos(angle) * sun + std::sin(angle) * side);
        PresetRun run{.title = fmt::format("{} degrees between view and light (Hempe 10.1.3)", degrees),
                      .scene = presetScene(arguments),
                      .judge = "floor",
                      .bothSides = degrees > kBelow,
                      .frames = 4};
        run.scene.eye = fmt::format("{},{},{}", eye.x, eye.y, eye.z);
        run.scene.target = fmt::format("{},{},{}", middle.x, middle.y, middle.z);
        for (const char* technique : kHard) run.settings.push_back(presetSetting(technique, 1024));
        run.settings.push_back(presetSetting("trapez", 1024, {{"maxSideAngle", "1"}}));
        runs.push_back(run);
    }
    return runs;
}
void judgeAngles(const PresetOutcome& outcome, Expectations& expect) {
    const auto of = [&](std::size_t run, const std::string& technique, const Figure& figure) {
        return outcome.figure(run, technique + " 1024", figure);
    };
    for (std::size_t run = 0; run < kAngles.size(); ++run)
        for (const char* technique : {"lisp", "trapez"}) {
            const auto corrected = outcome.figure(run, "trapez 1024 maxSideAngle=1", errorOf);
            expect.less(
                fmt::format("{} degrees: {}, error, at most 1.05 of the camera-fitted standard's", kAngles[run],
                            technique),
                of(run, technique, errorOf), timesAtMost(1.05, of(run, "std", errorOf)), kPercent,
                fmt::format("texels of {:.3f} m against {:.3f} m", of(run, technique, texelOf).value_or(0.0),
                            of(run, "std", texelOf).value_or(0.0)),
                std::string_view(technique) == "trapez"
                    ? fmt::format("the thesis' ill case (6.3.3): so near to the light's direction the sides open "
                                  "wide and the far end gets little; with maxSideAngle=1 the error is {:.3f} %",
                                  100 * corrected.value_or(0.0))
                    : "the worst ratio of a texel to the eye's distance is what LISP makes small, not the mean");
        }
    const auto gain = [&](std::size_t run, const std::string& technique) {
        return ratio(of(run, technique, texelOf), of(run, "std", texelOf));
    };
    constexpr std::size_t kAcross = 6, kAgainst = kAngles.size() - 1;
    for (const char* technique : {"lisp", "trapez", "psm"}) {
        expect.less(fmt::format("{}: the gain over STD (texels) is larger at 90 than at 0 degrees", technique),
                    gain(kAcross, technique), gain(0, technique), kTimes);
        expect.less(fmt::format("{}: and than at 180 degrees", technique), gain(kAcross, technique),
                    gain(kAgainst, technique), kTimes);
    }
    expectConstantStandard(outcome, 1024, expect);
}

std::vector<PresetRun> trapez(const TradeArguments& arguments) {
    std::vector<PresetRun> runs;
    for (const char* camera : {"main", "oblique", "far", "along"}) {
        PresetRun run =
            hardRun(arguments, fmt::format("corrections of TRAPEZ at 512 (Hempe 10.1.4): {}", camera), camera);
        run.settings = {presetSetting("std", 512), presetSetting("trapez", 512),
                        presetSetting("trapez", 512, {{"maxSideAngle", "3.1"}}),
                        presetSetting("trapez", 512, {{"maxSideAngle", "1"}}),
                        presetSetting("trapez", 512, {{"qualityMode", "1"}})};
        runs.push_back(run);
    }
    return runs;
}
void judgeTrapez(const PresetOutcome& outcome, Expectations& expect) {
    constexpr const char* kAsIs = "trapez 512";
    constexpr const char* kOff = "trapez 512 maxSideAngle=3.1";
    constexpr const char* kOn = "trapez 512 maxSideAngle=1";
    constexpr const char* kFitted = "trapez 512 qualityMode=1";
    for (std::size_t run = 0; run < outcome.runs.size(); ++run) {
        const std::string& camera = outcome.runs[run].camera;
        const auto of = [&](const char* label, const Figure& figure) { return outcome.figure(run, label, figure); };
        if (of(kOn, texelOf) == of(kOff, texelOf)) {
            expect.open(camera + ": the angle correction (sides of at most 1 rad)",
                        "the sides open less than that: it has nothing to do");
        } else {
            expect.less(camera + ": the angle correction (sides of at most 1 rad) makes far texels smaller",
                        of(kOn, zoneTexelOf(2)), of(kOff, zoneTexelOf(2)), kPixels);
            expect.less(camera + ": and pays with near ones", of(kOff, zoneTexelOf(0)), of(kOn, zoneTexelOf(0)),
                        kPixels);
            expect.less(camera + ": and comes nearer to the uniform map, far over near",
                        ratio(of("std 512", zoneTexelOf(2)), of("std 512", zoneTexelOf(0))),
                        ratio(of(kOn, zoneTexelOf(2)), of(kOn, zoneTexelOf(0))), kTimes);
        }
        if (of(kFitted, texelOf) == of(kAsIs, texelOf)) {
            expect.open(camera + ": fitting base and top to what is seen", "both drew the same");
        } else {
            expect.less(camera + ": fitting base and top to what is seen makes texels smaller", of(kFitted, texelOf),
                        of(kAsIs, texelOf), kMetres, {},
                        "what is seen reaches as far as the scene's box does, and the map is as large");
            expect.less(camera + ": and errors", of(kFitted, errorOf), of(kAsIs, errorOf), kPercent, {},
                        "where texels are as large, which leaflet hits a texel's centre decides");
        }
    }
}

constexpr std::array<const char*, 6> kRanges = {"0.1", "0.2", "0.3", "0.5", "0.7", "0.79"};

std::vector<PresetRun> focus(const TradeArguments& arguments) {
    PresetRun run = hardRun(arguments, "focus region of TRAPEZ at 512 (Hempe 10.1.5)", "main");
    run.settings = {presetSetting("std", 512), presetSetting("lisp", 512)};
    for (const char* range : kRanges) run.settings.push_back(presetSetting("trapez", 512, {{"range", range}}));
    return {run};
}
void judgeFocus(const PresetOutcome& outcome, Expectations& expect) {
    const auto of = [&](const Figure& figure, const char* range) {
        return outcome.figure(0, fmt::format("trapez 512 range={}", range), figure);
    };
    expect.less("a small region sharpens what is near, texels", of(zoneTexelOf(0), "0.1"), of(zoneTexelOf(0), "0.79"),
                kPixels);
    expect.less("a small region sharpens what is near, error", of(zoneErrorOf(0), "0.1"), of(zoneErrorOf(0), "0.79"));
    expect.less("a large one what is far, texels", of(zoneTexelOf(2), "0.79"), of(zoneTexelOf(2), "0.1"), kPixels);
    expect.less("a large one what is far, error", of(zoneErrorOf(2), "0.79"), of(zoneErrorOf(2), "0.1"), kPercent, {},
                "the zone's shadows are a few pixels, thinner than texels");
    std::optional<double> best;
    for (const char* range : kRanges)
        if (const auto error = of(errorOf, range); error && (!best || *error < *best)) best = error;
    expect.less("with the right region TRAPEZ does at least as well as LISP", best,
                timesAtMost(1.0, outcome.figure(0, "lisp 512", errorOf)), kPercent, {},
                "LISP takes the best distance for what is seen; of TRAPEZ's regions six were tried");
    expect.less("near 0.8 TRAPEZ becomes the uniform map: near texels within 5 % of STD's", of(zoneTexelOf(0), "0.79"),
                timesAtMost(1.05, outcome.figure(0, "std 512", zoneTexelOf(0))), kPixels);
}

}  // namespace

std::vector<TradePreset> hardShadowPresets() {
    return {{"map-sizes", "hard shadows at 512, 1024, 2048 (Hempe 10.1.1)", mapSizes, judgeMapSizes},
            {"zones", "near, middle and far at 512 (Hempe 10.1.2)", zones, judgeZones},
            {"views", "across, oblique, along the light, against it from below (Hempe 10.1.3)", views, judgeViews},
            {"angles", "0 to 180 degrees between view and light (Hempe 10.1.3)", angles, judgeAngles},
            {"trapez", "angle correction, and base and top fitted to what is seen (Hempe 10.1.4)", trapez, judgeTrapez},
            {"focus", "the trapezoid's focus region, 0.1 to 0.79 (Hempe 10.1.5)", focus, judgeFocus}};
}

}  // namespace umbriel
