#include "common/visibility/mapping.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/base/assert.h"
#include "common/visibility/cube.h"
#include "common/visibility/fibonacci.h"
#include "common/visibility/hemi_cube.h"
#include "common/visibility/hemi_sphere.h"
#include "common/visibility/octahedral.h"
#include "common/visibility/planar_pixels.h"
#include "common/visibility/single_plane.h"

namespace umbriel::visibility {
namespace {

using std::numbers::pi;

constexpr std::array<std::string_view, 6> kNames{"hemicube", "singleplane", "hemisphere",
                                                 "cube",     "octahedral",  "fibonacci"};

std::uint32_t interleave(std::uint32_t x, std::uint32_t y) {
    std::uint32_t code = 0;
    for (int bit = 0; bit < 16; ++bit) code |= ((x >> bit & 1u) << (2 * bit)) | ((y >> bit & 1u) << (2 * bit + 1));
    return code;
}

}  // namespace

std::string_view name(MappingKind kind) {
    return kNames.at(static_cast<std::size_t>(kind));
}

std::optional<MappingKind> mappingKindNamed(std::string_view text) {
    const auto found = std::ranges::find(kNames, text);
    if (found == kNames.end()) return std::nullopt;
    return static_cast<MappingKind>(found - kNames.begin());
}

Result<void> check(const Mapping& m) {
    if (static_cast<std::size_t>(m.kind) >= kNames.size()) return badInput("unknown mapping of a visibility map");
    if (m.kind == MappingKind::Fibonacci) {
        if (m.size < 1 || m.size > kMaxDirections) {
            return badInput(
                fmt::format("mapping fibonacci: {} directions, possible are 1 to {}", m.size, kMaxDirections));
        }
    } else {
        if (m.size < 2 || m.size > kMaxMappingSize || m.size % 2 != 0) {
            return badInput(fmt::format("mapping {}: size {} is not an even number from 2 to {}", name(m.kind), m.size,
                                        kMaxMappingSize));
        }
        if (pixelCount(m) > kMaxDirections) {
            return badInput(fmt::format("mapping {}: size {} has {} directions, more than {}", name(m.kind), m.size,
                                        pixelCount(m), kMaxDirections));
        }
    }
    if (m.kind == MappingKind::SinglePlane) {
        if (!(m.fovy > 0.0 && m.fovy < pi)) {
            return badInput(fmt::format("mapping singleplane: the opening angle {} degrees is not between 0 and 180",
                                        m.fovy * 180.0 / pi));
        }
    } else if (m.fovy != 0.0) {
        return badInput(fmt::format("mapping {}: an opening angle belongs to singleplane only", name(m.kind)));
    }
    return {};
}

std::uint32_t pixelCount(const Mapping& m) {
    switch (m.kind) {
        case MappingKind::HemiCube:
            return hemi_cube::pixelCount(m.size);
        case MappingKind::Cube:
            return cube::pixelCount(m.size);
        case MappingKind::Fibonacci:
            return m.size;
        default:
            return m.size * m.size;
    }
}

std::vector<ImageSize> images(const Mapping& m) {
    const std::uint32_t s = m.size;
    switch (m.kind) {
        case MappingKind::HemiCube:
            return {{s, s}, {s, s / 2}, {s, s / 2}, {s, s / 2}, {s, s / 2}};
        case MappingKind::HemiSphere:
            return {{2 * s, s / 2}};
        case MappingKind::Cube:
            return std::vector<ImageSize>(6, {s, s});
        case MappingKind::Fibonacci:
            return {{s, 1}};
        default:
            return {{s, s}};
    }
}

DirectionFrame directionFrame(const Mapping& m) {
    return m.kind == MappingKind::Octahedral ? DirectionFrame::Object : DirectionFrame::Vertex;
}

DirectionSide directionSide(const Mapping& m) {
    return m.kind == MappingKind::Cube ? DirectionSide::Own : DirectionSide::Upper;
}

glm::dvec3 direction(const Mapping& m, std::uint32_t pixel) {
    UMBRIEL_ASSERT(pixel < pixelCount(m), "a pixel outside its map");
    switch (m.kind) {
        case MappingKind::HemiCube:
            return hemi_cube::direction(m.size, pixel);
        case MappingKind::SinglePlane:
            return single_plane::direction(m.size, m.fovy, pixel);
        case MappingKind::HemiSphere:
            return hemi_sphere::direction(m.size, pixel);
        case MappingKind::Cube:
            return cube::direction(m.size, pixel);
        case MappingKind::Octahedral:
            return octahedral::direction(m.size, pixel);
        default:
            return fibonacci::direction(m.size, pixel);
    }
}

std::optional<std::uint32_t> pixelOf(const Mapping& m, const glm::dvec3& d) {
    switch (m.kind) {
        case MappingKind::HemiCube:
            return hemi_cube::pixelOf(m.size, d);
        case MappingKind::SinglePlane:
            return single_plane::pixelOf(m.size, m.fovy, d);
        case MappingKind::HemiSphere:
            return hemi_sphere::pixelOf(m.size, d);
        case MappingKind::Cube:
            return cube::pixelOf(m.size, d);
        case MappingKind::Octahedral:
            return octahedral::pixelOf(m.size, d);
        default:
            return fibonacci::pixelOf(m.size, d);
    }
}

double cosineWeight(const Mapping& m, std::uint32_t pixel) {
    switch (m.kind) {
        case MappingKind::HemiCube:
            return hemi_cube::cosineWeight(m.size, pixel);
        case MappingKind::SinglePlane:
            return single_plane::cosineWeight(m.size, m.fovy, pixel);
        case MappingKind::HemiSphere:
            return hemi_sphere::cosineWeight(m.size, pixel);
        case MappingKind::Cube:
            return cube::cosineWeight(m.size, pixel);
        case MappingKind::Octahedral:
            return octahedral::cosineWeight(m.size, pixel);
        default:
            return pi / m.size;
    }
}

double solidAngle(const Mapping& m, std::uint32_t pixel) {
    switch (m.kind) {
        case MappingKind::HemiCube:
            return hemi_cube::solidAngle(m.size, pixel);
        case MappingKind::SinglePlane:
            return single_plane::solidAngle(m.size, m.fovy, pixel);
        case MappingKind::HemiSphere:
            return hemi_sphere::solidAngle(m.size, pixel);
        case MappingKind::Cube:
            return cube::solidAngle(m.size, pixel);
        case MappingKind::Octahedral:
            return octahedral::solidAngle(m.size, pixel);
        default:
            return pi / m.size / fibonacci::direction(m.size, pixel).z;
    }
}

double midpointCosineWeight(const Mapping& m, std::uint32_t pixel) {
    switch (m.kind) {
        case MappingKind::HemiCube:
            return hemi_cube::midpointCosineWeight(m.size, pixel);
        case MappingKind::SinglePlane:
            return single_plane::midpointCosineWeight(m.size, m.fovy, pixel);
        case MappingKind::HemiSphere:
            return hemi_sphere::midpointCosineWeight(m.size, pixel);
        case MappingKind::Cube:
            return cube::midpointCosineWeight(m.size, pixel);
        case MappingKind::Octahedral:
            return octahedral::midpointCosineWeight(m.size, pixel);
        default:
            return pi / m.size;
    }
}

double midpointSolidAngle(const Mapping& m, std::uint32_t pixel) {
    switch (m.kind) {
        case MappingKind::HemiCube:
            return hemi_cube::midpointSolidAngle(m.size, pixel);
        case MappingKind::SinglePlane:
            return single_plane::midpointSolidAngle(m.size, m.fovy, pixel);
        case MappingKind::HemiSphere:
            return hemi_sphere::midpointSolidAngle(m.size, pixel);
        case MappingKind::Cube:
            return cube::midpointSolidAngle(m.size, pixel);
        case MappingKind::Octahedral:
            return octahedral::midpointSolidAngle(m.size, pixel);
        default:
            return solidAngle(m, pixel);
    }
}

glm::dvec3 vectorWeight(const Mapping& m, std::uint32_t pixel) {
    switch (m.kind) {
        case MappingKind::HemiCube:
            return polygonVector(hemi_cube::corners(m.size, pixel));
        case MappingKind::SinglePlane:
            return polygonVector(single_plane::corners(m.size, m.fovy, pixel));
        case MappingKind::HemiSphere:
            return hemi_sphere::vectorWeight(m.size, pixel);
        case MappingKind::Cube:
            return polygonVector(cube::corners(m.size, pixel));
        case MappingKind::Octahedral:
            return octahedral::vectorWeight(m.size, pixel);
        default:
            return fibonacci::direction(m.size, pixel) * solidAngle(m, pixel);
    }
}

double totalCosineWeight(const Mapping& m) {
    switch (m.kind) {
        case MappingKind::SinglePlane:
            return single_plane::totalCosineWeight(m.fovy);
        case MappingKind::Cube:
        case MappingKind::Octahedral:
            return 2.0 * pi;
        default:
            return pi;
    }
}

std::vector<Neighbours> neighbours(const Mapping& m) {
    switch (m.kind) {
        case MappingKind::HemiCube:
            return hemi_cube::neighbours(m.size);
        case MappingKind::SinglePlane:
            return single_plane::neighbours(m.size, m.fovy);
        case MappingKind::HemiSphere:
            return hemi_sphere::neighbours(m.size);
        case MappingKind::Cube:
            return cube::neighbours(m.size);
        case MappingKind::Octahedral:
            return octahedral::neighbours(m.size);
        default:
            return {};
    }
}

std::vector<std::uint32_t> sourceTable(const Mapping& from, const Mapping& to) {
    UMBRIEL_ASSERT(directionFrame(from) == directionFrame(to), "directions in one frame");
    std::vector<std::uint32_t> table(pixelCount(to));
    for (std::uint32_t pixel = 0; pixel < table.size(); ++pixel) {
        table[pixel] = pixelOf(from, direction(to, pixel)).value_or(kNoSource);
    }
    return table;
}

std::vector<std::uint32_t> packetOrder(const Mapping& m) {
    std::vector<std::uint32_t> order;
    order.reserve(pixelCount(m));
    if (m.kind == MappingKind::Fibonacci) {
        // Neighbours on the spiral are far apart; along a Z-curve of the disk they are close.
        order.resize(m.size);
        std::iota(order.begin(), order.end(), 0u);
        std::vector<std::uint32_t> code(m.size);
        for (std::uint32_t k = 0; k < m.size; ++k) {
            const glm::dvec3 d = fibonacci::direction(m.size, k);
            code[k] = interleave(static_cast<std::uint32_t>((d.x + 1.0) * 32767.0),
                                 static_cast<std::uint32_t>((d.y + 1.0) * 32767.0));
        }
        std::ranges::sort(
            order, [&](std::uint32_t a, std::uint32_t b) { return code[a] != code[b] ? code[a] < code[b] : a < b; });
        return order;
    }
    // Tiles of 4 x 2 pixels; where an image is no multiple of that, packets straddle tiles.
    std::uint32_t first = 0;
    for (const ImageSize& image : images(m)) {
        for (std::uint32_t top = 0; top < image.height; top += 2) {
            for (std::uint32_t left = 0; left < image.width; left += 4) {
                for (std::uint32_t j = top; j < std::min(top + 2, image.height); ++j) {
                    for (std::uint32_t i = left; i < std::min(left + 4, image.width); ++i) {
                        order.push_back(first + j * image.width + i);
                    }
                }
            }
        }
        first += image.width * image.height;
    }
    return order;
}

}  // namespace umbriel::visibility
