#pragma once

#include <epoxy/gl.h>

#include <cstdint>

#include "common/wall/tile_pixels.h"

namespace umbriel {

// How colours of a precision lie in images of the driver. A pixel takes four of bytesOf(componentsOf(precision)).
struct ColourFormat {
    const char* name;
    GLenum internal;
    GLenum type;  // that reads back what is stored, bit by bit
    std::uint32_t pixelBytes;
};

constexpr ColourFormat colourFormatOf(ColourPrecision precision) {
    switch (precision) {
        case ColourPrecision::Half:
            return {"RGBA16F", GL_RGBA16F, GL_HALF_FLOAT, 8};
        case ColourPrecision::Byte:
            return {"RGBA8", GL_RGBA8, GL_UNSIGNED_BYTE, 4};
        case ColourPrecision::Float:
            break;
    }
    return {"RGBA32F", GL_RGBA32F, GL_FLOAT, 16};
}

}  // namespace umbriel
