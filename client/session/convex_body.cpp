#include "client/session/convex_body.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace umbriel {

namespace {

// The points in order around their middle, seen along the normal.
void sortAround(std::vector<glm::dvec3>& points, const glm::dvec3& normal) {
    glm::dvec3 middle(0.0);
    for (const glm::dvec3& point : points) middle += point / static_cast<double>(points.size());
    const glm::dvec3 a = glm::abs(normal);
    const glm::dvec3 other = a.x <= a.y && a.x <= a.z ? glm::dvec3(1, 0, 0)
                             : a.y <= a.z             ? glm::dvec3(0, 1, 0)
                                                      : glm::dvec3(0, 0, 1);
    const glm::dvec3 across = glm::normalize(glm::cross(normal, other));
    const glm::dvec3 along = glm::cross(normal, across);
    const auto angle = [&](const glm::dvec3& p) {
        return std::atan2(glm::dot(p - middle, along), glm::dot(p - middle, across));
    };
    std::stable_sort(points.begin(), points.end(), [&](const auto& p, const auto& q) { return angle(p) < angle(q); });
}

}  // namespace

ConvexBody::ConvexBody(const Box3d& box, const glm::dvec3& origin) {
    if (box.empty()) return;
    constexpr std::array<std::array<int, 4>, 6> kFaces = {
        {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}}};
    for (const auto& corners : kFaces) {
        Face face;
        for (int corner : corners) face.push_back(box.corner(corner) - origin);
        _faces.push_back(std::move(face));
    }
    const glm::dvec3 largest = glm::max(glm::abs(box.lower - origin), glm::abs(box.upper - origin));
    // A few roundings of coordinates of this size.
    _tolerance = 1e-14 * (largest.x + largest.y + largest.z);
}

void ConvexBody::cut(const Plane& plane) {
    std::vector<Face> kept;
    Face cap;
    for (const Face& face : _faces) {
        Face inside;
        bool wasCut = false;
        for (std::size_t i = 0; i < face.size(); ++i) {
            const glm::dvec3& from = face[i];
            const glm::dvec3& to = face[(i + 1) % face.size()];
            const double distanceFrom = plane.signedDistance(from);
            const double distanceTo = plane.signedDistance(to);
            const bool fromInside = distanceFrom >= -_tolerance;
            const bool toInside = distanceTo >= -_tolerance;
            if (fromInside) inside.push_back(from);
            if (fromInside != toInside) {
                // The distances differ in sign but for the tolerance, so the quotient is kept between them.
                const double t = std::clamp(distanceFrom / (distanceFrom - distanceTo), 0.0, 1.0);
                inside.push_back(from + t * (to - from));
                cap.push_back(inside.back());
                wasCut = true;
            }
        }
        // What touches the plane in a single point brings nothing that its neighbours do not have.
        if (inside.size() >= 3 || (inside.size() == 2 && wasCut)) kept.push_back(std::move(inside));
    }
    if (cap.size() >= 3) {
        sortAround(cap, plane.normal);
        kept.push_back(std::move(cap));
    }
    _faces = std::move(kept);
}

std::vector<glm::dvec3> ConvexBody::corners() const {
    std::vector<glm::dvec3> corners;
    for (const Face& face : _faces) corners.insert(corners.end(), face.begin(), face.end());
    return corners;
}

}  // namespace umbriel
