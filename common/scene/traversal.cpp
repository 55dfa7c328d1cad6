#include "common/scene/traversal.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "common/math/rotation.h"
#include "common/scene/closed_surface.h"

namespace umbriel {

namespace {

Affine ownTransform(const Aspect& aspect, const Node& node) {
    const auto* transform = aspect.findAs<Transform>(node.core.get());
    if (!transform) return {};
    return {glm::dmat3(transform->linear.get()), transform->translation.get()};
}

// Half-open range of the children that are shown.
struct ChildRange {
    std::size_t first = 0;
    std::size_t end = 0;
};

ChildRange shownChildren(const VisitedNode& visited, const std::optional<glm::dvec3>& eyeWorld) {
    const std::size_t count = visited.node.children.size();
    const auto only = [count](std::int32_t index) -> ChildRange {
        if (index < 0 || static_cast<std::size_t>(index) >= count) return {};
        return {static_cast<std::size_t>(index), static_cast<std::size_t>(index) + 1};
    };
    if (!visited.core) return {0, count};
    if (isA<Switch>(*visited.core)) {
        const std::int32_t choice = static_cast<const Switch&>(*visited.core).choice;
        if (choice != Switch::kAll) return only(choice);
    } else if (eyeWorld && isA<LevelOfDetail>(*visited.core)) {
        const double distance = glm::distance(*eyeWorld, visited.worldFromNode.translation);
        return only(chosenLevel(static_cast<const LevelOfDetail&>(*visited.core), count, distance));
    }
    return {0, count};
}

bool sameChunks(const MultiStorage& a, const MultiStorage& b) {
    if (a.size() != b.size()) return false;
    for (std::size_t chunk = 0; chunk < a.chunkCount(); ++chunk)
        if (!a.sharesChunk(chunk, b)) return false;
    return true;
}

}  // namespace

Hierarchy::Hierarchy(const Aspect& aspect, Ref<Node> root) {
    if (aspect.find(root)) walk(aspect, root);
    const std::vector<ContainerId> ids = aspect.ids();
    std::unordered_set<ContainerId> children;
    for (ContainerId id : ids) {
        const auto* node = aspect.findAs<Node>(id);
        if (!node || _parents.contains(id)) continue;
        for (std::size_t i = 0; i < node->children.size(); ++i) children.insert(node->children[i]);
    }
    // First the topmost ones; what is left then is in cycles.
    for (const bool inCycles : {false, true})
        for (ContainerId id : ids)
            if (aspect.findAs<Node>(id) && !_parents.contains(id) && (inCycles || !children.contains(id)))
                walk(aspect, Ref<Node>(id));
}

void Hierarchy::walk(const Aspect& aspect, Ref<Node> top) {
    struct Link {
        ContainerId node;
        ContainerId parent;
    };
    std::vector<Link> pending{{top, {}}};
    while (!pending.empty()) {
        const Link link = pending.back();
        pending.pop_back();
        const auto* node = aspect.findAs<Node>(link.node);
        if (!node || !_parents.emplace(link.node, link.parent).second) continue;
        for (std::size_t i = node->children.size(); i-- > 0;) pending.push_back({node->children[i], link.node});
    }
}

Ref<Node> Hierarchy::parentOf(Ref<Node> node) const {
    const auto found = _parents.find(node);
    return Ref<Node>(found == _parents.end() ? ContainerId{} : found->second);
}

Affine Hierarchy::worldFromNode(const Aspect& aspect, Ref<Node> node) const {
    Affine worldFromNode;
    // The parents form a forest (each was set once, from a node walked earlier), so this ends.
    for (Ref<Node> current = node; current; current = parentOf(current))
        if (const Node* found = aspect.find(current)) worldFromNode = ownTransform(aspect, *found) * worldFromNode;
    return worldFromNode;
}

void traverse(const Aspect& aspect, Ref<Node> root, const std::optional<glm::dvec3>& eyeWorld,
              const std::function<Descend(const VisitedNode&)>& visit) {
    struct Pending {
        Ref<Node> node;
        Affine worldFromParent;
    };
    std::unordered_set<ContainerId> seen;
    std::vector<Pending> pending{{root, {}}};
    while (!pending.empty()) {
        const Pending next = pending.back();
        pending.pop_back();
        const Node* node = aspect.find(next.node);
        if (!node || !seen.insert(next.node).second || !node->visible) continue;
        const VisitedNode visited{next.node, *node, aspect.find(node->core.get()),
                                  next.worldFromParent * ownTransform(aspect, *node)};
        if (visit(visited) == Descend::No) continue;
        const ChildRange shown = shownChildren(visited, eyeWorld);
        for (std::size_t i = shown.end; i-- > shown.first;)
            pending.push_back({node->children[i], visited.worldFromNode});
    }
}

std::int32_t chosenLevel(const LevelOfDetail& levels, std::size_t childCount, double distance) {
    if (childCount == 0) return -1;
    for (std::size_t i = 0; i + 1 < childCount && i < levels.ranges.size(); ++i)
        if (distance < static_cast<double>(levels.ranges[i])) return static_cast<std::int32_t>(i);
    return static_cast<std::int32_t>(childCount - 1);
}

const Box3d& GeometryBounds::of(const Aspect& aspect, Ref<Geometry> geometry) {
    Entry& entry = _entries[geometry];
    entry.used = true;
    const Geometry* found = aspect.find(geometry);
    if (!found) {
        entry = {};
        return entry.box;
    }
    const MultiStorage& positions = found->positions.storage();
    if (entry.positions && sameChunks(*entry.positions, positions)) return entry.box;
    entry.positions = positions;
    entry.box = {};
    for (std::size_t chunk = 0; chunk < positions.chunkCount(); ++chunk) {
        const std::span<const std::byte> bytes = positions.chunk(chunk);
        for (std::size_t at = 0; at + sizeof(glm::vec3) <= bytes.size(); at += sizeof(glm::vec3)) {
            glm::vec3 position;
            std::memcpy(&position, bytes.data() + at, sizeof(position));
            if (isFinite(glm::dvec3(position))) entry.box.include(glm::dvec3(position));
        }
    }
    return entry.box;
}

const DeformedBounds& GeometryBounds::deformed(const Geometry& geometry, std::size_t jointCount) {
    DeformedEntry& entry = _deformed[geometry.id()];
    entry.used = true;
    const MultiStorage* sources[] = {&geometry.positions.storage(), &geometry.joints.storage(),
                                     &geometry.jointWeights.storage(), &geometry.morphPositions.storage()};
    bool same = entry.sources.size() == std::size(sources) && entry.jointCount == jointCount;
    for (std::size_t i = 0; same && i < std::size(sources); ++i) same = sameChunks(entry.sources[i], *sources[i]);
    if (same) return entry.bounds;
    entry.sources.clear();
    for (const MultiStorage* source : sources) entry.sources.push_back(*source);
    entry.jointCount = jointCount;
    entry.bounds = deformedBoundsOf(geometry, jointCount);
    return entry.bounds;
}

bool GeometryBounds::isClosed(const Geometry& geometry) {
    ClosedEntry& entry = _closed[geometry.id()];
    entry.used = true;
    const MultiStorage& positions = geometry.positions.storage();
    const MultiStorage& indices = geometry.indices.storage();
    if (entry.positions && sameChunks(*entry.positions, positions) && sameChunks(*entry.indices, indices))
        return entry.isClosed;
    entry.positions = positions;
    entry.indices = indices;
    entry.isClosed = isClosedSurface(geometry.positions.toVector(), geometry.indices.toVector());
    return entry.isClosed;
}

const std::vector<Box3d>& GeometryBounds::parts(const Geometry& geometry) {
    PartsEntry& entry = _parts[geometry.id()];
    entry.used = true;
    if (entry.positions && sameChunks(*entry.positions, geometry.positions.storage()) &&
        sameChunks(*entry.indices, geometry.indices.storage()))
        return entry.boxes;
    entry.positions = geometry.positions.storage();
    entry.indices = geometry.indices.storage();
    entry.boxes.clear();
    const std::vector<glm::vec3> positions = geometry.positions.toVector();
    const std::vector<std::uint32_t> indices = geometry.indices.toVector();
    for (std::size_t i = 0; i < indices.size(); ++i) {
        if (i % (3 * kPartTriangles) == 0) entry.boxes.emplace_back();
        if (indices[i] < positions.size() && isFinite(glm::dvec3(positions[indices[i]])))
            entry.boxes.back().include(glm::dvec3(positions[indices[i]]));
    }
    return entry.boxes;
}

void GeometryBounds::sweep() {
    const auto forget = [](auto& entries) {
        std::erase_if(entries, [](const auto& entry) { return !entry.second.used; });
        for (auto& entry : entries) entry.second.used = false;
    };
    forget(_entries);
    forget(_closed);
    forget(_parts);
    forget(_deformed);
}

namespace {

// In world metres. The hierarchy is made when the first skin needs it.
Box3d deformedWorldBounds(const Aspect& aspect, Ref<Node> root, const VisitedNode& visited,
                          const DeformedGeometry& core, GeometryBounds& bounds, std::optional<Hierarchy>& hierarchy) {
    const Geometry* geometry = aspect.find(core.geometry.get());
    if (!geometry) return {};
    const Skin* skin = aspect.find(core.skin.get());
    const std::size_t jointCount = skin ? skin->joints.size() : 0;
    const DeformedBounds& rest = bounds.deformed(*geometry, jointCount);
    const std::vector<float> weights = morphWeightsOf(aspect, core, morphTargetsOf(*geometry));
    if (jointCount == 0) {
        const Affine unmoved;
        return transformed(visited.worldFromNode, rest.of({&unmoved, 1}, weights));
    }
    if (!hierarchy) hierarchy.emplace(aspect, root);
    std::vector<Affine> worldFromJoint;
    for (std::size_t i = 0; i < jointCount; ++i)
        worldFromJoint.push_back(hierarchy->worldFromNode(aspect, skin->joints[i]));
    const glm::dvec3 anchor = worldFromJoint[0].translation;
    Box3d box = rest.of(jointMapsOf(*skin, worldFromJoint, anchor), weights);
    if (box.empty()) return box;
    return {box.lower + anchor, box.upper + anchor};
}

}  // namespace

Box3d worldBounds(const Aspect& aspect, Ref<Node> root, GeometryBounds& bounds,
                  const std::vector<Ref<Node>>& excluded) {
    Box3d result;
    std::optional<Hierarchy> hierarchy;
    const auto include = [&](const Box3d& box) {
        if (!box.empty() && isFinite(box.lower) && isFinite(box.upper)) result.include(box);
    };
    traverse(aspect, root, std::nullopt, [&](const VisitedNode& visited) {
        if (std::find(excluded.begin(), excluded.end(), visited.ref) != excluded.end()) return Descend::No;
        if (visited.core && isA<Geometry>(*visited.core))
            include(transformed(visited.worldFromNode, bounds.of(aspect, Ref<Geometry>(visited.core->id()))));
        else if (visited.core && isA<DeformedGeometry>(*visited.core))
            include(deformedWorldBounds(aspect, root, visited, static_cast<const DeformedGeometry&>(*visited.core),
                                        bounds, hierarchy));
        return Descend::Yes;
    });
    return result;
}

std::vector<Box3d> partBounds(const Aspect& aspect, Ref<Node> root, GeometryBounds& bounds) {
    std::vector<Box3d> result;
    std::optional<Hierarchy> hierarchy;
    const auto include = [&](const Box3d& box) {
        if (!box.empty() && isFinite(box.lower) && isFinite(box.upper)) result.push_back(box);
    };
    traverse(aspect, root, std::nullopt, [&](const VisitedNode& visited) {
        if (visited.core && isA<Geometry>(*visited.core))
            for (const Box3d& part : bounds.parts(static_cast<const Geometry&>(*visited.core)))
                include(transformed(visited.worldFromNode, part));
        else if (visited.core && isA<DeformedGeometry>(*visited.core))
            include(deformedWorldBounds(aspect, root, visited, static_cast<const DeformedGeometry&>(*visited.core),
                                        bounds, hierarchy));
        return Descend::Yes;
    });
    return result;
}

Box3d worldBounds(const Aspect& aspect, Ref<Node> root) {
    GeometryBounds bounds;
    return worldBounds(aspect, root, bounds);
}

std::vector<LightInEffect> lightsInEffect(const Aspect& aspect, Ref<Node> root, const Hierarchy& hierarchy,
                                          const std::vector<Ref<Node>>& listed) {
    std::vector<LightInEffect> lights;
    traverse(aspect, root, std::nullopt, [&](const VisitedNode& visited) {
        if (!visited.core) return Descend::Yes;
        if (!listed.empty() && std::find(listed.begin(), listed.end(), visited.ref) == listed.end())
            return Descend::Yes;
        const auto add = [&](LightKind kind, bool on, bool castsShadow, Ref<Node> beacon) {
            if (!on) return;
            const BeaconFrame frame = beaconFrame(aspect, hierarchy, aspect.find(beacon) ? beacon : visited.ref);
            lights.push_back({visited.ref, Ref<Container>(visited.core->id()), kind, castsShadow, frame.positionWorld,
                              -frame.worldFromBeacon[2], frame.worldFromBeacon[0], !frame.isDegenerate});
        };
        if (isA<AmbientLight>(*visited.core)) {
            add(LightKind::Ambient, static_cast<const AmbientLight&>(*visited.core).on, false, {});
        } else if (isA<DirectionalLight>(*visited.core)) {
            const auto& light = static_cast<const DirectionalLight&>(*visited.core);
            add(LightKind::Directional, light.on, light.castsShadow, light.beacon);
        } else if (isA<PointLight>(*visited.core)) {
            const auto& light = static_cast<const PointLight&>(*visited.core);
            add(LightKind::Point, light.on, light.castsShadow, light.beacon);
        } else if (isA<SpotLight>(*visited.core)) {
            const auto& light = static_cast<const SpotLight&>(*visited.core);
            add(LightKind::Spot, light.on, light.castsShadow, light.beacon);
        } else if (isA<GoniometricLight>(*visited.core)) {
            const auto& light = static_cast<const GoniometricLight&>(*visited.core);
            add(LightKind::Goniometric, light.on, light.castsShadow, light.beacon);
        }
        return Descend::Yes;
    });
    std::sort(lights.begin(), lights.end(),
              [](const LightInEffect& a, const LightInEffect& b) { return a.node < b.node; });
    return lights;
}

BeaconFrame beaconFrame(const Aspect& aspect, const Hierarchy& hierarchy, Ref<Node> beacon) {
    const Affine worldFromBeacon = hierarchy.worldFromNode(aspect, beacon);
    const auto turned = orthonormalised(worldFromBeacon.linear);
    return {worldFromBeacon.translation, turned.value_or(glm::dmat3(1.0)), !turned};
}

}  // namespace umbriel
