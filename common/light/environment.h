#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/math/glm.h"

namespace umbriel {

// A panorama: radiance by direction, columns x rows, first row at the top (+Y); where a direction is, says
// shaders/formula/environment.glsl: the middle is straight ahead, -Z, and +X right of it.
struct Panorama {
    int columns = 0;
    int rows = 0;
    std::vector<glm::vec3> radiance;

    const glm::vec3& at(int column, int row) const {
        return radiance[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                        static_cast<std::size_t>(column)];
    }
};

// What a panorama held that no light is.
struct PanoramaRepairs {
    std::uint64_t negative = 0;   // samples below 0: 0 now
    std::uint64_t notFinite = 0;  // NaN and infinite samples: 0 and kLargestRadiance now
    std::uint64_t tooLarge = 0;   // above kLargestRadiance: cut to it
};
// Sums of some thousand texels stay far within float.
inline constexpr float kLargestRadiance = 1e30f;
PanoramaRepairs repair(Panorama& panorama);

// Turned by half a circle about +Y: from and to the convention of OpenEXR's `latlong` maps, whose middle is +Z with +X
// left of it.
Panorama halfTurned(const Panorama& panorama);

// Six square views of 90 degrees in OpenGL's order of cube faces, each side x side, rows from the first texel of a
// cube map's face on, as a panorama of 4 side columns.
Panorama panoramaFromFaces(const std::vector<std::vector<glm::vec3>>& faces, int side);

// The point of the cube of half side 1 that a place in [0, 1]^2 on a face of OpenGL's shows.
glm::vec3 cubeDirection(int face, const glm::vec2& place);

// What the servers look up in place of an environment: cubes of faces in OpenGL's order, rows from the first texel on.
struct PrefilteredEnvironment {
    // Level by level, each half as large as the one before: level 0 the environment itself, level k what a GGX lobe of
    // perceptual roughness k / (levels - 1) sees of it around the mirror direction, seen along the normal.
    int faceSize = 0;
    int levels = 0;
    std::vector<glm::vec3> radiance;
    // The environment convolved with max(cos, 0) / pi: what an ideal diffuse surface of that normal reflects.
    int diffuseSize = 0;
    std::vector<glm::vec3> convolved;
};
inline constexpr int kEnvironmentLevels = 6;
inline constexpr int kDiffuseFaceSize = 16;

// faceSize: a power of two, at least 32; 0: a quarter of the columns, at most 256. An even environment stays even, to
// rounding, in all of it. Deterministic.
PrefilteredEnvironment prefilter(const Panorama& panorama, int faceSize = 0);

// How much of an even environment a GGX surface mirrors: reflectance at normal incidence * x + y (the split sum of
// Karis 2013, "Real Shading in Unreal Engine 4", with our distribution and visibility); z: the average over the light's
// directions, by cosine, of (1 - cos)^5 at the half vector, which Fresnel takes from the diffuse part.
// kReflectanceSide columns over the cosine between normal and eye and rows over roughness, at the middles of their
// texels.
inline constexpr int kReflectanceSide = 32;
std::vector<glm::vec3> mirroredShares();

}  // namespace umbriel
