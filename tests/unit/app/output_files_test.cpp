#include "client/app/output_files.h"

#include <gtest/gtest.h>

namespace umbriel {
namespace {

TileLayer factorsOf(const std::string& light, float factor) {
    TileLayer layer;
    layer.layer = Layer::LightFactors;
    layer.name = light;
    layer.channels = 1;
    const std::vector<float> values(4, factor);
    const auto* bytes = reinterpret_cast<const std::byte*>(values.data());
    layer.pixels.assign(bytes, bytes + values.size() * sizeof(float));
    return layer;
}

TEST(AssembledWall, KeepsTheLayersOfLightsWithTheSameNameApart) {
    std::vector<TilePixels> tiles(2);
    for (int i = 0; i < 2; ++i) {
        tiles[i].tile.pixels = {2 * i, 0, 2, 2};
        // A light may even be called as the second of two is numbered.
        const float first = 0.1f * static_cast<float>(i + 1);
        tiles[i].layers = {factorsOf("lamp", first), factorsOf("lamp", 0.5f), factorsOf("lamp_2", 0.75f),
                           factorsOf("sun", 1.0f)};
    }
    const LayeredImage wall = assembleWall({4, 2}, tiles, Eye::Mono);
    ASSERT_EQ(wall.layers.size(), 4u);
    const auto at = [&](const std::string& name, int x) {
        const FloatImage* layer = wall.floatLayer(name);
        return layer ? layer->at(x, 1, 0) : -1.0f;
    };
    EXPECT_EQ(at("lamp", 0), 0.1f);
    EXPECT_EQ(at("lamp", 3), 0.2f);
    EXPECT_EQ(at("lamp_2", 0), 0.5f);
    EXPECT_EQ(at("lamp_2", 3), 0.5f);
    EXPECT_EQ(at("lamp_2_2", 3), 0.75f);
    EXPECT_EQ(at("sun", 2), 1.0f);
}

// A tile keeps its last picture, which may have come in another precision.
TEST(AssembledWall, TilesOfEveryPrecisionStandBesideEachOther) {
    std::vector<TilePixels> tiles(3);
    const std::vector<float> floats(2 * 4, 0.5f);
    const std::vector<std::uint16_t> halves(2 * 4, 0x3800);
    const std::vector<std::uint8_t> bytes(2 * 4, 51);
    const auto fill = [&](std::size_t i, ComponentType type, std::span<const std::byte> pixels) {
        tiles[i].tile.pixels = {static_cast<std::int32_t>(i), 0, 1, 2};
        TileLayer& layer = tiles[i].layers.emplace_back();
        layer.components = type;
        layer.pixels.assign(pixels.begin(), pixels.end());
    };
    fill(0, ComponentType::Float, std::as_bytes(std::span(floats)));
    fill(1, ComponentType::Half, std::as_bytes(std::span(halves)));
    fill(2, ComponentType::Byte, std::as_bytes(std::span(bytes)));
    const LayeredImage wall = assembleWall({3, 2}, tiles, Eye::Mono);
    for (int y = 0; y < 2; ++y)
        for (int channel = 0; channel < 4; ++channel) {
            EXPECT_EQ(wall.rgba.at(0, y, channel), 0.5f);
            EXPECT_EQ(wall.rgba.at(1, y, channel), 0.5f);
            EXPECT_EQ(wall.rgba.at(2, y, channel), 0.2f);
        }
}

}  // namespace
}  // namespace umbriel
