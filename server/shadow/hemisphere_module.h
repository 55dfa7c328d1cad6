#pragma once

#include "server/shadow/shadow_module.h"

namespace umbriel {

// Dual paraboloid maps of point lights (Brabec, Annen & Seidel 2002): two maps, depth linear in the distance. Only
// vertices are mapped exactly, so casters are tessellated until an edge's chord leaves its arc by a quarter of a texel
// at most. Casters with holes are drawn as they are: their triangles are small. Other lights have the standard map.
class HemisphereModule final : public ShadowModule {
 public:
    ShadowFeatureSet features(const ShadowFit& fit) const override;
    ShadowDemand demand(const ShadowFit& fit) const override;
    gpu::GpuShadow describe(const ShadowFit& fit, const glm::dvec3& eyeWorld) const override;
    Result<void> draw(const ShadowFit& fit, ShadowMaps& maps, std::uint32_t layer, const PixelRect& texels,
                      ShadowPainter& painter) const override;
};

}  // namespace umbriel
