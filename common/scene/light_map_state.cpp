#include "common/scene/light_map_state.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <unordered_map>
#include <unordered_set>

#include "common/base/hash.h"
#include "common/scene/animation.h"
#include "common/scene/materials.h"

namespace umbriel {
namespace {

// Values in a row of bytes that is hashed.
class Bytes {
 public:
    template <class T>
    void add(const T& value) {
        static_assert(std::is_arithmetic_v<T>);
        const T positive = value == T{} ? T{} : value;  // -0 is 0
        const std::size_t at = _bytes.size();
        _bytes.resize(at + sizeof(T));
        std::memcpy(_bytes.data() + at, &positive, sizeof(T));
    }
    void add(const glm::dvec3& v) {
        for (int i = 0; i < 3; ++i) add(v[i]);
    }
    // By the hashes of its blocks, which are kept with it.
    void add(const MultiStorage& storage) {
        add(static_cast<std::uint64_t>(storage.size()));
        for (std::size_t chunk = 0; chunk < storage.chunkCount(); ++chunk)
            for (std::size_t block = 0; block < storage.blocksOfChunk(chunk); ++block) {
                const Hash128 hash = storage.blockHash(chunk, block);
                add(hash.low);
                add(hash.high);
            }
    }
    std::uint64_t hash() const { return hash64(_bytes); }

