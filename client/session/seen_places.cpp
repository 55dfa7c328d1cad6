#include "client/session/seen_places.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace umbriel {

namespace {

constexpr int kRays = 6;  // in each direction
constexpr int kPlacesOnRay = 3;
constexpr double kWidening = 1.0 / 64.0;  // of the box's diagonal

// The part of a ray on the inner side of planes.
struct RayPart {
    glm::dvec3 origin{0.0}, direction{0.0};
    double from = 0.0, to = std::numeric_limits<double>::infinity();

    void cut(const glm::dvec3& normal, double offset) {
        const double along = glm::dot(normal, direction), here = glm::dot(normal, origin) + offset;
        if (along > 0.0)
            from = std::max(from, -here / along);
        else if (along < 0.0)
            to = std::min(to, -here / along);
        else if (here < 0.0)
            to = -std::numeric_limits<double>::infinity();
    }
};

}  // namespace

std::vector<SeenPlace> seenPlaces(const View& view, const Box3d& box, std::span<const glm::dvec3> corners,
                                  std::span<const Plane> planes, double leastDepth) {
    std::vector<SeenPlace> places;
    if (box.empty() || corners.empty()) return places;
    const glm::dmat4 clipFromRelative = view.clipFromView * glm::dmat4(view.viewFromWorld);
    glm::dvec2 low(1.0), high(-1.0);  // of the rectangle, on the picture
    for (const glm::dvec3& corner : corners) {
        const glm::dvec4 clip = clipFromRelative * glm::dvec4(corner, 1.0);
        if (!(clip.w > 0.0)) continue;
        const glm::dvec2 at = glm::clamp(glm::dvec2(clip) / clip.w, glm::dvec2(-1.0), glm::dvec2(1.0));
        low = glm::min(low, at);
        high = glm::max(high, at);
    }
    if (!(low.x < high.x && low.y < high.y)) return places;
    const glm::dvec2 size = high - low;
    const double widening = kWidening * box.diagonal();
    const glm::dvec3 lower = box.lower - view.eyeWorld - widening, upper = box.upper - view.eyeWorld + widening;
    const glm::dmat3 worldFromView = glm::transpose(view.viewFromWorld);
    const glm::dmat4 viewFromClip = glm::inverse(view.clipFromView);
    const Plane farPlane = frustumOf(clipFromRelative).planes[5];
    // The measure of depth and its inverse.
    const auto measure = [&](double depth) {
        return depth < leastDepth ? depth / leastDepth : 1.0 + std::log(depth / leastDepth);
    };
    const auto depthAt = [&](double value) { return leastDepth * (value < 1.0 ? value : std::exp(value - 1.0)); };
    for (int row = 0; row < kRays; ++row)
        for (int column = 0; column < kRays; ++column) {
            const glm::dvec2 at = low + size * glm::dvec2(column + 0.5, row + 0.5) / double(kRays);
            const glm::dvec4 nearest = viewFromClip * glm::dvec4(at, 1.0, 1.0);
            const glm::dvec3 nearView = glm::dvec3(nearest) / nearest.w;
            if (!(nearView.z < 0.0) && !view.orthographic) continue;
            RayPart ray;
            if (view.orthographic) {
                ray.origin = worldFromView * nearView;
                ray.direction = -worldFromView[2];
            } else {
                ray.direction = worldFromView * (nearView / -nearView.z);
                ray.from = -nearView.z;
            }
            for (int axis = 0; axis < 3; ++axis) {
                glm::dvec3 normal(0.0);
                normal[axis] = 1.0;
                ray.cut(normal, -lower[axis]);
                ray.cut(-normal, upper[axis]);
            }
            ray.cut(farPlane.normal, farPlane.offset);
            for (const Plane& plane : planes) ray.cut(plane.normal, plane.offset + widening);
            if (!(ray.to > ray.from) || !std::isfinite(ray.to)) continue;
            const bool isEven = view.orthographic;
            const double first = isEven ? ray.from : measure(ray.from), last = isEven ? ray.to : measure(ray.to);
            for (int i = 0; i < kPlacesOnRay; ++i) {
                const double value = first + (last - first) * (i + 0.5) / kPlacesOnRay;
                const double depth = isEven ? value : depthAt(value);
                places.push_back({ray.origin + depth * ray.direction, isEven ? 1.0 : std::max(depth, leastDepth),
                                  (last - first) / kPlacesOnRay * 0.25 * size.x * size.y});
            }
        }
    return places;
}

}  // namespace umbriel
