#include "common/visibility/cube.h"

#include <algorithm>
#include <cmath>

#include "common/visibility/cube_face.h"

namespace umbriel::visibility::cube {
namespace {

FacePixel place(std::uint32_t s, std::uint32_t pixel) {
    const double step = 2.0 / s;
    const std::uint32_t column = pixel % s, row = pixel % (s * s) / s;
    return {static_cast<int>(pixel / (s * s)),
            row,
            -1.0 + column * step,
            -1.0 + (column + 1) * step,
            -1.0 + row * step,
            -1.0 + (row + 1) * step};
}

}  // namespace

std::uint32_t pixelCount(std::uint32_t s) {
    return 6 * s * s;
}

glm::dvec3 direction(std::uint32_t s, std::uint32_t pixel) {
    return directionOf(place(s, pixel));
}

std::optional<std::uint32_t> pixelOf(std::uint32_t s, const glm::dvec3& d) {
    const double ax = std::abs(d.x), ay = std::abs(d.y), az = std::abs(d.z);
    if (!(std::max({ax, ay, az}) > 0.0)) return std::nullopt;
    int index = d.z > 0 ? 4 : 5;
    if (ax > az || ay > az) index = ax >= ay ? (d.x > 0 ? 0 : 2) : (d.y > 0 ? 1 : 3);
    const FaceAxes axes = faceAxes(index);
    const double depth = glm::dot(d, axes.out);
    const auto cell = [&](double coordinate) {
        return static_cast<std::uint32_t>(std::clamp(std::floor((coordinate / depth + 1.0) * 0.5 * s), 0.0, s - 1.0));
    };
    return (static_cast<std::uint32_t>(index) * s + cell(glm::dot(d, axes.up))) * s + cell(glm::dot(d, axes.along));
}

double cosineWeight(std::uint32_t s, std::uint32_t pixel) {
    return cosineWeightOf(place(s, pixel));
}

double solidAngle(std::uint32_t s, std::uint32_t pixel) {
    return solidAngleOf(place(s, pixel));
}

double midpointCosineWeight(std::uint32_t s, std::uint32_t pixel) {
    return midpointCosineWeightOf(place(s, pixel), s);
}

double midpointSolidAngle(std::uint32_t s, std::uint32_t pixel) {
    return midpointSolidAngleOf(place(s, pixel), s);
}

std::vector<glm::dvec3> corners(std::uint32_t s, std::uint32_t pixel) {
    return cornersOf(place(s, pixel));
}

std::vector<Neighbours> neighbours(std::uint32_t s) {
    std::vector<Neighbours> result;
    const auto beyond = [s](const glm::dvec3& direction) { return pixelOf(s, direction); };
    for (std::uint32_t pixel = 0; pixel < pixelCount(s); ++pixel) {
        const FacePixel p = place(s, pixel);
        // The horizon is no neighbourhood.
        addNeighbours(p, pixel, s, !(p.isOnSide() && p.row == s / 2 - 1), !(p.isOnSide() && p.row == s / 2), beyond,
                      result);
    }
    return result;
}

}  // namespace umbriel::visibility::cube
