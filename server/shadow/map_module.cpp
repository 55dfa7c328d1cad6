#include "server/shadow/map_module.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/shadow/shadow_maps.h"
#include "shaders/formula_cpp.h"

namespace umbriel {
namespace {

glm::dvec4 rowOf(const glm::dmat4& matrix, int row) {
    return {matrix[0][row], matrix[1][row], matrix[2][row], matrix[3][row]};
}

struct Extent {
    double texel = 0.0;     // the longer side of the smallest texel, metres
    double farthest = 0.0;  // of what the map covers, from the eye, metres
};

// Of a parallel light's map; across: from the map (acrossFromMap), relative to the eye. At its corners and its middle.
Extent extentOf(const glm::dmat3& across, std::uint32_t mapSize, double depthPerMetre, double depthAtEye) {
    Extent extent{std::numeric_limits<double>::infinity(), 0.0};
    const double along = std::max(std::abs(depthAtEye), std::abs(1.0 - depthAtEye)) / depthPerMetre;
    for (const glm::dvec2& corner : {glm::dvec2(0, 0), {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}) {
        const glm::dvec3 t = across * glm::dvec3(corner, 1.0);
        const auto side = [&](int axis) {
            return glm::length((glm::dvec2(across[axis]) * t.z - glm::dvec2(t) * across[axis].z) / (t.z * t.z));
        };
        extent.texel = std::min(extent.texel, std::max(side(0), side(1)) * 2.0 / mapSize);
        extent.farthest = std::max(extent.farthest, glm::length(glm::dvec3(glm::dvec2(t) / t.z, along)));
    }
    return extent;
}

}  // namespace

glm::dmat3 acrossFromMap(const ShadowFit& fit, const glm::dvec3& originWorld) {
    // Row i of the map's clip space as a function of (tx, ty, 1): along the light it is constant (directional) or
    // proportional to the distance (perspective).
    glm::dmat3 mapFromAcross;
    const int rows[] = {0, 1, 3};
    for (int i = 0; i < 3; ++i) {
        const glm::dvec4 row = rowOf(fit.clipFromWorld, rows[i]);
        const glm::dvec3 gradient(row);
        mapFromAcross[0][i] = glm::dot(gradient, fit.worldFromLight[0]);
        mapFromAcross[1][i] = glm::dot(gradient, fit.worldFromLight[1]);
        mapFromAcross[2][i] =
            fit.perspective ? -glm::dot(gradient, fit.worldFromLight[2]) : glm::dot(gradient, originWorld) + row.w;
    }
    return glm::inverse(mapFromAcross);
}

bool isWarped(const ShadowFit& fit) {
    const glm::dvec3 gradient(rowOf(fit.clipFromWorld, 3));
    const glm::dvec2 across(glm::dot(gradient, fit.worldFromLight[0]), glm::dot(gradient, fit.worldFromLight[1]));
    // Rotations are exact to a few units in the last place.
    const double unwarped = fit.perspective ? 1.0 : 0.0;
    return std::abs(across.x) + std::abs(across.y) > 1e-12 * unwarped;
}

bool isMapMirrored(const ShadowFit& fit) {
    // Around the middle of the map, where clip x and y are 0 and w is positive.
    const glm::dvec4 x = fit.clipFromWorld * glm::dvec4(fit.worldFromLight[0], 0.0);
    const glm::dvec4 y = fit.clipFromWorld * glm::dvec4(fit.worldFromLight[1], 0.0);
    return x.x * y.y - x.y * y.x < 0.0;
}

double lookupReach(const ShadowFit& fit) {
    // The nearest texel's centre is half a texel away; 0.1 covers rounding. Biases lead along the light.
    constexpr double kTexelReach = 0.6;
    return kTexelReach + 0.5 * static_cast<double>(fit.filter.maxTexels) + (fit.filter.bilinear ? 1.0 : 0.0);
}

ShadowFeatureSet MapModule::features(const ShadowFit& fit) const {
    return bit(ShadowFeature::Maps) | _features | (isWarped(fit) ? bit(ShadowFeature::Warp) : 0) |
           (fit.perspective ? bit(ShadowFeature::Perspective) : 0) |
           (fit.shape == ShadowShape::CubeFace ? bit(ShadowFeature::Cube) : 0) |
           (fit.filter.nearestBlocker ? bit(ShadowFeature::NearestBlocker) : 0) |
           (fit.filter.bilinear ? bit(ShadowFeature::Bilinear) : 0) |
           (fit.filter.boundsBlock > 0 ? bit(ShadowFeature::Skip) : 0) |
           (boundsBlock(fit) > 0 ? bit(ShadowFeature::Bounds) : 0) | lookupFeatures(fit);
}

ShadowFeatureSet MapModule::lookupFeatures(const ShadowFit& fit) const {
    // The plain loop reads the map itself.
    if ((_features & bit(ShadowFeature::Filter)) == 0 || fit.filter.boundsBlock == 0) return 0;
    ShadowFeatureSet features = bit(ShadowFeature::Copy);
    const bool isSoft = (_features & bit(ShadowFeature::SoftFilter)) != 0;
    const std::uint32_t side = isSoft ? fit.filter.filterSamples : fit.filter.samplesPerRow;
    if (!fit.filter.bilinear && side == 6) features |= bit(ShadowFeature::Filter6);
    if (!fit.filter.bilinear && side == 8) features |= bit(ShadowFeature::Filter8);
    if (isSoft && fit.filter.blockerSamples == 6) features |= bit(ShadowFeature::Search6);
    return features;
}

std::uint32_t MapModule::boundsBlock(const ShadowFit& fit) const {
    const bool isFixed = (_features & bit(ShadowFeature::SoftFilter)) == 0 && !(fit.filter.widthMetres > 0.0f);
    const float width = isFixed ? fit.filter.widthTexels : fit.filter.maxTexels;
    // To the centre of the farthest texel, as decidedAround() of snippet/shadow_filter.glsl asks.
    const float reach = 0.5f * width + (fit.filter.bilinear ? 1.5f : 0.5f);
    return reach <= kBoundsMargin ? fit.filter.boundsBlock : 0;
}

ShadowDemand MapModule::demand(const ShadowFit& fit) const {
    constexpr std::string_view kFaces[] = {"face +x", "face -x", "face +y", "face -y", "face +z", "face -z"};
    return {_name, fit.shape == ShadowShape::CubeFace ? kFaces[fit.part % 6] : "", fit.mapSize, boundsBlock(fit)};
}

gpu::GpuShadow MapModule::describe(const ShadowFit& fit, const glm::dvec3& eyeWorld) const {
    gpu::GpuShadow shadow{};
    shadow.clipFromRelative = glm::mat4(fit.clipFromWorld * glm::translate(glm::dmat4(1.0), eyeWorld));
    const glm::dvec3 originWorld = fit.perspective ? fit.positionWorld : eyeWorld;
    const glm::dmat3 across = acrossFromMap(fit, originWorld);
    const double perTexel = 2.0 / fit.mapSize;
    const glm::dmat3& axes = fit.worldFromLight;
    shadow.texelX = glm::vec3((axes[0] * across[0][0] + axes[1] * across[0][1]) * perTexel);
    shadow.texelY = glm::vec3((axes[0] * across[1][0] + axes[1] * across[1][1]) * perTexel);
    if (isWarped(fit)) {
        shadow.warpX = static_cast<float>(across[0][2] * perTexel);
        shadow.warpY = static_cast<float>(across[1][2] * perTexel);
        shadow.unwarp = glm::vec3(across[0][2], across[1][2], across[2][2]);
    } else {
        shadow.unwarp = glm::vec3(0.0f, 0.0f, 1.0f);
    }
    shadow.axisZ = glm::vec3(axes[2]);
    shadow.isPerspective = fit.perspective ? 1.0f : 0.0f;
    shadow.origin = glm::vec3(originWorld - eyeWorld);
    shadow.mapSize = static_cast<float>(fit.mapSize);
    shadow.constantBias = fit.constantBias;
    shadow.normalOffset = fit.normalOffset;
    // The depth along the light's axis, from two points on it.
    const glm::dvec4 depthRow = rowOf(fit.clipFromWorld, 2);
    const double perMetre = glm::dot(glm::dvec3(depthRow), axes[2]);
    if (fit.perspective) {
        // z of the clip space is perMetre * (axial coordinate) + what it is at the light; w is minus that coordinate.
        const double atLight = glm::dot(glm::dvec3(depthRow), fit.positionWorld) + depthRow.w;
        shadow.depthScale = static_cast<float>(atLight);
        shadow.depthOffset = static_cast<float>(perMetre);
    } else {
        shadow.depthScale = static_cast<float>(fit.depthRange);
        shadow.depthOffset = static_cast<float>(fit.depthRange);
    }
    if (!fit.perspective) {
        const glm::dmat4 clipFromRelative = fit.clipFromWorld * glm::translate(glm::dmat4(1.0), eyeWorld);
        const double half = 0.5 * fit.mapSize;
        const glm::dvec4 w = rowOf(clipFromRelative, 3);
        shadow.texelRowX = glm::vec4((rowOf(clipFromRelative, 0) + w) * half);
        shadow.texelRowY = glm::vec4((rowOf(clipFromRelative, 1) + w) * half);
        shadow.depthPerMetre = static_cast<float>(perMetre);
        const Extent extent = extentOf(across, fit.mapSize, perMetre, rowOf(clipFromRelative, 2).w);
        if (!isWarped(fit)) {
            const glm::dvec3 sideX(shadow.texelX);
            const glm::dvec3 sideY(shadow.texelY);
            // The map's x and y are at right angles in every uniform fit: a side is its gradient by the squared length.
            shadow.offsetX = static_cast<float>(static_cast<double>(fit.normalOffset) * glm::dot(sideX, sideX));
            shadow.offsetY = static_cast<float>(static_cast<double>(fit.normalOffset) * glm::dot(sideY, sideY));
        }
        shadow.depthAtEye = static_cast<float>(rowOf(clipFromRelative, 2).w +
                                               perMetre * (static_cast<double>(fit.constantBias) * extent.texel +
                                                           formula_f64::shadowRoundingBias(extent.farthest)));
    }
    shadow.filterTexels = fit.filter.widthTexels;
    shadow.filterMetres = fit.filter.widthMetres;
    shadow.lightSize = fit.filter.lightSize;
    shadow.maxTexels = fit.filter.maxTexels;
    shadow.shape = static_cast<std::uint32_t>(fit.shape);
    shadow.filterSamples = std::max(fit.filter.samplesPerRow, fit.filter.filterSamples);
    shadow.blockerSamples = fit.filter.blockerSamples;
    shadow.boundsBlock = boundsBlock(fit);
    return shadow;
}

Result<void> MapModule::draw(const ShadowFit& fit, ShadowMaps& maps, std::uint32_t layer, const PixelRect& texels,
                             ShadowPainter& painter) const {
    maps.begin(layer, fit, texels);
    auto drawn = painter.drawCasters({CasterStage::Projection::Matrix, fit.clipFromWorld, {}});
    maps.end();
    if (!drawn || boundsBlock(fit) == 0) return drawn;
    return maps.fillBounds(layer, fit, painter);
}

}  // namespace umbriel
