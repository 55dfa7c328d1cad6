#include "client/trade/map_texels.h"

#include <algorithm>
#include <cmath>

namespace umbriel {
namespace {

// Of places on a map (-1 to 1) per metre along a surface's axes, and how far from the map's middle the place lies (1:
// on its border).
struct OnMap {
    glm::dmat2 mapFromSurface{0.0};
    double fromMiddle = 0.0;
};

std::optional<OnMap> onFlatMap(const ShadowFit& fit, const glm::dvec3& eyeWorld, const glm::dvec3& relative,
                               const AxesAcross& surface) {
    // Relative to the eye, so that nothing far away has to cancel.
    const glm::dmat4 clipFromRelative = fit.clipFromWorld * glm::translate(glm::dmat4(1.0), eyeWorld);
    const glm::dvec4 clip = clipFromRelative * glm::dvec4(relative, 1.0);
    if (!(clip.w > 0.0)) return std::nullopt;
    const auto derivative = [&](const glm::dvec3& along) {
        const glm::dvec4 d = clipFromRelative * glm::dvec4(along, 0.0);
        return glm::dvec2(d.x * clip.w - clip.x * d.w, d.y * clip.w - clip.y * d.w) / (clip.w * clip.w);
    };
    return OnMap{glm::dmat2(derivative(surface.u), derivative(surface.v)),
                 std::max(std::abs(clip.x), std::abs(clip.y)) / clip.w};
}

// As shaders/snippet/hemisphere.glsl: the stereographic projection of the direction from the light.
std::optional<OnMap> onHemisphere(const ShadowFit& fit, const glm::dvec3& eyeWorld, const glm::dvec3& relative,
                                  const AxesAcross& surface) {
    const glm::dmat3 lightFromWorld = glm::transpose(fit.worldFromLight);
    const glm::dvec3 p = lightFromWorld * (relative + (eyeWorld - fit.positionWorld));
    const double far = glm::length(p);
    if (!(far > 0.0) || p.z > 0.0) return std::nullopt;
    const glm::dvec3 d = p / far;
    const glm::dvec4 atOne =
        fit.clipFromWorld * glm::dvec4(fit.positionWorld + fit.worldFromLight[0] - fit.worldFromLight[2], 1.0);
    const double scale = atOne.x / atOne.w, below = 1.0 - d.z;
    const auto derivative = [&](const glm::dvec3& along) {
        const glm::dvec3 a = lightFromWorld * along;
        const glm::dvec3 turned = (a - d * glm::dot(d, a)) / far;
        return scale * (glm::dvec2(turned) / below + glm::dvec2(d) * (turned.z / (below * below)));
    };
    return OnMap{glm::dmat2(derivative(surface.u), derivative(surface.v)),
                 scale * std::max(std::abs(d.x), std::abs(d.y)) / below};
}

}  // namespace

std::optional<glm::dmat2> surfaceFromTexels(std::span<const ShadowFit> fits, const glm::dvec3& eyeWorld,
                                            const glm::dvec3& relative, const AxesAcross& surface) {
    std::optional<OnMap> best;
    std::uint32_t mapSize = 0;
    for (const ShadowFit& fit : fits) {
        if (fit.mapSize == 0) continue;
        const auto place = fit.shape == ShadowShape::Hemisphere ? onHemisphere(fit, eyeWorld, relative, surface)
                                                                : onFlatMap(fit, eyeWorld, relative, surface);
        if (!place || (best && best->fromMiddle <= place->fromMiddle)) continue;
        best = place;
        mapSize = fit.mapSize;
    }
    if (!best || !(std::abs(glm::determinant(best->mapFromSurface)) > 0.0)) return std::nullopt;
    return glm::inverse(best->mapFromSurface) * (2.0 / mapSize);
}

TexelSizes texelSizes(const SurfacePoints& points, const View& view, std::span<const ShadowFit> fits,
                      const std::vector<std::uint8_t>& marked) {
    TexelSizes sizes{std::vector<float>(points.size(), 0.0f), std::vector<float>(points.size(), 0.0f)};
    const glm::dmat4 clipFromRelative = view.clipFromView * glm::dmat4(view.viewFromWorld);
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!marked[i]) continue;
        const glm::dvec3 relative(points.relative[i]), normal(points.normals[i]);
        const AxesAcross surface = axesAcross(normal);
        const auto texel = surfaceFromTexels(fits, points.eyeWorld, relative, surface);
        if (!texel) continue;
        const double area = std::abs(glm::determinant(*texel));
        const glm::dvec4 clip = clipFromRelative * glm::dvec4(relative, 1.0);
        const auto onPicture = [&](const glm::dvec3& along) {
            const glm::dvec4 d = clipFromRelative * glm::dvec4(along, 0.0);
            return glm::dvec2(0.5 * points.width * (d.x * clip.w - clip.x * d.w),
                              0.5 * points.height * (d.y * clip.w - clip.y * d.w)) /
                   (clip.w * clip.w);
        };
        const double pixels = std::abs(glm::determinant(glm::dmat2(onPicture(surface.u), onPicture(surface.v))));
        sizes.pixels[i] = static_cast<float>(std::sqrt(area * pixels));
        const ShadowFit& fit = fits.front();
        const glm::dvec3 ray =
            fit.perspective ? relative + (points.eyeWorld - fit.positionWorld) : fit.worldFromLight[2];
        const double facing = std::abs(glm::dot(glm::normalize(ray), normal));
        sizes.metres[i] = static_cast<float>(std::sqrt(area * facing));
    }
    return sizes;
}

}  // namespace umbriel
