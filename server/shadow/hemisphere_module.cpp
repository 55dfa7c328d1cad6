#include "server/shadow/hemisphere_module.h"

#include "server/shadow/map_module.h"
#include "server/shadow/shadow_maps.h"

namespace umbriel {
namespace {

// What the maps of all other lights are drawn with.
const ShadowModule& plain() {
    return *shadowModule(ShadowMode::Standard);
}

struct Distances {
    double nearest = 0.0;
    double farthest = 0.0;
};

// Of the fit, from its depth row: depth is 1 and 0 there.
Distances distancesOf(const gpu::GpuShadow& shadow) {
    const double scale = static_cast<double>(shadow.depthScale);
    const double offset = static_cast<double>(shadow.depthOffset);
    return {scale / (1.0 + offset), scale / offset};
}

}  // namespace

ShadowFeatureSet HemisphereModule::features(const ShadowFit& fit) const {
    if (fit.shape != ShadowShape::Hemisphere) return plain().features(fit);
    return bit(ShadowFeature::Maps) | bit(ShadowFeature::Perspective) | bit(ShadowFeature::Hemispheres);
}

ShadowDemand HemisphereModule::demand(const ShadowFit& fit) const {
    if (fit.shape != ShadowShape::Hemisphere) return plain().demand(fit);
    return {"paraboloid", fit.part == 0 ? "-z" : "+z", fit.mapSize, 0};
}

gpu::GpuShadow HemisphereModule::describe(const ShadowFit& fit, const glm::dvec3& eyeWorld) const {
    gpu::GpuShadow shadow = plain().describe(fit, eyeWorld);
    if (fit.shape != ShadowShape::Hemisphere) return shadow;
    const Distances distances = distancesOf(shadow);
    // distance = offset - scale * depth
    shadow.depthScale = static_cast<float>(distances.farthest - distances.nearest);
    shadow.depthOffset = static_cast<float>(distances.farthest);
    return shadow;
}

Result<void> HemisphereModule::draw(const ShadowFit& fit, ShadowMaps& maps, std::uint32_t layer,
                                    const PixelRect& texels, ShadowPainter& painter) const {
    if (fit.shape != ShadowShape::Hemisphere) return plain().draw(fit, maps, layer, texels, painter);
    const Distances distances = distancesOf(plain().describe(fit, fit.positionWorld));
    maps.begin(layer, fit, texels);
    glEnable(GL_CLIP_DISTANCE0);
    CasterStage stage;
    stage.projection = CasterStage::Projection::Hemisphere;
    stage.stageFromWorld =
        glm::dmat4(glm::transpose(fit.worldFromLight)) * glm::translate(glm::dmat4(1.0), -fit.positionWorld);
    // The map's scale is that of the fit's matrix: x over w for a place at unit distance.
    const glm::dvec4 atOne =
        fit.clipFromWorld * glm::dvec4(fit.positionWorld + fit.worldFromLight[0] - fit.worldFromLight[2], 1.0);
    stage.hemisphere = glm::vec4(atOne.x / atOne.w, distances.nearest, distances.farthest, fit.mapSize);
    auto drawn = painter.drawCasters(stage);
    glDisable(GL_CLIP_DISTANCE0);
    maps.end();
    return drawn;
}

}  // namespace umbriel
