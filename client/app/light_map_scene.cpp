#include "client/app/light_map_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "client/app/trade_setting.h"
#include "client/trade/shadow_scene.h"
#include "client/trade/trade_choice.h"
#include "common/base/log.h"
#include "common/scene/light_map_state.h"

namespace umbriel {
namespace {

// Texels of all lights together: where textures of llvmpipe end.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
// Rows of textures begin at multiples of this.
constexpr std::uint64_t kRowBytes = 64;

// Of a light, with what pages share and rows are filled up with.
std::uint64_t textureBytes(std::uint32_t size) {
    const LightMapPages pages = LightMapPages::of(size, LightMap::kPageSize);
    const std::uint64_t row = (pages.side + kRowBytes - 1) / kRowBytes * kRowBytes;
    return row * pages.side * pages.columns * pages.columns;
}

double radiusOf(const Aspect& scene, const LightInEffect& light) {
    if (const auto* core = scene.findAs<DirectionalLight>(light.core.id)) return core->angularRadius;
    if (const auto* core = scene.findAs<PointLight>(light.core.id)) return core->radius;
    if (const auto* core = scene.findAs<SpotLight>(light.core.id)) return core->radius;
    if (const auto* core = scene.findAs<GoniometricLight>(light.core.id)) return core->radius;
    return 0.0;
}

// Everything below a node with this name counts as moving.
Result<void> letMove(const Aspect& scene, const Hierarchy& hierarchy, const std::string& name,
                     std::vector<DrawnSurface>& drawn) {
    bool known = false;
    for (DrawnSurface& surface : drawn)
        for (Ref<Node> node = surface.node; node; node = hierarchy.parentOf(node)) {
            const Node* above = scene.find(node);
            if (!above || above->name.get() != name) continue;
            surface.moves = known = true;
        }
    if (!known) return badInput(fmt::format("--moving '{}': nothing is drawn below a node of this name", name));
    return {};
}

LightMapSurface surfaceOf(const Aspect& scene, const DrawnSurface& drawn, const ShadowScene& rays) {
    LightMapSurface surface;
    surface.worldFromObject = drawn.worldFromObject;
    const Geometry& geometry = scene.get(drawn.geometry);
    for (const glm::vec3& p : geometry.positions.toVector()) {
        surface.objectPositions.emplace_back(p);
        surface.mesh.positions.push_back(drawn.worldFromObject.point(glm::dvec3(p)));
    }
    const std::vector<std::uint32_t> indices = geometry.indices.toVector();
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
        surface.mesh.triangles.emplace_back(indices[i], indices[i + 1], indices[i + 2]);
    if (geometry.texCoords1.size() == geometry.positions.size())
        for (const glm::vec2& t : geometry.texCoords1.toVector()) surface.mesh.texCoords.emplace_back(t);
    const auto low = static_cast<std::uint32_t>(drawn.node.id.value);
    for (std::uint32_t i = 0; i < surface.mesh.triangles.size(); ++i)
        surface.rayTriangles.push_back(rays.triangleOf(low, i));
    return surface;
}

}  // namespace

Result<LightMapFile> bakeLightMapOf(const Aspect& scene, Ref<Node> root, const LightMapOptions& options,
                                    const std::vector<std::string>& moving, LightMapDrawing* drawing) {
    const Hierarchy hierarchy(scene, root);
    std::vector<DrawnSurface> drawn = drawnSurfaces(scene, root, hierarchy);
    for (const std::string& name : moving)
        if (const auto done = letMove(scene, hierarchy, name, drawn); !done) return done.error();
    ShadowScene::Options casting;
    for (const DrawnSurface& surface : drawn)
        if (surface.moves) casting.excludeNodes.push_back(surface.node);
    const auto rays = ShadowScene::create(scene, root, casting);
    if (!rays) return rays.error();

    LightMapFile file;
    std::vector<LightMapLight> lights;
    std::vector<std::size_t> numbers;  // in the ShadowScene
    for (const LightInEffect& light : lightsInEffect(scene, root, hierarchy)) {
        if (!light.castsShadow || light.kind == LightKind::Ambient || umbriel::moves(scene, light, hierarchy)) continue;
        const auto& known = (*rays)->lights();
        const auto number =
            std::find_if(known.begin(), known.end(), [&](const TruthLight& l) { return l.node.id == light.node.id; });
        if (number == known.end()) continue;
        numbers.push_back(static_cast<std::size_t>(number - known.begin()));
        lights.push_back(
            {light.kind == LightKind::Directional, light.positionWorld, light.directionWorld, radiusOf(scene, light)});
        file.lightStates.push_back(lightState(scene, light));
        const std::string& name = scene.find(light.core.id)->name.get();
        file.lightNames.push_back(name.empty() ? fmt::format("#{}", light.node.id.value) : name);
    }
    if (lights.empty())
        return badInput("the scene has no light that stays where it is and casts shadows: nothing to bake");

    if (const std::uint64_t bytes = textureBytes(options.size) * lights.size(); bytes > kMostBytes)
        return badInput(
            fmt::format("{} x {} texels for {} lights are {} MiB, more than the {} of the largest texture "
                        "that every driver has; bake a smaller map",
                        options.size, options.size, lights.size(), bytes >> 20, kMostBytes >> 20));

    std::vector<LightMapSurface> surfaces;
    std::vector<Ref<Node>> nodes, gone;
    for (const DrawnSurface& surface : drawn) {
        (surface.moves ? gone : nodes).push_back(surface.node);
        if (surface.moves) continue;
        surfaces.push_back(surfaceOf(scene, surface, **rays));
        file.states.push_back(surface.state);
        for (const std::size_t number : numbers)
            surfaces.back().lit.push_back(
                (*rays)->reaches(number, static_cast<std::uint32_t>(surface.node.id.value)) ? 1 : 0);
    }
    if (surfaces.empty()) return badInput("nothing in the scene stays where it is: there is nothing to bake");
    if (drawing) drawing->describe(std::move(nodes), std::move(gone), std::move(numbers));
    auto baked = bakeLightMap(surfaces, lights, (*rays)->rays(), options, drawing);
    if (!baked) return baked.error();
    file.baked = std::move(*baked);
    return file;
}

Result<Ref<LightMap>> attachLightMap(Aspect& scene, Ref<Window> window, const LightMapFile& file) {
    const std::vector<Ref<Viewport>> viewports = scene.get(window).viewports.toVector();
    // By state; of several with one state each is taken once.
    std::map<std::uint64_t, std::vector<Ref<Node>>> found;
    if (!viewports.empty()) {
        const Ref<Node> root = scene.get(viewports.front()).root;
        for (const DrawnSurface& drawn : drawnSurfaces(scene, root, Hierarchy(scene, root)))
            if (drawn.state != 0) found[drawn.state].push_back(drawn.node);
    }
    for (auto& [state, nodes] : found) std::reverse(nodes.begin(), nodes.end());
    std::vector<Ref<Node>> surfaces;
    std::size_t missing = 0;
    for (const std::uint64_t state : file.states) {
        const auto same = found.find(state);
        if (same == found.end() || same->second.empty()) {
            surfaces.emplace_back();
            ++missing;
            continue;
        }
        surfaces.push_back(same->second.back());
        same->second.pop_back();
    }
    if (missing == surfaces.size())
        return badInput("it was baked of another scene: none of its surfaces is in this one; bake it again");
    const Ref<LightMap> map = scene.create<LightMap>("light map");
    scene.edit(map)
        .set<&LightMap::size>(file.baked.size)
        .assign<&LightMap::texels>(file.baked.texels)
        .assign<&LightMap::lightStates>(file.lightStates)
        .assign<&LightMap::surfaces>(surfaces)
        .assign<&LightMap::states>(file.states)
        .assign<&LightMap::triangles>(file.baked.triangles)
        .assign<&LightMap::places>(file.baked.places)
        .assign<&LightMap::charts>(file.baked.charts);
    for (const Ref<Viewport>& viewport : viewports) scene.edit(viewport).set<&Viewport::lightMap>(map);
    return map;
}

namespace {

bool isThere(const std::filesystem::path& path) {
    std::error_code error;
    return std::filesystem::exists(path, error);
}

Result<void> loadLightMap(const std::filesystem::path& path, Aspect& scene, Ref<Window> window) {
    const auto file = readLightMap(path);
    if (!file) return file.error();
    const auto attached = attachLightMap(scene, window, *file);
    if (!attached) return badInput(fmt::format("{}: {}", path.string(), attached.error().message));
    return {};
}

// A light map was chosen by umbriel trade and cannot be had: what it measured beside it is taken. The reason, as an
// error, when it was not umbriel trade that chose.
Result<void> applyWithoutLightMap(const SceneArguments& arguments, Aspect& scene, Ref<Window> window,
                                  const Error& reason) {
    const auto path = tradeFileOf(arguments.scene);
    const auto stored = readTrade(path);
    if (!stored || !*stored || !isLightMap((*stored)->chosen.setting)) return reason;
    const TradeSetting setting = nextChoice(**stored, [](const TradeSetting& one) {
                                     return !isLightMap(one);
                                 }).value_or(TradeSetting{"std", 512, {}, {}, {}});
    if (const auto applied = applySetting(scene, window, setting); !applied)
        return badInput(fmt::format("{}: {}", path.string(), applied.error().message));
    log::warning(fmt::format("{}: {} was chosen by umbriel trade; {}. Drawn with {}", path.string(),
                             labelOf((*stored)->chosen.setting), reason.message, labelOf(setting)));
    return {};
}

}  // namespace

bool hasLightMap(const SceneArguments& arguments) {
    return !arguments.lightMap.empty() || isThere(lightMapFileOf(arguments.scene));
}

Result<void> applyLightMap(const SceneArguments& arguments, Aspect& scene, Ref<Window> window) {
    bool isAsked = false;
    for (const Ref<Viewport>& viewport : scene.get(window).viewports.toVector())
        isAsked = isAsked || scene.get(viewport).shadowMode.get() == ShadowMode::LightMap;
    if (!arguments.lightMap.empty()) return loadLightMap(arguments.lightMap, scene, window);
    const std::filesystem::path path = lightMapFileOf(arguments.scene);
    // A frame budget may come to a light map later.
    if (!isAsked && (!arguments.frameBudget || !isThere(path))) return {};
    const bool isStored = isAsked && arguments.shadow == "auto" && !arguments.frameBudget;
    if (!isThere(path)) {
        const Error missing =
            badInput(fmt::format("{}there is no {}; make it with umbriel bake {} --light-map N, or name another with "
                                 "--light-map",
                                 isStored ? "" : "--shadow light-map: ", path.string(), arguments.scene));
        return isStored ? applyWithoutLightMap(arguments, scene, window, missing) : missing;
    }
    const auto loaded = loadLightMap(path, scene, window);
    if (loaded || !isStored) return loaded;
    return applyWithoutLightMap(arguments, scene, window, loaded.error());
}

}  // namespace umbriel
