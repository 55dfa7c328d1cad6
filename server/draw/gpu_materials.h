#pragma once

#include <array>
#include <unordered_map>
#include <vector>

#include "common/scene/aspect.h"
#include "common/scene/materials.h"
#include "server/draw/frame_plan.h"
#include "server/draw/gpu_textures.h"
#include "server/gl/buffer.h"

namespace umbriel {

// Texture units of the surface shaders.
enum class TextureUnit : GLuint {
    BaseColour,
    MetallicRoughness,
    Normal,
    Occlusion,
    Emission,
    Specular,
    ShadowMaps,
    FaceNormals,
    Primitives,
    FlatFaces,
    ShadowBounds,
    Darkness,
    Environment = 12,  // and the two after it
    Positions = 15,    // of the passes that draw darkness
    LightMap = 15,     // of surfaces and layers, in views that have one
};
inline constexpr std::size_t kMaterialTextures = 6;

// A material as draw items need it.
struct GpuMaterial {
    FeatureSet features = 0;                                // model, textures, alpha mode, sides
    std::uint32_t slot = 0;                                 // in the block buffer
    std::array<ContainerId, kMaterialTextures> textures{};  // Texture containers by unit; none: not used
    std::array<std::uint32_t, kMaterialTextures> texCoordSets{};
    bool wantsTangents = false;  // beyond a normal map: its highlights have a grain
    bool usesTexCoords(std::uint32_t set) const;
};

// All materials in one uniform buffer, one slot each; a changed material rewrites its slot.
class GpuMaterials {
 public:
    GpuMaterials();

    // Containers that changed or are gone; textures count for the materials that use them.
    void changed(ContainerId id);
    // The material of an id; the default one (white, rough dielectric) when it does not exist.
    const GpuMaterial& find(const Aspect& scene, const GpuTextures& images, ContainerId id);
    // Writes what is new to the GPU; before drawing.
    Result<void> upload();
    // Binds the material's block and textures.
    Result<void> bind(const Aspect& scene, const GpuMaterial& material, GpuTextures& textures) const;
    std::uint64_t bytes() const { return _buffer.size(); }

 private:
    // Written as the std140 block of shaders/stage/material.glsl.
    struct Block {
        glm::vec4 baseColour;
        glm::vec4 metallicRoughness;  // metallic, roughness, normal scale, occlusion strength
        glm::vec4 emission;           // w: alpha cutoff
        glm::vec4 specular;           // w: shininess
        glm::vec4 ambient;            // w: the share that needs no light
        glm::vec4 uvFromTexCoord[kMaterialTextures * 2];  // two rows a texture; w of the first: the set
        glm::vec4 lobes[kMaxLobes * 2];                   // albedo, exponent; axes, 1 where there is a lobe
    };
    struct Entry {
        GpuMaterial material;
        bool isStale = true;
    };
    void fill(const Aspect& scene, const GpuTextures& images, ContainerId id, Entry& entry);

    std::size_t _stride = 0;
    std::vector<std::byte> _content;
    std::vector<std::uint32_t> _dirtySlots;
    std::unordered_map<ContainerId, Entry> _entries;
    std::unordered_map<ContainerId, std::vector<ContainerId>> _usersOfTexture;
    gl::Buffer _buffer;
};

}  // namespace umbriel
