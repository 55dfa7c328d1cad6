#include "server/draw/culling.h"

namespace umbriel {
namespace {

glm::dvec4 row(const glm::dmat4& matrix, int index) {
    return {matrix[0][index], matrix[1][index], matrix[2][index], matrix[3][index]};
}

// Corner i of a box takes the maximum of axis k where bit k of i is set.
constexpr int kBoxFaces[6][4] = {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};

// A face of a box that planes have cut. Rounding may bend it, so that a plane adds a corner for every edge it cuts.
struct FacePolygon {
    std::array<glm::dvec3, 32> points;
    std::ptrdiff_t size = 0;

    void add(const glm::dvec3& point) {
        if (size < static_cast<std::ptrdiff_t>(points.size())) points[static_cast<std::size_t>(size++)] = point;
    }
};

// What lies on the inner side of a plane.
FacePolygon clipped(const FacePolygon& polygon, const Plane& plane) {
    FacePolygon inner;
    for (std::ptrdiff_t i = 0; i < polygon.size; ++i) {
        const glm::dvec3& a = polygon.points[static_cast<std::size_t>(i)];
        const glm::dvec3& b = polygon.points[static_cast<std::size_t>((i + 1) % polygon.size)];
        const double da = glm::dot(glm::dvec3(plane), a) + plane.w;
        const double db = glm::dot(glm::dvec3(plane), b) + plane.w;
        if (da >= 0.0) inner.add(a);
        if ((da >= 0.0) != (db >= 0.0)) inner.add(a + (b - a) * (da / (da - db)));
    }
    return inner;
}

}  // namespace

std::array<glm::dvec3, 8> Box::corners() const {
    std::array<glm::dvec3, 8> result;
    for (int i = 0; i < 8; ++i)
        result[i] = {(i & 1) ? maximum.x : minimum.x, (i & 2) ? maximum.y : minimum.y, (i & 4) ? maximum.z : minimum.z};
    return result;
}

glm::dmat4 clipFromRelativeOf(const View& view) {
    return view.clipFromView * glm::dmat4(view.viewFromWorld);
}

PixelRect pixelsOf(const View& view, const Box& box, const glm::dmat4& relativeFromObject, double marginPixels) {
    if (box.empty()) return {};
    const glm::dmat4 clipFromObject = clipFromRelativeOf(view) * relativeFromObject;
    glm::dvec2 lower(std::numeric_limits<double>::infinity());
    glm::dvec2 upper = -lower;
    for (const glm::dvec3& corner : box.corners()) {
        const glm::dvec4 clip = clipFromObject * glm::dvec4(corner, 1.0);
        // Beside the eye places run away to infinity, behind it they come back from the other side.
        if (!(clip.w > 1e-6 * glm::length(glm::dvec2(clip)))) return view.region;
        const glm::dvec2 place = glm::dvec2(clip) / clip.w;
        lower = glm::min(lower, place);
        upper = glm::max(upper, place);
    }
    const auto first = [&](double ndc, std::int32_t origin, std::int32_t size) {
        return static_cast<std::int32_t>(
            std::floor(origin + (std::clamp(ndc, -1.0, 1.0) + 1.0) * 0.5 * size - marginPixels));
    };
    const auto last = [&](double ndc, std::int32_t origin, std::int32_t size) {
        return static_cast<std::int32_t>(
            std::ceil(origin + (std::clamp(ndc, -1.0, 1.0) + 1.0) * 0.5 * size + marginPixels));
    };
    const std::int32_t x = first(lower.x, view.region.x, view.region.width);
    const std::int32_t y = first(lower.y, view.region.y, view.region.height);
    return intersect(view.region, {x, y, last(upper.x, view.region.x, view.region.width) - x,
                                   last(upper.y, view.region.y, view.region.height) - y});
}

Frustum tileFrustum(const View& view, const PixelRect& pixels, double marginPixels) {
    // Where a surface is unwrapped, its place in the world does not say.
    if (view.unwrapped) {
        Frustum everything{};
        everything.planes.fill({0.0, 0.0, 0.0, 1.0});
        return everything;
    }
    const glm::dmat4 clipFromRelative = clipFromRelativeOf(view);
    const glm::dvec4 x = row(clipFromRelative, 0);
    const glm::dvec4 y = row(clipFromRelative, 1);
    const glm::dvec4 z = row(clipFromRelative, 2);
    const glm::dvec4 w = row(clipFromRelative, 3);
    const auto ndc = [](double pixel, std::int32_t origin, std::int32_t size) {
        return 2.0 * (pixel - origin) / size - 1.0;
    };
    const double left = ndc(pixels.x - marginPixels, view.region.x, view.region.width);
    const double right = ndc(pixels.x + pixels.width + marginPixels, view.region.x, view.region.width);
    const double bottom = ndc(pixels.y - marginPixels, view.region.y, view.region.height);
    const double top = ndc(pixels.y + pixels.height + marginPixels, view.region.y, view.region.height);
    Frustum frustum;
    // Reversed depth: z = w at the near plane, 0 at the far one.
    frustum.planes = {x - left * w, right * w - x, y - bottom * w, top * w - y, w - z, z};
    const glm::dmat4 relativeFromClip = glm::inverse(clipFromRelative);
    const glm::dvec2 corners[4] = {{left, bottom}, {right, bottom}, {right, top}, {left, top}};
    for (int i = 0; i < 4; ++i) {
        const glm::dvec4 point = relativeFromClip * glm::dvec4(corners[i], 1.0, 1.0);
        frustum.nearCorners[i] = glm::dvec3(point) / point.w;
    }
    return frustum;
}

ObjectFrustum::ObjectFrustum(const Frustum& frustum, const glm::dmat4& relativeFromObject) {
    for (std::size_t i = 0; i < planes.size(); ++i) planes[i] = frustum.planes[i] * relativeFromObject;
}

Overlap ObjectFrustum::classify(const Box& box) const {
    if (box.empty()) return Overlap::Outside;
    const glm::dvec3 minimum(box.minimum);
    const glm::dvec3 maximum(box.maximum);
    bool inside = true;
    for (const Plane& plane : planes) {
        double farthest = plane.w;
        double nearest = plane.w;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = plane[axis] * minimum[axis];
            const double b = plane[axis] * maximum[axis];
            farthest += a > b ? a : b;
            nearest += a > b ? b : a;
        }
        if (farthest < 0.0) return Overlap::Outside;
        inside = inside && nearest >= 0.0;
    }
    return inside ? Overlap::Inside : Overlap::Partial;
}

