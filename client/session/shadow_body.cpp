#include "client/session/shadow_body.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "client/session/convex_body.h"
#include "client/session/seen_places.h"
#include "common/math/projection.h"
#include "common/math/rotation.h"

namespace umbriel {

namespace {

// Texels around what must be covered: normal offset and rounding need less than 1.5 on each side, snapping 1.
constexpr double kBorderTexels = 4.0;
constexpr std::uint32_t kSmallestSnapped = 16;

// An interval on the map, in the map's plane.
struct Span {
    double lower = std::numeric_limits<double>::infinity();
    double upper = -std::numeric_limits<double>::infinity();

    void include(double value) {
        lower = std::min(lower, value);
        upper = std::max(upper, value);
    }
    bool empty() const { return !(lower <= upper); }
    double length() const { return upper - lower; }
    double middle() const { return 0.5 * (lower + upper); }
};

// Widened by the border, to a side in steps of 2^(1/8), its lower end on a whole texel. smallest guards a span without
// extent (a flat scene seen edge-on).
Span snapped(const Span& covered, const ShadowFitRequest& request, double smallest) {
    const double wanted = std::max(covered.length(), smallest) / (1.0 - borderShare(request));
    const double side = std::exp2(std::ceil(8.0 * std::log2(wanted)) / 8.0);
    double lower = covered.middle() - 0.5 * side;
    const double texel = side / request.mapSize;
    // Beyond 2^50 texels from the origin the grid has no digits left.
    if (request.mapSize >= kSmallestSnapped && std::abs(lower) < texel * 0x1p50)
        lower = std::floor(lower / texel) * texel;
    return {lower, lower + side};
}

Span bordered(const Span& covered, const ShadowFitRequest& request, double smallest) {
    const double side = std::max(covered.length(), smallest) / (1.0 - borderShare(request));
    return {covered.middle() - 0.5 * side, covered.middle() + 0.5 * side};
}

void setBiases(ShadowFit& fit, const ShadowFitRequest& request) {
    // A slope bias given by hand replaces the automatic normal offset: both together would move shadows twice.
    const bool automaticSlope = !(request.offFactor >= 0.0f);
    fit.slopeBias = automaticSlope ? 0.0f : request.offFactor;
    fit.normalOffset = automaticSlope ? kNormalOffset : 0.0f;
    fit.constantBias = request.offBias >= 0.0f ? request.offBias : kConstantBias;
}

// x is the map's up vector, so that the common sun straight overhead is nowhere near the singular direction (as in
// Filament); a box aligned with the world's axes is then aligned with the map, too.
std::optional<glm::dmat3> worldFromLightOf(const glm::dvec3& directionWorld) {
    return rotationLookingAlong(directionWorld, {1.0, 0.0, 0.0});
}

glm::dvec3 axisOf(const View& view) {
    return -glm::dvec3(view.viewFromWorld[0][2], view.viewFromWorld[1][2], view.viewFromWorld[2][2]);
}

// The part of the scene's box, or of what view i sees of it, within that view, relative to its eye. The far plane of an
// infinite view has no normal and cuts nothing, which the box makes good.
std::vector<glm::dvec3> seenBody(const Box3d& sceneBounds, std::span<const View> views, std::size_t i,
                                 std::span<const ReceiverRange> receivers, std::span<const Plane> planes = {}) {
    const View& view = views[i];
    if (!receivers.empty() && receivers[i].boundsWorld.empty()) return {};
    ConvexBody body(receivers.empty() ? sceneBounds : receivers[i].boundsWorld, view.eyeWorld);
    for (const Plane& plane : frustumOf(view.clipFromView * glm::dmat4(view.viewFromWorld)).planes)
        if (plane.normal != glm::dvec3(0.0)) body.cut(plane);
    if (!receivers.empty()) {
        // Rounding: what lies on the very plane must not be lost.
        const double slack = 1e-9 * std::abs(receivers[i].farthest);
        body.cut({axisOf(view), -(receivers[i].nearest - slack)});
        body.cut({-axisOf(view), receivers[i].farthest + slack});
    }
    for (const Plane& plane : planes) body.cut(plane);
    return body.corners();
}

// Adds the corners of what view i sees, and places in it. planes: of the light, relative to that view's eye.
// inLight: from relative to the eye to the light's frame.
template <class InLight>
void addSeen(LightBody& body, const Box3d& sceneBounds, std::span<const View> views, std::size_t i,
             std::span<const ReceiverRange> receivers, std::vector<Plane> planes, const InLight& inLight) {
    const View& view = views[i];
    double farthest = 0.0;
    const std::vector<glm::dvec3> corners = seenBody(sceneBounds, views, i, receivers, planes);
    for (const glm::dvec3& corner : corners) {
        body.points.push_back(inLight(corner));
        farthest = std::max(farthest, glm::dot(corner, axisOf(view)));
    }
    if (!(farthest > 0.0)) return;
    if (!receivers.empty()) {
        planes.push_back({axisOf(view), -receivers[i].nearest});
        planes.push_back({-axisOf(view), receivers[i].farthest});
    }
    for (const SeenPlace& place : seenPlaces(view, receivers.empty() ? sceneBounds : receivers[i].boundsWorld, corners,
                                             planes, kNearShare * farthest))
        body.places.push_back({inLight(place.relative), place.depth, place.weight});
}

void setViews(LightBody& body, std::span<const View> views) {
    if (views.empty()) return;
    glm::dvec3 axis(0.0), eye(0.0);
    for (const View& view : views) {
        axis += axisOf(view) / static_cast<double>(views.size());
        eye += (view.eyeWorld - body.originWorld) / static_cast<double>(views.size());
    }
    body.axisLight = axis * body.worldFromLight;
    body.eyeLight = eye * body.worldFromLight;
}

}  // namespace

double borderShare(const ShadowFitRequest& request) {
    return std::min((kBorderTexels + request.borderTexels) / request.mapSize, 0.5);
}

bool isAffine(const glm::dmat3& mapFromAcross) {
    return mapFromAcross[0][2] == 0.0 && mapFromAcross[1][2] == 0.0;
}

std::optional<LightBody> directionalBody(const glm::dvec3& directionWorld, const Box3d& sceneBounds,
                                         std::span<const View> views, ShadowFitMode fit,
                                         std::span<const ReceiverRange> receivers) {
    const auto worldFromLight = worldFromLightOf(directionWorld);
    if (sceneBounds.empty() || !worldFromLight) return std::nullopt;
    LightBody body;
    body.worldFromLight = *worldFromLight;
    Span depth;
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 cornerLight = sceneBounds.corner(i) * *worldFromLight;
        depth.include(-cornerLight.z);
        if (fit == ShadowFitMode::Scene) body.points.push_back(cornerLight);
    }
    if (fit != ShadowFitMode::Scene) {
        setViews(body, views);
        for (std::size_t i = 0; i < views.size(); ++i)
            addSeen(body, sceneBounds, views, i, receivers, {},
                    [&](const glm::dvec3& relative) { return (relative + views[i].eyeWorld) * *worldFromLight; });
    }
    if (body.points.empty()) return std::nullopt;
    // A millionth of the scene, and what double can tell apart at its place; then for a single point at the origin.
    const double reach = std::max(glm::length(sceneBounds.lower), glm::length(sceneBounds.upper));
    body.smallest = std::max({1e-6 * sceneBounds.diagonal(), 1e-12 * reach, 1e-30});
    body.nearDistance = depth.lower;
    body.farDistance = depth.upper;
    return body;
}

