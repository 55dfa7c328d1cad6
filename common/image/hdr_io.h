#pragma once

#include <cstdint>
#include <filesystem>

#include "common/base/result.h"
#include "common/image/image.h"

namespace umbriel {

// What the Radiance format could not hold of a picture.
struct HdrRepairs {
    std::uint64_t negative = 0;  // samples below 0: written as 0
    std::uint64_t nan = 0;       // written as 0
    std::uint64_t tooLarge = 0;  // above kHdrMax, infinity among them: written as kHdrMax
};

// The largest value of a channel: 255/256 * 2^127.
constexpr float kHdrMax = 255.0F / 256.0F * 0x1p127F;

// Writes R, G, B as a Radiance picture (32-bit_rle_rgbe, Ward 1991: "Real Pixels", Graphics Gems II): three 8-bit
// mantissas under one exponent, run-length encoded scan lines, top row first. Alpha is not stored: the premultiplied
// colours are what shows over black. The same picture gives the same bytes: no date, no host. The file appears by
// rename (atomic_file.h).
//
// Error: mantissas are rounded to the nearest, so with M the largest channel of a pixel each channel is off by at most
// M / 255 (0.39 % of the largest; smaller channels lose bits): M / 256, and a little more where M is rounded up to a
// power of two and the steps double. A pixel whose channels are all below 2^-128 is black. That holds for readers that
// take a mantissa as it stands, as ours does; Radiance's own adds half a step, which doubles it.
//
// Bad input: an empty picture. Failure: the disk.
Result<HdrRepairs> writeHdr(const std::filesystem::path& path, const FloatImage& rgba);

}  // namespace umbriel
