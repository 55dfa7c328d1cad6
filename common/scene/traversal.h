#pragma once

#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "common/math/affine.h"
#include "common/math/box.h"
#include "common/scene/aspect.h"
#include "common/scene/deformed_bounds.h"
#include "common/scene/lights.h"
#include "common/scene/nodes.h"

namespace umbriel {

// Walks over the scene graph. The graph should be a tree of nodes, yet nothing stops an application (or a peer) from
// linking a node twice or into a cycle. So every walk visits a node once, where depth-first order in the order of
// children reaches it first; further links to it are as if they were not there. Walks use no recursion, so depth is
// limited by memory only. Children that do not exist are skipped.
//
// The world is the frame in which the root's parent would be: a transform in the root's core acts, its ancestors do
// not.

// Who is whose parent, for everything that stands somewhere by naming a node (beacons). Costs a look at every node;
// make a new one after nodes, transforms or what links them changed.
class Hierarchy {
 public:
    // Nodes not reached from root (beacons may stand outside the scene) are walked from their own topmost ancestors.
    Hierarchy(const Aspect& aspect, Ref<Node> root);

    // Nothing for the topmost nodes and for unknown ones.
    Ref<Node> parentOf(Ref<Node> node) const;
    // Product of the transforms from the topmost ancestor down to the node, its own core included. Identity for an
    // unknown node.
    Affine worldFromNode(const Aspect& aspect, Ref<Node> node) const;

 private:
    void walk(const Aspect& aspect, Ref<Node> top);
    std::unordered_map<ContainerId, ContainerId> _parents;  // 0: a topmost node
};

struct VisitedNode {
    Ref<Node> ref;
    const Node& node;
    const Container* core = nullptr;  // null: a group
    Affine worldFromNode;             // with the node's own Transform, if that is its core
};

enum class Descend : bool { No, Yes };

// Calls visit for every visible node below and including root, parents before children, in the order of children.
// Switches are obeyed; a LevelOfDetail picks by the distance of eyeWorld, without one all its children are visited.
void traverse(const Aspect& aspect, Ref<Node> root, const std::optional<glm::dvec3>& eyeWorld,
              const std::function<Descend(const VisitedNode&)>& visit);

// The index of the child that a LevelOfDetail shows; -1 when it has no children.
std::int32_t chosenLevel(const LevelOfDetail& levels, std::size_t childCount, double distance);

// Bounding boxes of geometries in their own frame (and whether they are closed), computed when first asked for and kept
// for as long as the positions are the same chunks of memory. Coordinates that are not finite do not count.
class GeometryBounds {
 public:
    const Box3d& of(const Aspect& aspect, Ref<Geometry> geometry);
    // What bounds every pose of a deformed geometry with a skin of so many joints (0: none).
    const DeformedBounds& deformed(const Geometry& geometry, std::size_t jointCount);
    // isClosedSurface(), of the pose at rest; kept likewise.
    bool isClosed(const Geometry& geometry);
    // Boxes around runs of kPartTriangles triangles in the order of the indices, of the pose at rest; kept likewise.
    static constexpr std::size_t kPartTriangles = 128;
    const std::vector<Box3d>& parts(const Geometry& geometry);
    // Forgets geometries that were not asked for since the last sweep.
    void sweep();

 private:
    struct Entry {
        std::optional<MultiStorage> positions;  // a copy holds its chunks: while they are shared, nothing was written
        Box3d box;
        bool used = true;
    };
    struct DeformedEntry {
        std::vector<MultiStorage> sources;  // as Entry::positions
        std::size_t jointCount = 0;
        DeformedBounds bounds;
        bool used = true;
    };
    struct ClosedEntry {
        std::optional<MultiStorage> positions, indices;  // as Entry::positions
        bool isClosed = false;
        bool used = true;
    };
    std::unordered_map<ContainerId, Entry> _entries;
    struct PartsEntry {
        std::optional<MultiStorage> positions, indices;  // as Entry::positions
        std::vector<Box3d> boxes;
        bool used = true;
    };
    std::unordered_map<ContainerId, ClosedEntry> _closed;
    std::unordered_map<ContainerId, PartsEntry> _parts;
    std::unordered_map<ContainerId, DeformedEntry> _deformed;
};

// Around all visible geometry below root (every level of detail), in world metres; conservative: the boxes of rotated
// geometries are boxes around their rotated boxes. Subtrees rooted at excluded nodes do not count. A box that is not
// finite (overflowing transforms) does not count.
Box3d worldBounds(const Aspect& aspect, Ref<Node> root, GeometryBounds& bounds,
                  const std::vector<Ref<Node>>& excluded = {});
// For one look; a frame loop keeps its GeometryBounds.
Box3d worldBounds(const Aspect& aspect, Ref<Node> root);

// The same in parts, for who wants to know where things are: the boxes of GeometryBounds::parts() in the world, of a
// deformed geometry one. Nothing of worldBounds() is outside of all of them but vertices of no triangle.
std::vector<Box3d> partBounds(const Aspect& aspect, Ref<Node> root, GeometryBounds& bounds);

enum class LightKind : std::uint32_t { Ambient, Directional, Point, Spot, Goniometric };

// A light that is on, with its place resolved. The core may be shared by several nodes (glTF), so the node names the
// light.
struct LightInEffect {
    Ref<Node> node;
    Ref<Container> core;
    LightKind kind = LightKind::Ambient;
    bool castsShadow = false;
    glm::dvec3 positionWorld{0.0};        // of the beacon's origin
    glm::dvec3 directionWorld{0, 0, -1};  // unit; the way the light travels along its axis
    glm::dvec3 axisXWorld{1, 0, 0};       // unit, perpendicular to it: where C = 0 of a photometric table lies
    bool hasDirection = true;             // false: its beacon has none, directionWorld is the world's -z
};

// Every light that is on below root, ascending by node. A light whose beacon has no direction left (a zero scale)
// shines along the world's -z. listed: only lights on these nodes count, when it is not empty.
std::vector<LightInEffect> lightsInEffect(const Aspect& aspect, Ref<Node> root, const Hierarchy& hierarchy,
                                          const std::vector<Ref<Node>>& listed = {});

// Where a beacon stands and how it is turned (rotation only, see orthonormalised()); identity rotation when its frame
// is degenerate.
struct BeaconFrame {
    glm::dvec3 positionWorld{0.0};
    glm::dmat3 worldFromBeacon{1.0};
    bool isDegenerate = false;
};
BeaconFrame beaconFrame(const Aspect& aspect, const Hierarchy& hierarchy, Ref<Node> beacon);

}  // namespace umbriel
