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

}  // namespace
}  // namespace umbriel
