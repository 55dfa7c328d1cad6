#include "client/session/light_map_fit.h"

#include <fmt/format.h>

#include <algorithm>

namespace umbriel {
namespace {

std::string nameOf(const Aspect& aspect, const LightInEffect& light) {
    const Container* core = aspect.find(light.core.id);
    const std::string name = core ? core->name.get() : std::string();
    return name.empty() ? fmt::format("#{}", light.node.id.value) : fmt::format("\"{}\"", name);
}

}  // namespace

LightMapUse useLightMap(const Aspect& aspect, const Viewport& viewport, const Hierarchy& hierarchy) {
    LightMapUse use;
    const LightMap* map = aspect.find(viewport.lightMap.get());
    if (!map) {
        use.messages.push_back(
            "shadows: there is no light map, standard maps are used; umbriel bake SCENE --light-map N makes one");
        return use;
    }
    const auto found = match(*map, drawnSurfaces(aspect, viewport.root, hierarchy, viewport.excludeNodes.toVector()));
    use.hasOthers = found.hasOthers;
    if (found.missing == 0) {
        use.map = map;
        return use;
    }
    use.messages.push_back(fmt::format(
        "shadows: the light map is stale: {} of the {} surfaces it was baked of have moved, changed or gone; "
        "standard maps are used until it is baked again",
        found.missing, map->surfaces.size()));
    return use;
}

ShadowFits fitWithLightMap(const Aspect& aspect, const std::vector<LightInEffect>& lights, const Hierarchy& hierarchy,
                           const Box3d& sceneBounds, std::span<const View> views, const ShadowFitRequest& request,
                           const LightMapUse& use) {
    ShadowFits result;
    ShadowFitRequest standard = request;
    standard.mode = standard.map = ShadowMode::Standard;
    for (const LightInEffect& light : lights) {
        if (!light.castsShadow) continue;
        const auto addMaps = [&](ShadowCasters casters) {
            ShadowFits fits = fitShadows(aspect, {light}, sceneBounds, views, standard);
            for (ShadowFit& fit : fits.fits) {
                fit.casters = casters;
                result.fits.push_back(fit);
            }
            for (std::string& message : fits.messages)
                if (std::find(result.messages.begin(), result.messages.end(), message) == result.messages.end())
                    result.messages.push_back(std::move(message));
        };
        const std::int32_t layer = use.map ? layerOf(*use.map, lightState(aspect, light)) : -1;
        if (layer < 0) {
            if (use.map && !moves(aspect, light, hierarchy))
                result.messages.push_back(
                    fmt::format("shadows: light {} is not in the light map as it stands now, so its part is stale: a "
                                "standard map is used until the light map is baked again",
                                nameOf(aspect, light)));
            addMaps(ShadowCasters::All);
            continue;
        }
        ShadowFit fit;
        fit.light = light.node;
        fit.mode = ShadowMode::LightMap;
        fit.layer = static_cast<std::uint32_t>(layer);
        result.fits.push_back(fit);
        if (!use.hasOthers) continue;
        addMaps(ShadowCasters::Moving);
        addMaps(ShadowCasters::Fixed);
    }
    return result;
}

}  // namespace umbriel
