#include "server/draw/facing.h"

#include <algorithm>
#include <cmath>

#include "server/shadow/map_module.h"

namespace umbriel {
namespace {

constexpr double kUnit = 1.0 / 16777216.0;  // half a unit in the last place of a float that is 1
// A product of a matrix and a point: elements are rounded, their products, and up to three sums.
constexpr double kProductRounding = 5.0 * kUnit;
// How far, in pixels: rasterisers round x and y to 1/256 of a pixel; a quotient, a product and a sum come before.
double windowRounding(std::int32_t pixels) {
    return std::sqrt(2.0) * (0.502 / 256.0 + 8.0 * kUnit * pixels);
}

// What is that far inside of the window, no rounding moves out of it.
constexpr double kSafePixels = 0.05;

glm::dvec4 row(const glm::dmat4& matrix, int index) {
    return {matrix[0][index], matrix[1][index], matrix[2][index], matrix[3][index]};
}

glm::dmat4 fromRows(const glm::dvec4& x, const glm::dvec4& y, const glm::dvec4& w) {
    return glm::transpose(glm::dmat4(x, y, glm::dvec4(0.0), w));
}

// By axis the farthest place of the box from its origin; and 1.
glm::dvec4 reachOf(const Box& box) {
    return {glm::dvec3(glm::max(glm::abs(box.minimum), glm::abs(box.maximum))), 1.0};
}

// The largest length that a a + b b can have where (a, b) has length 1.
double stretchOf(const glm::dvec3& a, const glm::dvec3& b) {
    const double difference = 0.5 * (glm::dot(a, a) - glm::dot(b, b));
    const double mean = 0.5 * (glm::dot(a, a) + glm::dot(b, b));
    return std::sqrt(mean + std::hypot(difference, glm::dot(a, b)));
}

}  // namespace

NormalCone normalConeOf(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions) {
    NormalCone cone;
    std::vector<glm::dvec3> normals;
    normals.reserve(indices.size() / 3);
    double altitude = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
        const glm::vec3& a = positions[indices[i]];
        const glm::vec3& b = positions[indices[i + 1]];
        const glm::vec3& c = positions[indices[i + 2]];
        if (a == b || b == c || c == a) continue;
        const glm::dvec3 ab = glm::dvec3(b) - glm::dvec3(a);
        const glm::dvec3 ac = glm::dvec3(c) - glm::dvec3(a);
        const glm::dvec3 normal = glm::cross(ab, ac);
        const double area = glm::length(normal);
        if (!(area > 0.0)) return cone;
        altitude = std::min(altitude, area / std::max({glm::length(ab), glm::length(ac), glm::length(ac - ab)}));
        normals.push_back(normal / area);
    }
    if (normals.empty()) return cone;
    glm::dvec3 sum(0.0);
    glm::dvec3 lower = normals.front();
    glm::dvec3 upper = lower;
    for (const glm::dvec3& normal : normals) {
        sum += normal;
        lower = glm::min(lower, normal);
        upper = glm::max(upper, normal);
    }
    for (const glm::dvec3& middle : {sum, lower + upper}) {
        const double length = glm::length(middle);
        if (!(length > 1e-6)) continue;
        const glm::vec3 axis(middle / length);
        double sine = 0.0;
        for (const glm::dvec3& normal : normals)
            sine = glm::dot(normal, glm::dvec3(axis)) > 0.0
                       ? std::max(sine, glm::length(glm::cross(normal, glm::dvec3(axis))))
                       : 2.0;
        // Also covers that the rounded axis is not quite a unit.
        const auto rounded = static_cast<float>(sine * (1.0 + 1e-6) + 2e-6);
        if (rounded < cone.sine) cone = {axis, rounded, static_cast<float>(altitude * (1.0 - 1e-6))};
    }
    return cone;
}