std::optional<LightBody> spotBody(const glm::dvec3& positionWorld, const glm::dvec3& directionWorld, double outerAngle,
                                  double range, const Box3d& sceneBounds, std::span<const View> views,
                                  ShadowFitMode fit, std::span<const ReceiverRange> receivers) {
    const auto worldFromLight = worldFromLightOf(directionWorld);
    if (sceneBounds.empty() || !worldFromLight || !isFinite(positionWorld) || !(outerAngle > 0.0)) return std::nullopt;
    Span depth;
    for (int i = 0; i < 8; ++i) depth.include(-((sceneBounds.corner(i) - positionWorld) * *worldFromLight).z);
    LightBody result;
    result.perspective = true;
    result.worldFromLight = *worldFromLight;
    result.originWorld = positionWorld;
    double farDistance = depth.upper;
    if (range > 0.0) farDistance = std::min(farDistance, range);
    if (!(farDistance > 0.0)) return std::nullopt;
    // With reversed depth a near plane close to the light costs nothing far away; casters nearer than 1/50000 of the
    // way are the lamp itself.
    farDistance *= 1.001;
    result.farDistance = farDistance;
    result.nearDistance = std::min(std::max(0.9 * depth.lower, 2e-5 * farDistance), 0.5 * farDistance);
    result.rim = std::tan(std::min(outerAngle, 0.5 * kMaxShadowFov));
    result.smallest = 1e-6 * result.rim;

    // The cone's pyramid, relative to the light.
    const glm::dmat3& axes = result.worldFromLight;
    std::vector<Plane> pyramid = {{-axes[2], -result.nearDistance}, {axes[2], farDistance}};
    for (const double side : {-1.0, 1.0})
        for (const glm::dvec3& axis : {axes[0], axes[1]})
            pyramid.push_back({glm::normalize(side * axis - result.rim * axes[2]), 0.0});

    const auto pyramidAt = [&](const glm::dvec3& originRelative) {
        std::vector<Plane> planes = pyramid;
        for (Plane& plane : planes) plane.offset += glm::dot(plane.normal, originRelative);
        return planes;
    };
    const auto inFront = [&](const glm::dvec3& relativeToLight) {
        glm::dvec3 pointLight = relativeToLight * axes;
        pointLight.z = std::min(pointLight.z, -result.nearDistance);
        return pointLight;
    };
    if (fit == ShadowFitMode::Scene) {
        ConvexBody body(sceneBounds, positionWorld);
        for (const Plane& plane : pyramid) body.cut(plane);
        for (const glm::dvec3& corner : body.corners()) result.points.push_back(inFront(corner));
    } else {
        setViews(result, views);
        for (std::size_t i = 0; i < views.size(); ++i) {
            const glm::dvec3 eyeRelative = views[i].eyeWorld - positionWorld;
            addSeen(result, sceneBounds, views, i, receivers, pyramidAt(eyeRelative),
                    [&](const glm::dvec3& relative) { return inFront(relative + eyeRelative); });
        }
    }
    if (result.points.empty()) return std::nullopt;
    return result;
}

