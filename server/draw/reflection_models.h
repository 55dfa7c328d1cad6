#pragma once

#include <array>
#include <string_view>

#include "common/scene/materials.h"
#include "server/draw/frame_plan.h"

namespace umbriel {

// How a reflection model is drawn: the feature that stands for it and the snippet that its surfaces are composed with.
struct ReflectionModule {
    ReflectionModel model;
    Feature feature;
    std::string_view snippet;  // below shaders/
};

// Every model but Unlit, which has neither.
inline constexpr std::array kReflectionModules = {
    ReflectionModule{ReflectionModel::MetallicRoughness, Feature::MetallicRoughness,
                     "snippet/reflection_metallic_roughness.glsl"},
    ReflectionModule{ReflectionModel::BlinnPhong, Feature::BlinnPhong, "snippet/reflection_blinn_phong.glsl"},
};
inline constexpr std::string_view kUnlitSnippet = "snippet/reflection_unlit.glsl";

// The features of all models; none of them: unlit.
constexpr FeatureSet litFeatures() {
    FeatureSet features = 0;
    for (const ReflectionModule& module : kReflectionModules) features |= bit(module.feature);
    return features;
}
// 0 for Unlit.
constexpr FeatureSet featureOf(ReflectionModel model) {
    for (const ReflectionModule& module : kReflectionModules)
        if (module.model == model) return bit(module.feature);
    return 0;
}
constexpr std::string_view reflectionSnippet(FeatureSet features) {
    for (const ReflectionModule& module : kReflectionModules)
        if (has(features, module.feature)) return module.snippet;
    return kUnlitSnippet;
}

}  // namespace umbriel
