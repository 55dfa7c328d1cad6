#pragma once

#include "server/shadow/shadow_module.h"

namespace umbriel {

// Modules that draw depth from the light into a map: they differ in the fit that the client computed and in the
// features of the shader that reads the map.
class MapModule final : public ShadowModule {
 public:
    // features: beside ShadowFeature::Maps and those that follow from the fit.
    constexpr MapModule(std::string_view name, ShadowFeatureSet features) : _name(name), _features(features) {}

    ShadowFeatureSet features(const ShadowFit& fit) const override;
    ShadowDemand demand(const ShadowFit& fit) const override;
    gpu::GpuShadow describe(const ShadowFit& fit, const glm::dvec3& eyeWorld) const override;
    Result<void> draw(const ShadowFit& fit, ShadowMaps& maps, std::uint32_t layer, const PixelRect& texels,
                      ShadowPainter& painter) const override;

 private:
    // Texels a side of the blocks whose bounds are worth having; 0: none asked for, or no filter fits into one.
    std::uint32_t boundsBlock(const ShadowFit& fit) const;
    // Of how filters read the map.
    ShadowFeatureSet lookupFeatures(const ShadowFit& fit) const;

    std::string_view _name;
    ShadowFeatureSet _features;
};

// The map's plane: t = H^-1 m, where t is a place across the light (metres relative to origin, or, of a perspective
// light, metres at unit distance) and m map coordinates with x and y in [-1, 1], both homogeneous. Scaled so that w of
// the clip space over the light's own is 1 / (third row of the result * m).
glm::dmat3 acrossFromMap(const ShadowFit& fit, const glm::dvec3& originWorld);

// How far, along an axis of the map, in texels, the farthest texel centre that a surface is compared with may lie from
// the surface's own place: normal offset, nearest texel, filter, rounding.
double lookupReach(const ShadowFit& fit);

// True when texels vary over the map.
bool isWarped(const ShadowFit& fit);
// Of a parallel light: whether what is wound counter-clockwise seen from the light is wound clockwise on the map.
bool isMapMirrored(const ShadowFit& fit);

}  // namespace umbriel
