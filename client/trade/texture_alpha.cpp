#include "client/trade/texture_alpha.h"

#include <algorithm>
#include <cmath>

namespace umbriel {
namespace {

int wrapped(int i, int size, WrapMode mode) {
    if (mode == WrapMode::ClampToEdge) return std::clamp(i, 0, size - 1);
    const int period = mode == WrapMode::Repeat ? size : 2 * size;
    const int within = ((i % period) + period) % period;
    return within < size ? within : period - 1 - within;
}

}  // namespace

TextureAlpha::TextureAlpha(const Aspect& scene, Ref<Texture> ref) {
    const Texture* texture = scene.find(ref);
    if (!texture) return;
    const Image* image = scene.find(texture->image.get());
    if (!image || image->format.get() != TexelFormat::RGBA8) return;
    const std::size_t texels = std::size_t{image->width.get()} * image->height.get();
    if (texels == 0 || image->texels.size() != 4 * texels) return;
    _width = static_cast<int>(image->width.get());
    _height = static_cast<int>(image->height.get());
    const std::vector<std::uint8_t> bytes = image->texels.toVector();
    _alpha.reserve(texels);
    for (std::size_t i = 0; i < texels; ++i) _alpha.push_back(bytes[4 * i + 3]);
    _texCoordSet = texture->texCoordSet.get() == 0 ? 0 : 1;
    _wrapS = texture->wrapS;
    _wrapT = texture->wrapT;
    _isLinear = texture->magFilter.get() == FilterMode::Linear;
    const double c = std::cos(static_cast<double>(texture->rotation.get()));
    const double s = std::sin(static_cast<double>(texture->rotation.get()));
    const glm::dvec2 scale(texture->scale.get());
    _rowU = {c * scale.x, s * scale.y};
    _rowV = {-s * scale.x, c * scale.y};
    _offset = glm::dvec2(texture->offset.get());
}

std::uint8_t TextureAlpha::texel(int x, int y) const {
    const int column = wrapped(x, _width, _wrapS), row = wrapped(y, _height, _wrapT);
    return _alpha[static_cast<std::size_t>(row) * static_cast<std::size_t>(_width) + static_cast<std::size_t>(column)];
}

double TextureAlpha::at(const glm::dvec2& texCoord) const {
    if (_alpha.empty()) return 1.0;
    const glm::dvec2 uv(glm::dot(_rowU, texCoord) + _offset.x, glm::dot(_rowV, texCoord) + _offset.y);
    // Beyond this no texel is told from its neighbour, and int would overflow.
    if (!(std::abs(uv.x) < 1e5 && std::abs(uv.y) < 1e5)) return 1.0;
    const double x = uv.x * _width, y = uv.y * _height;
    if (!_isLinear) return texel(static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y))) / 255.0;
    const int column = static_cast<int>(std::floor(x - 0.5)), row = static_cast<int>(std::floor(y - 0.5));
    const double fx = x - 0.5 - column, fy = y - 0.5 - row;
    const double top = texel(column, row) * (1.0 - fx) + texel(column + 1, row) * fx;
    const double bottom = texel(column, row + 1) * (1.0 - fx) + texel(column + 1, row + 1) * fx;
    return (top * (1.0 - fy) + bottom * fy) / 255.0;
}

}  // namespace umbriel
