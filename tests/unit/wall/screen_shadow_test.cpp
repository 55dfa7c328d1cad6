#include "common/wall/screen_shadow.h"

#include <gtest/gtest.h>

#include <cmath>

namespace umbriel {
namespace {

TEST(GaussWeights, SumToOneAndFallAsTheGaussianDoes) {
    for (const float radius : {0.5f, 1.0f, 2.5f, 6.0f, 32.0f}) {
        const std::vector<float> weights = gaussWeights(radius);
        ASSERT_EQ(weights.size(), 1 + static_cast<std::size_t>(std::ceil(radius)));
        double sum = -static_cast<double>(weights[0]);
        for (const float weight : weights) sum += 2.0 * static_cast<double>(weight);
        // Each is rounded to 24 bits.
        EXPECT_NEAR(sum, 1.0, 1e-6) << radius;
        // At a distance of one standard deviation, half the radius.
        if (radius == 6.0f) EXPECT_NEAR(weights[3] / weights[0], std::exp(-0.5), 1e-6);
    }
    EXPECT_EQ(gaussWeights(0.0f), std::vector<float>{1.0f});
}

}  // namespace
}  // namespace umbriel
