#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/scene/light_map.h"

namespace umbriel {
namespace {

TEST(LightMapPages, OfWhatATextureHoldsAreOne) {
    for (const std::uint32_t size : {1u, 2u, 777u, 16384u}) {
        const LightMapPages pages = LightMapPages::of(size, 16384);
        EXPECT_EQ(pages.columns, 1u);
        EXPECT_EQ(pages.side, size);
    }
    EXPECT_EQ(LightMapPages::of(17000, 16384).columns, 2u);
    EXPECT_EQ(LightMapPages::of(17000, 16384).side, 8501u);
    EXPECT_EQ(LightMapPages::of(LightMap::kMaxSize, 16384).columns, 2u);
    EXPECT_EQ(LightMapPages::of(LightMap::kMaxSize, 16384).side, 16384u);
    EXPECT_EQ(LightMapPages::of(LightMap::kMaxSize + 1, 16384).columns, 3u);
}

// With the arithmetic of shaders/snippet/shadow_light_map.glsl.
RC_GTEST_PROP(LightMapPages, HoldAllFourTexelsAroundAnyPlace, ()) {
    const auto size = *rc::gen::inRange(2u, 40000u);
    const auto largest = *rc::gen::inRange(2u, 20000u);
    const LightMapPages pages = LightMapPages::of(size, largest);
    RC_ASSERT(pages.side >= 1u && pages.side <= std::max(largest, 1u));
    if (pages.columns == 1) {
        RC_ASSERT(pages.side == size);
        return;
    }
    const auto stride = static_cast<float>(pages.side - 1);
    const float columns = std::ceil((static_cast<float>(size) - 1.0f) / stride);
    RC_ASSERT(columns == static_cast<float>(pages.columns));
    // Every page has something, and all of the atlas is in one.
    RC_ASSERT((pages.columns - 1) * (pages.side - 1) < size - 1);
    RC_ASSERT(pages.columns * (pages.side - 1) >= size - 1);
    const auto lower = *rc::gen::inRange(0u, size - 1);  // of the four texels the lower left one
    for (const float part : {0.0f, 0.25f, 0.5f, 0.75f}) {
        const float at = static_cast<float>(lower) + 0.5f + part;
        const float page = std::clamp(std::floor((at - 0.5f) / stride), 0.0f, columns - 1.0f);
        const float local = at - page * stride;
        RC_ASSERT(local - 0.5f >= 0.0f);
        // The upper one has a weight only where the place is not in the lower one's middle.
        RC_ASSERT(std::floor(local - 0.5f) + (part > 0.0f ? 1.0f : 0.0f) <= stride);
        RC_ASSERT(local + page * stride == at);
    }
}

}  // namespace
}  // namespace umbriel
