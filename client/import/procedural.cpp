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

// At most one option a demo so far: the count n.
struct Demo {
    DemoDescription description;
    int defaultCount;
    int largestCount;  // 0: the demo has no options
    Ref<LoadedScene> (*build)(Aspect& aspect, int count);
};

constexpr std::array kDemos = {
    Demo{{"car", "a car driving in a circle between cones: one wheel geometry, four nodes, animated", ""},
         0,
         0,
         [](Aspect& aspect, int) { return buildCar(aspect); }},
    Demo{{"city", "a city of shared building geometries in separately culled blocks, with streets and trees",
          "n=BUILDINGS (1 to 100000, default 2000)"},
         2000,
         100000,
         [](Aspect& aspect, int count) { return buildCity(aspect, count); }},
    Demo{{"cloth", "a woven cloth with folds, draped over a ball", ""},
         0,
         0,
         [](Aspect& aspect, int) { return buildCloth(aspect); }},
    Demo{{"palms", "thin fronds at three distances, an aeroplane, a post near the eye: for the shadow experiments",
          "n=PALMS (1 to 5000, default 9)"},
         9,
         5000,
         [](Aspect& aspect, int count) { return buildPalms(aspect, count); }},
    Demo{{"spheres", "a square of spheres, roughness to the right, metalness to the back",
          "n=SPHERES (1 to 10000, default 49)"},
         49,
         10000,
         [](Aspect& aspect, int count) { return buildSpheres(aspect, count); }},
    Demo{{"torus", "a shiny torus of n segments around and half as many across: what interpolated shading makes of it",
          "n=SEGMENTS (1 to 2000, default 48; fewer than 3 count as 3)"},
         48,
         2000,
         [](Aspect& aspect, int count) { return buildTorus(aspect, count); }},
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

// The count from "n=7"; an error for anything else.
Result<int> parseCount(const Demo& demo, std::string_view options) {
    int count = demo.defaultCount;
    while (!options.empty()) {
        const std::size_t end = options.find('&');
        const std::string_view option = options.substr(0, end);
        options = end == std::string_view::npos ? std::string_view{} : options.substr(end + 1);
        const std::size_t equals = option.find('=');
        const std::string_view key = option.substr(0, equals);
        if (demo.largestCount == 0)
            return badInput(fmt::format("demo:{} has no option '{}': it has none at all", demo.description.name, key));
        if (key != "n")
            return badInput(fmt::format("demo:{} has no option '{}'; it has {}", demo.description.name, key,
                                        demo.description.options));
        const std::string_view value =
            equals == std::string_view::npos ? std::string_view{} : option.substr(equals + 1);
        const auto [rest, error] = std::from_chars(value.data(), value.data() + value.size(), count);
        if (error != std::errc{} || rest != value.data() + value.size() || count < 1 || count > demo.largestCount)
            return badInput(fmt::format("demo:{} cannot take n='{}'; it has {}", demo.description.name, value,
                                        demo.description.options));
    }
    return count;
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
        const auto count = parseCount(demo, question == std::string_view::npos ? "" : rest.substr(question + 1));
        if (count.has_error()) return count.error();
        return demo.build(aspect, *count);
    }
    return badInput(fmt::format("there is no procedural scene '{}'; there are {}", uri, knownDemos()));
}

}  // namespace umbriel
