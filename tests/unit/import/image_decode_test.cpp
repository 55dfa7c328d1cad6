#include "client/import/image_decode.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace umbriel {
namespace {

// A PNG's signature and its first chunk.
std::vector<std::byte> pngOf(std::uint32_t width, std::uint32_t height) {
    std::string text("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", 16);
    for (const std::uint32_t number : {width, height})
        for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>(number >> shift & 255);
    text += std::string("\x08\x02\0\0\0\0\0\0\0", 9);
    const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
    return {bytes, bytes + text.size()};
}

std::string reasonOf(const std::vector<std::byte>& picture) {
    ByteBudget budget(1 << 20, "the scene");
    try {
        decodeImage(picture, 16384, budget, "images[0]");
    } catch (const ImportRefused& refused) {
        return refused.what();
    }
    return "";
}

TEST(ImageDecode, APictureThatIsTooLargeIsCalledThat) {
    for (const auto& [width, height] : {std::pair{60000u, 60000u}, {16385u, 1u}, {1u, 16385u}, {4000000000u, 2u}})
        EXPECT_EQ(reasonOf(pngOf(width, height)), "images[0]: " + std::to_string(width) + " x " +
                                                      std::to_string(height) +
                                                      " texels are too many, 16384 a side is the limit; scale it down");
}

TEST(ImageDecode, OtherPicturesAreRefusedForWhatTheyAre) {
    EXPECT_NE(reasonOf(pngOf(0, 5)).find("cannot be decoded"), std::string::npos);
    EXPECT_NE(reasonOf(pngOf(16384, 2)).find("cannot be decoded"), std::string::npos);  // ends there
    std::vector<std::byte> cut = pngOf(60000, 60000);
    cut.resize(20);
    EXPECT_NE(reasonOf(cut).find("cannot be decoded"), std::string::npos);
    EXPECT_NE(reasonOf(std::vector<std::byte>(40)).find("neither PNG nor JPEG"), std::string::npos);
}

}  // namespace
}  // namespace umbriel
