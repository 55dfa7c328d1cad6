#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/aspect.h"
#include "common/scene/materials.h"

namespace umbriel {

// The alpha of a texture as the renderer samples it at the finest level: its transform, wrapping and filter
// (snippet/material.glsl). Images without an alpha channel are opaque. A copy: outlives the scene.
class TextureAlpha {
 public:
    // An opaque one when the texture or its image is absent.
    TextureAlpha(const Aspect& scene, Ref<Texture> texture);

    std::uint32_t texCoordSet() const { return _texCoordSet; }
    bool isOpaque() const { return _alpha.empty(); }
    // At a texture coordinate, before the texture's own transform; 0..1.
    double at(const glm::dvec2& texCoord) const;

 private:
    std::uint8_t texel(int x, int y) const;

    int _width = 0;
    int _height = 0;
    std::vector<std::uint8_t> _alpha;
    std::uint32_t _texCoordSet = 0;
    WrapMode _wrapS = WrapMode::Repeat;
    WrapMode _wrapT = WrapMode::Repeat;
    bool _isLinear = true;
    glm::dvec2 _rowU{1.0, 0.0};
    glm::dvec2 _rowV{0.0, 1.0};
    glm::dvec2 _offset{0.0};
};

}  // namespace umbriel
