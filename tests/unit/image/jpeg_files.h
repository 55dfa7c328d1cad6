#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace umbriel::test {

// A JPEG file, R, G, B interleaved, top row first, at the best quality.
std::string jpegOf(int width, int height, const std::vector<std::uint8_t>& codes);

// The same with an EXIF segment that says the exposure time, the f-number (in tenths) and the ISO speed.
std::string withExif(const std::string& jpeg, std::uint32_t numerator, std::uint32_t denominator,
                     std::uint32_t apertureTenths, std::uint16_t isoSpeed);

}  // namespace umbriel::test
