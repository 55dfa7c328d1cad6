#pragma once

#include <optional>

#include "server/shadow/shadow_module.h"

namespace umbriel {

// Modules that work in the view: what keeps the light from the visible surfaces is drawn over them, one layer of the
// darkness images for each light, and read by shaders/snippet/shadow_view.glsl. server/draw/darkness_painter.h draws.
class ViewModule final : public ShadowModule {
 public:
    // positions: the pass needs to know where the surfaces lie, beside their depth.
    constexpr ViewModule(std::string_view name, bool positions) : _name(name), _positions(positions) {}

    ShadowFeatureSet features(const ShadowFit& fit) const override;
    ShadowDemand demand(const ShadowFit& fit) const override;
    gpu::GpuShadow describe(const ShadowFit& fit, const glm::dvec3& eyeWorld) const override;
    // Never called: there is no map.
    Result<void> draw(const ShadowFit& fit, ShadowMaps& maps, std::uint32_t layer, const PixelRect& texels,
                      ShadowPainter& painter) const override;

 private:
    std::string_view _name;
    bool _positions;
};

// The light of a fit as a point (w 1) or as the direction towards it (w 0), relative to the eye, world axes.
glm::dvec4 lightRelative(const ShadowFit& fit, const glm::dvec3& eyeWorld);

// Projects from a light onto a plane (Blinn 1988; Ganster 2002, eq. 10 with the 0 at (3,3) that flattens z): points in
// one space, normal . x + w = 0 the plane. Nothing when the light is not on the plane's positive side: then it lights
// no face of it. w of the result is positive for what lies between light and plane.
std::optional<glm::dmat4> flattening(const glm::dvec4& plane, const glm::dvec4& light);

}  // namespace umbriel
