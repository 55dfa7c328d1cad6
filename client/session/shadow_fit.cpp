#include "client/session/shadow_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "client/session/convex_body.h"
#include "common/math/projection.h"
#include "common/math/rotation.h"

namespace umbriel {

namespace {

// Texels around what must be covered: normal offset and rounding need less than 1.5 on each side, snapping 1.
constexpr double kBorderTexels = 4.0;
constexpr std::uint32_t kSmallestSnapped = 16;

// An interval on the map, in the map's plane: metres, or tangents for a perspective map.
struct Span {
    double lower = std::numeric_limits<double>::infinity();
    double upper = -std::numeric_limits<double>::infinity();

    void include(double value) {
        lower = std::min(lower, value);
        upper = std::max(upper, value);
    }
    bool empty() const { return !(lower <= upper); }
    double length() const { return upper - lower; }
};

// Widened by the border, to a side in steps of 2^(1/8), its lower end on a whole texel. smallest guards a span without
// extent (a flat scene seen edge-on).
Span snapped(const Span& covered, std::uint32_t mapSize, double smallest) {
    const double border = std::min(kBorderTexels / mapSize, 0.5);
    const double wanted = std::max(covered.length(), smallest) / (1.0 - border);
    const double side = std::exp2(std::ceil(8.0 * std::log2(wanted)) / 8.0);
    double lower = 0.5 * (covered.lower + covered.upper) - 0.5 * side;
    const double texel = side / mapSize;
    // Beyond 2^50 texels from the origin the grid has no digits left.
    if (mapSize >= kSmallestSnapped && std::abs(lower) < texel * 0x1p50) lower = std::floor(lower / texel) * texel;
    return {lower, lower + side};
}

// The part of the scene's box that the view sees, relative to its eye. The far plane of an infinite view has no normal
// and cuts nothing, which the box makes good.
ConvexBody seenBody(const Box3d& sceneBounds, const View& view) {
    ConvexBody body(sceneBounds, view.eyeWorld);
    for (const Plane& plane : frustumOf(view.clipFromView * glm::dmat4(view.viewFromWorld)).planes)
        if (plane.normal != glm::dvec3(0.0)) body.cut(plane);
    return body;
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
std::optional<glm::dmat3> lightFromWorldOf(const glm::dvec3& directionWorld) {
    const auto worldFromLight = rotationLookingAlong(directionWorld, {1.0, 0.0, 0.0});
    if (!worldFromLight) return std::nullopt;
    return glm::transpose(*worldFromLight);
}

std::string nameOf(const Aspect& aspect, const LightInEffect& light) {
    const Container* core = aspect.find(light.core);
    const std::string name = core ? core->name.get() : std::string();
    return name.empty() ? fmt::format("#{}", light.node.id.value) : fmt::format("\"{}\"", name);
}

}  // namespace

std::uint32_t resolveMapSize(std::uint32_t mapSize, PixelSize wall, std::uint32_t limit,
                             std::vector<std::string>& messages) {
    if (mapSize == 0) {
        const std::int32_t within = std::max(1, std::min(wall.width, wall.height));
        mapSize = std::bit_floor(static_cast<std::uint32_t>(within));
    }
    if (mapSize > limit) {
        messages.push_back(
            fmt::format("shadow maps of {} texels are larger than the limit: {} are used", mapSize, limit));
        mapSize = limit;
    }
    return mapSize;
}

std::optional<ShadowFit> fitDirectional(const glm::dvec3& directionWorld, const Box3d& sceneBounds,
                                        std::span<const View> views, const ShadowFitRequest& request) {
    const auto lightFromWorld = lightFromWorldOf(directionWorld);
    if (sceneBounds.empty() || !lightFromWorld) return std::nullopt;
    Span x, y, depth;
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 cornerLight = *lightFromWorld * sceneBounds.corner(i);
        depth.include(-cornerLight.z);
        if (request.fit == ShadowFitMode::Scene) {
            x.include(cornerLight.x);
            y.include(cornerLight.y);
        }
    }
    if (request.fit != ShadowFitMode::Scene)
        for (const View& view : views)
            for (const glm::dvec3& corner : seenBody(sceneBounds, view).corners()) {
                const glm::dvec3 cornerLight = *lightFromWorld * (corner + view.eyeWorld);
                x.include(cornerLight.x);
                y.include(cornerLight.y);
            }
    if (x.empty() || y.empty()) return std::nullopt;

    // A millionth of the scene, and what double can tell apart at its place; then for a single point at the origin.
    const double reach = std::max(glm::length(sceneBounds.lower), glm::length(sceneBounds.upper));
    const double smallest = std::max({1e-6 * sceneBounds.diagonal(), 1e-12 * reach, 1e-30});
    x = snapped(x, request.mapSize, smallest);
    y = snapped(y, request.mapSize, smallest);