std::optional<ShadowFit> composeFit(const LightBody& body, glm::dmat3 h, const ShadowFitRequest& request) {
    ShadowFit fit;
    fit.mode = request.mode;
    fit.mapSize = request.mapSize;
    fit.perspective = body.perspective;
    fit.worldFromLight = body.worldFromLight;
    fit.positionWorld = body.perspective ? body.originWorld : glm::dvec3(0.0);
    const glm::dmat3 acrossFromMap = glm::inverse(h);
    // w over that of the unwarped map is 1 / (row 3 of the inverse * m): at least 1 on the whole map, so that depths
    // stay below 1, and no more.
    double largest = 0.0, smallestUnwarp = std::numeric_limits<double>::infinity();
    for (const double cx : {-1.0, 1.0})
        for (const double cy : {-1.0, 1.0}) {
            const double unwarp = (acrossFromMap * glm::dvec3(cx, cy, 1.0)).z;
            largest = std::max(largest, unwarp);
            smallestUnwarp = std::min(smallestUnwarp, unwarp);
        }
    // A border that reaches over the warp's horizon cannot be drawn.
    if (!(smallestUnwarp > 0.0)) return std::nullopt;
    if (!isAffine(h)) h *= largest;

    // The largest texel: sides of the map's corners, where extremes lie.
    const glm::dmat3 across = glm::inverse(h);
    for (const double cx : {-1.0, 1.0})
        for (const double cy : {-1.0, 1.0}) {
            const glm::dvec3 t = across * glm::dvec3(cx, cy, 1.0);
            for (int side = 0; side < 2; ++side) {
                const glm::dvec2 moved =
                    (glm::dvec2(across[side]) * t.z - glm::dvec2(t) * across[side].z) / (t.z * t.z);
                fit.texelSize = std::max(fit.texelSize, glm::length(moved) * 2.0 / request.mapSize);
            }
        }

    glm::dmat4 clipFromLight(0.0);
    double nearest = body.nearDistance, farthest = body.farDistance;
    if (!body.perspective) {
        // Casters on the very face of the box must not be clipped by rounding, receivers moved by the biases not
        // either.
        const double margin = 1e-3 * (farthest - nearest) + 2.0 * fit.texelSize;
        nearest -= margin;
        farthest += margin;
    }
    fit.depthRange = farthest - nearest;
    const int rows[] = {0, 1, 3};
    for (int i = 0; i < 3; ++i) {
        clipFromLight[0][rows[i]] = h[0][i];
        clipFromLight[1][rows[i]] = h[1][i];
        if (body.perspective)
            clipFromLight[2][rows[i]] = -h[2][i];
        else
            clipFromLight[3][rows[i]] = h[2][i];
    }
    if (body.perspective) {
        clipFromLight[2][2] = nearest / fit.depthRange;
        clipFromLight[3][2] = farthest * nearest / fit.depthRange;
    } else {
        clipFromLight[2][2] = 1.0 / fit.depthRange;
        clipFromLight[3][2] = farthest / fit.depthRange;
    }
    glm::dmat4 lightFromWorld(glm::transpose(body.worldFromLight));
    lightFromWorld[3] = glm::dvec4(-(body.originWorld * body.worldFromLight), 1.0);
    fit.clipFromWorld = clipFromLight * lightFromWorld;
    fit.filter = request.filter;
    setBiases(fit, request);
    if (!isFinite(fit.clipFromWorld) || !(fit.texelSize > 0.0)) return std::nullopt;
    return fit;
}

