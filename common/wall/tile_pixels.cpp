#include "common/wall/tile_pixels.h"

#include <cstring>

#include "common/base/assert.h"
#include "common/math/half.h"

namespace umbriel {
namespace {

template <class T, class Convert>
void convertEach(std::span<const std::byte> bytes, std::span<float> floats, const Convert& convert) {
    for (std::size_t i = 0; i < floats.size(); ++i) {
        T value;
        std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
        floats[i] = convert(value);
    }
}

}  // namespace

void convertToFloats(ComponentType type, std::span<const std::byte> bytes, std::span<float> floats) {
    UMBRIEL_ASSERT(bytes.size() == floats.size() * bytesOf(type), "as many values as there is room for");
    switch (type) {
        case ComponentType::Float:
            if (!floats.empty()) std::memcpy(floats.data(), bytes.data(), bytes.size());
            return;
        case ComponentType::Half:
            return convertEach<std::uint16_t>(bytes, floats, [](std::uint16_t value) { return floatFromHalf(value); });
        case ComponentType::Byte:
            return convertEach<std::uint8_t>(bytes, floats,
                                             [](std::uint8_t value) { return static_cast<float>(value) / 255.0f; });
        case ComponentType::Uint:
            break;
    }
    UMBRIEL_ASSERT(false, "numbers of nodes and triangles are no floats");
}

}  // namespace umbriel
