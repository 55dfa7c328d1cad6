#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client/import/import_error.h"
#include "common/scene/aspect.h"
#include "common/scene/materials.h"

namespace umbriel {

// A decoded picture: first row first, 3 (RGB) or 4 (RGBA) bytes a texel; grey is widened so that every texture reads
// alike.
struct DecodedImage {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    int channels = 3;
    std::vector<std::uint8_t> texels;
    bool isGrey = false;  // the file holds one channel, or one and alpha
};

// PNG or JPEG, by content. Width and height are checked against the limit and the budget before the texels are decoded.
// Throws ImportRefused.
DecodedImage decodeImage(std::span<const std::byte> encoded, std::uint32_t largestSide, ByteBudget& sceneBytes,
                         std::string_view place);

// Puts a decoded picture into a new Image container.
Ref<Image> createImage(Aspect& scene, const DecodedImage& decoded, const std::string& name);

}  // namespace umbriel
