#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/wall/view.h"

namespace umbriel {

// What a channel of a pixel is; the values are those of the protocol.
//   Float: 32 bits. Uint: 32 bits, unsigned. Half: 16 bits. Byte: 8 bits, of which 255 stand for 1.
enum class ComponentType : std::uint32_t { Float, Uint, Half, Byte };

constexpr std::size_t bytesOf(ComponentType type) {
    return type == ComponentType::Byte ? 1 : type == ComponentType::Half ? 2 : 4;
}

// Of a colour that was asked for in this precision.
constexpr ComponentType componentsOf(ColourPrecision precision) {
    switch (precision) {
        case ColourPrecision::Half:
            return ComponentType::Half;
        case ColourPrecision::Byte:
            return ComponentType::Byte;
        case ColourPrecision::Float:
            break;
    }
    return ComponentType::Float;
}

// One layer of a drawn tile: rows bottom-up as GL reads them back, pixels interleaved.
struct TileLayer {
    Layer layer = Layer::Colour;
    std::string name;               // "colour", "depth", "position", "normal", "ids", "light.<name or id>"
    std::uint32_t channels = 4;
    ComponentType components = ComponentType::Float;  // ids: Uint; colours: as asked for
    std::vector<std::byte> pixels;                    // width * height * channels * bytesOf(components)
};

// The picture of one tile, all layers that were asked for.
struct TilePixels {
    TileAssignment tile;
    std::vector<TileLayer> layers;
};

// Values of a layer as floats, each of them exactly (a byte: the float nearest to a 255th of it); infinities and what
// is no number stay so. bytes: of floats.size() components that are not Uint.
void convertToFloats(ComponentType type, std::span<const std::byte> bytes, std::span<float> floats);

}  // namespace umbriel
