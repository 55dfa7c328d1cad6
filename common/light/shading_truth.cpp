#include "common/light/shading_truth.h"

#include <algorithm>
#include <cmath>

#include "shaders/formula_cpp.h"

namespace umbriel {
namespace {

namespace f = formula_f64;
using glm::dvec3;

f::ClassicMaterial classicMaterial(const Material& material, const dvec3& diffuse) {
    f::ClassicMaterial classic;
    classic.ambient = dvec3(material.ambient.get());
    classic.diffuse = diffuse;
    classic.specular = dvec3(material.specular.get());
    classic.shininess = material.shininess;
    return classic;
}

f::MetallicRoughness metallicRoughness(const Material& material, const dvec3& baseColour) {
    f::MetallicRoughness made;
    made.baseColour = baseColour;
    made.metallic = std::clamp(material.metallic.get(), 0.0f, 1.0f);
    made.roughness = std::clamp(material.roughness.get(), 0.0f, 1.0f);
    return made;
}

dvec3 lafortune(const Material& material, const ShadedPoint& point, const dvec3& toLight) {
    const double cosLight = glm::dot(point.normalWorld, toLight);
    if (!(cosLight > 0.0)) return dvec3(0.0);
    const dvec3 bitangent = glm::cross(point.normalWorld, point.tangentWorld);
    const auto local = [&](const dvec3& direction) {
        return f::localFromFrame(direction, point.tangentWorld, bitangent, point.normalWorld);
    };
    dvec3 brdf = f::lambertBrdf(point.baseColour);
    const std::size_t count =
        std::min({kMaxLobes, material.lobeAlbedos.size(), material.lobeAxes.size(), material.lobeExponents.size()});
    for (std::size_t i = 0; i < count; ++i) {
        f::LafortuneLobe lobe;
        lobe.albedo = dvec3(glm::vec3(material.lobeAlbedos[i]));
        lobe.axes = dvec3(glm::vec3(material.lobeAxes[i]));
        lobe.exponent = material.lobeExponents[i];
        brdf += f::lafortuneLobe(lobe, local(toLight), local(point.toEyeWorld));
    }
    return brdf * cosLight;
}

// A light's contribution with its highlight dimmed by a share: the model is linear in what the share multiplies.
dvec3 reflected(const Material& material, const ShadedPoint& point, const dvec3& toLight, const dvec3& highlightShare) {
    const dvec3& n = point.normalWorld;
    const dvec3& v = point.toEyeWorld;
    const dvec3& base = point.baseColour;
    const dvec3 specular = dvec3(material.specular.get()) * highlightShare;
    const double shininess = material.shininess;
    const dvec3 diffuse = f::diffuseReflect(base, dvec3(1.0), n, toLight);
    const auto classic = [&](double highlight) { return (diffuse + specular * highlight) * f::kInversePi; };
    switch (material.model.get()) {
        case ReflectionModel::Unlit:
            return dvec3(0.0);
        case ReflectionModel::MetallicRoughness:
            return f::metallicRoughnessReflect(metallicRoughness(material, base), n, toLight, v);
        case ReflectionModel::TorranceSparrow: {
            f::TorranceSparrow made = f::torranceSparrowFrom(metallicRoughness(material, base));
            made.reflectance *= highlightShare;
            return f::torranceSparrowReflect(made, n, toLight, v);
        }
        case ReflectionModel::Lambert:
            return diffuse * f::kInversePi;
        case ReflectionModel::Phong:
        case ReflectionModel::GeneralSum:
            return classic(f::phongHighlight(n, toLight, v, shininess));
        case ReflectionModel::PhongGated:
            return classic(f::phongHighlightGated(n, toLight, v, shininess));
        case ReflectionModel::BlinnPhong:
        case ReflectionModel::OpenGlSum:
            return classic(f::blinnPhongHighlight(n, toLight, v, shininess));
        case ReflectionModel::Schlick:
            return classic(f::schlickHighlight(n, toLight, v, shininess));
        case ReflectionModel::NormalisedPhong:
            return diffuse * f::kInversePi + f::normalisedPhongReflect(specular, shininess, n, toLight, v);
        case ReflectionModel::PhongBrdf:
            return diffuse * f::kInversePi + f::nonReciprocalPhongReflect(specular, shininess, n, toLight, v);
        case ReflectionModel::Lafortune:
            return lafortune(material, point, toLight);
        case ReflectionModel::PhongOriginal: {
            f::PhongOriginal made;
            made.colour = base * (1.0 - static_cast<double>(material.ambientShare.get()));
            made.ambient = 0.0;
            made.specular = specular;
            made.shininess = shininess;
            return f::phongOriginal(made, n, toLight, v) * f::kInversePi;
        }
    }
    return dvec3(0.0);
}

template <class Core>
double fadeOf(const Core& light, double meters) {
    if (light.fade.get() == LightFade::Polynomial) return f::artistAttenuation(meters, dvec3(light.attenuation.get()));
    return f::inverseSquare(meters * meters);
}

double spotShare(const SpotLight& light, const dvec3& fromLight, const dvec3& axis, double meters) {
    const double cosOuter = std::cos(static_cast<double>(light.outerAngle.get()));
    const double exponent = light.exponent;
    switch (light.falloff.get()) {
        case SpotFalloff::Edge:
            break;
        case SpotFalloff::Cone:
            return f::spotCone(fromLight, axis, cosOuter, exponent) * fadeOf(light, meters);
        case SpotFalloff::Product:
            return f::spotClampedProduct(fromLight, axis, exponent, meters, dvec3(light.attenuation.get()));
    }
    const double cosInner = std::cos(static_cast<double>(light.innerAngle.get()));
    return f::spotFactor(glm::dot(fromLight, axis), cosOuter, f::spotScale(cosInner, cosOuter)) * fadeOf(light, meters);
}

double webShare(const Aspect& aspect, const GoniometricLight& light, const LightInEffect& placed,
                const dvec3& fromLight) {
    const IntensityTable* table = aspect.find(light.table.get());
    if (!table || table->columns < 1 || table->rows < 2 ||
        std::size_t{table->columns} * table->rows != table->shares.size())
        return 0.0;
    const dvec3 up = -placed.directionWorld;
    const dvec3 local(glm::dot(fromLight, placed.axisXWorld), glm::dot(fromLight, glm::cross(up, placed.axisXWorld)),
                      glm::dot(fromLight, up));
    const f::WebPlace place =
        f::webPlace(local, static_cast<int>(table->columns.get()), static_cast<int>(table->rows.get()));
    const auto entry = [&](int column, int row) {
        return static_cast<double>(
            table->shares[static_cast<std::size_t>(row) * table->columns + static_cast<std::size_t>(column)]);
    };
    return f::webIntensity(entry(place.column0, place.row0), entry(place.column1, place.row0),
                           entry(place.column0, place.row1), entry(place.column1, place.row1), place.across,
                           place.down);
}

template <class Core>
void takeShares(const Core& light, Arrival& arrival) {
    arrival.ambientShare = dvec3(light.ambientShare.get());
    arrival.highlightShare = dvec3(light.highlightShare.get());
}

}  // namespace

dvec3 reflectedTruth(const Material& material, const ShadedPoint& point, const dvec3& toLightWorld) {
    return reflected(material, point, toLightWorld, dvec3(1.0));
}

dvec3 ambientTruth(const Material& material, const dvec3& baseColour) {
    const dvec3 one(1.0);
    switch (material.model.get()) {
        case ReflectionModel::Unlit:
            return dvec3(0.0);
        case ReflectionModel::MetallicRoughness:
        case ReflectionModel::TorranceSparrow:
            return f::metallicRoughnessAmbient(metallicRoughness(material, baseColour), one, 1.0);
        case ReflectionModel::Lambert:
        case ReflectionModel::PhongBrdf:
        case ReflectionModel::Lafortune:
            return baseColour;
        case ReflectionModel::NormalisedPhong:
            return baseColour + dvec3(material.specular.get());
        case ReflectionModel::PhongOriginal:
            return baseColour * static_cast<double>(material.ambientShare.get());
        case ReflectionModel::BlinnPhong:
        case ReflectionModel::Phong:
        case ReflectionModel::PhongGated:
        case ReflectionModel::Schlick:
        case ReflectionModel::GeneralSum:
        case ReflectionModel::OpenGlSum:
            break;
    }
    return f::ambientReflect(classicMaterial(material, baseColour).ambient, one);
}

Arrival arrivalTruth(const Aspect& aspect, const LightInEffect& light, const dvec3& positionWorld) {
    Arrival arrival;
    if (const auto* sun = aspect.findAs<DirectionalLight>(light.core)) {
        arrival.toLightWorld = -light.directionWorld;
        arrival.irradiance = dvec3(sun->irradiance.get());
        takeShares(*sun, arrival);
        return arrival;
    }
    double squared = 0.0;
    arrival.toLightWorld = f::directionTo(light.positionWorld, positionWorld, squared);
    const double meters = f::lengthOf(light.positionWorld - positionWorld);
    const auto local = [&](const auto& core, double share) {
        arrival.irradiance =
            dvec3(core.intensity.get()) * (share * f::rangeWindow(squared, static_cast<double>(core.range.get())));
        takeShares(core, arrival);
    };
    if (const auto* point = aspect.findAs<PointLight>(light.core))
        local(*point, fadeOf(*point, meters));
    else if (const auto* spot = aspect.findAs<SpotLight>(light.core))
        local(*spot, spotShare(*spot, -arrival.toLightWorld, light.directionWorld, meters));
    else if (const auto* web = aspect.findAs<GoniometricLight>(light.core))
        local(*web, fadeOf(*web, meters) * webShare(aspect, *web, light, -arrival.toLightWorld));
    return arrival;
}

dvec3 radianceTruth(const Aspect& aspect, const Material& material, const ShadedPoint& point,
                    const std::vector<LightInEffect>& lights) {
    if (material.model.get() == ReflectionModel::Unlit) return point.baseColour;
    dvec3 radiance(material.emission.get());
    const dvec3 ambient = ambientTruth(material, point.baseColour);
    for (const LightInEffect& light : lights) {
        if (const auto* everywhere = aspect.findAs<AmbientLight>(light.core)) {
            radiance += ambient * dvec3(everywhere->radiance.get());
            continue;
        }
        const Arrival arrival = arrivalTruth(aspect, light, point.positionWorld);
        radiance += reflected(material, point, arrival.toLightWorld, arrival.highlightShare) * arrival.irradiance;
        radiance += ambient * arrival.ambientShare * arrival.irradiance * f::kInversePi;
        if (material.model.get() == ReflectionModel::PhongOriginal)
            radiance += ambient * arrival.irradiance * f::kInversePi;
    }
    return radiance;
}

}  // namespace umbriel