bool ObjectFrustum::isBeyondNear(const Box& box) const {
    if (box.empty()) return false;
    const Plane& plane = planes[4];
    double nearest = plane.w;
    for (int axis = 0; axis < 3; ++axis)
        nearest += std::min(plane[axis] * double{box.minimum[axis]}, plane[axis] * double{box.maximum[axis]});
    return nearest >= 0.0;
}

void hullOfIntersection(const Box& box, const glm::dmat4& relativeFromObject, const Frustum& frustum,
                        std::vector<glm::dvec3>& points) {
    points.clear();
    std::array<glm::dvec3, 8> corners = box.corners();
    for (glm::dvec3& corner : corners) corner = glm::dvec3(relativeFromObject * glm::dvec4(corner, 1.0));
    // The planes that cut it.
    std::array<bool, 6> isCut{};
    for (std::size_t i = 0; i < isCut.size(); ++i) {
        const Plane& plane = frustum.planes[i];
        std::size_t inside = 0;
        for (const glm::dvec3& corner : corners) inside += glm::dot(glm::dvec3(plane), corner) + plane.w >= 0.0;
        if (inside == 0) return;
        isCut[i] = inside < corners.size();
    }
    for (const auto& face : kBoxFaces) {
        FacePolygon polygon;
        for (const int corner : face) polygon.add(corners[static_cast<std::size_t>(corner)]);
        for (std::size_t i = 0; i < isCut.size() && polygon.size > 0; ++i)
            if (isCut[i]) polygon = clipped(polygon, frustum.planes[i]);
        points.insert(points.end(), polygon.points.begin(), polygon.points.begin() + polygon.size);
    }
    if (!isCut[4]) return;
    // A corner of the frustum inside the box is a vertex of the intersection that no face of the box shows.
    const glm::dmat4 objectFromRelative = glm::inverse(relativeFromObject);
    for (const glm::dvec3& corner : frustum.nearCorners) {
        const glm::dvec3 object(objectFromRelative * glm::dvec4(corner, 1.0));
        if (glm::all(glm::greaterThanEqual(object, glm::dvec3(box.minimum))) &&
            glm::all(glm::lessThanEqual(object, glm::dvec3(box.maximum))))
            points.push_back(corner);
    }
}

}  // namespace umbriel
