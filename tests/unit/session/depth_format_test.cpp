#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "client/session/shadow_fit.h"

namespace umbriel {
namespace {

// Why maps are 32-bit floats, reversed: what rounding alone does to a stored depth, in texels of the map, which is what
// a constant bias is measured in.
enum class Format { D16, D24, D32F };

double stored(Format format, double depth) {
    switch (format) {
        case Format::D16:
            return std::round(depth * 65535.0) / 65535.0;
        case Format::D24:
            return std::round(depth * 16777215.0) / 16777215.0;
        case Format::D32F:
            return static_cast<double>(static_cast<float>(depth));
    }
    return 0.0;
}

constexpr double kFar = 1.0, kNear = 2e-5;  // as spotBody() chooses them at worst

double depthOf(double distance, bool reversed, bool perspective) {
    const double normal =
        perspective ? kFar * (distance - kNear) / (distance * (kFar - kNear)) : (distance - kNear) / (kFar - kNear);
    // Not 1 - normal: that has lost its digits already.
    const double turned =
        perspective ? kNear * (kFar - distance) / (distance * (kFar - kNear)) : (kFar - distance) / (kFar - kNear);
    return reversed ? turned : normal;
}

double distanceOf(double depth, bool reversed, bool perspective) {
    const double span = kFar - kNear;
    if (!perspective) return reversed ? kFar - depth * span : kNear + depth * span;
    return reversed ? kNear * kFar / (depth * span + kNear) : kNear * kFar / (kFar - depth * span);
}

// The largest error over the whole depth, in texels.
double worstTexels(Format format, bool reversed, bool perspective, double texelAtOne) {
    double worst = 0.0;
    for (int i = 1; i < 20000; ++i) {
        // As many places near the light as far away.
        const double distance = kNear * std::pow(kFar / kNear, i / 20000.0);
        const double back = distanceOf(stored(format, depthOf(distance, reversed, perspective)), reversed, perspective);
        worst = std::max(worst, std::abs(back - distance) / (perspective ? texelAtOne * distance : texelAtOne));
    }
    return worst;
}

TEST(DepthFormat, OnlyReversedFloatsAreFarMorePreciseThanTheConstantBias) {
    // A spot of 70 degrees, 1024 texels; a sun whose depth is a hundred map sides, 16384 texels.
    const double spot = 2.0 * std::tan(0.61) / 1024, sun = kFar / 100 / 16384;
    std::printf("%-6s %-9s %12s %12s\n", "format", "depth", "spot, texels", "sun, texels");
    const char* names[] = {"D16", "D24", "D32F"};
    for (const Format format : {Format::D16, Format::D24, Format::D32F})
        for (const bool reversed : {false, true}) {
            const double inSpot = worstTexels(format, reversed, true, spot);
            const double inSun = worstTexels(format, reversed, false, sun);
            std::printf("%-6s %-9s %12.6f %12.6f\n", names[static_cast<int>(format)], reversed ? "reversed" : "normal",
                        inSpot, inSun);
            const bool ours = format == Format::D32F && reversed;
            if (ours) {
                EXPECT_LT(inSpot, 0.01 * double(kConstantBias));
                EXPECT_LT(inSun, double(kConstantBias));
            } else {
                EXPECT_GT(std::max(inSpot, inSun), double(kConstantBias));
            }
        }
}

}  // namespace
}  // namespace umbriel
