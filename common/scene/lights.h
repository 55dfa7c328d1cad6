#pragma once

#include "common/scene/nodes.h"

namespace umbriel {

// A light is the core of a node and lights what is below that node. It stands where its beacon stands: at the beacon
// node's origin, shining along the beacon's -z (glTF); without a beacon, its own node is taken.

// Constant irradiance from far away.
struct DirectionalLight : Container {
    static constexpr std::string_view kTypeName = "DirectionalLight";
    Single<bool> on{true};
    Single<Ref<Node>> beacon;
    Single<glm::vec3> irradiance{glm::vec3(1.0f)};  // W/m^2 on a surface facing the light
    Single<bool> castsShadow{true};
    Single<float> angularRadius{0.0f};              // radians, of the luminous disc; for soft shadows

    static void declare(TypeBuilder<DirectionalLight>& type) {
        type.field<&DirectionalLight::on>("on");
        type.field<&DirectionalLight::beacon>("beacon");
        type.field<&DirectionalLight::irradiance>("irradiance");
        type.field<&DirectionalLight::castsShadow>("castsShadow");
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

    static void declare(TypeBuilder<PointLight>& type) {
        type.field<&PointLight::on>("on");
        type.field<&PointLight::beacon>("beacon");
        type.field<&PointLight::intensity>("intensity");
        type.field<&PointLight::range>("range");
        type.field<&PointLight::radius>("radius");
        type.field<&PointLight::castsShadow>("castsShadow");
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
    Single<float> outerAngle{0.785398163f};
    Single<float> radius{0.0f};
    Single<bool> castsShadow{true};

    static void declare(TypeBuilder<SpotLight>& type) {
        type.field<&SpotLight::on>("on");
        type.field<&SpotLight::beacon>("beacon");
        type.field<&SpotLight::intensity>("intensity");
        type.field<&SpotLight::range>("range");
        type.field<&SpotLight::innerAngle>("innerAngle");
        type.field<&SpotLight::outerAngle>("outerAngle");
        type.field<&SpotLight::radius>("radius");
        type.field<&SpotLight::castsShadow>("castsShadow");
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
