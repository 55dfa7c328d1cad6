#pragma once

#include <span>
#include <vector>

#include "common/math/affine.h"
#include "common/math/box.h"
#include "common/scene/aspect.h"
#include "common/scene/deformation.h"

namespace umbriel {

// Joints per vertex, as in Geometry::joints.
inline constexpr std::size_t kJointsPerVertex = 4;

// The joints of a vertex and their weights as they are used: weights that are not positive numbers and joints beyond
// the skin do not count; the rest sums to 1; a vertex that nothing is left of hangs on the first joint.
struct VertexJoints {
    std::uint16_t joints[kJointsPerVertex] = {0, 0, 0, 0};
    float weights[kJointsPerVertex] = {1.0f, 0.0f, 0.0f, 0.0f};
};
// Of every vertex of the geometry; empty when it has no joints, or not as many as vertices.
std::vector<VertexJoints> vertexJointsOf(const Geometry& geometry, std::size_t jointCount);

// How many morph targets a geometry has; 0 when its displacements are not those of its vertices.
std::size_t morphTargetsOf(const Geometry& geometry);
// The weights of its targets, those that are not finite as 0; as many as targets.
std::vector<float> morphWeightsOf(const Aspect& scene, const DeformedGeometry& core, std::size_t targets);

// Where some vertices of a deformed geometry can be: the box of those that each joint holds, and how far each morph
// target may move any of them. Bounds of a pose then cost joints, not vertices.
class DeformedBounds {
 public:
    // joints: empty for a geometry without skin. deltas: the displacement of target t is deltas[t * vertex count].
    void include(const glm::vec3& rest, const VertexJoints* joints);
    void includeDelta(std::size_t target, const glm::vec3& delta);

    // Around every included vertex, whatever float arithmetic rounds it to. maps: objectFromRest by joint; one, when
    // there is no skin. Empty for no vertices.
    Box3d of(std::span<const Affine> maps, std::span<const float> morphWeights) const;

 private:
    struct Part {
        std::uint16_t joint = 0;
        Box3d box;
    };
    std::vector<Part> _parts;  // ascending by joint
    std::vector<Box3d> _deltas;
};

// Of all vertices of a geometry.
DeformedBounds deformedBoundsOf(const Geometry& geometry, std::size_t jointCount);

// The positions of a deformed geometry's vertices, computed in double; maps as DeformedBounds::of().
std::vector<glm::dvec3> deformedPositions(const Aspect& scene, const DeformedGeometry& core,
                                          std::span<const Affine> maps);

// The joint maps of a skin in a frame with the world's axes around `anchor`: worldFromJoint by joint, times the inverse
// bind. A joint without place (not finite, destroyed) stands at the anchor, unturned.
std::vector<Affine> jointMapsOf(const Skin& skin, std::span<const Affine> worldFromJoint, const glm::dvec3& anchor);

}  // namespace umbriel
