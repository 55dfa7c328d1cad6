#include "common/visibility/hemi_cube.h"

#include <algorithm>
#include <cmath>

#include "common/visibility/cube_face.h"

namespace umbriel::visibility::hemi_cube {
namespace {

FacePixel place(std::uint32_t s, std::uint32_t pixel) {
    const double step = 2.0 / s;
    FacePixel p;
    std::uint32_t column = pixel % s;
    if (pixel < s * s) {
        p.row = pixel / s;
        p.v0 = -1.0 + p.row * step;
        p.v1 = -1.0 + (p.row + 1) * step;
    } else {
        const std::uint32_t rest = pixel - s * s;
        const std::uint32_t perSide = s * (s / 2);
        p.face = static_cast<int>(rest / perSide);
        column = rest % perSide % s;
        p.row = rest % perSide / s;
        p.v0 = p.row * step;
        p.v1 = (p.row + 1) * step;
    }
    p.u0 = -1.0 + column * step;
    p.u1 = -1.0 + (column + 1) * step;
    return p;
}

std::uint32_t cell(double coordinate, double low, std::uint32_t s, std::uint32_t count) {
    const double index = std::floor((coordinate - low) * 0.5 * s);
    return static_cast<std::uint32_t>(std::clamp(index, 0.0, count - 1.0));
}

}  // namespace

std::uint32_t pixelCount(std::uint32_t s) {
    return 3 * s * s;
}

glm::dvec3 direction(std::uint32_t s, std::uint32_t pixel) {
    return directionOf(place(s, pixel));
}

std::optional<std::uint32_t> pixelOf(std::uint32_t s, const glm::dvec3& d) {
    if (!(d.z > 0.0)) return std::nullopt;
    const double ax = std::abs(d.x), ay = std::abs(d.y);
    if (d.z >= ax && d.z >= ay) return cell(d.y / d.z, -1.0, s, s) * s + cell(d.x / d.z, -1.0, s, s);
    const int index = ax >= ay ? (d.x > 0 ? 0 : 2) : (d.y > 0 ? 1 : 3);
    const FaceAxes axes = faceAxes(index);
    const double depth = glm::dot(d, axes.out);
    const std::uint32_t column = cell(glm::dot(d, axes.along) / depth, -1.0, s, s);
    const std::uint32_t row = cell(d.z / depth, 0.0, s, s / 2);
    return s * s + static_cast<std::uint32_t>(index) * s * (s / 2) + row * s + column;
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
        addNeighbours(p, pixel, s, true, true, beyond, result);
    }
    return result;
}

}  // namespace umbriel::visibility::hemi_cube
