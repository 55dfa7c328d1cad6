#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/image/image.h"
#include "common/image/tone_mapping.h"

namespace umbriel {

// How linear radiance becomes 8 bits.
struct PngOptions {
    double exposure = 0.0;  // EV
    // Off: opaque RGB, the premultiplied colours composited over black, which leaves them as they are.
    // On: RGBA with straight alpha, as PNG demands: colours are divided by their coverage before encoding; where
    // coverage is 0 the colour is 0.
    bool alpha = false;
    ToneMapping toneMapping = ToneMapping::Clamp;  // in place of the display transform's clamp
};

// Shows R, G, B, A through the display transform (display.h) as an 8-bit sRGB file. The same picture gives the same
// bytes (of one libpng and zlib version); the file appears by rename (atomic_file.h).
Result<void> writePng(const std::filesystem::path& path, const FloatImage& rgba, const PngOptions& options = {});

// Writes bytes that are encoded already, top row first, interleaved; `channels` 3 (RGB) or 4 (RGBA, straight alpha).
Result<void> writePngBytes(const std::filesystem::path& path, int width, int height, int channels,
                           std::span<const std::uint8_t> samples);

// The bytes of such a file. A picture that is not empty (asserted).
Result<std::vector<std::uint8_t>> encodePng(int width, int height, int channels, std::span<const std::uint8_t> samples);

// Reads 1 to 16 bits per channel, grey, palette or colour, with or without alpha, into linear floats premultiplied by
// alpha. Samples are taken as sRGB whatever gAMA, cHRM or ICC chunks say. Sizes beyond the limits are refused before
// samples are allocated.
Result<LayeredImage> readPng(const std::filesystem::path& path, const ImageLimits& limits = {});

}  // namespace umbriel