std::optional<ShadowFit> fitMap(const LightBody& body, const glm::dmat3& mapFromAcross,
                                const ShadowFitRequest& request) {
    const bool affine = isAffine(mapFromAcross);
    Span x, y;
    for (const glm::dvec3& point : body.points) {
        const glm::dvec3 mapped = mapFromAcross * glm::dvec3(body.across(point), 1.0);
        if (!(mapped.z > 0.0)) return std::nullopt;
        x.include(mapped.x / mapped.z);
        y.include(mapped.y / mapped.z);
    }
    const double smallest = affine ? body.smallest : std::max(1e-6 * std::max(x.length(), y.length()), 1e-30);
    const auto placed = [&](const Span& covered) {
        const Span span = affine ? snapped(covered, request, smallest) : bordered(covered, request, smallest);
        if (!affine || body.rim <= 0.0) return span;
        const double widened = body.rim / (1.0 - borderShare(request));
        return span.length() < 2.0 * widened ? span : Span{-widened, widened};
    };
    x = placed(x);
    y = placed(y);

    // Map coordinates of [-1, 1] over x and y.
    glm::dmat3 clipFromMap(1.0);
    clipFromMap[0][0] = 2.0 / x.length();
    clipFromMap[1][1] = 2.0 / y.length();
    clipFromMap[2][0] = -2.0 * x.middle() / x.length();
    clipFromMap[2][1] = -2.0 * y.middle() / y.length();
    return composeFit(body, mapFromAcross == glm::dmat3(1.0) ? clipFromMap : clipFromMap * mapFromAcross, request);
}

}  // namespace umbriel
