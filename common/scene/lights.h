#pragma once

#include "common/scene/nodes.h"

namespace umbriel {

// A light is the core of a node and lights what is below that node. It stands where its beacon stands: at the beacon
// node's origin, shining along the beacon's -z (glTF); without a beacon, its own node is taken.

// Every light but the ambient one carries two shares for the textbook's sums, in which a light has three colours: it adds
// ambientShare of its irradiance / pi to the ambient light around (a_i; faded as the rest, unshadowed), and highlights see
// highlightShare of it (s_i). The defaults are those of physics.

// How light fades with distance: 1/d^2, or the artist's min(1 / (kc + kl d + kq d^2), 1) with attenuation = (kc, kl, kq);
// an intensity then counts as the irradiance where that is 1.
enum class LightFade : std::uint32_t { InverseSquare, Polynomial };
template <> inline constexpr std::uint32_t kEnumCount<LightFade> = 2;

// How a spot fades away from its axis: between an inner and an outer angle (glTF); max(p.l, 0)^exponent, 0 outside of the
// outer angle (the textbook's case formula); or min(max(p.l, 0)^exponent / (kc + kl d + kq d^2), 1) without a cone (5.2).
enum class SpotFalloff : std::uint32_t { Edge, Cone, Product };
template <> inline constexpr std::uint32_t kEnumCount<SpotFalloff> = 3;

// Constant irradiance from far away.
struct DirectionalLight : Container {
    static constexpr std::string_view kTypeName = "DirectionalLight";
    Single<bool> on{true};
    Single<Ref<Node>> beacon;
    Single<glm::vec3> irradiance{glm::vec3(1.0f)};  // W/m^2 on a surface facing the light
    Single<bool> castsShadow{true};
    Single<glm::vec3> ambientShare{glm::vec3(0.0f)};
    Single<glm::vec3> highlightShare{glm::vec3(1.0f)};
    Single<float> angularRadius{0.0f};              // radians, of the luminous disc; for soft shadows

    static void declare(TypeBuilder<DirectionalLight>& type) {
        type.field<&DirectionalLight::on>("on");
        type.field<&DirectionalLight::beacon>("beacon");
        type.field<&DirectionalLight::irradiance>("irradiance");
        type.field<&DirectionalLight::castsShadow>("castsShadow");
        type.field<&DirectionalLight::ambientShare>("ambientShare");
        type.field<&DirectionalLight::highlightShare>("highlightShare");
        type.field<&DirectionalLight::angularRadius>("angularRadius");
    }
};

// Radiates evenly in all directions; irradiance falls with 1/d^2.
struct PointLight : Container {
    static constexpr std::string_view kTypeName = "PointLight";
    Single<bool> on{true};
    Single<Ref<Node>> beacon;
    Single<glm::vec3> intensity{glm::vec3(1.0f)};  // W/sr
    Single<float> range{0.0f};                     // metres, where it has faded to nothing; 0: never
    Single<float> radius{0.0f};                    // metres, of the luminous sphere; for soft shadows
    Single<bool> castsShadow{true};
    Single<LightFade> fade{LightFade::InverseSquare};
    Single<glm::vec3> attenuation{glm::vec3(1.0f, 0.0f, 0.0f)};  // kc, kl (1/m), kq (1/m^2)
    Single<glm::vec3> ambientShare{glm::vec3(0.0f)};
    Single<glm::vec3> highlightShare{glm::vec3(1.0f)};

    static void declare(TypeBuilder<PointLight>& type) {
        type.field<&PointLight::on>("on");
        type.field<&PointLight::beacon>("beacon");
        type.field<&PointLight::intensity>("intensity");
        type.field<&PointLight::range>("range");
        type.field<&PointLight::radius>("radius");
        type.field<&PointLight::castsShadow>("castsShadow");
        type.field<&PointLight::fade>("fade");
        type.field<&PointLight::attenuation>("attenuation");
        type.field<&PointLight::ambientShare>("ambientShare");
        type.field<&PointLight::highlightShare>("highlightShare");
    }
};

// A point light inside a cone; full up to the inner angle, nothing from the outer angle on (glTF).
struct SpotLight : Container {
    static constexpr std::string_view kTypeName = "SpotLight";
    Single<bool> on{true};
    Single<Ref<Node>> beacon;
    Single<glm::vec3> intensity{glm::vec3(1.0f)};  // W/sr on the axis
    Single<float> range{0.0f};
    Single<float> innerAngle{0.0f};                // radians from the axis, 0 <= inner < outer <= pi/2
    Single<float> outerAngle{0.785398163f};        // of SpotFalloff::Cone up to pi
    Single<float> radius{0.0f};
    Single<bool> castsShadow{true};
    Single<LightFade> fade{LightFade::InverseSquare};
    Single<glm::vec3> attenuation{glm::vec3(1.0f, 0.0f, 0.0f)};  // kc, kl (1/m), kq (1/m^2)
    Single<SpotFalloff> falloff{SpotFalloff::Edge};
    Single<float> exponent{1.0f};                  // [0, 1e6]
    Single<glm::vec3> ambientShare{glm::vec3(0.0f)};
    Single<glm::vec3> highlightShare{glm::vec3(1.0f)};

