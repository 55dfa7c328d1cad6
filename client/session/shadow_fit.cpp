#include "client/session/shadow_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "client/session/shadow_around.h"
#include "client/session/shadow_body.h"
#include "client/session/shadow_warp.h"
#include "common/wall/screen_shadow.h"

namespace umbriel {

namespace {

// Beyond these single precision on the way to the picture ends in infinity, or no shadow is left.
constexpr float kLongest = 999999936.0f;  // metres: the last float below 1e9
constexpr float kSteepestBias = 1e3f;
constexpr float kLargestBias = 16384.0f;  // texels: all of the largest map
constexpr double kFarthestPlane = 1e12;   // metres

std::string nameOf(const Aspect& aspect, const LightInEffect& light) {
    const Container* core = aspect.find(light.core);
    const std::string name = core ? core->name.get() : std::string();
    return name.empty() ? fmt::format("#{}", light.node.id.value) : fmt::format("\"{}\"", name);
}

// The body's map by the request's warp; the uniform one where the warp's is not finite.
std::optional<ShadowFit> fitBody(const LightBody& body, const ShadowFitRequest& request) {
    const glm::dmat3 uniform(1.0);
    glm::dmat3 warp = uniform;
    if (request.map == ShadowMode::LightSpacePerspective) warp = lispWarp(body, request);
    if (request.map == ShadowMode::Trapezoid) warp = trapezoidWarp(body, request);
    if (request.map == ShadowMode::Perspective) warp = perspectiveWarp(body, request);
    if (warp != uniform)
        if (auto fit = fitMap(body, warp, request)) return fit;
    return fitMap(body, uniform, request);
}

// Made in the view, from the light's place alone.
bool isInView(ShadowMode mode) {
    return isPlanar(mode) || mode == ShadowMode::VolumeZPass || mode == ShadowMode::VolumeZFail ||
           mode == ShadowMode::Blob;
}

// Orthonormal, shining along -z.
glm::dmat3 axesAlong(const glm::dvec3& direction) {
    const glm::dvec3 z = -glm::normalize(direction);
    const glm::dvec3 x = glm::normalize(glm::cross(std::abs(z.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0), z));
    return {x, glm::cross(z, x), z};
}

std::optional<ShadowFit> placeInView(const LightInEffect& light, const ShadowFitRequest& request) {
    if (light.kind == LightKind::Ambient) return std::nullopt;
    ShadowFit fit;
    fit.mode = request.mode;
    fit.perspective = light.kind != LightKind::Directional;
    fit.positionWorld = light.positionWorld;
    fit.worldFromLight = axesAlong(light.directionWorld);
    fit.planeWorld = request.planeWorld;
    fit.blobSize = request.blobSize;
    return fit;
}

// Whether a light has anything to say to a plane of its own shadows.
bool isBefore(const glm::dvec4& planeWorld, const LightInEffect& light) {
    const glm::dvec3 normal(planeWorld);
    if (light.kind == LightKind::Directional) return glm::dot(normal, light.directionWorld) < -1e-12;
    const double offset = glm::dot(normal, light.positionWorld) + planeWorld.w;
    return offset > 1e-12 * (glm::length(light.positionWorld) + std::abs(planeWorld.w));
}

bool isFiltered(ShadowMode mode) {
    return mode == ShadowMode::PercentageCloser || mode == ShadowMode::PercentageCloserSoft;
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
                                        std::span<const View> views, const ShadowFitRequest& request,
                                        std::span<const ReceiverRange> receivers) {
    const auto body = directionalBody(directionWorld, sceneBounds, views, request.fit, receivers);
    return body ? fitBody(*body, request) : std::nullopt;
}

std::optional<ShadowFit> fitSpot(const glm::dvec3& positionWorld, const glm::dvec3& directionWorld, double outerAngle,
                                 double range, const Box3d& sceneBounds, std::span<const View> views,
                                 const ShadowFitRequest& request, std::span<const ReceiverRange> receivers) {
    const auto body =
        spotBody(positionWorld, directionWorld, outerAngle, range, sceneBounds, views, request.fit, receivers);
    return body ? fitBody(*body, request) : std::nullopt;
}

bool isPlanar(ShadowMode mode) {
    return mode == ShadowMode::Planar || mode == ShadowMode::PlanarStencil;
}

bool isFitted(ShadowMode mode) {
    switch (mode) {
        case ShadowMode::Standard:
        case ShadowMode::Perspective:
        case ShadowMode::LightSpacePerspective:
        case ShadowMode::Trapezoid:
        case ShadowMode::PercentageCloser:
        case ShadowMode::PercentageCloserSoft:
        case ShadowMode::DualParaboloid:
        case ShadowMode::Cube:
        case ShadowMode::Planar:
        case ShadowMode::PlanarStencil:
        case ShadowMode::VolumeZPass:
        case ShadowMode::VolumeZFail:
        case ShadowMode::Blob:
        case ShadowMode::LightMap:
            return true;
        default:
            return false;
    }
}

glm::vec3 possibleShadowColour(const glm::vec3& given) {
    glm::vec3 colour(0.0f);
    for (int i = 0; i < 3; ++i)
        if (given[i] > 0.0f) colour[i] = std::min(given[i], 1.0f);
    return colour;
}

ShadowFitRequest requestOf(const Viewport& viewport, std::uint32_t mapSize, std::vector<std::string>& messages) {
    ShadowFitRequest request;
    request.fit = viewport.shadowFit;
    request.mapSize = mapSize;
    request.mode = viewport.shadowMode;
    const auto replaced = [&](const char* field, auto given, auto used) {
        messages.push_back(fmt::format("shadows: {} of {} is not possible, {} is used", field, given, used));
        return used;
    };
    const auto within = [&](const char* field, float given, float least, float most, float otherwise) {
        return given >= least && given <= most ? given : replaced(field, given, otherwise);
    };
    constexpr float kAnyNegative = std::numeric_limits<float>::lowest();  // the field says that it is to be found
    request.offFactor = within("offFactor", viewport.offFactor, kAnyNegative, kSteepestBias, -1.0f);
    request.offBias = within("offBias", viewport.offBias, kAnyNegative, kLargestBias, -1.0f);
    if (const glm::vec3 given = viewport.shadowColor; given != possibleShadowColour(given)) {
        const auto text = [](const glm::vec3& c) { return fmt::format("{},{},{}", c.x, c.y, c.z); };
        replaced("shadowColor", text(given), text(possibleShadowColour(given)));
    }
    request.range = viewport.range;
    if (!(request.range > 0.0f && request.range < 0.8f)) {
        // At 0.8 and beyond the trapezoid is the uniform map; nothing and less is no range at all.
        const float used = request.range >= 0.8f ? 0.8f : 0.3f;
        messages.push_back(fmt::format("shadows: a range of {} is not between 0 and 0.8, {} is used{}", request.range,
                                       used, used == 0.8f ? " (the uniform map)" : ""));
        request.range = used;
    }
    request.maxSideAngle = within("maxSideAngle", viewport.maxSideAngle, 0.01f, 3.0f, 1.5f);
    request.lispFactor = viewport.lispFactor;
    if (!(request.lispFactor > 0.0f)) request.lispFactor = replaced("lispFactor", request.lispFactor, 1.0f);
    request.map = request.mode;
    request.tight = viewport.qualityMode && request.fit != ShadowFitMode::Scene &&
                    (request.mode == ShadowMode::Trapezoid || request.mode == ShadowMode::LightSpacePerspective ||
                     request.mode == ShadowMode::Perspective);
    if (isFiltered(request.mode)) {
        request.map = viewport.filteredMap;
        if (request.map != ShadowMode::Standard && request.map != ShadowMode::Perspective &&
            request.map != ShadowMode::LightSpacePerspective && request.map != ShadowMode::Trapezoid) {
            messages.push_back("shadows: filteredMap is std, psm, lisp or trapez; std is used");
            request.map = ShadowMode::Standard;
        }
        ShadowFilter& filter = request.filter;
        const float most = std::min(256.0f, static_cast<float>(mapSize));
        const float quality = viewport.qualityMode ? 2.0f : 1.0f;
        const auto samples = [&](const char* field, std::uint32_t given, std::uint32_t otherwise) {
            const std::uint32_t checked = given >= 1 && given <= 32 ? given : replaced(field, given, otherwise);
            return viewport.qualityMode ? 2 * checked : checked;
        };
        if (request.mode == ShadowMode::PercentageCloser) {
            filter.widthTexels = within("filterWidth", viewport.filterWidth, 0.0f, most, 8.0f);
            filter.widthMetres = within("filterMetres", viewport.filterMetres, 0.0f, kLongest, 0.0f);
            filter.samplesPerRow = samples("samplesPerRow", viewport.samplesPerRow, 6u);
            filter.bilinear = viewport.hardwareFilter;
            // A width in metres has as many texels as the map makes of it, up to as many as a border can hold.
            filter.maxTexels = filter.widthMetres > 0.0f ? std::min(64.0f, most) : filter.widthTexels;
        } else {
            filter.blockerSamples = samples("blockerSamples", viewport.blockerSamples, 6u);
            filter.filterSamples = samples("filterSamples", viewport.filterSamples, 8u);
            filter.maxTexels = std::min(quality * within("maxPenumbra", viewport.maxPenumbra, 0.0f, most, 32.0f), most);
            filter.nearestBlocker = viewport.nearestBlocker;
            filter.bilinear = viewport.hardwareFilter;
        }
        request.borderTexels = static_cast<double>(filter.maxTexels);
        // Small enough that many are filled by one surface, large enough that making them costs little.
        constexpr std::uint32_t kBoundsStride = 8;
        if (viewport.skipUniform) filter.boundsBlock = kBoundsStride;
    }
    within("gauss", viewport.gauss, 0.0f, kLargestGauss, viewport.gauss > 0.0f ? kLargestGauss : 0.0f);
    within("edgeThreshold", viewport.edgeThreshold, 0.0f, 1e9f, 0.0f);
    request.lightSize = within("lightSize", viewport.lightSize, kAnyNegative, kLongest, -1.0f);
    if (request.mode == ShadowMode::LightMap) request.lightMap = viewport.lightMap;
    request.blobSize = within("blobSize", viewport.blobSize, 1e-3f, 1e3f, 1.0f);
    const glm::dvec3 normal = viewport.planeNormal;
    const double length = glm::length(normal);
    if (std::abs(viewport.planeOffset) > kFarthestPlane * length && length > 0.0 && std::isfinite(length))
        messages.push_back(fmt::format("shadows: planeOffset of {} is not possible; the plane is found instead",
                                       viewport.planeOffset.get()));
    else if (length > 0.0 && std::isfinite(length) && std::isfinite(viewport.planeOffset.get()))
        request.planeWorld = glm::dvec4(normal, viewport.planeOffset.get()) / length;
    else if (normal != glm::dvec3(0.0))
        messages.push_back("shadows: planeNormal is no direction; the plane is found instead");
    return request;
}

ShadowFits fitShadows(const Aspect& aspect, const std::vector<LightInEffect>& lights, const Box3d& sceneBounds,
                      std::span<const View> views, const ShadowFitRequest& request,
                      std::span<const ReceiverRange> receivers) {
    ShadowFits result;
    if (sceneBounds.empty()) return result;
    for (const LightInEffect& light : lights) {
        if (!light.castsShadow) continue;
        ShadowFitRequest own = request;
        // A diameter; of a directional light that of its penumbrae a metre behind what casts them.
        const auto sizeOr = [&](double radius) { return static_cast<float>(2.0 * std::max(radius, 0.0)); };
        std::vector<ShadowFit> fits;
        const auto add = [&](std::optional<ShadowFit> fit) {
            if (fit) fits.push_back(*fit);
        };
        if (!light.hasDirection && light.kind != LightKind::Point)
            result.messages.push_back(
                fmt::format("light {}: its beacon has no direction (a scale of 0, or not finite); it shines along -z",
                            nameOf(aspect, light)));
        if (isPlanar(request.mode) && request.planeWorld != glm::dvec4(0.0) && light.kind != LightKind::Ambient &&
            !isBefore(request.planeWorld, light))
            result.messages.push_back(
                fmt::format("light {} lies on the plane of the planar shadows, or behind it, and "
                            "casts none there; move one of them or choose another mode",
                            nameOf(aspect, light)));
        if (isInView(request.mode)) {
            add(placeInView(light, request));
        } else if (light.kind == LightKind::Directional) {
            const double radius = request.lightSize >= 0.0f
                                      ? 0.5 * static_cast<double>(request.lightSize)
                                      : static_cast<double>(aspect.findAs<DirectionalLight>(light.core)->angularRadius);
            own.filter.lightSize = sizeOr(std::tan(std::clamp(radius, 0.0, 1.5)));
            if (!(glm::length(light.directionWorld) > 0.0) || !isFinite(light.directionWorld)) {
                result.messages.push_back(
                    fmt::format("light {} has no direction and casts no shadow", nameOf(aspect, light)));
                continue;
            }
            add(fitDirectional(light.directionWorld, sceneBounds, views, own, receivers));
        } else if (light.kind == LightKind::Spot) {
            const SpotLight* spot = aspect.findAs<SpotLight>(light.core);
            own.filter.lightSize = request.lightSize >= 0.0f ? request.lightSize : sizeOr(spot->radius);
            const double outer = spot->outerAngle;
            if (!(outer > 0.0)) {
                result.messages.push_back(fmt::format("spot light {} has a cone of {} degrees and lights nothing",
                                                      nameOf(aspect, light), glm::degrees(2.0 * outer)));
                continue;
            }
            if (2.0 * outer > kMaxShadowFov) {
                result.messages.push_back(
                    fmt::format("spot light {}: no single map sees {:.0f} degrees, it gets a cube",
                                nameOf(aspect, light), glm::degrees(2.0 * outer)));
                fits = fitCube(light.positionWorld, spot->range, sceneBounds, own);
            } else {
                add(fitSpot(light.positionWorld, light.directionWorld, outer, spot->range, sceneBounds, views, own,
                            receivers));
            }
        } else if (light.kind == LightKind::Point || light.kind == LightKind::Goniometric) {
            const PointLight* point = aspect.findAs<PointLight>(light.core);
            const double range = point ? point->range.get() : aspect.findAs<GoniometricLight>(light.core)->range.get();
            own.filter.lightSize =
                request.lightSize >= 0.0f ? request.lightSize : sizeOr(point ? point->radius.get() : 0.0f);
            const double radius = 0.5 * sceneBounds.diagonal();
            const glm::dvec3 towards = sceneBounds.centre() - light.positionWorld;
            const double sine = radius / glm::length(towards);
            const bool isFar = sine < std::sin(kNarrowestAround);
            const bool isAround = request.mode == ShadowMode::Cube || request.mode == ShadowMode::DualParaboloid;
            if (isFar && isAround)
                result.messages.push_back(fmt::format(
                    "light {} is so far away that the scene fills {:.3g} degrees around it: it gets one map "
                    "aimed at the scene instead of maps all around",
                    nameOf(aspect, light), glm::degrees(2.0 * std::asin(sine))));
            if (request.mode == ShadowMode::DualParaboloid && !isFar)
                fits = fitHemispheres(light.positionWorld, range, sceneBounds, own);
            else if ((request.mode == ShadowMode::Cube && !isFar) || !(sine < std::sin(kWidestSingle)))
                fits = fitCube(light.positionWorld, range, sceneBounds, own);
            else
                // At least a hair wide, for a scene that is a single point.
                add(fitSpot(light.positionWorld, towards, std::max(std::asin(sine), 1e-9), range, sceneBounds, views,
                            own, receivers));
        }
        for (ShadowFit& fit : fits) {
            fit.light = light.node;
            result.fits.push_back(fit);
        }
    }
    return result;
}

}  // namespace umbriel
