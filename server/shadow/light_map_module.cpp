#include "server/shadow/light_map_module.h"

namespace umbriel {

ShadowFeatureSet LightMapModule::features(const ShadowFit&) const {
    return bit(ShadowFeature::Maps) | bit(ShadowFeature::LightMap);
}

ShadowDemand LightMapModule::demand(const ShadowFit&) const {
    ShadowDemand demand;
    demand.module = "light map";
    demand.inLightMap = true;
    return demand;
}

gpu::GpuShadow LightMapModule::describe(const ShadowFit& fit, const glm::dvec3&) const {
    gpu::GpuShadow shadow{};
    shadow.shape = gpu::kShadowLightMap;
    shadow.layer = static_cast<float>(fit.layer);
    return shadow;
}

Result<void> LightMapModule::draw(const ShadowFit&, ShadowMaps&, std::uint32_t, const PixelRect&,
                                  ShadowPainter&) const {
    return failure("light maps are not drawn");
}

}  // namespace umbriel