FacingTest FacingTest::of(const glm::dmat4& windowFromObject, const glm::dvec3& rounding, double pixels,
                          bool isMirrored) {
    FacingTest test;
    const glm::dvec4 x = row(windowFromObject, 0);
    const glm::dvec4 y = row(windowFromObject, 1);
    const glm::dvec4 w = row(windowFromObject, 3);
    const bool isParallel = glm::dvec3(w) == glm::dvec3(0.0);
    glm::dvec3 towards = glm::cross(glm::dvec3(x), glm::dvec3(y));  // the side that sees triangles counter-clockwise
    towards /= glm::length(towards);
    const glm::dvec3 third = isParallel ? towards : glm::dvec3(w);
    const glm::dmat3 linear = glm::transpose(glm::dmat3(glm::dvec3(x), glm::dvec3(y), third));
    const glm::dmat3 inverse = glm::inverse(linear);
    const glm::dvec3 moved(glm::length(inverse[0]), glm::length(inverse[1]),
                           isParallel ? 0.0 : glm::length(inverse[2]));
    const double movedPerPixel = stretchOf(inverse[0], inverse[1]);
    if (isParallel) {
        test._eye = isMirrored ? towards : -towards;
        test._moved = glm::dot(moved, rounding) + movedPerPixel * pixels * std::abs(w.w);
    } else {
        test._eye = -(inverse * glm::dvec3(x.w, y.w, w.w));
        test._moved = glm::dot(moved, rounding);
        test._movedPerDistance = movedPerPixel * pixels * glm::length(glm::dvec3(w));
        // Corners in order, seen from the eye, are wound like their determinant, times this one's sign.
        if (!((glm::determinant(linear) < 0.0) != isMirrored)) return {};
    }
    const double all = glm::length(test._eye) + test._moved + test._movedPerDistance;
    if (!std::isfinite(all)) return {};
    test._kind = isParallel ? Kind::Direction : Kind::Eye;
    return test;
}

FacingTest FacingTest::ofView(const View& view, const glm::dmat4& relativeFromObject, const Box& box, bool isMirrored) {
    if (view.unwrapped || box.empty()) return {};
    const glm::dmat4 clipFromRelative = clipFromRelativeOf(view);
    const glm::dvec4 x = row(clipFromRelative, 0) * (0.5 * view.region.width);
    const glm::dvec4 y = row(clipFromRelative, 1) * (0.5 * view.region.height);
    const glm::dvec4 w = row(clipFromRelative, 3);
    // No coordinate of a corner is larger, nor any sum on the way there. Both products round.
    const glm::dvec4 objectReach = reachOf(box);
    glm::dvec4 reach(0.0, 0.0, 0.0, 1.0);
    for (int i = 0; i < 3; ++i) reach[i] = glm::dot(glm::abs(row(relativeFromObject, i)), objectReach);
    const auto rounded = [&](const glm::dvec4& r) { return 2.0 * kProductRounding * glm::dot(glm::abs(r), reach); };
    FacingTest test = of(fromRows(x, y, w) * relativeFromObject, {rounded(x), rounded(y), rounded(w)},
                         windowRounding(std::max(view.region.width, view.region.height)), isMirrored);
    test.clip(ObjectFrustum(tileFrustum(view, view.region, -kSafePixels), relativeFromObject), box);
    return test;
}

void FacingTest::clip(const ObjectFrustum& unclipped, const Box& box) {
    _unclipped = unclipped;
    _isClipped = unclipped.classify(box) != Overlap::Inside;
}

FacingTest FacingTest::ofMap(const ShadowFit& fit, const glm::dmat4& worldFromObject, const Box& box, bool isMirrored) {
    if (fit.mapSize == 0 || fit.perspective || fit.shape != ShadowShape::Single || box.empty()) return {};
    if (isWarped(fit)) return ofWarpedMap(fit, worldFromObject, box, isMirrored);
    const glm::dmat4 clipFromObject = fit.clipFromWorld * worldFromObject;
    const glm::dvec4 x = row(clipFromObject, 0);
    const glm::dvec4 y = row(clipFromObject, 1);
    const double half = 0.5 * fit.mapSize;
    const auto rounded = [&](const glm::dvec4& r) {
        return half * kProductRounding * glm::dot(glm::abs(r), reachOf(box));
    };
    const double w = fit.clipFromWorld[3][3];
    FacingTest test = of(fromRows(x * half, y * half, {0.0, 0.0, 0.0, w}), {rounded(x), rounded(y), 0.0},
                         windowRounding(static_cast<std::int32_t>(fit.mapSize)), isMirrored);
    // Only across: depths beyond the map's are clamped.
    const glm::dvec4 side(0.0, 0.0, 0.0, (1.0 - kSafePixels / half) * w);
    const glm::dvec4 everything(0.0, 0.0, 0.0, 1.0);
    ObjectFrustum unclipped;
    unclipped.planes = {side + x, side - x, side + y, side - y, everything, everything};
    test.clip(unclipped, box);
    return test;
}

