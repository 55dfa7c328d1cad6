#include "client/session/receiver_range.h"

#include <algorithm>
#include <limits>

#include "client/session/convex_body.h"

namespace umbriel {

std::vector<ReceiverRange> receiverRanges(std::span<const Box3d> parts, std::span<const View> views) {
    std::vector<ReceiverRange> ranges;
    for (const View& view : views) {
        std::vector<Plane> planes;
        for (const Plane& plane : frustumOf(view.clipFromView * glm::dmat4(view.viewFromWorld)).planes)
            if (plane.normal != glm::dvec3(0.0)) planes.push_back(plane);
        const glm::dvec3 axis =
            -glm::dvec3(view.viewFromWorld[0][2], view.viewFromWorld[1][2], view.viewFromWorld[2][2]);
        ReceiverRange range;
        range.nearest = std::numeric_limits<double>::infinity();
        range.farthest = -range.nearest;
        const auto include = [&](const glm::dvec3& relative) {
            range.boundsWorld.include(relative + view.eyeWorld);
            range.nearest = std::min(range.nearest, glm::dot(relative, axis));
            range.farthest = std::max(range.farthest, glm::dot(relative, axis));
        };
        for (const Box3d& part : parts) {
            if (part.empty()) continue;
            const glm::dvec3 middle = part.centre() - view.eyeWorld, half = 0.5 * part.size();
            bool isOutside = false, isInside = true;
            for (const Plane& plane : planes) {
                const double here = glm::dot(plane.normal, middle) + plane.offset;
                const double reach = glm::dot(glm::abs(plane.normal), half);
                isOutside = isOutside || here < -reach;
                isInside = isInside && here > reach;
            }
            if (isOutside) continue;
            if (isInside) {
                for (int i = 0; i < 8; ++i) include(part.corner(i) - view.eyeWorld);
                continue;
            }
            ConvexBody body(part, view.eyeWorld);
            for (const Plane& plane : planes) body.cut(plane);
            for (const glm::dvec3& corner : body.corners()) include(corner);
        }
        if (range.boundsWorld.empty()) range = {};
        ranges.push_back(range);
    }
    return ranges;
}

}  // namespace umbriel
