#include "server/draw/light_list.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "common/scene/lights.h"
#include "server/shadow/shadow_maps.h"

namespace umbriel {
namespace {

glm::vec3 unitOr(const glm::dvec3& v, const glm::vec3& fallback) {
    const double length = glm::length(v);
    return length > 0.0 && std::isfinite(length) ? glm::vec3(v / length) : fallback;
}

struct Described {
    gpu::GpuLight light{};
    FeatureSet features = 0;
    bool castsShadow = false;
    ContainerId beacon;
    ContainerId table;
};

bool isZero(const glm::vec3& v) {
    return v == glm::vec3(0.0f);
}

// What all kinds but the ambient light have.
template <class Core>
bool describeCommon(const Core& light, Described& result) {
    result.beacon = light.beacon.get().id;
    result.castsShadow = light.castsShadow;
    result.light.ambientShare = light.ambientShare;
    result.light.highlightShare = light.highlightShare;
    if (!isZero(result.light.ambientShare)) result.features |= bit(Feature::LightAmbient);
    if (result.light.highlightShare != glm::vec3(1.0f)) result.features |= bit(Feature::LightHighlights);
    return light.on.get();
}

// What all kinds have that stand somewhere.
template <class Core>
bool describeLocal(const Core& light, gpu::uint kind, Feature feature, Described& result) {
    result.features = bit(feature);
    result.light.kind = kind;
    result.light.irradianceOrIntensity = light.intensity;
    result.light.range = light.range;
    result.light.radius = light.radius;
    result.light.attenuation = light.attenuation;
    if (light.fade.get() == LightFade::Polynomial) {
        result.light.fade = gpu::kFadePolynomial;
        result.features |= bit(Feature::ArtistAttenuation);
    }
    return describeCommon(light, result);
}

void describeCone(const SpotLight& light, Described& result) {
    const double outer = std::cos(static_cast<double>(light.outerAngle.get()));
    const double inner = std::cos(static_cast<double>(light.innerAngle.get()));
    result.light.spotCosOuter = static_cast<float>(outer);
    result.light.spotScale = static_cast<float>(1.0 / std::max(0.001, inner - outer));  // formula/light.glsl
    result.light.spotExponent = light.exponent;
    const SpotFalloff falloff = light.falloff;
    if (falloff == SpotFalloff::Edge) return;
    result.light.spotForm = falloff == SpotFalloff::Cone ? gpu::kSpotCone : gpu::kSpotProduct;
    result.features |= bit(Feature::SpotExponents);
}

// Nothing for a light that is off or no light.
std::optional<Described> describeLight(const Aspect& scene, const SceneTree& tree, const SceneTree::Light& source,
                                       const glm::dvec3& eyeWorld) {
    Described result;
    const Container* core = scene.find(source.light);
    if (!core) return std::nullopt;
    bool on = false;
    if (isA<DirectionalLight>(*core)) {
        const auto& light = static_cast<const DirectionalLight&>(*core);
        result.features = bit(Feature::DirectionalLights);
        result.light.kind = gpu::kLightDirectional;
        result.light.irradianceOrIntensity = light.irradiance;
        on = describeCommon(light, result);
    } else if (isA<PointLight>(*core)) {
        on = describeLocal(static_cast<const PointLight&>(*core), gpu::kLightPoint, Feature::PointLights, result);
    } else if (isA<SpotLight>(*core)) {
        const auto& light = static_cast<const SpotLight&>(*core);
        on = describeLocal(light, gpu::kLightSpot, Feature::SpotLights, result);
        describeCone(light, result);
    } else if (isA<GoniometricLight>(*core)) {
        const auto& light = static_cast<const GoniometricLight&>(*core);
        on = describeLocal(light, gpu::kLightGoniometric, Feature::GoniometricLights, result);
        result.table = light.table.get().id;
    }
    if (!on) return std::nullopt;
    const Placement own = tree.entries()[source.entry].world;
    const Placement placed = result.beacon ? tree.placementOf(scene, result.beacon).value_or(own) : own;
    result.light.position = glm::vec3(placed.translation - eyeWorld);
    result.light.direction = unitOr(-placed.linear[2], glm::vec3(0.0f, 0.0f, -1.0f));
    const glm::dvec3 along(result.light.direction);
    result.light.axisX =
        unitOr(placed.linear[0] - along * glm::dot(along, placed.linear[0]), glm::vec3(1.0f, 0.0f, 0.0f));
    result.light.shadowIndex = -1;
    return result;
}

// Where a light's table lies among the webs of the list; appended when it is not there. False: no table to go by.
bool placeWeb(const Aspect& scene, ContainerId id, gpu::GpuLight& light, LightList& list,
              std::map<ContainerId, gpu::uint>& known) {
    const IntensityTable* table = scene.findAs<IntensityTable>(id);
    if (!table) return false;
    const std::uint32_t columns = table->columns;
    const std::uint32_t rows = table->rows;
    if (columns < 1 || rows < 2 || columns > IntensityTable::kMaxSide || rows > IntensityTable::kMaxSide ||
        std::size_t{columns} * rows != table->shares.size())
        return false;
    light.webColumns = columns;
    light.webRows = rows;
    const auto [found, isNew] = known.try_emplace(id, static_cast<gpu::uint>(list.webs.size()));
    light.webFirst = found->second;
    if (!isNew) return true;
    for (const float share : table->shares.toVector())
        list.webs.push_back(std::isfinite(share) ? std::max(share, 0.0f) : 0.0f);
    return true;
}

// Whether no light has more parts of a shadow than a block holds.
bool partsFitBlocks(const LightList& list) {
    std::size_t parts = 0;
    for (std::size_t i = 0; i < list.shadowLights.size(); ++i) {
        parts = i > 0 && list.shadowLights[i] == list.shadowLights[i - 1] ? parts + 1 : 1;
        if (parts > gpu::kBlockParts) return false;
    }
    return true;
}

}  // namespace

LightList listLights(const Aspect& scene, const SceneTree& tree, const View& view, const Viewport* viewport) {
    LightList list;
    const auto chosen = [&](ContainerId node) {
        if (!viewport || viewport->lightNodes.empty()) return true;
        for (std::size_t i = 0; i < viewport->lightNodes.size(); ++i)
            if (viewport->lightNodes[i].id == node) return true;
        return false;
    };
    const bool shadowsOn = viewport && viewport->shadowOn.get() && viewport->shadowMode.get() != ShadowMode::None &&
                           viewport->show.get() != ShadowShow::ColorMap;
    std::vector<std::int32_t> listed(tree.lights().size(), -1);
    std::vector<glm::vec3> ambient(tree.lights().size(), glm::vec3(0.0f));
    std::vector<FeatureSet> features(tree.lights().size(), 0);
    std::map<ContainerId, gpu::uint> webs;
    std::vector<std::uint8_t> hasMaps(tree.lights().size(), 0);
    std::uint32_t maps = 0;
    const LightMap* lightMap = viewport ? scene.find(viewport->lightMap.get()) : nullptr;
    const std::size_t lightMapLayers = lightMap ? lightMap->lightStates.size() : 0;
    for (std::size_t i = 0; i < tree.lights().size(); ++i) {
        const SceneTree::Light& source = tree.lights()[i];
        if (!chosen(source.node)) continue;
        if (const AmbientLight* light = scene.findAs<AmbientLight>(source.light)) {
            if (light->on.get()) {
                ambient[i] = light->radiance;
                features[i] = bit(Feature::AmbientLights);
            }
            continue;
        }
        auto described = describeLight(scene, tree, source, view.eyeWorld);
        if (!described) continue;
        if (has(described->features, Feature::GoniometricLights) &&
            !placeWeb(scene, described->table, described->light, list, webs))
            continue;
        features[i] = described->features;
        described->light.index = static_cast<std::uint32_t>(list.lights.size());
        if (shadowsOn && described->castsShadow)
            for (const ShadowFit& fit : view.fits) {
                const ShadowModule* module = shadowModule(fit.mode);
                if (!module || (fit.light != source.light && fit.light != source.node)) continue;
                const ShadowDemand demand = module->demand(fit);
                if (demand.inLightMap ? fit.layer >= lightMapLayers : fit.mapSize == 0 && !demand.inView) continue;
                gpu::GpuShadow shadow = module->describe(fit, view.eyeWorld);
                if (demand.inLightMap) shadow.mapSize = static_cast<float>(lightMap->size.get());
                const auto index = static_cast<std::uint32_t>(list.shadows.size());
                if (!demand.inLightMap && !demand.inView) {
                    shadow.layer = static_cast<float>(maps++);
                    hasMaps[i] = 1;
                }
                if (described->light.shadowIndex < 0) {
                    described->light.shadowIndex = static_cast<std::int32_t>(index);
                } else if (fit.casters == ShadowCasters::Moving) {
                    // Beside the light map, which comes first; of several parts the first one.
                    const auto own = static_cast<std::uint32_t>(described->light.shadowIndex);
                    gpu::GpuShadow& first = list.shadows[own];
                    if (first.shape == gpu::kShadowLightMap && first.besideMap == 0) first.besideMap = index - own;
                }
                list.shadows.push_back(shadow);
                list.fits.push_back(&fit);
                list.shadowLights.push_back(described->light.index);
                features[i] |= featuresOf(module->features(fit));
            }
        if (described->light.shadowIndex >= 0) {
            described->light.darknessLayer = static_cast<std::uint32_t>(list.darkLights.size());
            list.darkLights.push_back(described->light.index);
        }
        listed[i] = static_cast<std::int32_t>(described->light.index);
        list.lights.push_back(described->light);
        list.nodes.push_back(source.node);
        const std::string& name = scene.find(source.light)->name.get();
        list.names.push_back(name.empty() ? std::to_string(source.light.value) : name);
    }
    // Maps that no buffer can hold, or whose rows would differ there, are read as they are.
    std::uint64_t texels = 0;
    std::uint32_t side = 0;
    bool isEven = true;
    for (const ShadowFit* fit : list.fits) {
        texels += std::uint64_t{fit->mapSize} * fit->mapSize;
        isEven = isEven && (side == 0 || fit->mapSize == 0 || fit->mapSize == side);
        side = std::max(side, fit->mapSize);
    }
    if (!isEven || texels > kLargestCopyTexels)
        for (FeatureSet& set : features)
            set &= ~(bit(Feature::ShadowCopy) | bit(Feature::ShadowFilter6) | bit(Feature::ShadowFilter8) |
                     bit(Feature::ShadowSearch6));
    std::uint32_t blocks = 0;
    for (const std::vector<std::uint32_t>& set : tree.lightSets()) {
        LightList::Run run;
        bool anyMaps = false;
        run.first = static_cast<std::uint32_t>(list.indices.size());
        for (const std::uint32_t light : set) {
            run.ambient += ambient[light];
            run.features |= features[light];
            anyMaps = anyMaps || hasMaps[light] != 0;
            if (listed[light] < 0) continue;
            const auto index = static_cast<std::uint32_t>(listed[light]);
            list.indices.push_back(index);
            if (list.lights[index].shadowIndex >= 0) ++run.shadows;
        }
        run.count = static_cast<std::uint32_t>(list.indices.size()) - run.first;
        if (anyMaps && has(run.features, Feature::ShadowLightMap)) run.features |= bit(Feature::ShadowMixed);
        if (run.count >= 1 && run.count <= gpu::kBlockLights && partsFitBlocks(list)) {
            constexpr Feature kCounts[gpu::kBlockLights] = {Feature::OneLight, Feature::TwoLights, Feature::ThreeLights,
                                                            Feature::FourLights};
            run.features |= bit(kCounts[run.count - 1]);
            run.block = blocks++;
        }
        list.runs.push_back(run);
    }
    list.blocks.resize(std::size_t{blocks} * gpu::kBlockLights);
    return list;
}

void fillLightBlocks(LightList& list) {
    for (const LightList::Run& run : list.runs) {
        if (!run.block) continue;
        for (std::uint32_t i = 0; i < run.count; ++i) {
            const gpu::GpuLight& light = list.lights[list.indices[run.first + i]];
            gpu::BlockLight& block = list.blocks[*run.block * gpu::kBlockLights + i];
            block.light = light;
            if (light.shadowIndex < 0) continue;
            const auto first = static_cast<std::size_t>(light.shadowIndex);
            for (std::size_t part = 0; part < gpu::kBlockParts && first + part < list.shadows.size(); ++part)
                block.shadows[part] = list.shadows[first + part];
        }
    }
}

}  // namespace umbriel
