#include "server/shadow/view_module.h"

#include <cmath>

namespace umbriel {

ShadowFeatureSet ViewModule::features(const ShadowFit&) const {
    return bit(ShadowFeature::Maps) | bit(ShadowFeature::View);
}

ShadowDemand ViewModule::demand(const ShadowFit&) const {
    ShadowDemand demand;
    demand.module = _name;
    demand.inView = true;
    demand.positions = _positions;
    return demand;
}

gpu::GpuShadow ViewModule::describe(const ShadowFit&, const glm::dvec3&) const {
    gpu::GpuShadow shadow{};
    shadow.shape = gpu::kShadowInView;
    return shadow;
}

Result<void> ViewModule::draw(const ShadowFit&, ShadowMaps&, std::uint32_t, const PixelRect&, ShadowPainter&) const {
    return failure("this shadow module has no map to draw");
}

glm::dvec4 lightRelative(const ShadowFit& fit, const glm::dvec3& eyeWorld) {
    return fit.perspective ? glm::dvec4(fit.positionWorld - eyeWorld, 1.0) : glm::dvec4(fit.worldFromLight[2], 0.0);
}

std::optional<glm::dmat4> flattening(const glm::dvec4& plane, const glm::dvec4& light) {
    const double above = glm::dot(plane, light);
    if (!(above > 1e-12 * (glm::length(glm::dvec3(plane)) * glm::length(glm::dvec3(light)) + std::abs(plane.w))))
        return std::nullopt;
    // above * identity - light * plane^T, scaled so that w is 1 on the plane.
    return glm::dmat4(1.0) - glm::outerProduct(light, plane) / above;
}

}  // namespace umbriel
