#include "common/visibility/octahedral.h"

#include <algorithm>
#include <cmath>

#include "common/visibility/planar_pixels.h"

namespace umbriel::visibility::octahedral {
namespace {

double signOf(double value) {
    return value < 0.0 ? -1.0 : 1.0;
}

// A point of the octahedron, not normalised. At u = 0 or v = 0 of the lower half the side is given by `within`.
glm::dvec3 unfold(double u, double v, double withinU, double withinV) {
    const double z = 1.0 - std::abs(u) - std::abs(v);
    if (z >= 0.0) return {u, v, z};
    return {(1.0 - std::abs(v)) * signOf(withinU), (1.0 - std::abs(u)) * signOf(withinV), z};
}

struct Place {
    double u0, u1, v0, v1;
    double u() const { return 0.5 * (u0 + u1); }
    double v() const { return 0.5 * (v0 + v1); }
};

Place place(std::uint32_t s, std::uint32_t pixel) {
    const double n = s, i = pixel % s, j = pixel / s;
    return {(2 * i - n) / n, (2 * i + 2 - n) / n, (2 * j - n) / n, (2 * j + 2 - n) / n};
}

// One polygon, or two where the fold |u| + |v| = 1 is a diagonal of the pixel. Corners counter-clockwise from outside.
std::vector<std::vector<glm::dvec3>> outline(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    const auto at = [&](double u, double v) { return unfold(u, v, p.u(), p.v()); };
    const glm::dvec3 a = at(p.u0, p.v0), b = at(p.u1, p.v0), c = at(p.u1, p.v1), d = at(p.u0, p.v1);
    // On the fold the centre has height 0 up to rounding; otherwise at least 1/s.
    if (std::abs(1.0 - std::abs(p.u()) - std::abs(p.v())) > 0.5 / s) return {{a, b, c, d}};
    if (p.u() * p.v() > 0.0) return {{a, b, d}, {b, c, d}};
    return {{a, b, c}, {a, c, d}};
}

}  // namespace

glm::dvec3 direction(std::uint32_t s, std::uint32_t pixel) {
    const Place p = place(s, pixel);
    return glm::normalize(unfold(p.u(), p.v(), p.u(), p.v()));
}

std::optional<std::uint32_t> pixelOf(std::uint32_t s, const glm::dvec3& d) {
    const double sum = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
    if (!(sum > 0.0)) return std::nullopt;
    double u = d.x / sum, v = d.y / sum;
    if (d.z < 0.0) {
        const double folded = (1.0 - std::abs(v)) * signOf(u);
        v = (1.0 - std::abs(u)) * signOf(v);
        u = folded;
    }
    const auto cell = [&](double coordinate) {
        return static_cast<std::uint32_t>(std::clamp(std::floor((coordinate + 1.0) * 0.5 * s), 0.0, s - 1.0));
    };
    return cell(v) * s + cell(u);
}

glm::dvec3 vectorWeight(std::uint32_t s, std::uint32_t pixel) {
    glm::dvec3 sum(0.0);
    for (const auto& polygon : outline(s, pixel)) sum += polygonVector(polygon);
    return sum;
}

double cosineWeight(std::uint32_t s, std::uint32_t pixel) {
    double sum = 0.0;
    for (const auto& polygon : outline(s, pixel)) sum += std::abs(polygonVector(polygon).z);
    return sum;
}

double solidAngle(std::uint32_t s, std::uint32_t pixel) {
    double sum = 0.0;
    for (const auto& polygon : outline(s, pixel)) sum += polygonSolidAngle(polygon);
    return sum;
}

double midpointSolidAngle(std::uint32_t s, std::uint32_t pixel) {
    // du dv / r^3, r the length before normalising.
    const Place p = place(s, pixel);
    const double r = glm::length(unfold(p.u(), p.v(), p.u(), p.v()));
    return 4.0 / (static_cast<double>(s) * s) / (r * r * r);
}

double midpointCosineWeight(std::uint32_t s, std::uint32_t pixel) {
    return midpointSolidAngle(s, pixel) * std::abs(direction(s, pixel).z);
}

std::vector<Neighbours> neighbours(std::uint32_t s) {
    std::vector<Neighbours> result;
    for (std::uint32_t pixel = 0; pixel < s * s; ++pixel) {
        const Place p = place(s, pixel);
        const std::uint32_t i = pixel % s, j = pixel / s;
        const auto add = [&](std::uint32_t other, double u, double v) {
            result.push_back({pixel, other, glm::normalize(unfold(u, v, p.u(), p.v()))});
        };
        if (i + 1 < s) add(pixel + 1, p.u1, p.v());
        if (j + 1 < s) add(pixel + s, p.u(), p.v1);
        // Each border of the square is folded onto itself about its middle.
        const std::uint32_t across = (s - 1 - j) * s + i, along = j * s + (s - 1 - i);
        if ((i == 0 || i + 1 == s) && across > pixel) add(across, i == 0 ? p.u0 : p.u1, p.v());
        if ((j == 0 || j + 1 == s) && along > pixel) add(along, p.u(), j == 0 ? p.v0 : p.v1);
    }
    return result;
}

}  // namespace umbriel::visibility::octahedral
