#include "client/session/shadow_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "client/session/shadow_body.h"

namespace umbriel {

namespace {

std::string nameOf(const Aspect& aspect, const LightInEffect& light) {
    const Container* core = aspect.find(light.core);
    const std::string name = core ? core->name.get() : std::string();
    return name.empty() ? fmt::format("#{}", light.node.id.value) : fmt::format("\"{}\"", name);
}

// The body's map by the request's warp; the uniform one where the warp has no answer.
std::optional<ShadowFit> fitBody(const LightBody& body, const ShadowFitRequest& request) {
    return fitMap(body, glm::dmat3(1.0), request);
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
    const auto body = directionalBody(directionWorld, sceneBounds, views, request.fit);
    return body ? fitBody(*body, request) : std::nullopt;
}

std::optional<ShadowFit> fitSpot(const glm::dvec3& positionWorld, const glm::dvec3& directionWorld, double outerAngle,
                                 double range, const Box3d& sceneBounds, std::span<const View> views,
                                 const ShadowFitRequest& request) {
    const auto body = spotBody(positionWorld, directionWorld, outerAngle, range, sceneBounds, views, request.fit);
    return body ? fitBody(*body, request) : std::nullopt;
}

bool isFitted(ShadowMode mode) {
    return mode == ShadowMode::Standard;
}

ShadowFitRequest requestOf(const Viewport& viewport, std::uint32_t mapSize, std::vector<std::string>& messages) {
    static_cast<void>(messages);
    ShadowFitRequest request;
    request.fit = viewport.shadowFit;
    request.mapSize = mapSize;
    request.offFactor = viewport.offFactor;
    request.offBias = viewport.offBias;
    request.mode = viewport.shadowMode;
    return request;
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
        } else if (light.kind == LightKind::Point || light.kind == LightKind::Goniometric) {
            const PointLight* point = aspect.findAs<PointLight>(light.core);
            const double range = point ? point->range : aspect.findAs<GoniometricLight>(light.core)->range;
            const double radius = 0.5 * sceneBounds.diagonal();
            const glm::dvec3 towards = sceneBounds.centre() - light.positionWorld;
            const double sine = radius / glm::length(towards);
            if (sine < std::sin(0.5 * kMaxShadowFov))
                // At least a hair wide, for a scene that is a single point.
                fit = fitSpot(light.positionWorld, towards, std::max(std::asin(sine), 1e-9), range, sceneBounds, views,
                              request);
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
