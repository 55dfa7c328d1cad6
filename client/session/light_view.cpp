#include "client/session/light_view.h"

#include "common/math/glm.h"
#include "common/wall/shadow_show.h"

namespace umbriel {

std::vector<View> lightViews(const View& view, const std::vector<ShadowFit>& fits) {
    std::vector<View> views;
    const ShowLayout layout = showLayoutOf(view.region, static_cast<std::int32_t>(fits.size()));
    for (std::size_t part = 0; part < fits.size(); ++part) {
        const ShadowFit& fit = fits[part];
        View& made = views.emplace_back(view);
        made.region = layout.cell(static_cast<std::int32_t>(part));
        made.orthographic = !fit.perspective;
        if (fit.perspective) {
            made.eyeWorld = fit.positionWorld;
        } else {
            // The middle of where the map's depth begins: single precision is spent near there.
            const glm::dvec4 middle = glm::inverse(fit.clipFromWorld) * glm::dvec4(0.0, 0.0, 1.0, 1.0);
            made.eyeWorld = glm::dvec3(middle) / middle.w;
        }
        made.viewFromWorld = glm::transpose(fit.worldFromLight);
        made.clipFromView =
            fit.clipFromWorld * glm::translate(glm::dmat4(1.0), made.eyeWorld) * glm::dmat4(fit.worldFromLight);
    }
    return views;
}

ShadowMode projectiveMode(ShadowMode mode) {
    switch (mode) {
        case ShadowMode::DualParaboloid:
            return ShadowMode::Cube;
        case ShadowMode::Planar:
        case ShadowMode::PlanarStencil:
        case ShadowMode::VolumeZPass:
        case ShadowMode::VolumeZFail:
        case ShadowMode::Blob:
        case ShadowMode::LightMap:
        case ShadowMode::VisibilityMap:
            return ShadowMode::Standard;
        default:
            return mode;
    }
}

std::string cannotShow(ShadowShow show, const std::vector<ShadowFit>& fits) {
    const bool needsShadow = show == ShadowShow::LightView || show == ShadowShow::FactorMap;
    const bool needsMap = show == ShadowShow::ShadowMap || show == ShadowShow::SeenArea;
    if ((needsShadow || needsMap) && fits.empty()) return "there is no light with a shadow to show; choose --shadow";
    if (needsMap && fits.front().mapSize == 0) return "this shadow mode has no map to show";
    return {};
}

}  // namespace umbriel
