#include "client/import/validate.h"

#include <cmath>
#include <cstring>
#include <unordered_map>
#include <vector>

#include "client/import/import_error.h"
#include "common/scene/cameras.h"
#include "common/scene/deformed_bounds.h"
#include "common/scene/lights.h"
#include "common/scene/materials.h"

namespace umbriel {
namespace {

std::string nameOf(const Container& container) {
    return std::string(container.type().name) + " #" + std::to_string(container.id().value);
}

[[noreturn]] void refuse(const Container& container, const std::string& reason) {
    throw ImportRefused(nameOf(container), reason);
}

template <class... Types>
bool isAnyOf(const Container& container) {
    return (isA<Types>(container) || ...);
}

bool isExpected(const Container& container) {
    return isAnyOf<Node, Transform, Geometry, Image, Texture, Material, DirectionalLight, PointLight, SpotLight,
                   PerspectiveCamera, OrthographicCamera, Skin, MorphWeights, DeformedGeometry, AnimatedPose,
                   AnimationChannel, Animation, LoadedScene>(container);
}

template <class Number>
bool allFinite(std::span<const std::byte> bytes) {
    for (std::size_t at = 0; at + sizeof(Number) <= bytes.size(); at += sizeof(Number)) {
        Number number;
        std::memcpy(&number, bytes.data() + at, sizeof(Number));
        if (!std::isfinite(number)) return false;
    }
    return true;
}

bool allFinite(ElementKind kind, std::span<const std::byte> bytes) {
    switch (kind) {
        case ElementKind::F32:
        case ElementKind::Vec2:
        case ElementKind::Vec3:
        case ElementKind::Vec4:
        case ElementKind::Mat3:
        case ElementKind::Mat4:
            return allFinite<float>(bytes);
        case ElementKind::F64:
        case ElementKind::DVec3:
        case ElementKind::DMat4:
            return allFinite<double>(bytes);
        default:
            return true;
    }
}

void checkNumbers(const Container& container) {
    for (const FieldDescriptor& field : container.type().fields) {
        bool finite = true;
        if (field.isMulti) {
            const MultiStorage& storage = field.multi(container);
            for (std::size_t i = 0; i < storage.chunkCount() && finite; ++i)
                finite = allFinite(field.kind, storage.chunk(i));
        } else if (field.kind != ElementKind::String) {
            const auto* value = static_cast<const std::byte*>(field.address_(container));
            finite = allFinite(field.kind, {value, infoOf(field.kind).size});
        }
        if (!finite) refuse(container, "its " + std::string(field.name) + " are not finite");
    }
}

class SceneCheck {
 public:
    SceneCheck(const Aspect& scene, const TreeLimits& limits) : _scene(scene), _limits(limits) {}

    void check(Ref<LoadedScene> loaded) {
        if (!_scene.find(loaded)) throw ImportRefused("there is no loaded scene");
        std::size_t loadedScenes = 0;
        for (const ContainerId id : _scene.ids()) {
            const Container& container = *_scene.find(id);
            if (!isExpected(container)) refuse(container, "does not belong into a file");
            loadedScenes += isA<LoadedScene>(container) ? 1 : 0;
            checkNumbers(container);
            checkContent(container);
        }
        if (loadedScenes != 1) throw ImportRefused("there are several loaded scenes");
        checkTree();
    }

 private:
    template <class T>
    const T* as(ContainerId id) const {
        return _scene.findAs<T>(id);
    }

    // Refers to one of these types, or to nothing.
    template <class... Types>
    void requireRef(const Container& from, ContainerId to) const {
        if (!to) return;
        const Container* found = _scene.find(to);
        if (!found || !isAnyOf<Types...>(*found))
            refuse(from, "refers to #" + std::to_string(to.value) + ", which is not fit");
    }

    template <class... Types, class Field>
    void requireRefs(const Container& from, const Field& field) const {
        for (std::size_t i = 0; i < field.size(); ++i) {
            if (!field[i]) refuse(from, "refers to nothing");
            requireRef<Types...>(from, field[i]);
        }
    }