    ShadowFit fit;
    fit.mode = ShadowMode::Standard;
    fit.mapSize = request.mapSize;
    fit.texelSize = std::max(x.length(), y.length()) / request.mapSize;
    // Casters on the very face of the box must not be clipped by rounding, receivers moved by the biases not either.
    const double margin = 1e-3 * depth.length() + 2.0 * fit.texelSize;
    fit.depthRange = depth.length() + 2.0 * margin;
    fit.clipFromWorld =
        reversedOrthographic(x.lower, x.upper, y.lower, y.upper, depth.lower - margin, depth.upper + margin) *
        glm::dmat4(*lightFromWorld);
    setBiases(fit, request);
    if (!isFinite(fit.clipFromWorld)) return std::nullopt;
    return fit;
}

std::optional<ShadowFit> fitSpot(const glm::dvec3& positionWorld, const glm::dvec3& directionWorld, double outerAngle,
                                 double range, const Box3d& sceneBounds, std::span<const View> views,
                                 const ShadowFitRequest& request) {
    const auto lightFromWorld = lightFromWorldOf(directionWorld);
    if (sceneBounds.empty() || !lightFromWorld || !isFinite(positionWorld) || !(outerAngle > 0.0)) return std::nullopt;
    Span depth;
    for (int i = 0; i < 8; ++i) depth.include(-(*lightFromWorld * (sceneBounds.corner(i) - positionWorld)).z);
    double farDistance = depth.upper;
    if (range > 0.0) farDistance = std::min(farDistance, range);
    if (!(farDistance > 0.0)) return std::nullopt;
    // With reversed depth a near plane close to the light costs nothing far away; casters nearer than 1/50000 of the
    // way are the lamp itself.
    farDistance *= 1.001;
    const double nearDistance = std::min(std::max(0.9 * depth.lower, 2e-5 * farDistance), 0.5 * farDistance);
    const double rim = std::tan(std::min(outerAngle, 0.5 * kMaxShadowFov));

    // The cone's pyramid, relative to the light.
    const glm::dmat3 worldFromLight = glm::transpose(*lightFromWorld);
    std::vector<Plane> pyramid = {{-worldFromLight[2], -nearDistance}, {worldFromLight[2], farDistance}};
    for (const double side : {-1.0, 1.0})
        for (const glm::dvec3& axis : {worldFromLight[0], worldFromLight[1]})
            pyramid.push_back({glm::normalize(side * axis - rim * worldFromLight[2]), 0.0});

    Span x, y;
    const auto include = [&](ConvexBody body, const glm::dvec3& originRelative) {
        for (Plane plane : pyramid) {
            plane.offset += glm::dot(plane.normal, originRelative);
            body.cut(plane);
        }
        for (const glm::dvec3& corner : body.corners()) {
            const glm::dvec3 cornerLight = *lightFromWorld * (corner + originRelative);
            const double along = std::max(-cornerLight.z, nearDistance);
            x.include(cornerLight.x / along);
            y.include(cornerLight.y / along);
        }
    };
    if (request.fit == ShadowFitMode::Scene)
        include(ConvexBody(sceneBounds, positionWorld), glm::dvec3(0.0));
    else
        for (const View& view : views) include(seenBody(sceneBounds, view), view.eyeWorld - positionWorld);
    if (x.empty() || y.empty()) return std::nullopt;

    const double widened = rim / (1.0 - std::min(kBorderTexels / request.mapSize, 0.5));
    const auto withinCone = [&](const Span& covered) {
        const Span span = snapped(covered, request.mapSize, 1e-6 * rim);
        return span.length() < 2.0 * widened ? span : Span{-widened, widened};
    };
    x = withinCone(x);
    y = withinCone(y);

    ShadowFit fit;
    fit.mode = ShadowMode::Standard;
    fit.mapSize = request.mapSize;
    fit.perspective = true;
    fit.texelSize = std::max(x.length(), y.length()) / request.mapSize;
    fit.depthRange = farDistance - nearDistance;
    glm::dmat4 lightFromPlace(*lightFromWorld);
    lightFromPlace[3] = glm::dvec4(-(*lightFromWorld * positionWorld), 1.0);
    fit.clipFromWorld = reversedFrustum(x.lower * nearDistance, x.upper * nearDistance, y.lower * nearDistance,
                                        y.upper * nearDistance, nearDistance, farDistance) *
                        lightFromPlace;
    setBiases(fit, request);
    if (!isFinite(fit.clipFromWorld)) return std::nullopt;
    return fit;
}

ShadowFits fitShadows(const Aspect& aspect, const std::vector<LightInEffect>& lights, const Box3d& sceneBounds,
                      std::span<const View> views, const ShadowFitRequest& request) {
    ShadowFits result;
    if (sceneBounds.empty()) return result;
    for (const LightInEffect& light : lights) {
        if (!light.castsShadow) continue;
        std::optional<ShadowFit> fit;
        if (light.kind == LightKind::Directional) {
            fit = fitDirectional(light.directionWorld, sceneBounds, views, request);
        } else if (light.kind == LightKind::Spot) {
            const SpotLight* spot = aspect.findAs<SpotLight>(light.core);
            const double outer = spot->outerAngle;
            if (2.0 * outer > kMaxShadowFov)
                result.messages.push_back(fmt::format("spot light {}: its shadow map covers {:.0f} of {:.0f} degrees",
                                                      nameOf(aspect, light), glm::degrees(kMaxShadowFov),
                                                      glm::degrees(2.0 * outer)));
            fit = fitSpot(light.positionWorld, light.directionWorld, outer, spot->range, sceneBounds, views, request);
        } else if (light.kind == LightKind::Point) {
            const PointLight* point = aspect.findAs<PointLight>(light.core);
            const double radius = 0.5 * sceneBounds.diagonal();
            const glm::dvec3 towards = sceneBounds.centre() - light.positionWorld;
            const double sine = radius / glm::length(towards);
            if (sine < std::sin(0.5 * kMaxShadowFov))
                // At least a hair wide, for a scene that is a single point.
                fit = fitSpot(light.positionWorld, towards, std::max(std::asin(sine), 1e-9), point->range, sceneBounds,
                              views, request);
            else
                result.messages.push_back(fmt::format(
                    "point light {} is inside the scene and casts no shadow: a single map cannot see all around it",
                    nameOf(aspect, light)));
        }
        if (!fit) continue;
        fit->light = light.node;
        result.fits.push_back(*fit);
    }
    return result;
}

}  // namespace umbriel
