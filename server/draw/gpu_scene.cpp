#include "server/draw/gpu_scene.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>

#include "common/base/assert.h"
#include "common/base/hash.h"
#include "common/base/log.h"
#include "common/wall/shadow_show.h"
#include "server/draw/reflection_models.h"

namespace umbriel {
namespace {

constexpr FeatureSet kLit = litFeatures();
constexpr Feature kTextureFeatures[kMaterialTextures] = {Feature::BaseColourTexture, Feature::MetallicRoughnessTexture,
                                                         Feature::NormalTexture,     Feature::OcclusionTexture,
                                                         Feature::EmissionTexture,   Feature::SpecularTexture};
constexpr FeatureSet kAllTextures = bit(Feature::BaseColourTexture) | bit(Feature::MetallicRoughnessTexture) |
                                    bit(Feature::NormalTexture) | bit(Feature::OcclusionTexture) |
                                    bit(Feature::EmissionTexture) | bit(Feature::SpecularTexture);

Feature texCoordFeature(std::uint32_t set) {
    return set == 0 ? Feature::TexCoords0 : Feature::TexCoords1;
}

// Keeps the textures that the geometry has coordinates for, and adds the coordinates that the kept ones read.
FeatureSet withTexCoords(FeatureSet features, const GpuMaterial& material, FeatureSet attributes) {
    for (std::size_t i = 0; i < kMaterialTextures; ++i) {
        if (!has(features, kTextureFeatures[i])) continue;
        const Feature coordinates = texCoordFeature(material.texCoordSets[i]);
        if (has(attributes, coordinates))
            features |= bit(coordinates);
        else
            features &= ~bit(kTextureFeatures[i]);
    }
    return features;
}

// Lights with a shadow that travel from the vertices to the pixels as interpolants, for each side, of which OpenGL
// promises 15; what more of them leave at the vertices lies in a table. kShadowedLights of shaders/snippet.
constexpr std::uint32_t kVertexShadows = 4;

// How a lit geometry with normals is shaded.
FeatureSet frequencyFeatures(ShadingFrequency frequency, const GpuMaterial& material, const LightList::Run& run) {
    switch (frequency) {
        case ShadingFrequency::Phong:
            return 0;
        case ShadingFrequency::FlatMean:
            return bit(Feature::FlatMean);
        case ShadingFrequency::Gouraud:
        case ShadingFrequency::Flat:
            break;
    }
    // A vertex does not know which of its sides will be seen.
    return bit(Feature::VertexShading) | (material.features & bit(Feature::DoubleSided)) |
           (run.shadows > kVertexShadows ? bit(Feature::VertexTable) : 0) |
           (frequency == ShadingFrequency::Flat ? bit(Feature::FlatShading) : 0);
}

FeatureSet surfaceFeatures(const GpuMaterial& material, FeatureSet attributes, const LightList::Run& run,
                           ShadingFrequency shading) {
    const bool isLit = (material.features & kLit) != 0;
    const FeatureSet frequency =
        isLit && has(attributes, Feature::VertexNormals) ? frequencyFeatures(shading, material, run) : 0;
    FeatureSet features = material.features & ~bit(Feature::DoubleSided);  // a state, not code
    // The mean normal of a triangle is its only one.
    if (has(frequency, Feature::FlatMean) || !has(attributes, Feature::VertexTangents))
        features &= ~bit(Feature::NormalTexture);
    features = withTexCoords(features, material, attributes) | (attributes & bit(Feature::VertexColours));
    if (!isLit) return features;
    features |= run.features | (attributes & bit(Feature::VertexNormals)) | frequency;
    if (has(features, Feature::NormalTexture)) features |= bit(Feature::VertexTangents);
    if (material.wantsTangents) features |= attributes & bit(Feature::VertexTangents);
    return features;
}

// Whether the constants of a surface's shader fit into interpolants: those of one parallel light with one map at most
// (shaders/snippet/passed_constants.glsl).
bool canPassConstants(FeatureSet features) {
    constexpr FeatureSet kOthers = bit(Feature::PointLights) | bit(Feature::SpotLights) |
                                   bit(Feature::GoniometricLights) | bit(Feature::VertexShading) |
                                   bit(Feature::ShadowPerspective) | bit(Feature::ShadowCube) |
                                   bit(Feature::ShadowHemispheres) | bit(Feature::ShadowView) |
                                   bit(Feature::ShadowLightMap) | bit(Feature::ShadowMixed);
    return has(features, Feature::OneLight) && has(features, Feature::DirectionalLights) && (features & kOthers) == 0;
}

FeatureSet fogFeature(const Fog* fog) {
    if (!fog) return 0;
    constexpr Feature kModes[kEnumCount<FogMode>] = {Feature::FogLinear, Feature::FogQuadratic, Feature::FogExponential,
                                                     Feature::FogSquaredExponential};
    return bit(kModes[static_cast<std::uint32_t>(fog->mode.get())]);
}

constexpr FeatureSet kShadowFeatures = ~(bit(Feature::Shadows) - 1);

// The same with what the view's darkness holds in place of what a module does.
FeatureSet withDarkness(FeatureSet features) {
    if (!has(features, Feature::Shadows)) return features;
    return (features & ~kShadowFeatures) | bit(Feature::Shadows) | bit(Feature::ShadowView);
}

// Only the silhouette matters; and for light factors, the lights.
FeatureSet maskFeatures(const GpuMaterial& material, FeatureSet attributes) {
    if (!has(material.features, Feature::AlphaMask)) return 0;
    FeatureSet features = material.features & (bit(Feature::AlphaMask) | bit(Feature::BaseColourTexture));
    return withTexCoords(features, material, attributes) | (attributes & bit(Feature::VertexColours));
}

bool excluded(const SceneTree& tree, const Viewport& viewport, std::uint32_t entry) {
    for (std::size_t i = 0; i < viewport.excludeNodes.size(); ++i) {
        const auto [first, end] = tree.rangeOf(viewport.excludeNodes[i].id);
        if (entry >= first && entry < end) return true;
    }
    return false;
}

// Four steps per doubling of the distance.
int depthBucketOf(double distance) {
    int exponent = 0;
    const double mantissa = std::frexp(distance, &exponent);  // in [1/2, 1)
    return exponent * 4 + static_cast<int>((mantissa - 0.5) * 8.0);
}

// What a caster's place in a shadow map depends on; every byte is a member's.
struct Caster {
    std::uint64_t node = 0;
    std::uint64_t content = 0;  // counts what the geometry sent to the GPU
    std::uint64_t features = 0;  // those of its texture's holes, which are among the first 64
    std::uint64_t revision = 0;
    glm::dmat4 worldFromObject{0.0};
};
static_assert(sizeof(Caster) == 4 * 8 + 16 * 8);

Caster casterOf(const SurfaceItem& item) {
    UMBRIEL_ASSERT((item.casterFeatures >> 64) == 0, "holes of casters are among the first 64 features");
    return {item.node.value, item.geometry->uploadedBytes(), static_cast<std::uint64_t>(item.casterFeatures), 0,
            item.worldFromObject};
}

glm::mat3 normalMatrix(const glm::dmat3& linear) {
    // The adjugate's transpose instead of the inverse's: finite for flattening transforms too, and equal up to a scale;
    // its sign follows the determinant, so a mirrored surface keeps its outside.
    const glm::dmat3 cofactor(glm::cross(linear[1], linear[2]), glm::cross(linear[2], linear[0]),
                              glm::cross(linear[0], linear[1]));
    const double determinant = glm::dot(linear[0], cofactor[0]);
    double largest = 0.0;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(cofactor[i][k]));
    if (!(largest > 0.0)) return glm::mat3(1.0f);
    return glm::mat3(cofactor * ((determinant < 0.0 ? -1.0 : 1.0) / largest));
}

}  // namespace

