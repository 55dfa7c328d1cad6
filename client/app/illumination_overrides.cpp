#include "client/app/illumination_overrides.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace umbriel {
namespace {

bool readsRoughness(ReflectionModel model) {
    return model == ReflectionModel::MetallicRoughness || model == ReflectionModel::TorranceSparrow;
}

// Models whose highlight is a power of the angle to the mirrored light, not of the half angle.
bool mirrorsTheLight(ReflectionModel model) {
    switch (model) {
        case ReflectionModel::Phong:
        case ReflectionModel::PhongGated:
        case ReflectionModel::NormalisedPhong:
        case ReflectionModel::PhongBrdf:
        case ReflectionModel::Lafortune:
        case ReflectionModel::PhongOriginal:
        case ReflectionModel::GeneralSum:
            return true;
        default:
            return false;
    }
}

// What all models have in common: what a material looks like.
struct Look {
    glm::vec3 diffuse{0.0f};
    glm::vec3 reflectance{0.0f};  // of the highlight, as a share of the light
    float halfExponent = 1.0f;    // of the half angle
    float metallic = 0.0f;
    float roughness = 1.0f;
};

constexpr float kDielectric = 0.04f;
constexpr float kMirrorShare = 0.25f;  // the mirrored light turns twice as far as the half vector

// The height of Blinn's highlight that gives back `reflectance` straight on: (s + 8) / 8.
glm::vec3 highlightOf(const glm::vec3& reflectance, float halfExponent) {
    return glm::min(reflectance * ((halfExponent + 8.0f) / 8.0f), glm::vec3(1.0f));
}

Look lookOf(const Material& material) {
    Look look;
    const glm::vec3 base(material.baseColour.get());
    const ReflectionModel model = material.model;
    if (readsRoughness(model)) {
        look.metallic = std::clamp(material.metallic.get(), 0.0f, 1.0f);
        look.roughness = std::clamp(material.roughness.get(), 0.0f, 1.0f);
        look.diffuse = base * (1.0f - look.metallic);
        look.reflectance = glm::mix(glm::vec3(kDielectric), base, look.metallic);
        const float alpha = std::max(look.roughness * look.roughness, 2e-3f);
        look.halfExponent = std::max(2.0f / (alpha * alpha) - 2.0f, 0.0f);
        return look;
    }
    look.diffuse = base;
    look.halfExponent = material.shininess / (mirrorsTheLight(model) ? kMirrorShare : 1.0f);
    look.reflectance = glm::vec3(material.specular.get()) * (8.0f / (look.halfExponent + 8.0f));
    look.roughness = std::clamp(std::pow(2.0f / (look.halfExponent + 2.0f), 0.25f), 0.0f, 1.0f);
    return look;
}

void setClassic(Edit<Material>& edit, const Look& look, ReflectionModel model) {
    const float exponent = std::min(look.halfExponent * (mirrorsTheLight(model) ? kMirrorShare : 1.0f), 1e4f);
    const bool isShare = model == ReflectionModel::NormalisedPhong;  // its specular colour is what comes back in all
    glm::vec3 specular = isShare ? look.reflectance : highlightOf(look.reflectance, look.halfExponent);
    // Phong's BRDF has no 1/pi in it.
    if (model == ReflectionModel::PhongBrdf) specular *= std::numbers::inv_pi_v<float>;
    edit.set<&Material::baseColour>(glm::vec4(look.diffuse, edit.read().baseColour.get().w))
        .set<&Material::specular>(specular)
        .set<&Material::shininess>(exponent)
        .set<&Material::ambient>(glm::min(look.diffuse + look.reflectance, glm::vec3(1.0f)))
        .set<&Material::ambientShare>(0.1f);
    if (model != ReflectionModel::Lafortune) return;
    const glm::vec3 albedo =
        look.reflectance * ((exponent + 2.0f) * 0.5f * std::numbers::inv_pi_v<float>);  // lafortuneMirrorAlbedo
    edit.assign<&Material::lobeAlbedos>(std::vector<glm::vec3>{albedo})
        .assign<&Material::lobeAxes>(std::vector<glm::vec3>{{-1.0f, -1.0f, 1.0f}})
        .assign<&Material::lobeExponents>(std::vector<float>{exponent});
}

}  // namespace

void overrideModel(Aspect& scene, ReflectionModel model) {
    for (const ContainerId id : scene.ids()) {
        const Material* material = scene.findAs<Material>(id);
        if (!material || material->model.get() == model || material->model.get() == ReflectionModel::Unlit) continue;
        const bool hadRoughness = readsRoughness(material->model);
        const Look look = lookOf(*material);
        auto edit = scene.edit(Ref<Material>(id));
        edit.set<&Material::model>(model);
        if (readsRoughness(model)) {
            if (hadRoughness) continue;
            edit.set<&Material::metallic>(look.metallic).set<&Material::roughness>(look.roughness);
        } else if (model != ReflectionModel::Unlit) {
            setClassic(edit, look, model);
        }
    }
}

void overrideShading(Aspect& scene, ShadingFrequency frequency) {
    for (const ContainerId id : scene.ids())
        if (scene.findAs<Geometry>(id)) scene.edit(Ref<Geometry>(id)).set<&Geometry::shading>(frequency);
}

}  // namespace umbriel
