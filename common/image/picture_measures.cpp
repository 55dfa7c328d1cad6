#include "common/image/picture_measures.h"

#include <cmath>

#include "common/image/colour_difference.h"
#include "common/image/display.h"
#include "common/image/grey.h"

namespace umbriel {
namespace {

std::uint64_t pixelsAbove(const FloatImage& a, const FloatImage& b, double threshold) {
    std::uint64_t count = 0;
    const float* fromA = a.samples().data();
    const float* fromB = b.samples().data();
    for (std::size_t i = 0; i < a.pixelCount(); ++i, fromA += 4, fromB += 4) {
        bool above = false;
        for (int c = 0; c < 3; ++c) {
            const double difference = std::abs(static_cast<double>(fromA[c]) - static_cast<double>(fromB[c]));
            above = above || !(difference <= threshold) || !std::isfinite(fromA[c]);  // NaN is above, too
        }
        count += above ? 1 : 0;
    }
    return count;
}

}  // namespace

PictureMeasures measurePictures(const FloatImage& a, const FloatImage& b, const PictureMeasureOptions& options) {
    UMBRIEL_ASSERT(a.channelCount() == 4 && b.channelCount() == 4, "pictures are compared as RGBA");
    UMBRIEL_ASSERT(a.width() == b.width() && a.height() == b.height(), "pictures have unequal sizes");
    const double scale = exposureScale(options.exposure);
    const FloatImage greyA = displayGrey(a, scale);
    const FloatImage greyB = displayGrey(b, scale);
    return {pixelsAbove(a, b, options.threshold), edgeDisplacement(greyA, greyB, options.edges),
            machBandDifference(greyA, greyB), colourDifference(a, b, scale)};
}

}  // namespace umbriel
