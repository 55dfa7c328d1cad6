#pragma once

#include <cstdint>
#include <span>

#include "common/math/glm.h"
#include "common/wall/view.h"
#include "server/draw/culling.h"

namespace umbriel {

// The directions that some triangles face: of counter-clockwise ones towards their viewer. Cones of normals are Shirman
// and Abi-Ezzi's ("The cone of normals technique for fast processing of curved patches", 1993), of clusters of
// triangles Wihlidal's ("Optimizing the graphics pipeline with compute", GDC 2016).
struct NormalCone {
    glm::vec3 axis{0.0f};   // unit
    float sine = 2.0f;      // of the largest angle between the axis and a normal, rounded up; 2: a right angle or more
    float altitude = 0.0f;  // the smallest one of a triangle, rounded down
};

// Triangles of which two corners share a place face nowhere. indices: three a triangle, within positions.
NormalCone normalConeOf(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions);

// Which triangles of one object a view or a map of a parallel light culls as back faces, for certain: in exact
// arithmetic as in that of the GPU, which rounds places to floats and then to parts of a pixel. A triangle keeps the
// way it is wound while no corner moves further than a share of its smallest altitude, and what rounding may move is
// known. Pure: no GL.
class FacingTest {
 public:
    // Nothing is known.
    FacingTest() = default;
    // box: of the object, in its space. isMirrored: front faces are wound clockwise in the window.
    static FacingTest ofView(const View& view, const glm::dmat4& relativeFromObject, const Box& box, bool isMirrored);
    // Nothing is known of maps of lights that stand somewhere.
    static FacingTest ofMap(const ShadowFit& fit, const glm::dmat4& worldFromObject, const Box& box, bool isMirrored);

    // Whether all triangles in the box with these normals are culled. Not known of what may be clipped: pieces have
    // other altitudes.
    bool isTurnedAway(const Box& box, const NormalCone& normals) const;

 private:
    // To x, y in pixels times w, and w. rounding: of these three.
    static FacingTest of(const glm::dmat4& windowFromObject, const glm::dvec3& rounding, double pixels,
                         bool isMirrored);
    static FacingTest ofWarpedMap(const ShadowFit& fit, const glm::dmat4& worldFromObject, const Box& box,
                                  bool isMirrored);
    // unclipped: what lies inside of it is not clipped.
    void clip(const ObjectFrustum& unclipped, const Box& box);

    enum class Kind { Never, Eye, Direction } _kind = Kind::Never;
    glm::dvec3 _eye{0.0};  // object space; Direction: the unit direction of sight
    // How far a corner may seem moved, object space: a length, and one per distance from the eye.
    double _moved = 0.0;
    double _movedPerDistance = 0.0;
    bool _isClipped = false;   // some of the object
    ObjectFrustum _unclipped;  // if so: what is not
};

}  // namespace umbriel
