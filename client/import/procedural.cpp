#include "client/import/procedural.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <optional>
#include <string>

#include "client/import/procedural_demos.h"

namespace umbriel {

namespace {

constexpr std::string_view kScheme = "demo:";

// What a demo may be asked for: its count n, of one demo the number of triangles instead.
struct Counts {
    int n = 0;
    int triangles = 0;  // 0: as n says
};

struct Demo {
    DemoDescription description;
    int defaultCount;
    int largestCount;  // 0: the demo has no options
    Ref<LoadedScene> (*build)(Aspect& aspect, const Counts& counts);
    int fewestTriangles = 0;  // 0: cannot be asked for
    int mostTriangles = 0;
};

constexpr std::array kDemos = {
    Demo{{"car", "a car driving in a circle between cones: one wheel geometry, four nodes, animated", ""},
         0,
         0,
         [](Aspect& aspect, const Counts&) { return buildCar(aspect); }},
    Demo{{"city", "a city of shared building geometries in separately culled blocks, with streets and trees",
          "n=BUILDINGS (1 to 100000, default 2000)"},
         2000,
         100000,
         [](Aspect& aspect, const Counts& counts) { return buildCity(aspect, counts.n); }},
    Demo{{"cloth", "a woven cloth with folds, draped over a ball", ""},
         0,
         0,
         [](Aspect& aspect, const Counts&) { return buildCloth(aspect); }},
    Demo{{"palms", "thin fronds at three distances, an aeroplane, a post near the eye: for the shadow experiments",
          "n=PALMS (1 to 5000, default 9) or triangles=N (2000 to 5000000)"},
         9,
         5000,
         [](Aspect& aspect, const Counts& counts) { return buildPalms(aspect, counts.n, counts.triangles); },
         2000,
         5000000},
    Demo{{"spheres", "a square of spheres, roughness to the right, metalness to the back",
          "n=SPHERES (1 to 10000, default 49)"},
         49,
         10000,
         [](Aspect& aspect, const Counts& counts) { return buildSpheres(aspect, counts.n); }},
    Demo{{"torus", "a shiny torus of n segments around and half as many across: what interpolated shading makes of it",
          "n=SEGMENTS (1 to 2000, default 48; fewer than 3 count as 3)"},
         48,
         2000,
         [](Aspect& aspect, const Counts& counts) { return buildTorus(aspect, counts.n); }},
};

constexpr std::array<DemoDescription, kDemos.size()> kDescriptions = [] {
    std::array<DemoDescription, kDemos.size()> descriptions;
    for (std::size_t i = 0; i < kDemos.size(); ++i) descriptions[i] = kDemos[i].description;
    return descriptions;
}();

std::string knownDemos() {
    std::string names;
    for (const Demo& demo : kDemos)
        names += fmt::format("{}{}{}", names.empty() ? "" : ", ", kScheme, demo.description.name);
    return names;
}

// The counts from "n=7" or "triangles=2602"; an error for anything else.
Result<Counts> parseCounts(const Demo& demo, std::string_view options) {
    Counts counts{demo.defaultCount};
    while (!options.empty()) {
        const std::size_t end = options.find('&');
        const std::string_view option = options.substr(0, end);
        options = end == std::string_view::npos ? std::string_view{} : options.substr(end + 1);
        const std::size_t equals = option.find('=');
        const std::string_view key = option.substr(0, equals);
        if (demo.largestCount == 0)
            return badInput(fmt::format("demo:{} has no option '{}': it has none at all", demo.description.name, key));
        const bool triangles = key == "triangles" && demo.mostTriangles > 0;
        if (key != "n" && !triangles)
            return badInput(fmt::format("demo:{} has no option '{}'; it has {}", demo.description.name, key,
                                        demo.description.options));
        const std::string_view value =
            equals == std::string_view::npos ? std::string_view{} : option.substr(equals + 1);
        int& count = triangles ? counts.triangles : counts.n;
        const auto [rest, error] = std::from_chars(value.data(), value.data() + value.size(), count);
        if (error != std::errc{} || rest != value.data() + value.size() ||
            count < (triangles ? demo.fewestTriangles : 1) ||
            count > (triangles ? demo.mostTriangles : demo.largestCount))
            return badInput(fmt::format("demo:{} cannot take {}='{}'; it has {}", demo.description.name, key, value,
                                        demo.description.options));
    }
    return counts;
}

}  // namespace

std::span<const DemoDescription> demos() {
    return kDescriptions;
}

bool isDemo(std::string_view uri) {
    return uri.substr(0, kScheme.size()) == kScheme;
}

Result<Ref<LoadedScene>> buildDemo(std::string_view uri, Aspect& aspect) {
    if (!isDemo(uri)) return badInput(fmt::format("'{}' is no procedural scene; there are {}", uri, knownDemos()));
    const std::string_view rest = uri.substr(kScheme.size());
    const std::size_t question = rest.find('?');
    const std::string_view name = rest.substr(0, question);
    for (const Demo& demo : kDemos) {
        if (demo.description.name != name) continue;
        const auto counts = parseCounts(demo, question == std::string_view::npos ? "" : rest.substr(question + 1));
        if (counts.has_error()) return counts.error();
        return demo.build(aspect, *counts);
    }
    return badInput(fmt::format("there is no procedural scene '{}'; there are {}", uri, knownDemos()));
}

}  // namespace umbriel
