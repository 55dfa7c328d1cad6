#include "client/trade/shadow_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "client/trade/texture_alpha.h"
#include "common/scene/deformed_bounds.h"
#include "common/scene/materials.h"

namespace umbriel {
namespace {

constexpr std::size_t kMaxLights = 64;

// What decides where a masked geometry has holes.
struct Mask {
    TextureAlpha texture;
    double alpha = 1.0;
    double cutoff = 0.5;
};

struct MaskedTriangle {
    std::uint32_t mask = 0;
    glm::dvec2 texCoord[3] = {};
    double alpha[3] = {1.0, 1.0, 1.0};
};

// What the rays ask while they are traced.
struct Holes {
    static constexpr std::uint32_t kNeverSolid = ~0u;
    std::vector<Mask> masks;
    std::vector<MaskedTriangle> triangles;
    std::vector<std::uint32_t> of;  // by triangle of the scene: index above; kNeverSolid: casts nothing

    bool isSolid(std::uint32_t triangle, double u, double v) const {
        if (of[triangle] == kNeverSolid) return false;
        const MaskedTriangle& t = triangles[of[triangle]];
        const Mask& mask = masks[t.mask];
        const double w = 1.0 - u - v;
        const double vertex = w * t.alpha[0] + u * t.alpha[1] + v * t.alpha[2];
        const glm::dvec2 texCoord = w * t.texCoord[0] + u * t.texCoord[1] + v * t.texCoord[2];
        return mask.alpha * vertex * mask.texture.at(texCoord) >= mask.cutoff;
    }
};

// Where a node's vertices are: morphed, then skinned (server/draw/deformer.h does it in float), or placed.
std::vector<glm::dvec3> worldPositions(const Aspect& scene, const Hierarchy& hierarchy, const VisitedNode& visited,
                                       const Geometry& geometry, const DeformedGeometry* deformed) {
    std::vector<glm::dvec3> positions;
    for (const glm::vec3& p : geometry.positions.toVector()) positions.emplace_back(p);
    const std::size_t vertices = positions.size();
    const Skin* skin = deformed ? scene.find(deformed->skin.get()) : nullptr;
    if (deformed) {
        const std::vector<float> weights = morphWeightsOf(scene, *deformed, morphTargetsOf(geometry));
        const std::vector<glm::vec3> deltas = geometry.morphPositions.toVector();
        for (std::size_t t = 0; t < weights.size(); ++t)
            for (std::size_t v = 0; v < vertices; ++v)
                positions[v] += static_cast<double>(weights[t]) * glm::dvec3(deltas[t * vertices + v]);
    }
    const std::vector<VertexJoints> joints =
        skin ? vertexJointsOf(geometry, skin->joints.size()) : std::vector<VertexJoints>();
    if (joints.size() != vertices || joints.empty()) {
        for (glm::dvec3& p : positions) p = visited.worldFromNode.point(p);
        return positions;
    }
    std::vector<Affine> worldFromJoint;
    for (const Ref<Node>& joint : skin->joints.toVector())
        worldFromJoint.push_back(hierarchy.worldFromNode(scene, joint));
    const glm::dvec3 anchor = worldFromJoint.front().translation;
    const std::vector<Affine> maps = jointMapsOf(*skin, worldFromJoint, anchor);
    for (std::size_t v = 0; v < vertices; ++v) {
        glm::dvec3 sum(0.0);
        for (std::size_t k = 0; k < kJointsPerVertex; ++k)
            if (joints[v].weights[k] > 0.0f)
                sum += static_cast<double>(joints[v].weights[k]) * maps[joints[v].joints[k]].point(positions[v]);
        positions[v] = anchor + sum;
    }
    return positions;
}

TruthLight describe(const Aspect& scene, const LightInEffect& effect) {
    TruthLight light;
    light.node = effect.node;
    light.kind = effect.kind;
    light.castsShadow = effect.castsShadow;
    light.positionWorld = effect.positionWorld;
    light.directionWorld = effect.directionWorld;
    const Container* core = scene.find(effect.core.id);
    light.name = core->name->empty() ? std::to_string(effect.core.id.value) : core->name.get();
    const auto local = [&](const auto& of) {
        light.range = of.range;
        light.radius = of.radius;
    };
    if (const auto* sun = scene.findAs<DirectionalLight>(effect.core.id)) {
        light.radius = sun->angularRadius;
    } else if (const auto* point = scene.findAs<PointLight>(effect.core.id)) {
        local(*point);
    } else if (const auto* luminaire = scene.findAs<GoniometricLight>(effect.core.id)) {
        local(*luminaire);
    } else if (const auto* spot = scene.findAs<SpotLight>(effect.core.id)) {
        local(*spot);
        light.cosOuter = std::cos(static_cast<double>(spot->outerAngle.get()));
    }
    return light;
}

}  // namespace

Result<std::unique_ptr<ShadowScene>> ShadowScene::create(const Aspect& scene, Ref<Node> root, const Options& options) {
    auto result = std::make_unique<ShadowScene>();
    const Hierarchy hierarchy(scene, root);
    const std::vector<LightInEffect> effects = lightsInEffect(scene, root, hierarchy, options.lightNodes);
    std::vector<glm::dvec3> positions;
    std::vector<glm::uvec3> corners;
    auto holes = std::make_shared<Holes>();
    std::vector<std::uint8_t> mayHaveHoles;
    std::map<ContainerId, std::uint32_t> masks;  // by material
    std::map<ContainerId, std::size_t> lightOf;  // by node
    bool tooMany = false, collides = false;

    traverse(scene, root, options.eyeWorld, [&](const VisitedNode& visited) {
        const auto effect = std::find_if(effects.begin(), effects.end(),
                                         [&](const LightInEffect& e) { return e.node.id == visited.ref.id; });
        if (effect != effects.end() && effect->kind != LightKind::Ambient) {
            lightOf[visited.ref.id] = result->_lights.size();
            result->_lights.push_back(describe(scene, *effect));
        }
        if (!visited.core) return Descend::Yes;
        const auto* deformed =
            isA<DeformedGeometry>(*visited.core) ? static_cast<const DeformedGeometry*>(visited.core) : nullptr;
        const auto* drawn = deformed                       ? scene.find(deformed->geometry.get())
                            : isA<Geometry>(*visited.core) ? static_cast<const Geometry*>(visited.core)
                                                           : nullptr;
        if (!drawn) return Descend::Yes;
        const Geometry& geometry = *drawn;

        Instance instance;
        instance.firstTriangle = static_cast<std::uint32_t>(corners.size());
        ContainerId material = geometry.material.get().id;
        bool excluded = false, grouped = false;
        for (Ref<Node> node = visited.ref; node; node = hierarchy.parentOf(node)) {
            const Node* above = scene.find(node);
            if (!above) break;
            if (!above->name->empty()) instance.names.push_back(above->name.get());
            if (const auto light = lightOf.find(node.id); light != lightOf.end() && light->second < kMaxLights)
                instance.lights |= std::uint64_t{1} << light->second;
            excluded = excluded || std::any_of(options.excludeNodes.begin(), options.excludeNodes.end(),
                                               [&](Ref<Node> e) { return e.id == node.id; });
            if (grouped) continue;
            if (const auto* group = scene.findAs<MaterialGroup>(above->core.get().id)) {
                if (group->material.get()) material = group->material.get().id;
                grouped = true;
            }
        }
        const Material* surface = scene.findAs<Material>(material);
        const bool blended = surface && surface->alphaMode.get() == AlphaMode::Blend;
        const bool masked = surface && surface->alphaMode.get() == AlphaMode::Mask;
        std::uint32_t mask = 0;
        if (masked) {
            const auto [known, isNew] = masks.try_emplace(material, static_cast<std::uint32_t>(holes->masks.size()));
            if (isNew)
                holes->masks.push_back({TextureAlpha(scene, surface->baseColourTexture),
                                        static_cast<double>(surface->baseColour->w),
                                        static_cast<double>(surface->alphaCutoff.get())});
            mask = known->second;
        }

        const auto first = static_cast<std::uint32_t>(positions.size());
        const std::vector<glm::dvec3> own = worldPositions(scene, hierarchy, visited, geometry, deformed);
        const std::vector<std::uint32_t> indices = geometry.indices.toVector();
        if (positions.size() + own.size() > 0xfffffff0u || corners.size() + indices.size() / 3 > 0xfffffff0u) {
            tooMany = true;
            return Descend::No;
        }
        positions.insert(positions.end(), own.begin(), own.end());
        std::vector<glm::vec2> texCoords;
        std::vector<glm::vec4> colours;
        if (masked) {
            texCoords =
                (holes->masks[mask].texture.texCoordSet() == 0 ? geometry.texCoords0 : geometry.texCoords1).toVector();
            colours = geometry.colours.toVector();
        }
        for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
            glm::uvec3 triangle(indices[i], indices[i + 1], indices[i + 2]);
            // Broken triangles keep their number, and cast nothing.
            const bool broken = std::max({triangle.x, triangle.y, triangle.z}) >= own.size();
            if (broken && own.empty()) break;
            corners.push_back(broken ? glm::uvec3(first) : triangle + first);
            mayHaveHoles.push_back(masked || blended || excluded || broken ? 1 : 0);
            std::uint32_t hole = Holes::kNeverSolid;
            if (masked && !excluded && !broken) {
                MaskedTriangle entry;
                entry.mask = mask;
                for (int k = 0; k < 3; ++k) {
                    if (!texCoords.empty()) entry.texCoord[k] = glm::dvec2(texCoords[triangle[k]]);
                    if (!colours.empty()) entry.alpha[k] = static_cast<double>(colours[triangle[k]].w);
                }
                hole = static_cast<std::uint32_t>(holes->triangles.size());
                holes->triangles.push_back(entry);
            }
            holes->of.push_back(hole);
        }
        instance.triangles = static_cast<std::uint32_t>(corners.size()) - instance.firstTriangle;
        const auto low = static_cast<std::uint32_t>(visited.ref.id.value);
        if (!result->_instances.emplace(low, std::move(instance)).second) collides = true;
        return Descend::Yes;
    });
    if (tooMany) return badInput("the scene has too many vertices for rays: 2^32 at most");
    if (collides)
        return badInput("two drawn nodes have ids with the same low 32 bits: the layer of ids cannot tell them apart");
    if (result->_lights.size() > kMaxLights)
        return badInput(fmt::format("the scene has {} lights; shadows of at most {} are judged", result->_lights.size(),
                                    kMaxLights));
    auto rays = trace::OcclusionScene::create(
        positions, corners, std::move(mayHaveHoles),
        [holes](std::uint32_t triangle, double u, double v) { return holes->isSolid(triangle, u, v); });
    if (!rays) return rays.error();
    result->_rays = std::move(*rays);
    return result;
}

std::uint32_t ShadowScene::triangleOf(std::uint32_t node, std::uint32_t primitive) const {
    const auto found = _instances.find(node);
    if (found == _instances.end() || primitive >= found->second.triangles) return trace::OcclusionScene::kNoTriangle;
    return found->second.firstTriangle + primitive;
}

bool ShadowScene::reaches(std::size_t light, std::uint32_t node) const {
    const auto found = _instances.find(node);
    return found != _instances.end() && light < kMaxLights && (found->second.lights >> light & 1u) != 0;
}

std::vector<std::uint32_t> ShadowScene::nodesNamed(const std::string& name) const {
    std::set<std::uint32_t> nodes;
    for (const auto& [node, instance] : _instances)
        if (std::find(instance.names.begin(), instance.names.end(), name) != instance.names.end()) nodes.insert(node);
    return {nodes.begin(), nodes.end()};
}

}  // namespace umbriel
