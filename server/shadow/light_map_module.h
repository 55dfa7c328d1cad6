#pragma once

#include "server/shadow/shadow_module.h"

namespace umbriel {

// Factors of a static light from the viewport's light map (common/scene/light_map.h): nothing is drawn. Beside it the
// light may have maps of what moves and of what does not (ShadowFit::casters), for shadows that the map does not know;
// LightList links them.
class LightMapModule final : public ShadowModule {
 public:
    ShadowFeatureSet features(const ShadowFit& fit) const override;
    ShadowDemand demand(const ShadowFit& fit) const override;
    gpu::GpuShadow describe(const ShadowFit& fit, const glm::dvec3& eyeWorld) const override;
    // Never called: there is nothing to draw.
    Result<void> draw(const ShadowFit& fit, ShadowMaps& maps, std::uint32_t layer, const PixelRect& texels,
                      ShadowPainter& painter) const override;
};

}  // namespace umbriel
