#include "common/visibility/cube.h"

#include <algorithm>
#include <cmath>

#include "common/visibility/hemi_cube.h"
#include "common/visibility/planar_pixels.h"

namespace umbriel::visibility::cube {
namespace {

struct Place {
    int side;
    std::uint32_t row;
    double u0, u1, v0, v1;
    bool isSide() const { return side < 4; }
    double u() const { return 0.5 * (u0 + u1); }
    double v() const { return 0.5 * (v0 + v1); }
};

Place place(std::uint32_t s, std::uint32_t pixel) {
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
    const Place p = place(s, pixel);
    const hemi_cube::Side axes = hemi_cube::side(p.side);
    return glm::normalize(axes.out + p.u() * axes.along + p.v() * axes.up);
}

std::optional<std::uint32_t> pixelOf(std::uint32_t s, const glm::dvec3& d) {
    const double ax = std::abs(d.x), ay = std::abs(d.y), az = std::abs(d.z);
    if (!(std::max({ax, ay, az}) > 0.0)) return std::nullopt;
    int index = d.z > 0 ? 4 : 5;
    if (ax > az || ay > az) index = ax >= ay ? (d.x > 0 ? 0 : 2) : (d.y > 0 ? 1 : 3);
    const hemi_cube::Side axes = hemi_cube::side(index);
    const double depth = glm::dot(d, axes.out);
    const auto cell = [&](double coordinate) {
        return static_cast<std::uint32_t>(std::clamp(std::floor((coordinate / depth + 1.0) * 0.5 * s), 0.0, s - 1.0));
    };
    return (static_cast<std::uint32_t>(index) * s + cell(glm::dot(d, axes.up))) * s + cell(glm::dot(d, axes.along));
}

double cosineWeight(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    return p.isSide() ? perpendicularCosine(p.u0, p.u1, p.v0, p.v1) : parallelCosine(p.u0, p.u1, p.v0, p.v1);
}

double solidAngle(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    return planeSolidAngle(p.u0, p.u1, p.v0, p.v1);
}

double midpointCosineWeight(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    const double r2 = 1.0 + p.u() * p.u() + p.v() * p.v();
    return 4.0 / (static_cast<double>(s) * s) * (p.isSide() ? std::abs(p.v()) : 1.0) / (r2 * r2);
}

double midpointSolidAngle(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    const double r2 = 1.0 + p.u() * p.u() + p.v() * p.v();
    return 4.0 / (static_cast<double>(s) * s) / (r2 * std::sqrt(r2));
}

std::vector<glm::dvec3> corners(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    const hemi_cube::Side axes = hemi_cube::side(p.side);
    const auto at = [&](double u, double v) { return axes.out + u * axes.along + v * axes.up; };
    return {at(p.u0, p.v0), at(p.u1, p.v0), at(p.u1, p.v1), at(p.u0, p.v1)};
}

std::vector<Neighbours> neighbours(std::uint32_t s) {
    std::vector<Neighbours> result;
    for (std::uint32_t pixel = 0; pixel < pixelCount(s); ++pixel) {
        const Place p = place(s, pixel);
        const hemi_cube::Side axes = hemi_cube::side(p.side);
        const double step = 1e-3 / s;  // over the edge, and no further
        const auto add = [&](double u, double v, double edgeU, double edgeV) {
            const auto other = pixelOf(s, axes.out + u * axes.along + v * axes.up);
            if (other && *other > pixel) {
                result.push_back({pixel, *other, glm::normalize(axes.out + edgeU * axes.along + edgeV * axes.up)});
            }
        };
        add(p.u1 + step, p.v(), p.u1, p.v());
        add(p.u0 - step, p.v(), p.u0, p.v());
        if (!(p.isSide() && p.row == s / 2 - 1)) add(p.u(), p.v1 + step, p.u(), p.v1);
        if (!(p.isSide() && p.row == s / 2)) add(p.u(), p.v0 - step, p.u(), p.v0);
    }
    return result;
}

}  // namespace umbriel::visibility::cube