FacingTest FacingTest::ofWarpedMap(const ShadowFit& fit, const glm::dmat4& worldFromObject, const Box& box,
                                   bool isMirrored) {
    const glm::dmat4 clipFromObject = fit.clipFromWorld * worldFromObject;
    const glm::dvec4 x = row(clipFromObject, 0);
    const glm::dvec4 y = row(clipFromObject, 1);
    const glm::dvec4 w = row(clipFromObject, 3);
    // Along the light none of the three changes; which side it is on, the middle of the map says for all of it.
    const glm::dvec3 towards = glm::normalize(glm::cross(glm::dvec3(x), glm::dvec3(y)));
    FacingTest test;
    test._eye = isMirrored ? towards : -towards;
    const glm::dmat3 across = acrossFromMap(fit, glm::dvec3(0.0));
    const auto rounded = [&](const glm::dvec4& r) { return kProductRounding * glm::dot(glm::abs(r), reachOf(box)); };
    const double pixels = windowRounding(static_cast<std::int32_t>(fit.mapSize)) * 2.0 / fit.mapSize;
    // The largest texels lie at a corner, where w is the least.
    for (const glm::dvec2& at : {glm::dvec2(-1, -1), {1, -1}, {-1, 1}, {1, 1}}) {
        const double atW = 1.0 / (across * glm::dvec3(at, 1.0)).z;
        if (!(atW > 0.0)) return {};
        const glm::dvec3 perX = (glm::dvec3(x) - at.x * glm::dvec3(w)) / atW;
        const glm::dvec3 perY = (glm::dvec3(y) - at.y * glm::dvec3(w)) / atW;
        const glm::dmat3 inverse = glm::inverse(glm::transpose(glm::dmat3(perX, perY, towards)));
        const double byProducts = std::hypot(rounded(x) + rounded(w), rounded(y) + rounded(w)) / atW;
        // Of its own, a texel's longest diagonal may be longer within the map, though not by much.
        test._moved = std::max(test._moved, 1.1 * stretchOf(inverse[0], inverse[1]) * (pixels + byProducts));
    }
    if (!std::isfinite(glm::length(test._eye) + test._moved)) return {};
    test._kind = Kind::Direction;
    const glm::dvec4 side = w * (1.0 - kSafePixels * 2.0 / fit.mapSize);
    const glm::dvec4 everything(0.0, 0.0, 0.0, 1.0);
    ObjectFrustum unclipped;
    unclipped.planes = {side + x, side - x, side + y, side - y, everything, everything};
    test.clip(unclipped, box);
    return test;
}

bool FacingTest::isTurnedAway(const Box& box, const NormalCone& normals) const {
    if (_kind == Kind::Never || !(normals.sine < 1.0f)) return false;
    const glm::dvec3 axis(normals.axis);
    const double altitude = normals.altitude;
    // With corners moved by up to e a triangle of smallest altitude h and longest side l, all within D of an eye at d
    // behind its plane, keeps the sign of its corners' determinant, l h d, while that is more than 3 l e D + 3 D e^2 +
    // e^3: with 8 e <= h, while d is more than 3.41 e D / h. From an axis to normals around it a sine of s + m leaves
    // one of sin(m), which is at least 0.84 m.
    constexpr double kMargin = 4.1;
    const glm::dvec3 half = 0.5 * (glm::dvec3(box.maximum) - glm::dvec3(box.minimum));
    const glm::dvec3 toBox = _kind == Kind::Eye ? box.centre() - _eye : _eye;
    double nearest = glm::dot(toBox, axis);
    double farthest = 1.0;
    if (_kind == Kind::Eye) {
        nearest -= glm::dot(glm::abs(axis), half);
        if (!(nearest > 0.0)) return false;
        farthest = glm::length(toBox) + glm::length(half);
    }
    const double moved = _moved + _movedPerDistance * farthest;
    if (!(8.0 * moved <= altitude)) return false;
    if (!(nearest >= (double{normals.sine} + kMargin * moved / altitude) * farthest)) return false;
    return !_isClipped || _unclipped.classify(box) == Overlap::Inside;
}

}  // namespace umbriel
