#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/bake/light_map_bake.h"
#include "common/base/result.h"
#include "common/image/image.h"

namespace umbriel {

// A light map as it is kept, .umlight: what was baked, and the states (common/scene/light_map_state.h) of what it was
// baked of. Little-endian:
//
//     bytes 0..7   "UMLIGHT1"
//     u32          texels along each side
//     u32 x 4      how many lights, surfaces, triangles of all surfaces, charts
//     per light    u64 state, u32 length, its name for people
//     per surface  u64 state, u32 triangles
//     per triangle u32 chart, 2^32 - 1: none
//     per chart    12 f32
//     texels       bytes, light after light, first row at v = 0
//     u64, u64     XXH3-128 of everything before
//
// The same scene, lights and settings give the same bytes, whatever the number of threads.
struct LightMapFile {
    BakedLightMap baked;  // its counts are not kept
    std::vector<std::uint64_t> lightStates;
    std::vector<std::string> lightNames;
    std::vector<std::uint64_t> states;  // by surface
};

// The file appears by rename. Failure: the disk.
Result<void> writeLightMap(const std::filesystem::path& path, const LightMapFile& file);

// Bad input: no such file, none of these, cut short or damaged, another version, sizes beyond the limits.
Result<LightMapFile> readLightMap(const std::filesystem::path& path);

// The atlas for eyes: a layer "light0", "light1"... with the factors of each light, whose names are text attributes;
// the first row at the top. R, G, B are the first light's factors, A is 1.
LayeredImage atlasPicture(const LightMapFile& file);

// SCENE.umlight, beside the scene; of demos in the current folder.
std::filesystem::path lightMapFileOf(const std::string& scene);

}  // namespace umbriel
