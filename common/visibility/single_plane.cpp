#include "common/visibility/single_plane.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/visibility/planar_pixels.h"

namespace umbriel::visibility::single_plane {
namespace {

struct Place {
    double x0, x1, y0, y1;
    double x() const { return 0.5 * (x0 + x1); }
    double y() const { return 0.5 * (y0 + y1); }
};

Place place(std::uint32_t s, double fovy, std::uint32_t pixel) {
    const double t = std::tan(0.5 * fovy);
    const double n = s;
    const double i = pixel % s, j = pixel / s;
    return {t * (2 * i - n) / n, t * (2 * i + 2 - n) / n, t * (2 * j - n) / n, t * (2 * j + 2 - n) / n};
}

}  // namespace

glm::dvec3 direction(std::uint32_t s, double fovy, std::uint32_t pixel) {
    const Place p = place(s, fovy, pixel);
    return glm::normalize(glm::dvec3(p.x(), p.y(), 1.0));
}

std::optional<std::uint32_t> pixelOf(std::uint32_t s, double fovy, const glm::dvec3& d) {
    const double reach = std::tan(0.5 * fovy) * d.z;
    if (!(d.z > 0.0) || std::abs(d.x) > reach || std::abs(d.y) > reach) return std::nullopt;
    const auto cell = [&](double coordinate) {
        return static_cast<std::uint32_t>(std::clamp(std::floor((coordinate / reach + 1.0) * 0.5 * s), 0.0, s - 1.0));
    };
    return cell(d.y) * s + cell(d.x);
}

double cosineWeight(std::uint32_t s, double fovy, std::uint32_t pixel) {
    const Place p = place(s, fovy, pixel);
    return parallelCosine(p.x0, p.x1, p.y0, p.y1);
}

double solidAngle(std::uint32_t s, double fovy, std::uint32_t pixel) {
    const Place p = place(s, fovy, pixel);
    return planeSolidAngle(p.x0, p.x1, p.y0, p.y1);
}

double midpointCosineWeight(std::uint32_t s, double fovy, std::uint32_t pixel) {
    const Place p = place(s, fovy, pixel);
    const double r2 = 1.0 + p.x() * p.x() + p.y() * p.y();
    return (p.x1 - p.x0) * (p.y1 - p.y0) / (r2 * r2);
}

double midpointSolidAngle(std::uint32_t s, double fovy, std::uint32_t pixel) {
    const Place p = place(s, fovy, pixel);
    const double r2 = 1.0 + p.x() * p.x() + p.y() * p.y();
    return (p.x1 - p.x0) * (p.y1 - p.y0) / (r2 * std::sqrt(r2));
}

std::vector<glm::dvec3> corners(std::uint32_t s, double fovy, std::uint32_t pixel) {
    const Place p = place(s, fovy, pixel);
    return {{p.x0, p.y0, 1.0}, {p.x1, p.y0, 1.0}, {p.x1, p.y1, 1.0}, {p.x0, p.y1, 1.0}};
}

std::vector<Neighbours> neighbours(std::uint32_t s, double fovy) {
    std::vector<Neighbours> result;
    for (std::uint32_t pixel = 0; pixel < s * s; ++pixel) {
        const Place p = place(s, fovy, pixel);
        if (pixel % s + 1 < s) result.push_back({pixel, pixel + 1, glm::normalize(glm::dvec3(p.x1, p.y(), 1.0))});
        if (pixel / s + 1 < s) result.push_back({pixel, pixel + s, glm::normalize(glm::dvec3(p.x(), p.y1, 1.0))});
    }
    return result;
}

double totalCosineWeight(double fovy) {
    const double sine = std::sin(0.5 * fovy);
    return 4.0 * sine * std::atan(sine);
}

double firstRayAngle(std::uint32_t s, double fovy) {
    return std::atan(std::numbers::sqrt2 * std::tan(0.5 * fovy) / s);
}

bool firstRayIsTooFar(std::uint32_t s, double fovy) {
    constexpr double kDegree = std::numbers::pi / 180.0;
    return firstRayAngle(s, fovy) >= (fovy >= 160.0 * kDegree ? 7.5 : 6.0) * kDegree;
}

}  // namespace umbriel::visibility::single_plane
