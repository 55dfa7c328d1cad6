#include "common/image/colour_difference.h"

#include <cmath>
#include <cstring>

#include "common/image/tone_mapping.h"

namespace umbriel {
namespace {

// Cube root, and a line below (6/29)^3, where the root would be too steep.
double labCurve(double ratio) {
    constexpr double kDelta = 6.0 / 29.0;
    return ratio > kDelta * kDelta * kDelta ? std::cbrt(ratio) : ratio / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
}

}  // namespace

std::array<double, 3> labFromLinear(double red, double green, double blue) {
    // IEC 61966-2-1, annex F: XYZ of linear sRGB. Each row's sum is the white point, so grey has a* = b* = 0 exactly.
    static constexpr double kXyz[3][3] = {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
    std::array<double, 3> f{};
    for (std::size_t i = 0; i < 3; ++i) {
        const double white = kXyz[i][0] + kXyz[i][1] + kXyz[i][2];
        f[i] = labCurve((kXyz[i][0] * red + kXyz[i][1] * green + kXyz[i][2] * blue) / white);
    }
    return {116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])};
}

double deltaE(const std::array<double, 3>& labA, const std::array<double, 3>& labB) {
    return std::hypot(labA[0] - labB[0], labA[1] - labB[1], labA[2] - labB[2]);
}

Spread colourDifference(const FloatImage& a, const FloatImage& b, double scale) {
    UMBRIEL_ASSERT(a.channelCount() == 4 && b.channelCount() == 4, "pictures are compared as RGBA");
    UMBRIEL_ASSERT(a.width() == b.width() && a.height() == b.height(), "pictures have unequal sizes");
    const auto labOf = [scale](const float* pixel) {
        const auto shown = [&](int c) { return toneMapped(ToneMapping::Clamp, static_cast<double>(pixel[c]) * scale); };
        return labFromLinear(shown(0), shown(1), shown(2));
    };
    std::vector<float> differences(a.pixelCount(), 0.0F);
    for (std::size_t i = 0; i < differences.size(); ++i) {
        const float* pixelA = a.samples().data() + 4 * i;
        const float* pixelB = b.samples().data() + 4 * i;
        if (std::memcmp(pixelA, pixelB, 3 * sizeof(float)) != 0) {
            differences[i] = static_cast<float>(deltaE(labOf(pixelA), labOf(pixelB)));
        }
    }
    return spreadOf(std::move(differences));
}

}  // namespace umbriel
