#include "common/visibility/hemi_cube.h"

#include <algorithm>
#include <cmath>

#include "common/visibility/planar_pixels.h"

namespace umbriel::visibility::hemi_cube {
namespace {

// Where a pixel lies: on the plane [u0,u1] x [v0,v1] of a side.
struct Place {
    int side = 4;
    std::uint32_t column = 0;
    std::uint32_t row = 0;
    double u0 = 0, u1 = 0, v0 = 0, v1 = 0;
    double u() const { return 0.5 * (u0 + u1); }
    double v() const { return 0.5 * (v0 + v1); }
};

Place place(std::uint32_t s, std::uint32_t pixel) {
    const double step = 2.0 / s;
    Place p;
    if (pixel < s * s) {
        p.column = pixel % s;
        p.row = pixel / s;
        p.v0 = -1.0 + p.row * step;
        p.v1 = -1.0 + (p.row + 1) * step;
    } else {
        const std::uint32_t rest = pixel - s * s;
        const std::uint32_t perSide = s * (s / 2);
        p.side = static_cast<int>(rest / perSide);
        p.column = rest % perSide % s;
        p.row = rest % perSide / s;
        p.v0 = p.row * step;
        p.v1 = (p.row + 1) * step;
    }
    p.u0 = -1.0 + p.column * step;
    p.u1 = -1.0 + (p.column + 1) * step;
    return p;
}

std::uint32_t cell(double coordinate, double low, std::uint32_t s, std::uint32_t count) {
    const double index = std::floor((coordinate - low) * 0.5 * s);
    return static_cast<std::uint32_t>(std::clamp(index, 0.0, count - 1.0));
}

}  // namespace

Side side(int index) {
    switch (index) {
        case 0:
            return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        case 1:
            return {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}};
        case 2:
            return {{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
        case 3:
            return {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};
        case 4:
            return {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
        default:
            return {{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}};
    }
}

std::uint32_t pixelCount(std::uint32_t s) {
    return 3 * s * s;
}

glm::dvec3 direction(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    const Side axes = side(p.side);
    return glm::normalize(axes.out + p.u() * axes.along + p.v() * axes.up);
}

std::optional<std::uint32_t> pixelOf(std::uint32_t s, const glm::dvec3& d) {
    if (!(d.z > 0.0)) return std::nullopt;
    const double ax = std::abs(d.x), ay = std::abs(d.y);
    if (d.z >= ax && d.z >= ay) return cell(d.y / d.z, -1.0, s, s) * s + cell(d.x / d.z, -1.0, s, s);
    const int index = ax >= ay ? (d.x > 0 ? 0 : 2) : (d.y > 0 ? 1 : 3);
    const Side axes = side(index);
    const double depth = glm::dot(d, axes.out);
    const std::uint32_t column = cell(glm::dot(d, axes.along) / depth, -1.0, s, s);
    const std::uint32_t row = cell(d.z / depth, 0.0, s, s / 2);
    return s * s + static_cast<std::uint32_t>(index) * s * (s / 2) + row * s + column;
}

double cosineWeight(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    return p.side == 4 ? parallelCosine(p.u0, p.u1, p.v0, p.v1) : perpendicularCosine(p.u0, p.u1, p.v0, p.v1);
}

double solidAngle(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    return planeSolidAngle(p.u0, p.u1, p.v0, p.v1);
}

double midpointCosineWeight(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    const double r2 = 1.0 + p.u() * p.u() + p.v() * p.v();
    return 4.0 / (static_cast<double>(s) * s) * (p.side == 4 ? 1.0 : p.v()) / (r2 * r2);
}

double midpointSolidAngle(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    const double r2 = 1.0 + p.u() * p.u() + p.v() * p.v();
    return 4.0 / (static_cast<double>(s) * s) / (r2 * std::sqrt(r2));
}

std::vector<glm::dvec3> corners(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    const Side axes = side(p.side);
    const auto at = [&](double u, double v) { return axes.out + u * axes.along + v * axes.up; };
    return {at(p.u0, p.v0), at(p.u1, p.v0), at(p.u1, p.v1), at(p.u0, p.v1)};
}

std::vector<Neighbours> neighbours(std::uint32_t s) {
    std::vector<Neighbours> result;
    for (std::uint32_t pixel = 0; pixel < pixelCount(s); ++pixel) {
        const Place p = place(s, pixel);
        const Side axes = side(p.side);
        const double step = 1e-3 / s;  // over the edge, and no further
        const auto add = [&](double u, double v, double edgeU, double edgeV) {
            // A step off this side lands on the side next to it.
            const auto other = pixelOf(s, axes.out + u * axes.along + v * axes.up);
            if (other && *other > pixel) {
                result.push_back({pixel, *other, glm::normalize(axes.out + edgeU * axes.along + edgeV * axes.up)});
            }
        };
        add(p.u1 + step, p.v(), p.u1, p.v());
        add(p.u0 - step, p.v(), p.u0, p.v());
        add(p.u(), p.v1 + step, p.u(), p.v1);
        add(p.u(), p.v0 - step, p.u(), p.v0);
    }
    return result;
}

}  // namespace umbriel::visibility::hemi_cube
