#pragma once

#include "common/scene/nodes.h"

namespace umbriel {

// Light from all around, prefiltered on the client (common/light/environment.h): cubes of faces in OpenGL's order, rows
// from the first texel of a face on. Counts as absent when the sizes do not suit the texels.
struct EnvironmentMap : Container {
    static constexpr std::string_view kTypeName = "EnvironmentMap";
    Single<std::uint32_t> faceSize{0u};  // texels a side of level 0; level k is faceSize / 2^k
    Single<std::uint32_t> levels{0u};
    Multi<glm::vec3> radiance;  // W/(m^2 sr), level by level: level k for roughness k / (levels - 1)
    Single<std::uint32_t> diffuseSize{0u};
    Multi<glm::vec3> convolved;       // with max(cos, 0) / pi
    Multi<glm::vec3> mirroredShares;  // a square: by the cosine with the eye, rows by roughness

    static void declare(TypeBuilder<EnvironmentMap>& type) {
        type.field<&EnvironmentMap::faceSize>("faceSize");
        type.field<&EnvironmentMap::levels>("levels");
        type.field<&EnvironmentMap::radiance>("radiance");
        type.field<&EnvironmentMap::diffuseSize>("diffuseSize");
        type.field<&EnvironmentMap::convolved>("convolved");
        type.field<&EnvironmentMap::mirroredShares>("mirroredShares");
    }
};

// A light: what is below its node mirrors and diffusely reflects an environment, without shadows; dimmed by occlusion
// textures. Of several above each other the innermost counts. Its beacon turns it.
struct EnvironmentLight : Container {
    static constexpr std::string_view kTypeName = "EnvironmentLight";
    Single<bool> on{true};
    Single<Ref<Node>> beacon;
    Single<Ref<EnvironmentMap>> map;
    Single<glm::vec3> scale{glm::vec3(1.0f)};  // multiplies its radiance

    static void declare(TypeBuilder<EnvironmentLight>& type) {
        type.field<&EnvironmentLight::on>("on");
        type.field<&EnvironmentLight::beacon>("beacon");
        type.field<&EnvironmentLight::map>("map");
        type.field<&EnvironmentLight::scale>("scale");
    }
};

// Shows an environment light's map, turned and scaled as the light.
struct EnvironmentBackground : Container {
    static constexpr std::string_view kTypeName = "EnvironmentBackground";
    Single<Ref<EnvironmentLight>> light;

    static void declare(TypeBuilder<EnvironmentBackground>& type) { type.field<&EnvironmentBackground::light>("light"); }
};

}  // namespace umbriel
