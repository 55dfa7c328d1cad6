#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/visibility/mesh.h"

namespace umbriel::visibility::test {

// A skirt with omega folds, closed around, open above and below: `around` x `down` vertices.
Mesh cloth(std::uint32_t around, std::uint32_t down);
// A flat square in z = 0, n x n quads, normals up.
Mesh plate(std::uint32_t n);
// Inscribed in the unit sphere: convex, normals outwards. From an octahedron, split `splits` times.
Mesh sphere(int splits);
// The cube [-1,1]^3, n x n quads a side; inwards turns the normals in.
Mesh box(std::uint32_t n, bool inwards);
// A strip folded `folds` times with walls at right angles: many layers close together.
Mesh accordion(std::uint32_t folds, std::uint32_t n, float gap);

// The same mesh moved; in single precision, as a file would hold it.
Mesh moved(Mesh mesh, const glm::dvec3& by);

// Reads what the project's shared meshes use: OBJ with v and f (polygons are split into fans), PLY ascii or
// little-endian. Empty when the file is not there.
std::optional<Mesh> load(const std::string& path);
// $UMBRIEL_SHARED/data/NAME; empty when the variable or the file is missing.
std::optional<Mesh> loadShared(const std::string& name);

}  // namespace umbriel::visibility::test