    void checkContent(const Container& container) {
        const ContainerId id = container.id();
        if (const auto* node = as<Node>(id)) {
            requireRef<Transform, Geometry, DeformedGeometry, DirectionalLight, PointLight, SpotLight>(
                container, node->core.get());
            requireRefs<Node>(container, node->children);
        } else if (const auto* geometry = as<Geometry>(id)) {
            checkGeometry(*geometry);
        } else if (const auto* deformed = as<DeformedGeometry>(id)) {
            checkDeformed(*deformed);
        } else if (const auto* skin = as<Skin>(id)) {
            requireRefs<Node>(container, skin->joints);
            if (skin->joints.empty() || skin->inverseBinds.size() != skin->joints.size())
                refuse(container, "has not a matrix for each joint");
        } else if (const auto* image = as<Image>(id)) {
            checkImage(*image);
        } else if (const auto* texture = as<Texture>(id)) {
            requireRef<Image>(container, texture->image.get());
            if (texture->texCoordSet > 1) refuse(container, "uses texture coordinates that do not exist");
        } else if (const auto* material = as<Material>(id)) {
            for (const ContainerId used :
                 {material->baseColourTexture.get().id, material->metallicRoughnessTexture.get().id,
                  material->specularTexture.get().id, material->normalTexture.get().id,
                  material->occlusionTexture.get().id, material->emissionTexture.get().id})
                requireRef<Texture>(container, used);
        } else if (const auto* loaded = as<LoadedScene>(id)) {
            if (!as<Node>(loaded->root.get())) refuse(container, "has no root");
            requireRefs<PerspectiveCamera, OrthographicCamera>(container, loaded->cameras);
            requireRefs<Animation>(container, loaded->animations);
        } else {
            checkLightOrCamera(container);
            checkAnimation(container);
        }
    }

    void checkGeometry(const Geometry& geometry) {
        requireRef<Material>(geometry, geometry.material.get());
        const std::size_t vertices = geometry.positions.size();
        for (const std::size_t size : {geometry.normals.size(), geometry.tangents.size(), geometry.colours.size(),
                                       geometry.texCoords0.size(), geometry.texCoords1.size()})
            if (size != 0 && size != vertices) refuse(geometry, "has attributes of different lengths");
        if (geometry.joints.size() != geometry.jointWeights.size() * kJointsPerVertex ||
            (!geometry.joints.empty() && geometry.jointWeights.size() != vertices))
            refuse(geometry, "has joints that do not suit its vertices");
        if (!geometry.morphPositions.empty() && morphTargetsOf(geometry) == 0)
            refuse(geometry, "has morph targets that do not suit its vertices");
        if (geometry.indices.size() % 3 != 0) refuse(geometry, "has an incomplete triangle");
        const MultiStorage& indices = geometry.indices.storage();
        for (std::size_t i = 0; i < indices.chunkCount(); ++i) {
            const auto bytes = indices.chunk(i);
            for (std::size_t at = 0; at < bytes.size(); at += sizeof(std::uint32_t)) {
                std::uint32_t index;
                std::memcpy(&index, bytes.data() + at, sizeof(index));
                if (index >= vertices) refuse(geometry, "has an index beyond its vertices");
            }
        }
    }

    void checkDeformed(const DeformedGeometry& deformed) {
        const Geometry* geometry = as<Geometry>(deformed.geometry.get());
        if (!geometry) refuse(deformed, "has no geometry");
        requireRef<Skin>(deformed, deformed.skin.get());
        requireRef<MorphWeights>(deformed, deformed.morph.get());
        const Skin* skin = as<Skin>(deformed.skin.get());
        if (!skin) return;
        const std::vector<std::uint16_t> joints = geometry->joints.toVector();
        for (const std::uint16_t joint : joints)
            if (joint >= skin->joints.size()) refuse(deformed, "has a vertex on a joint beyond its skin");
    }

    void checkImage(const Image& image) {
        constexpr std::uint32_t kLargestSide = 65536;
        constexpr std::uint64_t kChannels[] = {1, 2, 3, 4};
        const std::uint32_t format = static_cast<std::uint32_t>(image.format.get());
        if (format >= 4 || image.width > kLargestSide || image.height > kLargestSide)
            refuse(image, "is of an impossible size");
        if (std::uint64_t{image.width} * image.height * kChannels[format] != image.texels.size())
            refuse(image, "has texels that do not suit its size");
    }

    void checkLightOrCamera(const Container& container) {
        const auto nonNegative = [](const glm::vec3& v) { return v.x >= 0.0f && v.y >= 0.0f && v.z >= 0.0f; };
        const ContainerId id = container.id();
        bool valid = true;
        if (const auto* sun = as<DirectionalLight>(id)) {
            requireRef<Node>(container, sun->beacon.get());
            valid = nonNegative(sun->irradiance);
        } else if (const auto* point = as<PointLight>(id)) {
            requireRef<Node>(container, point->beacon.get());
            valid = nonNegative(point->intensity) && point->range >= 0.0f && point->radius >= 0.0f;
        } else if (const auto* spot = as<SpotLight>(id)) {
            requireRef<Node>(container, spot->beacon.get());
            valid = nonNegative(spot->intensity) && spot->range >= 0.0f && spot->radius >= 0.0f &&
                    spot->innerAngle >= 0.0f && spot->innerAngle < spot->outerAngle && spot->outerAngle <= 1.5708f;
        } else if (const auto* perspective = as<PerspectiveCamera>(id)) {
            requireRef<Node>(container, perspective->beacon.get());
            valid = perspective->fovY > 0.0 && perspective->fovY < 3.1416 && perspective->aspect >= 0.0 &&
                    perspective->nearDistance >= 0.0 &&
                    (perspective->farDistance == 0.0 || perspective->farDistance > perspective->nearDistance);
        } else if (const auto* box = as<OrthographicCamera>(id)) {
            requireRef<Node>(container, box->beacon.get());
            valid = box->halfWidth > 0.0 && box->halfHeight > 0.0 && box->farDistance > box->nearDistance;
        }
        if (!valid) refuse(container, "is out of range");
    }