void setSides(const SurfaceItem& item) {
    if (has(item.material->features, Feature::DoubleSided))
        glDisable(GL_CULL_FACE);
    else
        glEnable(GL_CULL_FACE);
    glFrontFace(item.isMirrored ? GL_CW : GL_CCW);
}

ShownLight shownLightOf(const ViewScene& view) {
    ShownLight shown;
    if (!view.viewport) return shown;
    const auto light = shownLight(view.view->fits, view.viewport->showLight);
    for (std::uint32_t i = 0; light && i < view.lights.fits.size(); ++i) {
        if (view.lights.fits[i]->light != *light) continue;
        if (shown.parts++ == 0) shown.first = i;
        if (view.lights.fits[i]->mode == ShadowMode::LightMap) break;  // has no maps of its own to show
    }
    return shown;
}

bool ViewScene::isMapShown() const {
    if (!viewport) return false;
    const ShadowShow show = viewport->show;
    return show == ShadowShow::ShadowMap || show == ShadowShow::SeenArea;
}

void bindLightMap(const ViewScene& view, const SurfaceItem& item) {
    view.lightMap->bind();
    item.lightMapPlaces->bindBase(GL_SHADER_STORAGE_BUFFER, GpuLightMap::kPlacesBinding);
}

GpuScene::GpuScene(std::size_t textureBudgetBytes, int maxTextureSize, std::uint32_t largestPage, bool passesConstants)
    : _textures(textureBudgetBytes, maxTextureSize), _passesConstants(passesConstants), _lightMaps(largestPage) {}

