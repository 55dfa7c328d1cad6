#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/math/glm.h"

namespace umbriel::visibility {

// How the pixels of a visibility map stand for directions. Ganster 2002, chapter 2.2, with the corrections named at
// each mapping; one file for each.
enum class MappingKind : std::uint8_t {
    HemiCube = 0,
    SinglePlane = 1,
    HemiSphere = 2,
    Cube = 3,
    Octahedral = 4,
    Fibonacci = 5
};

// A mapping with its parameters. Two mappings with equal fields have the same pixels.
struct Mapping {
    MappingKind kind = MappingKind::HemiSphere;
    // HemiCube, SinglePlane, Cube, Octahedral: edge of a square image; HemiSphere: the image is 2s x s/2; even in all
    // of them. Fibonacci: the number of directions.
    std::uint32_t size = 32;
    // SinglePlane only: full opening angle, radians, below pi; 0 otherwise.
    double fovy = 0.0;
    friend bool operator==(const Mapping&, const Mapping&) = default;
};

// Directions in a frame of the vertex (z is its normal), or in the mesh's own axes, the same for every vertex.
enum class DirectionFrame : std::uint8_t { Vertex = 0, Object = 1 };

// Which side of the surface a direction is seen from. Upper: from the normal's side. Own: directions with z < 0 are
// seen from the other side (Cube: two HemiCubes, each lifted to its own side).
enum class DirectionSide : std::uint8_t { Upper = 0, Own = 1 };

// Rectangles of pixels that lie one after the other, each row by row.
struct ImageSize {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
};

inline constexpr std::uint32_t kMaxMappingSize = 1024;
// So that a block of 1024 rows of anything stays below 256 MiB.
inline constexpr std::uint32_t kMaxDirections = 1u << 17;

// Bad input when the size is odd, zero or too large, or fovy does not fit the kind.
Result<void> check(const Mapping& mapping);

// "hemicube", "singleplane", "hemisphere", "cube", "octahedral", "fibonacci".
std::string_view name(MappingKind kind);
std::optional<MappingKind> mappingKindNamed(std::string_view name);

// All below require check(mapping) to hold (asserted where cheap).
std::uint32_t pixelCount(const Mapping& mapping);
std::vector<ImageSize> images(const Mapping& mapping);
DirectionFrame directionFrame(const Mapping& mapping);
DirectionSide directionSide(const Mapping& mapping);

// Unit direction of the pixel's centre, in the mapping's frame.
glm::dvec3 direction(const Mapping& mapping, std::uint32_t pixel);
// The pixel that holds a direction (any length, not zero); none when the mapping does not see it. Nearest centre for
// Fibonacci, by search.
std::optional<std::uint32_t> pixelOf(const Mapping& mapping, const glm::dvec3& direction);

// Integral of |cos| over the pixel, steradians, in closed form; cos is against z. Object frame: against z as well, see
// vectorWeight() for other normals.
double cosineWeight(const Mapping& mapping, std::uint32_t pixel);
// Solid angle of the pixel in closed form. Fibonacci: weight / cos at the centre, as its pixels have no outline.
double solidAngle(const Mapping& mapping, std::uint32_t pixel);
// The usual approximation: integrand at the centre times the area of the pixel.
double midpointCosineWeight(const Mapping& mapping, std::uint32_t pixel);
double midpointSolidAngle(const Mapping& mapping, std::uint32_t pixel);
// Integral of the unit direction over the pixel; its product with a normal is the cosine weight for that normal.
// Closed form (Lambert's) for pixels bounded by great circles; HemiSphere integrates its ring; Fibonacci: the centre
// times the solid angle.
glm::dvec3 vectorWeight(const Mapping& mapping, std::uint32_t pixel);
// What the cosine weights add up to: pi, 2 pi for Cube and Octahedral (both sides), and for SinglePlane
// 4 sin(fovy/2) atan(sin(fovy/2)).
double totalCosineWeight(const Mapping& mapping);

// Two pixels whose solid angles touch, with the direction of the middle of what they share.
struct Neighbours {
    std::uint32_t first = 0;
    std::uint32_t second = 0;
    glm::dvec3 middle{0.0};  // unit length
};
// Every pair once, also across the borders of images and at the pole of HemiSphere (whose pixels all meet in one
// point). Empty for Fibonacci.
std::vector<Neighbours> neighbours(const Mapping& mapping);

// For each pixel of `to` the pixel of `from` that its centre falls into, kNoSource where `from` does not see it: turns
// maps of one mapping into another's by copying, as the rasteriser makes HemiSphere from HemiCube (Ganster
// 2002, 2.2.3). Both in the same frame (asserted).
inline constexpr std::uint32_t kNoSource = ~0u;
std::vector<std::uint32_t> sourceTable(const Mapping& from, const Mapping& to);

// Order in which rays are traced: eight after each other form a packet of neighbouring directions. A permutation.
std::vector<std::uint32_t> packetOrder(const Mapping& mapping);

}  // namespace umbriel::visibility
