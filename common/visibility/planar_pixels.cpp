#include "common/visibility/planar_pixels.h"

#include <cmath>

namespace umbriel::visibility {
namespace {

double parallelCorner(double x, double y) {
    const double rx = std::sqrt(1.0 + x * x);
    const double ry = std::sqrt(1.0 + y * y);
    return 0.5 * (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry));
}

double perpendicularCorner(double y, double z) {
    const double rz = std::sqrt(1.0 + z * z);
    return 0.5 * (std::atan(y) - std::atan(y / rz) / rz);
}

double solidAngleCorner(double x, double y) {
    return std::atan2(x * y, std::sqrt(1.0 + x * x + y * y));
}

double triangleSolidAngle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    return 2.0 * std::atan2(glm::dot(a, glm::cross(b, c)),
                            la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
}

}  // namespace

double parallelCosine(double x0, double x1, double y0, double y1) {
    return parallelCorner(x1, y1) - parallelCorner(x0, y1) - parallelCorner(x1, y0) + parallelCorner(x0, y0);
}

double perpendicularCosine(double y0, double y1, double z0, double z1) {
    // The antiderivative is even in z, so below the horizon the sign turns.
    const double integral = perpendicularCorner(y1, z1) - perpendicularCorner(y0, z1) - perpendicularCorner(y1, z0) +
                            perpendicularCorner(y0, z0);
    return std::abs(integral);
}

double planeSolidAngle(double x0, double x1, double y0, double y1) {
    return solidAngleCorner(x1, y1) - solidAngleCorner(x0, y1) - solidAngleCorner(x1, y0) + solidAngleCorner(x0, y0);
}

double polygonSolidAngle(std::span<const glm::dvec3> corners) {
    double sum = 0.0;
    for (std::size_t i = 2; i < corners.size(); ++i) sum += triangleSolidAngle(corners[0], corners[i - 1], corners[i]);
    return sum;
}

glm::dvec3 polygonVector(std::span<const glm::dvec3> corners) {
    glm::dvec3 sum(0.0);
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const glm::dvec3& a = corners[i];
        const glm::dvec3& b = corners[(i + 1) % corners.size()];
        const glm::dvec3 normal = glm::cross(a, b);
        const double length = glm::length(normal);
        if (length > 0.0) sum += normal * (0.5 * std::atan2(length, glm::dot(a, b)) / length);
    }
    return sum;
}

}  // namespace umbriel::visibility
