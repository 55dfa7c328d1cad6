#include "common/wall/screen_shadow.h"

#include <algorithm>
#include <cmath>

namespace umbriel {

std::int32_t ScreenShadow::reach() const {
    // An edge is one between two pixels.
    return std::max(static_cast<std::int32_t>(std::ceil(radius)), edges ? 1 : 0);
}

ScreenShadow screenShadowOf(const Viewport& viewport) {
    ScreenShadow result;
    const ShadowShow show = viewport.show;
    const bool isOn =
        viewport.shadowOn && viewport.shadowMode.get() != ShadowMode::None && show != ShadowShow::ColorMap;
    const float radius = viewport.gauss;
    if (isOn && radius > 0.0f) result.radius = std::min(radius, kLargestGauss);
    const float threshold = viewport.edgeThreshold;
    if (threshold > 0.0f) result.edgeThreshold = threshold;
    result.factors = isOn && (viewport.screenSpace || viewport.foreignShading || result.radius > 0.0f ||
                              show == ShadowShow::FactorMap);
    result.edges = result.edgeThreshold > 0.0f && (result.radius > 0.0f || show == ShadowShow::EdgeMap);
    result.surfaces = result.edges || show == ShadowShow::SeenArea;
    return result;
}

std::vector<float> gaussWeights(float radius) {
    std::vector<double> weights = {1.0};
    double sum = 1.0;
    const double deviation = 0.5 * static_cast<double>(radius);
    for (int i = 1; i <= static_cast<int>(std::ceil(radius)); ++i) {
        const double x = i / deviation;
        weights.push_back(std::exp(-0.5 * x * x));
        sum += 2.0 * weights.back();
    }
    std::vector<float> result;
    for (const double weight : weights) result.push_back(static_cast<float>(weight / sum));
    return result;
}

}  // namespace umbriel
