#include "common/wall/tile_pixels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace umbriel {
namespace {

template <class T>
std::vector<float> converted(ComponentType type, const std::vector<T>& values) {
    std::vector<float> floats(values.size(), -1.0f);
    convertToFloats(type, std::as_bytes(std::span(values)), floats);
    return floats;
}

TEST(TileLayerValues, FloatsKeepTheirBits) {
    const std::vector<float> values{0.1f, -0.0f, std::numeric_limits<float>::infinity(), std::nanf("77"), 1e-42f};
    const auto floats = converted(ComponentType::Float, values);
    EXPECT_EQ(std::memcmp(floats.data(), values.data(), values.size() * sizeof(float)), 0);
    EXPECT_TRUE(converted(ComponentType::Float, std::vector<float>()).empty());
}

TEST(TileLayerValues, BytesAre255ths) {
    std::vector<std::uint8_t> values(256);
    for (int i = 0; i < 256; ++i) values[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(i);
    const auto floats = converted(ComponentType::Byte, values);
    for (int i = 0; i < 256; ++i) EXPECT_EQ(floats[static_cast<std::size_t>(i)], static_cast<float>(i / 255.0)) << i;
    EXPECT_EQ(floats[255], 1.0f);
}

// At any place and of any number, as loops over many at once have ends.
TEST(TileLayerValues, HalvesAreTheirFloatsWhereverTheyLie) {
    std::vector<std::uint16_t> all(65536);
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint16_t>(i);
    const auto floats = converted(ComponentType::Half, all);
    EXPECT_EQ(floats[0x3555], 0x1.554p-2f);
    EXPECT_EQ(floats[0x0001], 0x1p-24f);
    EXPECT_TRUE(std::isinf(floats[0xfc00]));
    EXPECT_TRUE(std::isnan(floats[0x7e00]));
    std::vector<std::byte> bytes(1 + all.size() * 2);
    std::memcpy(bytes.data() + 1, all.data(), all.size() * 2);
    for (std::size_t count = 1; count < 40; ++count) {
        std::vector<float> some(count);
        const std::size_t first = 1000 * count;
        convertToFloats(ComponentType::Half, std::span(bytes).subspan(1 + first * 2, count * 2), some);
        EXPECT_EQ(std::memcmp(some.data(), floats.data() + first, count * sizeof(float)), 0) << count;
    }
}

}  // namespace
}  // namespace umbriel