void GpuScene::changed(const ChangeList& changes, const Aspect& scene) {
    for (const ContainerChange& change : changes.changed) {
        const Container* container = scene.find(change.id);
        if (!container) continue;
        if (isA<Transform>(*container)) {
            _movedTransforms.push_back(change.id);
        } else if (isA<EnvironmentMap>(*container)) {
            _environments.forget(change.id);
        } else if (isA<LightMap>(*container)) {
            _lightMaps.forget(change.id);
        } else if (isA<Skin>(*container)) {
            _deformer.changed(change.id);
        } else if (isA<DeformedGeometry>(*container)) {
            _deformer.changed(change.id);
            _structureChanged = true;
        } else if (isA<Geometry>(*container)) {
            _deformer.changed(change.id);
            std::vector<MultiChange>& pending = _pending[change.id];
            for (const MultiChange& multi : change.multis) {
                const auto same = std::find_if(pending.begin(), pending.end(),
                                               [&](const MultiChange& p) { return p.field == multi.field; });
                if (same == pending.end())
                    pending.push_back(multi);
                else
                    same->touched.add(multi.touched);
            }
            for (std::size_t field = 0; field < container->type().fields.size(); ++field)
                if (((change.fields >> field) & 1) && !container->type().fields[field].isMulti)
                    _structureChanged = true;
        } else if (isA<Image>(*container)) {
            ++_revision;
            _textures.forget(change.id);
            _materials.changed(change.id);
        } else if (isA<Texture>(*container) || isA<Material>(*container)) {
            ++_revision;
            _materials.changed(change.id);
        } else if (isA<Node>(*container) || isA<Switch>(*container) || isA<MaterialGroup>(*container)) {
            ++_revision;
            _structureChanged = true;
        }
    }
    for (const ContainerId id : changes.destroyed) {
        if (const auto found = _geometries.find(id); found != _geometries.end()) {
            _uploadedByForgotten += found->second.uploadedBytes();
            _geometries.erase(found);
        }
        _deformer.changed(id);
        _environments.forget(id);
        _lightMaps.forget(id);
        _pending.erase(id);
        _textures.forget(id);
        _materials.changed(id);
        _structureChanged = true;
        ++_revision;
    }
}

Result<void> GpuScene::update(const Aspect& scene) {
    for (const auto& [id, changes] : _pending) {
        const auto found = _geometries.find(id);
        const Geometry* geometry = scene.findAs<Geometry>(id);
        if (found == _geometries.end() || !geometry || changes.empty()) continue;
        if (auto updated = found->second.update(*geometry, changes); !updated) return updated;
    }
    _pending.clear();
    if (_structureChanged) {
        _trees.clear();
    } else {
        for (auto& [root, tree] : _trees) tree.moved(scene, _movedTransforms);
    }
    _structureChanged = false;
    _movedTransforms.clear();
    return {};
}

SceneTree& GpuScene::treeOf(const Aspect& scene, ContainerId root) {
    const auto [found, isNew] = _trees.try_emplace(root);
    if (isNew) {
        found->second.rebuild(scene, root);
        for (const std::string& warning : found->second.warnings()) log::warning(warning);
    }
    return found->second;
}

Result<GpuGeometry*> GpuScene::geometryOf(const Aspect& scene, ContainerId id, const GpuGeometry::Needs& needs) {
    const Geometry* geometry = scene.findAs<Geometry>(id);
    if (!geometry) return nullptr;
    if (const auto found = _geometries.find(id); found != _geometries.end()) {
        if (auto required = found->second.require(*geometry, needs); !required) return required.error();
        return &found->second;
    }
    auto uploaded = GpuGeometry::upload(*geometry, needs);
    if (!uploaded) return uploaded.error();
    return &_geometries.emplace(id, std::move(*uploaded)).first->second;
}