 private:
    std::vector<std::byte> _bytes;
};

// Where a surface that is cut out by a texture has its holes.
void addMask(const Aspect& aspect, const Material& material, const Geometry& geometry, Bytes& bytes) {
    bytes.add(material.alphaCutoff.get());
    bytes.add(material.baseColour->w);
    bytes.add(geometry.colours.storage());
    const Texture* texture = aspect.find(material.baseColourTexture.get());
    if (!texture) return;
    bytes.add(texture->texCoordSet.get());
    bytes.add((texture->texCoordSet.get() == 0 ? geometry.texCoords0 : geometry.texCoords1).storage());
    for (const glm::vec2& v : {texture->offset.get(), texture->scale.get()}) {
        bytes.add(v.x);
        bytes.add(v.y);
    }
    bytes.add(texture->rotation.get());
    bytes.add(static_cast<std::uint32_t>(texture->wrapS.get()));
    bytes.add(static_cast<std::uint32_t>(texture->wrapT.get()));
    const Image* image = aspect.find(texture->image.get());
    if (!image) return;
    bytes.add(image->width.get());
    bytes.add(image->height.get());
    bytes.add(image->texels.storage());
}

std::uint64_t surfaceState(const Aspect& aspect, const Geometry& geometry, ContainerId materialId,
                           const Affine& worldFromObject, bool isExcluded) {
    Bytes bytes;
    for (int i = 0; i < 3; ++i) bytes.add(worldFromObject.linear[i]);
    bytes.add(worldFromObject.translation);
    bytes.add(geometry.positions.storage());
    bytes.add(geometry.indices.storage());
    const Material* material = aspect.findAs<Material>(materialId);
    const AlphaMode alpha = material ? material->alphaMode.get() : AlphaMode::Opaque;
    // What is blended casts nothing, as what is excluded.
    const bool casts = !isExcluded && alpha != AlphaMode::Blend;
    bytes.add(static_cast<std::uint32_t>(casts ? 1 : 0));
    bytes.add(static_cast<std::uint32_t>(casts && alpha == AlphaMode::Mask ? 1 : 0));
    if (casts && alpha == AlphaMode::Mask) addMask(aspect, *material, geometry, bytes);
    return bytes.hash();
}

// The transforms that animations write.
std::unordered_set<ContainerId> animatedTransforms(const Aspect& aspect) {
    std::unordered_set<ContainerId> animated;
    for (const ContainerId id : aspect.ids())
        if (const auto* channel = aspect.findAs<AnimationChannel>(id))
            if (const AnimatedPose* pose = aspect.find(channel->pose.get())) animated.insert(pose->target.get().id);
    return animated;
}

}  // namespace

std::vector<DrawnSurface> drawnSurfaces(const Aspect& aspect, Ref<Node> root, const Hierarchy& hierarchy,
                                        const std::vector<Ref<Node>>& excluded) {
    const std::unordered_set<ContainerId> animated = animatedTransforms(aspect);
    // What a node passes on to those below it.
    struct Inherited {
        bool moves = false;
        bool isExcluded = false;
        ContainerId material;  // of the innermost group
    };
    std::unordered_map<ContainerId, Inherited> known;  // looked up only
    std::vector<DrawnSurface> drawn;
    traverse(aspect, root, std::nullopt, [&](const VisitedNode& visited) {
        Inherited own;
        if (const auto above = known.find(hierarchy.parentOf(visited.ref)); above != known.end()) own = above->second;
        own.isExcluded = own.isExcluded || std::find(excluded.begin(), excluded.end(), visited.ref) != excluded.end();
        if (visited.core) {
            own.moves = own.moves || animated.contains(visited.core->id()) || isA<LevelOfDetail>(*visited.core);
            if (isA<MaterialGroup>(*visited.core))
                own.material = static_cast<const MaterialGroup&>(*visited.core).material.get().id;
        }
        known[visited.ref] = own;
        if (!visited.core) return Descend::Yes;
        if (isA<DeformedGeometry>(*visited.core)) {
            const auto& deformed = static_cast<const DeformedGeometry&>(*visited.core);
            drawn.push_back({visited.ref, deformed.geometry, visited.worldFromNode, 0, true});
        } else if (isA<Geometry>(*visited.core)) {
            const auto& geometry = static_cast<const Geometry&>(*visited.core);
            const ContainerId material = own.material ? own.material : geometry.material.get().id;
            drawn.push_back({visited.ref, Ref<Geometry>(geometry.id()), visited.worldFromNode,
                             surfaceState(aspect, geometry, material, visited.worldFromNode, own.isExcluded),
                             own.moves});
        }
        return Descend::Yes;
    });
    return drawn;
}

std::uint64_t lightState(const Aspect& aspect, const LightInEffect& light) {
    Bytes bytes;
    bytes.add(static_cast<std::uint32_t>(light.kind));
    if (light.kind == LightKind::Directional) {
        bytes.add(light.directionWorld);
        if (const auto* core = aspect.findAs<DirectionalLight>(light.core.id)) bytes.add(core->angularRadius.get());
        return bytes.hash();
    }
    // Where a cone or a range ends, light ends; shadows do not change with it.
    bytes.add(light.positionWorld);
    if (const auto* point = aspect.findAs<PointLight>(light.core.id)) bytes.add(point->radius.get());
    if (const auto* spot = aspect.findAs<SpotLight>(light.core.id)) bytes.add(spot->radius.get());
    return bytes.hash();
}

bool moves(const Aspect& aspect, const LightInEffect& light, const Hierarchy& hierarchy) {
    const std::unordered_set<ContainerId> animated = animatedTransforms(aspect);
    Ref<Node> stands = light.node;
    const Container* core = aspect.find(light.core.id);
    const auto beaconOf = [&](const auto* typed) {
        if (typed && aspect.find(typed->beacon.get())) stands = typed->beacon.get();
    };
    if (core) {
        beaconOf(aspect.findAs<DirectionalLight>(core->id()));
        beaconOf(aspect.findAs<PointLight>(core->id()));
        beaconOf(aspect.findAs<SpotLight>(core->id()));
        beaconOf(aspect.findAs<GoniometricLight>(core->id()));
    }
    for (; stands; stands = hierarchy.parentOf(stands))
        if (const Node* node = aspect.find(stands); node && animated.contains(node->core.get().id)) return true;
    return false;
}

LightMapMatch match(const LightMap& map, const std::vector<DrawnSurface>& drawn) {
    std::unordered_map<ContainerId, std::uint64_t> states;  // looked up only
    for (const DrawnSurface& surface : drawn) states.emplace(surface.node, surface.state);
    LightMapMatch result;
    const std::vector<Ref<Node>> surfaces = map.surfaces.toVector();
    const std::vector<std::uint64_t> wanted = map.states.toVector();
    std::unordered_set<ContainerId> inMap;
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        const auto found = states.find(surfaces[i]);
        if (found == states.end() || i >= wanted.size() || found->second != wanted[i])
            ++result.missing;
        else
            inMap.insert(surfaces[i]);
    }
    result.hasOthers = std::any_of(drawn.begin(), drawn.end(),
                                   [&](const DrawnSurface& surface) { return !inMap.contains(surface.node); });
    return result;
}

std::int32_t layerOf(const LightMap& map, std::uint64_t lightState) {
    for (std::size_t i = 0; i < map.lightStates.size(); ++i)
        if (map.lightStates[i] == lightState) return static_cast<std::int32_t>(i);
    return -1;
}

}  // namespace umbriel
