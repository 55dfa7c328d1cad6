#include "client/app/orbit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace umbriel {
namespace {

// Straight up or down the heading would lose its meaning.
constexpr double kMaxElevation = 0.499 * std::numbers::pi;
constexpr double kMinDistance = 1e-9;
constexpr double kMaxDistance = 1e12;

}  // namespace

Orbit Orbit::around(const glm::dvec3& centre, const glm::dvec3& eye) {
    const glm::dvec3 offset = eye - centre;
    Orbit orbit;
    orbit.centre = centre;
    orbit.distance = std::clamp(glm::length(offset), kMinDistance, kMaxDistance);
    orbit.elevation = std::clamp(std::asin(std::clamp(offset.y / orbit.distance, -1.0, 1.0)), -kMaxElevation, kMaxElevation);
    orbit.heading = offset.x == 0.0 && offset.z == 0.0 ? 0.0 : std::atan2(offset.x, offset.z);
    return orbit;
}

glm::dvec3 Orbit::eye() const {
    return centre + distance * glm::dvec3(std::cos(elevation) * std::sin(heading), std::sin(elevation),
                                          std::cos(elevation) * std::cos(heading));
}

void Orbit::turn(double right, double up) {
    heading = std::remainder(heading - right * std::numbers::pi, 2.0 * std::numbers::pi);
    elevation = std::clamp(elevation - up * std::numbers::pi, -kMaxElevation, kMaxElevation);
}

void Orbit::pan(double right, double up) {
    const glm::dvec3 forward = glm::normalize(centre - eye());
    const glm::dvec3 rightWorld = glm::normalize(glm::cross(forward, glm::dvec3(0, 1, 0)));
    centre -= distance * (right * rightWorld + up * glm::cross(rightWorld, forward));
}

void Orbit::approach(double notches) {
    distance = std::clamp(distance * std::pow(0.9, std::clamp(notches, -100.0, 100.0)), kMinDistance, kMaxDistance);
}

}  // namespace umbriel
