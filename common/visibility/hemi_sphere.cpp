#include "common/visibility/hemi_sphere.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace umbriel::visibility::hemi_sphere {
namespace {

using std::numbers::pi;

glm::dvec3 towards(double azimuth, double elevation) {
    const double c = std::cos(elevation);
    return {c * std::cos(azimuth), c * std::sin(azimuth), std::sin(elevation)};
}

double elevation(std::uint32_t s, std::uint32_t pixel) {
    return pi * (pixel / (2 * s) + 0.5) / s;
}
double azimuth(std::uint32_t s, std::uint32_t pixel) {
    return pi * (pixel % (2 * s) + 0.5) / s;
}

}  // namespace

glm::dvec3 direction(std::uint32_t s, std::uint32_t pixel) {
    return towards(azimuth(s, pixel), elevation(s, pixel));
}

std::optional<std::uint32_t> pixelOf(std::uint32_t s, const glm::dvec3& d) {
    if (!(d.z > 0.0)) return std::nullopt;
    const double up = std::atan2(d.z, std::hypot(d.x, d.y));
    double around = std::atan2(d.y, d.x);
    if (around < 0.0) around += 2.0 * pi;
    const double row = std::clamp(std::floor(up * s / pi), 0.0, s / 2 - 1.0);
    const double column = std::clamp(std::floor(around * s / pi), 0.0, 2.0 * s - 1.0);
    return static_cast<std::uint32_t>(row) * 2 * s + static_cast<std::uint32_t>(column);
}

double cosineWeight(std::uint32_t s, std::uint32_t pixel) {
    // Azimuth pi/s times (sin^2 e1 - sin^2 e0) / 2.
    return pi / (2.0 * s) * std::sin(2.0 * elevation(s, pixel)) * std::sin(pi / s);
}

double solidAngle(std::uint32_t s, std::uint32_t pixel) {
    // sin e1 - sin e0 as a product, which loses no digits.
    return pi / s * 2.0 * std::cos(elevation(s, pixel)) * std::sin(0.5 * pi / s);
}

double midpointCosineWeight(std::uint32_t s, std::uint32_t pixel) {
    const double e = elevation(s, pixel);
    return pi / s * (pi / s) * std::sin(e) * std::cos(e);
}

double midpointSolidAngle(std::uint32_t s, std::uint32_t pixel) {
    return pi / s * (pi / s) * std::cos(elevation(s, pixel));
}

glm::dvec3 vectorWeight(std::uint32_t s, std::uint32_t pixel) {
    // Integral of cos^2 e over the row, times the integral of the azimuth's direction.
    const double e = elevation(s, pixel);
    const double a = azimuth(s, pixel);
    const double row = 0.5 * (pi / s + std::cos(2.0 * e) * std::sin(pi / s));
    const double chord = 2.0 * std::sin(0.5 * pi / s);
    return {row * chord * std::cos(a), row * chord * std::sin(a), cosineWeight(s, pixel)};
}

std::vector<Neighbours> neighbours(std::uint32_t s) {
    std::vector<Neighbours> result;
    const std::uint32_t width = 2 * s;
    for (std::uint32_t j = 0; j < s / 2; ++j) {
        for (std::uint32_t i = 0; i < width; ++i) {
            const std::uint32_t pixel = j * width + i;
            result.push_back({pixel, j * width + (i + 1) % width, towards(pi * (i + 1) / s, pi * (j + 0.5) / s)});
            if (j + 1 < s / 2) {
                result.push_back({pixel, pixel + width, towards(pi * (i + 0.5) / s, pi * (j + 1) / s)});
            }
        }
    }
    // All of the last row meet in the pole: it is a boundary when any of them differs from the first.
    const std::uint32_t last = (s / 2 - 1) * width;
    for (std::uint32_t i = 1; i < width; ++i) result.push_back({last, last + i, {0.0, 0.0, 1.0}});
    return result;
}

}  // namespace umbriel::visibility::hemi_sphere