Result<ViewScene> GpuScene::prepare(const Aspect& scene, const View& view, std::uint32_t layers,
                                    ShaderLibrary& shaders) {
    ViewScene result;
    result.view = &view;
    result.viewport = scene.findAs<Viewport>(view.viewport);
    if (!result.viewport) return result;
    const Viewport& viewport = *result.viewport;
    SceneTree& tree = treeOf(scene, viewport.root.get().id);
    result.fog = scene.findAs<Fog>(viewport.fog.get().id);
    result.lights = listLights(scene, tree, view, &viewport);
    result.screen = screenShadowOf(viewport);
    result.environments = environmentsBySet(scene, tree, viewport);
    const std::vector<std::uint8_t> hidden =
        tree.hasLevelsOfDetail() ? tree.hiddenByDetail(scene, view.eyeWorld) : std::vector<std::uint8_t>();
    const bool wantsLayers = (layers & ~static_cast<std::uint32_t>(Layer::Colour)) != 0;
    const bool wantsFactors = (layers & static_cast<std::uint32_t>(Layer::LightFactors)) != 0;

    const bool asksLightMap = std::any_of(result.lights.fits.begin(), result.lights.fits.end(),
                                          [](const ShadowFit* fit) { return fit->mode == ShadowMode::LightMap; });
    const LightMap* lightMap = asksLightMap ? scene.find(viewport.lightMap.get()) : nullptr;
    if (lightMap) {
        auto found = _lightMaps.find(scene, lightMap->id());
        if (!found) return found.error();
        result.lightMap = *found;
    }
    // By ShadowCasters, in the tree's order, which the eye does not change.
    std::array<std::vector<Caster>, 3> casters;
    for (const SceneTree::Item& source : tree.items()) {
        if (!hidden.empty() && hidden[source.entry]) continue;
        SurfaceItem item;
        item.node = source.node;
        item.run = source.lightSet;
        item.material = &_materials.find(scene, _textures, source.material);
        LightList::Run run = result.lights.runs[source.lightSet];
        const FeatureSet materialFeatures = item.material->features;
        const bool isLit = (materialFeatures & kLit) != 0;
        const Geometry* geometry = scene.findAs<Geometry>(source.geometry);
        if (!geometry) continue;
        const ShadingFrequency shading = geometry->shading;
        GpuGeometry::Needs needs;
        needs.keepOrder = has(materialFeatures, Feature::AlphaBlend);
        needs.faceNormals = wantsLayers || result.screen.factors || result.screen.surfaces ||
                            (isLit && (has(run.features, Feature::Shadows) || geometry->normals.empty() ||
                                       shading == ShadingFrequency::FlatMean ||
                                       geometry->normals.size() != geometry->positions.size()));
        needs.tangents = has(materialFeatures, Feature::NormalTexture) || item.material->wantsTangents;
        needs.tangentSet = item.material->texCoordSets[static_cast<std::size_t>(TextureUnit::Normal)];
        needs.flatFaces = isLit && shading == ShadingFrequency::FlatMean;
        needs.primitives = (layers & static_cast<std::uint32_t>(Layer::Ids)) != 0;
        Placement placement = tree.entries()[source.entry].world;
        if (source.deformation) {
            auto deformed = _deformer.prepare(scene, tree, source.deformation, placement, needs, shaders);
            if (!deformed) return deformed.error();
            item.geometry = deformed->geometry;
            placement = deformed->world;
            item.isMirrored = deformed->isMirrored;
            if (item.geometry) result.deformed.push_back(_deformer.sizeOf(source.deformation));
        } else {
            auto uploaded = geometryOf(scene, source.geometry, needs);
            if (!uploaded) return uploaded.error();
            item.geometry = *uploaded;
        }
        if (!item.geometry || item.geometry->triangles() == 0) continue;

        item.isInLightMap = result.lightMap && !source.deformation && result.lightMap->holds(item.node, *item.geometry);
        // What is not in the light map has maps instead.
        if (!item.isInLightMap && has(run.features, Feature::ShadowLightMap))
            run.features = (run.features & ~bit(Feature::ShadowLightMap)) | bit(Feature::ShadowMixed);
        if (has(run.features, Feature::ShadowLightMap) && result.lightMap->isPaged())
            run.features |= bit(Feature::ShadowLightMapPages);
        const FeatureSet attributes = item.geometry->attributes();
        item.features = surfaceFeatures(*item.material, attributes, run, shading) | fogFeature(result.fog);
        if (isLit && result.environments[item.run]) item.features |= bit(Feature::Environment);
        if (isLit && view.orthographic) item.features |= bit(Feature::Orthographic);
        if (has(item.features, Feature::Shadows) && viewport.shadowColor.get() != glm::vec3(0.0f))
            item.features |= bit(Feature::ShadowColour);
        item.casterFeatures = maskFeatures(*item.material, attributes);
        item.layerFeatures = item.casterFeatures;
        if (wantsFactors) item.layerFeatures |= run.features & ~bit(Feature::AmbientLights);
        if (view.unwrapped) item.layerFeatures |= bit(Feature::Unwrapped);
        if (result.screen.factors && !has(materialFeatures, Feature::AlphaBlend)) {
            if (!isLit && viewport.foreignShading && has(run.features, Feature::Shadows)) {
                constexpr FeatureSet kNotForeign = bit(Feature::LightAmbient) | bit(Feature::LightHighlights);
                item.features |= bit(Feature::ForeignShading) | (run.features & ~kNotForeign);
            }
            item.factorFeatures = item.casterFeatures | (run.features & ~bit(Feature::AmbientLights));
            item.features = withDarkness(item.features);
            item.layerFeatures = withDarkness(item.layerFeatures);
        }
        item.relativeFromObject = placement.relativeTo(view.eyeWorld);
        item.worldFromObject = placement.relativeTo(glm::dvec3(0.0));
        item.normalFromObject = normalMatrix(placement.linear);
        if (item.normalFromObject == glm::mat3(1.0f)) {
            if (needs.faceNormals && isLit) item.features |= bit(Feature::WorldAxes);
            item.layerFeatures |= bit(Feature::WorldAxes);
        }
        if (needs.faceNormals && isLit) item.features |= attributes & bit(Feature::FirstVertexNormals);
        item.layerFeatures |= attributes & bit(Feature::FirstVertexNormals);
        if (_passesConstants && isLit && canPassConstants(item.features))
            item.features |= bit(Feature::PassedConstants);
        item.isMirrored = item.isMirrored != (glm::determinant(placement.linear) < 0.0);
        // Light passes through what is blended; how much, no plain shadow map can say.
        item.castsShadow = !has(materialFeatures, Feature::AlphaBlend) && !excluded(tree, viewport, source.entry);
        const glm::dvec3 middle(item.relativeFromObject * glm::dvec4(item.geometry->box().centre(), 1.0));
        item.distance = glm::length(middle);
        item.hidesBacks = !view.unwrapped && has(materialFeatures, Feature::DoubleSided) &&
                          (materialFeatures & (bit(Feature::AlphaMask) | bit(Feature::AlphaBlend))) == 0;
        item.depthBucket = depthBucketOf(item.distance);
        if (item.castsShadow) {
            casters[0].push_back(casterOf(item));
            if (result.lightMap) casters[item.isInLightMap ? 1 : 2].push_back(casters[0].back());
        }
        const Box& box = item.geometry->box();
        result.boxWorld.include(transformed(Affine{glm::dmat3(item.worldFromObject), glm::dvec3(item.worldFromObject[3])},
                                            Box3d{glm::dvec3(box.minimum), glm::dvec3(box.maximum)}));
        result.items.push_back(item);
    }
    // Only now does every geometry have the order that all of its users need.
    for (SurfaceItem& item : result.items) {
        if (!item.isInLightMap) continue;
        auto places = result.lightMap->placesOf(*lightMap, item.node, *item.geometry);
        if (!places) return places.error();
        item.lightMapPlaces = *places;
    }
    for (std::size_t i = 0; i < casters.size(); ++i) {
        casters[i].push_back({});
        casters[i].back().revision = _revision;
        // Grows whenever a caster changes its shape; what is deformed is never fixed.
        if (static_cast<ShadowCasters>(i) != ShadowCasters::Fixed)
            casters[i].back().content = _deformer.deformedVertices();
        result.casterStates[i] = hash64(std::as_bytes(std::span(casters[i])));
    }
    const auto isBlended = [](const SurfaceItem& item) { return has(item.features, Feature::AlphaBlend); };
    const auto middle = std::stable_partition(result.items.begin(), result.items.end(), std::not_fn(isBlended));
    result.opaqueItems = static_cast<std::size_t>(middle - result.items.begin());
    std::sort(result.items.begin(), middle, [](const SurfaceItem& a, const SurfaceItem& b) {
        return std::tuple(a.depthBucket, a.features, a.material->slot, a.node) <
               std::tuple(b.depthBucket, b.features, b.material->slot, b.node);
    });
    std::sort(middle, result.items.end(), [](const SurfaceItem& a, const SurfaceItem& b) {
        return std::tuple(-a.distance, a.node) < std::tuple(-b.distance, b.node);
    });
    return result;
}

std::optional<EnvironmentUse> GpuScene::environmentOf(const Aspect& scene, const ViewScene& view, ContainerId light) {
    return useOf(scene, treeOf(scene, view.viewport->root.get().id), light, std::nullopt);
}

std::uint64_t GpuScene::uploadedGeometryBytes() const {
    std::uint64_t bytes = _uploadedByForgotten;
    for (const auto& [id, geometry] : _geometries) bytes += geometry.uploadedBytes();
    return bytes;
}

}  // namespace umbriel
