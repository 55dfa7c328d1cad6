#include "common/image/mach_bands.h"

#include <algorithm>
#include <cmath>

namespace umbriel {
namespace {

float neighbourSum(const FloatImage& grey, int x, int y) {
    const int right = std::min(x + 1, grey.width() - 1);
    const int below = std::min(y + 1, grey.height() - 1);
    return (grey.at(std::max(x - 1, 0), y, 0) + grey.at(right, y, 0)) +
           (grey.at(x, std::max(y - 1, 0), 0) + grey.at(x, below, 0));
}

}  // namespace

std::vector<float> retinaRow(std::span<const float> row) {
    std::vector<float> response(row.size());
    for (std::size_t i = 0; i < row.size(); ++i) {
        const float left = row[i == 0 ? 0 : i - 1];
        const float right = row[std::min(i + 1, row.size() - 1)];
        response[i] = row[i] - kInhibition * (left + right);
    }
    return response;
}

FloatImage retinaImage(const FloatImage& grey) {
    UMBRIEL_ASSERT(grey.channelCount() == 1, "the retina sees one channel");
    FloatImage response(grey.width(), grey.height(), grey.channels());
    for (int y = 0; y < grey.height(); ++y) {
        for (int x = 0; x < grey.width(); ++x) {
            response.at(x, y, 0) = grey.at(x, y, 0) - kInhibition * neighbourSum(grey, x, y);
        }
    }
    return response;
}

MachBandDifference machBandDifference(const FloatImage& greyA, const FloatImage& greyB) {
    UMBRIEL_ASSERT(greyA.width() == greyB.width() && greyA.height() == greyB.height(), "pictures have unequal sizes");
    const FloatImage a = retinaImage(greyA);
    const FloatImage b = retinaImage(greyB);
    std::vector<float> response(a.samples().size());
    std::vector<float> overshoot(a.samples().size());
    constexpr float kFlat = 1.0F - 4.0F * kInhibition;
    for (std::size_t i = 0; i < response.size(); ++i) {
        const float difference = a.samples()[i] - b.samples()[i];
        response[i] = std::abs(difference);
        overshoot[i] = std::abs(difference - kFlat * (greyA.samples()[i] - greyB.samples()[i]));
    }
    return {spreadOf(std::move(response)), spreadOf(std::move(overshoot))};
}

}  // namespace umbriel
