#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "common/base/assert.h"
#include "common/math/pixel_rect.h"

namespace umbriel {

// A picture in memory: row 0 is the TOP row and samples are interleaved (pixel by pixel, channel by channel), which
// is the order of PNG and EXR files. OpenGL reads back bottom-up: assemble.h turns tiles over.
//
// Samples are moved, never computed with: NaN payloads, infinities, denormals and -0 survive.
template <class T>
class BasicImage {
 public:
    static_assert(std::is_same_v<T, float> || std::is_same_v<T, std::uint32_t>);

    BasicImage() = default;
    // All samples are `fill`. Sizes are in pixels and not negative.
    BasicImage(int width, int height, std::vector<std::string> channels, T fill = T{})
        : _width(width), _height(height), _channels(std::move(channels)) {
        UMBRIEL_ASSERT(width >= 0 && height >= 0, "an image size is negative");
        _samples.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * _channels.size(), fill);
    }

    int width() const { return _width; }
    int height() const { return _height; }
    std::size_t pixelCount() const { return static_cast<std::size_t>(_width) * static_cast<std::size_t>(_height); }
    int channelCount() const { return static_cast<int>(_channels.size()); }
    // Names as in an EXR file without the layer's name: "R", "Z", "node".
    const std::vector<std::string>& channels() const { return _channels; }

    // x counts from the left, y from the top.
    T& at(int x, int y, int channel) { return _samples[index(x, y, channel)]; }
    const T& at(int x, int y, int channel) const { return _samples[index(x, y, channel)]; }

    // All channels of one pixel, channelCount() values.
    T* pixel(int x, int y) { return _samples.data() + index(x, y, 0); }
    const T* pixel(int x, int y) const { return _samples.data() + index(x, y, 0); }

    // pixelCount() * channelCount() values, top row first.
    std::vector<T>& samples() { return _samples; }
    const std::vector<T>& samples() const { return _samples; }

 private:
    std::size_t index(int x, int y, int channel) const {
        UMBRIEL_ASSERT(x >= 0 && x < _width && y >= 0 && y < _height && channel >= 0 && channel < channelCount(),
                       "a pixel outside the image was asked for");
        return (static_cast<std::size_t>(y) * static_cast<std::size_t>(_width) + static_cast<std::size_t>(x)) *
                   _channels.size() +
               static_cast<std::size_t>(channel);
    }

    int _width = 0;
    int _height = 0;
    std::vector<std::string> _channels;
    std::vector<T> _samples;
};

using FloatImage = BasicImage<float>;
using UintImage = BasicImage<std::uint32_t>;  // ids: not interpolated, not exposed

// R, G, B linear and premultiplied by A, as EXR demands; A is coverage. All 0: background not set.
inline FloatImage makeRgbaImage(int width, int height) {
    return {width, height, {"R", "G", "B", "A"}};
}

// A named set of channels beside the colour, for example "depth" (Z), "position" (X, Y, Z), "normal" (X, Y, Z),
// "ids" (node, primitive; UINT), "light.<name>" (factor). In the file its channels are called `name.channel`; the
// empty name stands for top-level channels such as a plain `Z`.
struct ImageLayer {
    std::string name;
    std::variant<FloatImage, UintImage> image;

    bool isUint() const { return std::holds_alternative<UintImage>(image); }
    int width() const {
        return std::visit([](const auto& i) { return i.width(); }, image);
    }
    int height() const {
        return std::visit([](const auto& i) { return i.height(); }, image);
    }
    const std::vector<std::string>& channels() const {
        return std::visit([](const auto& i) -> const std::vector<std::string>& { return i.channels(); }, image);
    }
};

// In LayeredImage::texts of a picture that an EXR file calls an environment map (OpenEXR's attribute `envmap`):
// "latlong" or "cube".
inline constexpr std::string_view kEnvironmentKindText = "environmentMap";

// What one picture file holds. Every layer has the size of `rgba`.
struct LayeredImage {
    FloatImage rgba;                           // always R, G, B, A
    std::vector<ImageLayer> layers;            // a reader sorts them by name, FLOAT before UINT
    std::map<std::string, std::string> texts;  // attributes; must not have the name of one of EXR's own
    std::map<std::string, float> numbers;

    int width() const { return rgba.width(); }
    int height() const { return rgba.height(); }

    // Null when there is none of that name and type.
    const FloatImage* floatLayer(std::string_view name) const { return find<FloatImage>(name); }
    const UintImage* uintLayer(std::string_view name) const { return find<UintImage>(name); }

 private:
    template <class Image>
    const Image* find(std::string_view name) const {
        for (const ImageLayer& layer : layers) {
            if (layer.name == name) {
                if (const Image* image = std::get_if<Image>(&layer.image)) {
                    return image;
                }
            }
        }
        return nullptr;
    }
};

// The same rectangle counted from the other edge: from the bottom to from the top, and back.
inline PixelRect turnedOver(PixelRect rect, int imageHeight) {
    rect.y = imageHeight - rect.y - rect.height;
    return rect;
}

// What a reader may cost. Checked before samples are allocated.
struct ImageLimits {
    std::uint64_t pixels = std::uint64_t{1} << 28;
    std::uint64_t bytes = std::uint64_t{1} << 30;  // decoded samples of all channels, with the decoder's own copy
    std::uint64_t fileBytes = std::uint64_t{1} << 32;
    int channels = 128;
};

}  // namespace umbriel
