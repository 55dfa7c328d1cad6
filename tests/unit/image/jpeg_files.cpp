#include "tests/unit/image/jpeg_files.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace umbriel::test {
namespace {

void append(std::string& bytes, std::uint32_t value, int count) {  // little-endian, as "II" says
    for (int i = 0; i < count; ++i) {
        bytes.push_back(static_cast<char>(value >> (8 * i)));
    }
}

void appendEntry(std::string& bytes, std::uint16_t tag, std::uint16_t type, std::uint32_t value) {
    append(bytes, tag, 2);
    append(bytes, type, 2);
    append(bytes, 1, 4);
    append(bytes, value, 4);
}

}  // namespace

std::string jpegOf(int width, int height, const std::vector<std::uint8_t>& codes) {
    std::string bytes;
    stbi_write_jpg_to_func(
        [](void* context, void* data, int size) {
            static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
        },
        &bytes, width, height, 3, codes.data(), 100);
    return bytes;
}

std::string withExif(const std::string& jpeg, std::uint32_t numerator, std::uint32_t denominator,
                     std::uint32_t apertureTenths, std::uint16_t isoSpeed) {
    constexpr std::uint16_t kShort = 3;
    constexpr std::uint16_t kLong = 4;
    constexpr std::uint16_t kRational = 5;
    std::string tiff = "II*";
    tiff.push_back('\0');
    append(tiff, 8, 4);  // IFD 0 at 8: one entry, which points to the EXIF IFD at 26
    append(tiff, 1, 2);
    appendEntry(tiff, 0x8769, kLong, 26);
    append(tiff, 0, 4);
    append(tiff, 3, 2);  // EXIF IFD: 2 + 3 * 12 + 4 bytes, so the rationals lie at 68
    appendEntry(tiff, 0x829a, kRational, 68);
    appendEntry(tiff, 0x829d, kRational, 76);
    appendEntry(tiff, 0x8827, kShort, isoSpeed);
    append(tiff, 0, 4);
    append(tiff, numerator, 4);
    append(tiff, denominator, 4);
    append(tiff, apertureTenths, 4);
    append(tiff, 10, 4);
    const std::size_t length = 2 + 6 + tiff.size();
    std::string segment = "\xff\xe1";
    segment.push_back(static_cast<char>(length >> 8));
    segment.push_back(static_cast<char>(length));
    segment += std::string("Exif\0\0", 6) + tiff;
    return jpeg.substr(0, 2) + segment + jpeg.substr(2);
}

}  // namespace umbriel::test
