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
    FeatureSet textures;       // it reads, beside those of all models but Unlit
};

// Every model but Unlit, which has neither.
inline constexpr std::array kReflectionModules = {
    ReflectionModule{ReflectionModel::MetallicRoughness, Feature::MetallicRoughness,
                     "snippet/reflection_metallic_roughness.glsl", bit(Feature::MetallicRoughnessTexture)},
    ReflectionModule{ReflectionModel::BlinnPhong, Feature::BlinnPhong, "snippet/reflection_blinn_phong.glsl",
                     bit(Feature::SpecularTexture)},
    ReflectionModule{ReflectionModel::Lambert, Feature::Lambert, "snippet/reflection_lambert.glsl", 0},
    ReflectionModule{ReflectionModel::Phong, Feature::Phong, "snippet/reflection_phong.glsl",
                     bit(Feature::SpecularTexture)},
    ReflectionModule{ReflectionModel::PhongGated, Feature::PhongGated, "snippet/reflection_phong_gated.glsl",
                     bit(Feature::SpecularTexture)},
    ReflectionModule{ReflectionModel::Schlick, Feature::Schlick, "snippet/reflection_schlick.glsl",
                     bit(Feature::SpecularTexture)},
    ReflectionModule{ReflectionModel::NormalisedPhong, Feature::NormalisedPhong,
                     "snippet/reflection_normalised_phong.glsl", bit(Feature::SpecularTexture)},
    ReflectionModule{ReflectionModel::PhongBrdf, Feature::PhongBrdf, "snippet/reflection_phong_brdf.glsl",
                     bit(Feature::SpecularTexture)},
    ReflectionModule{ReflectionModel::TorranceSparrow, Feature::TorranceSparrow,
                     "snippet/reflection_torrance_sparrow.glsl", bit(Feature::MetallicRoughnessTexture)},
    ReflectionModule{ReflectionModel::Lafortune, Feature::Lafortune, "snippet/reflection_lafortune.glsl", 0},
    ReflectionModule{ReflectionModel::PhongOriginal, Feature::PhongOriginal, "snippet/reflection_phong_original.glsl",
                     bit(Feature::SpecularTexture)},
    ReflectionModule{ReflectionModel::GeneralSum, Feature::GeneralSum, "snippet/reflection_general_sum.glsl",
                     bit(Feature::SpecularTexture)},
    ReflectionModule{ReflectionModel::OpenGlSum, Feature::OpenGlSum, "snippet/reflection_opengl_sum.glsl",
                     bit(Feature::SpecularTexture)},
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
// Whether a model's highlight is its specular colour times a finite number, as in snippet/classic_material.glsl.
constexpr bool hasClassicHighlight(ReflectionModel model) {
    return model == ReflectionModel::BlinnPhong || model == ReflectionModel::Phong ||
           model == ReflectionModel::PhongGated || model == ReflectionModel::Schlick;
}
// Whether a model looks at a texture.
constexpr bool readsTexture(ReflectionModel model, Feature texture) {
    if (texture == Feature::BaseColourTexture) return true;
    if (model == ReflectionModel::Unlit) return false;
    if (texture != Feature::MetallicRoughnessTexture && texture != Feature::SpecularTexture) return true;
    for (const ReflectionModule& module : kReflectionModules)
        if (module.model == model) return has(module.textures, texture);
    return false;
}
constexpr std::string_view reflectionSnippet(FeatureSet features) {
    for (const ReflectionModule& module : kReflectionModules)
        if (has(features, module.feature)) return module.snippet;
    return kUnlitSnippet;
}

}  // namespace umbriel