    static void declare(TypeBuilder<SpotLight>& type) {
        type.field<&SpotLight::on>("on");
        type.field<&SpotLight::beacon>("beacon");
        type.field<&SpotLight::intensity>("intensity");
        type.field<&SpotLight::range>("range");
        type.field<&SpotLight::innerAngle>("innerAngle");
        type.field<&SpotLight::outerAngle>("outerAngle");
        type.field<&SpotLight::radius>("radius");
        type.field<&SpotLight::castsShadow>("castsShadow");
        type.field<&SpotLight::fade>("fade");
        type.field<&SpotLight::attenuation>("attenuation");
        type.field<&SpotLight::falloff>("falloff");
        type.field<&SpotLight::exponent>("exponent");
        type.field<&SpotLight::ambientShare>("ambientShare");
        type.field<&SpotLight::highlightShare>("highlightShare");
    }
};

// The luminous intensity of a luminaire over directions, on a regular grid: columns of C, column i at 2 pi i / columns,
// and rows of gamma, row j at pi j / (rows - 1) from nadir. Several lights may share one. In the light's frame nadir is
// -z, C = 0 lies towards +x, C = pi/2 towards +y.
struct IntensityTable : Container {
    static constexpr std::string_view kTypeName = "IntensityTable";
    static constexpr std::uint32_t kMaxSide = 4096;
    Single<std::uint32_t> columns{0u};  // 1 to kMaxSide
    Single<std::uint32_t> rows{0u};     // 2 to kMaxSide
    Multi<float> shares;                // of the brightest entry, row by row; of another length the light is dark

    static void declare(TypeBuilder<IntensityTable>& type) {
        type.field<&IntensityTable::columns>("columns");
        type.field<&IntensityTable::rows>("rows");
        type.field<&IntensityTable::shares>("shares");
    }
};

// A point light whose intensity depends on the direction, from a photometric file.
struct GoniometricLight : Container {
    static constexpr std::string_view kTypeName = "GoniometricLight";
    Single<bool> on{true};
    Single<Ref<Node>> beacon;
    Single<glm::vec3> intensity{glm::vec3(1.0f)};  // W/sr where the table is 1
    Single<Ref<IntensityTable>> table;
    Single<float> range{0.0f};
    Single<float> radius{0.0f};
    Single<bool> castsShadow{true};
    Single<LightFade> fade{LightFade::InverseSquare};
    Single<glm::vec3> attenuation{glm::vec3(1.0f, 0.0f, 0.0f)};  // kc, kl (1/m), kq (1/m^2)
    Single<glm::vec3> ambientShare{glm::vec3(0.0f)};
    Single<glm::vec3> highlightShare{glm::vec3(1.0f)};

    static void declare(TypeBuilder<GoniometricLight>& type) {
        type.field<&GoniometricLight::on>("on");
        type.field<&GoniometricLight::beacon>("beacon");
        type.field<&GoniometricLight::intensity>("intensity");
        type.field<&GoniometricLight::table>("table");
        type.field<&GoniometricLight::range>("range");
        type.field<&GoniometricLight::radius>("radius");
        type.field<&GoniometricLight::castsShadow>("castsShadow");
        type.field<&GoniometricLight::fade>("fade");
        type.field<&GoniometricLight::attenuation>("attenuation");
        type.field<&GoniometricLight::ambientShare>("ambientShare");
        type.field<&GoniometricLight::highlightShare>("highlightShare");
    }
};

// The same radiance from every direction, unshadowed; dimmed by occlusion textures.
struct AmbientLight : Container {
    static constexpr std::string_view kTypeName = "AmbientLight";
    Single<bool> on{true};
    Single<glm::vec3> radiance{glm::vec3(0.0f)};  // W/(m^2 sr)

    static void declare(TypeBuilder<AmbientLight>& type) {
        type.field<&AmbientLight::on>("on");
        type.field<&AmbientLight::radiance>("radiance");
    }
};

}  // namespace umbriel
