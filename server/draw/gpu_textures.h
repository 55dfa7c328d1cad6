#pragma once

#include <map>
#include <tuple>
#include <unordered_map>

#include "common/scene/aspect.h"
#include "common/scene/materials.h"
#include "server/gl/texture.h"

namespace umbriel {

// The scene's images on the GPU, once per image and colour space, and the samplers they are read with. An image is kept
// as RGBA8 with a full mip chain where a texture asks for mips; grey images are spread over RGB.
class GpuTextures {
 public:
    // budgetBytes: of all images together. maxSize: texels a side.
    GpuTextures(std::size_t budgetBytes, int maxSize) : _budgetBytes(budgetBytes), _maxSize(maxSize) {}

    // sRgb: colours; otherwise data. Null when there is no such image, its size does not fit its texels, or it is
    // larger than the driver's limit. Error: over the budget, or the driver is out of memory.
    Result<const gl::Texture2D*> find(const Aspect& scene, ContainerId image, bool sRgb, bool mips);
    // Whether find() would return one.
    bool isUsable(const Aspect& scene, ContainerId image) const;
    const gl::Sampler& samplerFor(const Texture& texture);
    const gl::Sampler& plainSampler();  // linear, clamped, no mips

    // The image's texels or size changed, or it is gone.
    void forget(ContainerId image);
    std::size_t bytes() const { return _bytes; }

 private:
    struct Entry {
        gl::Texture2D texture;
        bool mips = false;
        std::size_t bytes = 0;
    };
    using Key = std::pair<ContainerId, bool>;
    std::size_t _budgetBytes;
    int _maxSize;
    std::size_t _bytes = 0;
    std::map<Key, Entry> _entries;
    std::map<std::tuple<WrapMode, WrapMode, FilterMode, FilterMode, MipMode>, gl::Sampler> _samplers;
    gl::Sampler _plain;
};

}  // namespace umbriel