    void checkAnimation(const Container& container) {
        const ContainerId id = container.id();
        if (const auto* pose = as<AnimatedPose>(id)) {
            if (!as<Transform>(pose->target.get())) refuse(container, "has no target");
        } else if (const auto* animation = as<Animation>(id)) {
            requireRefs<AnimationChannel>(container, animation->channels);
            if (!(animation->duration >= 0.0)) refuse(container, "has a negative duration");
        } else if (const auto* channel = as<AnimationChannel>(id)) {
            const bool isWeights = channel->path.get() == AnimationPath::Weights;
            const MorphWeights* morph = as<MorphWeights>(channel->morph.get());
            if (isWeights ? !morph : !as<AnimatedPose>(channel->pose.get())) refuse(container, "has no pose");
            const std::size_t components = isWeights                                        ? morph->weights.size()
                                           : channel->path.get() == AnimationPath::Rotation ? 4
                                                                                            : 3;
            const std::size_t numbers =
                components * (channel->interpolation.get() == AnimationInterpolation::CubicSpline ? 3u : 1u);
            if (channel->times.empty() || channel->values.size() != channel->times.size() * numbers)
                refuse(container, "has values that do not suit its keys");
            for (std::size_t i = 1; i < channel->times.size(); ++i)
                if (!(channel->times[i] > channel->times[i - 1])) refuse(container, "has keys that do not ascend");
        }
    }

    // Every node has at most one parent and hangs below a root: with one parent each, what no root reaches is a cycle.
    void checkTree() {
        std::unordered_map<ContainerId, bool> hasParent;
        std::size_t nodes = 0;
        for (const ContainerId id : _scene.ids())
            if (const auto* node = as<Node>(id)) {
                ++nodes;
                for (std::size_t i = 0; i < node->children.size(); ++i) {
                    bool& known = hasParent[node->children[i]];
                    if (known) refuse(*_scene.find(node->children[i]), "has two parents");
                    known = true;
                }
            }
        struct Visit {
            ContainerId node;
            std::uint32_t depth;
        };
        std::vector<Visit> open;
        for (const ContainerId id : _scene.ids())
            if (as<Node>(id) && !hasParent.contains(id)) open.push_back({id, 0});
        std::size_t reached = 0;
        std::unordered_map<ContainerId, std::uint32_t> depths;
        while (!open.empty()) {
            const Visit visit = open.back();
            open.pop_back();
            ++reached;
            const Node& node = *as<Node>(visit.node);
            if (visit.depth > _limits.depth) refuse(node, "lies too deep");
            depths.emplace(visit.node, visit.depth);
            for (std::size_t i = 0; i < node.children.size(); ++i) open.push_back({node.children[i], visit.depth + 1});
        }
        if (reached != nodes) throw ImportRefused("the nodes form a cycle");
        checkWays(depths);
    }

    void checkWays(const std::unordered_map<ContainerId, std::uint32_t>& depths) const {
        std::uint64_t steps = 0;
        const auto walk = [&](const Container& from, ContainerId node) {
            const auto found = depths.find(node);
            if (found != depths.end()) steps += found->second + std::uint64_t{1};
            if (steps > _limits.stepsUp) refuse(from, "stands at a node that lies too deep");
        };
        for (const ContainerId id : _scene.ids()) {
            const Container& container = *_scene.find(id);
            if (const auto* skin = as<Skin>(id)) {
                for (std::size_t i = 0; i < skin->joints.size(); ++i) walk(container, skin->joints[i]);
            } else if (const auto* sun = as<DirectionalLight>(id)) {
                walk(container, sun->beacon.get());
            } else if (const auto* lamp = as<PointLight>(id)) {
                walk(container, lamp->beacon.get());
            } else if (const auto* spot = as<SpotLight>(id)) {
                walk(container, spot->beacon.get());
            } else if (const auto* lens = as<PerspectiveCamera>(id)) {
                walk(container, lens->beacon.get());
            } else if (const auto* box = as<OrthographicCamera>(id)) {
                walk(container, box->beacon.get());
            }
        }
    }

    const Aspect& _scene;
    const TreeLimits& _limits;
};

}  // namespace

TreeLimits treeLimits(const ImportLimits& limits) {
    return {limits.depth + limits.lights + 3, limits.stepsUp};
}

Result<void> validateLoadedScene(const Aspect& scene, Ref<LoadedScene> loaded, const TreeLimits& limits) {
    try {
        SceneCheck(scene, limits).check(loaded);
        return {};
    } catch (const ImportRefused& reason) {
        return failure(reason.what());
    }
}

}  // namespace umbriel
