#pragma once

#include <cstdint>
#include <span>

#include "common/math/box.h"
#include "common/wall/view.h"
#include "server/draw/mesh_layout.h"

namespace umbriel {

// A flat part of a scene behind which, seen from a light, nothing of the scene lies, such as the ground that everything
// stands on, darkens nothing, itself neither: shadow maps go without it, whatever the tile.

// Faces of a box, a bit each: -x, +x, -y, +y, -z, +z.
using BoxFaces = std::uint8_t;

// The face of `whole` that the box of a part lies flat on, as its bit; 0: none.
BoxFaces faceUnder(const Box& part, const Box& whole);
// Those of `whole` that any cluster lies flat on.
BoxFaces flatFacesOf(std::span<const Cluster> clusters, const Box& whole);

// Of `faces`, those of an item's box behind which nothing of the scene lies, seen from the fit's light. scene: around all
// that is drawn, metres, world axes. What the rounding of coordinates may have put behind does not count.
BoxFaces backmostFaces(BoxFaces faces, const Box& item, const glm::dmat4& worldFromObject, const Box3d& scene,
                       const ShadowFit& fit);

}  // namespace umbriel
