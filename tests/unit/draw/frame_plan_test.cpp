#include "server/draw/frame_plan.h"

#include <gtest/gtest.h>

namespace umbriel {
namespace {

constexpr std::int32_t kLimit = 16384;

class FramePlanTest : public ::testing::Test {
 protected:
    FramePlanTest() {
        views.wall = {640, 360};
        views.views.resize(1);
        demand.region = {0, 0, 640, 360};
        TileAssignment tile;
        tile.pixels = {0, 0, 640, 360};
        tiles.push_back(tile);
    }
    FramePlan plan() {
        auto planned = planFrame(views, {demand}, tiles, demand.lights, kLimit);
        EXPECT_TRUE(planned);
        return planned.value();
    }
    std::size_t count(const FramePlan& of, PassKind kind) {
        std::size_t found = 0;
        for (const PlannedPass& pass : of.passes) found += pass.kind == kind;
        return found;
    }

    WallViews views;
    ViewDemand demand;
    std::vector<TileAssignment> tiles;
};

TEST_F(FramePlanTest, AnEmptySceneHasNoPass) {
    const FramePlan empty = plan();
    EXPECT_TRUE(empty.passes.empty());
    EXPECT_TRUE(empty.variants.empty());
}

TEST_F(FramePlanTest, AFeatureAddsExactlyItsPass) {
    demand.surfaces[bit(Feature::MetallicRoughness)] = 3;
    const FramePlan plain = plan();
    EXPECT_EQ(plain.passes.size(), 1u);
    EXPECT_EQ(plain.variants.size(), 1u);
    EXPECT_FALSE(plain.hasPass(PassKind::ShadowMap));

    demand.lights = 1;
    demand.shadows.push_back({.light = "sun", .demand = {.module = "standard", .mapTexels = 512}, .casters = 3});
    const FramePlan shadowed = plan();
    EXPECT_EQ(shadowed.passes.size(), 2u);
    EXPECT_EQ(count(shadowed, PassKind::ShadowMap), 1u);
    EXPECT_EQ(shadowed.bytes - plain.bytes, 512u * 512u * 4u);

    EXPECT_EQ(count(shadowed, PassKind::Deform), 0u);
    demand.deformed.geometries = 2;
    EXPECT_EQ(count(plan(), PassKind::Deform), 1u);
    EXPECT_EQ(plan().passes.front().kind, PassKind::Deform) << "before what draws the vertices";
    demand.surfaces[bit(Feature::AlphaBlend)] = 1;
    EXPECT_EQ(count(plan(), PassKind::Blend), 1u);
    demand.background = BackgroundKind::Gradient;
    EXPECT_EQ(count(plan(), PassKind::Background), 1u);
    demand.foregrounds = 2;
    EXPECT_EQ(count(plan(), PassKind::Foreground), 1u);
    EXPECT_EQ(count(plan(), PassKind::Resolve), 0u);
    views.samples = 4;
    EXPECT_EQ(count(plan(), PassKind::Resolve), 1u);
}

TEST_F(FramePlanTest, LayersAreDrawnWhenAskedFor) {
    demand.surfaces[bit(Feature::MetallicRoughness)] = 3;
    demand.lights = 18;
    const std::uint64_t plain = plan().bytes;
    views.layers |= static_cast<std::uint32_t>(Layer::Depth);
    EXPECT_EQ(count(plan(), PassKind::Layers), 1u);
    EXPECT_EQ(plan().bytes - plain, 640u * 360u * 4u);
    views.layers |= static_cast<std::uint32_t>(Layer::LightFactors);
    EXPECT_EQ(count(plan(), PassKind::Layers), 3u);  // depth; lights 0..15; lights 16, 17
}

TEST_F(FramePlanTest, AnUnwrappedViewHasMapsAndLayersAlone) {
    demand.surfaces[bit(Feature::MetallicRoughness)] = 3;
    demand.background = BackgroundKind::Colour;
    demand.foregrounds = 1;
    demand.lights = 1;
    demand.shadows.push_back({.light = "sun", .demand = {.module = "standard", .mapTexels = 512}, .casters = 3});
    views.layers = static_cast<std::uint32_t>(Layer::Ids) | static_cast<std::uint32_t>(Layer::LightFactors);
    demand.unwrapped = true;
    const FramePlan unwrapped = plan();
    EXPECT_EQ(count(unwrapped, PassKind::ShadowMap), 1u);
    EXPECT_EQ(count(unwrapped, PassKind::Layers), 2u);
    EXPECT_EQ(unwrapped.passes.size(), 3u);
    EXPECT_TRUE(unwrapped.variants.empty());
}

TEST_F(FramePlanTest, ExactTilesRefuseAWallBeyondTheDriver) {
    views.tiles = TileMode::Exact;
    views.wall = {kLimit + 1, 100};
    const auto refused = planFrame(views, {demand}, tiles, 0, kLimit);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, Error::Kind::BadInput);
    EXPECT_NE(refused.error().message.find("16385x100"), std::string::npos);
    EXPECT_NE(refused.error().message.find("--tiles offset"), std::string::npos);
    views.tiles = TileMode::Offset;
    EXPECT_TRUE(planFrame(views, {demand}, tiles, 0, kLimit));
}

TEST_F(FramePlanTest, ExplainNamesPassesTargetsAndVariants) {
    demand.surfaces[bit(Feature::BlinnPhong) | bit(Feature::VertexNormals)] = 7;
    EXPECT_EQ(plan().explain(),
              "passes: 1\n"
              "  view 0 surfaces    reach 0 px -> colour, depth: 7 items, 0 lights\n"
              "targets: 2 (4500.0 KiB)\n"
              "  colour: RGBA32F 640x360 3600.0 KiB\n"
              "  depth: D32F 640x360 900.0 KiB\n"
              "shader variants: 1\n"
              "  7 items: normals blinn-phong\n");
}

TEST_F(FramePlanTest, ColoursTakeTheBytesOfTheirPrecision) {
    demand.surfaces[bit(Feature::BlinnPhong)] = 7;
    views.samples = 4;
    const std::uint64_t pixels = 640 * 360;
    const auto bytesIn = [&](ColourPrecision precision) {
        views.colourPrecision = precision;
        return plan().bytes;
    };
    const std::uint64_t depth = 4 * 4 * pixels;
    EXPECT_EQ(bytesIn(ColourPrecision::Float), depth + 16 * 5 * pixels) << "four samples, and the tile";
    EXPECT_EQ(bytesIn(ColourPrecision::Half), depth + 8 * 5 * pixels);
    EXPECT_EQ(bytesIn(ColourPrecision::Byte), depth + 4 * 5 * pixels);
    EXPECT_NE(plan().explain().find("colour: RGBA8 640x360"), std::string::npos);
}

TEST_F(FramePlanTest, TilesWithinABlockAreNotCopied) {
    const auto isInPlace = [&](PixelRect pixels) {
        const TileAssignment tile{0, pixels, Eye::Mono};
        return isDrawnInPlace(views, {&tile, 1});
    };
    views.wall = {4096, 2048};
    EXPECT_TRUE(isInPlace({1024, 0, 1024, 1024}));
    EXPECT_FALSE(isInPlace({1023, 0, 2, 2}));
    EXPECT_FALSE(isInPlace({0, 1000, 10, 25}));
    views.tiles = TileMode::Exact;
    EXPECT_TRUE(isInPlace({1023, 0, 2, 2}));
    views.samples = 4;
    EXPECT_FALSE(isInPlace({0, 0, 2, 2}));
    views.samples = 1;
    const TileAssignment two[] = {{0, {0, 0, 2, 2}, Eye::Mono}, {1, {2, 0, 2, 2}, Eye::Mono}};
    EXPECT_FALSE(isDrawnInPlace(views, two));
}

TEST_F(FramePlanTest, EveryFeatureHasADefineOfItsOwn) {
    std::map<std::string, int> defines;
    for (std::uint32_t i = 0; i < kFeatureCount; ++i) ++defines[defineOf(static_cast<Feature>(i))];
    EXPECT_EQ(defines.size(), kFeatureCount);
}

}  // namespace
}  // namespace umbriel
