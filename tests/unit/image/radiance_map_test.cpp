#include "common/image/radiance_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace umbriel {
namespace {

// Known responses: code / 255 as a function of exposure, white at 1. Clipped by the camera, after the noise.
double gammaResponse(double exposure) {
    return std::pow(exposure, 1.0 / 2.2);
}
// A camera's S over sRGB's gamma: toe and shoulder.
double cameraResponse(double exposure) {
    const double v = std::pow(std::min(exposure, 1.0), 1.0 / 2.2);
    return (exposure > 1.0 ? exposure : 0.6 * v + 0.4 * v * v * (3.0 - 2.0 * v));
}
double linearResponse(double exposure) {
    return exposure;
}

constexpr int kWidth = 256;
constexpr int kHeight = 64;

using Response = std::function<double(double)>;

double radianceAt(int x, int y, int channel) {
    // Three decades from left to right, a little different in each channel; rows dither what quantisation hides.
    return 1e-2 * std::pow(1e3, (x + static_cast<double>(y) / kHeight) / kWidth) * (1.0 + 0.3 * channel);
}

// `noise` is the standard deviation in codes of a deterministic noise.
std::vector<Exposure> seriesOf(const Response& response, double noise = 0.0) {
    std::mt19937_64 random(7);
    const auto gauss = [&random] {
        double sum = -6.0;
        for (int i = 0; i < 12; ++i) {
            sum += static_cast<double>(random() >> 11) * 0x1p-53;
        }
        return sum;
    };
    std::vector<Exposure> series;
    for (const double seconds : {1.0 / 64, 1.0 / 32, 1.0 / 16, 1.0 / 8, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) {
        Exposure exposure{kWidth, kHeight, {}, seconds};
        for (int y = 0; y < kHeight; ++y) {
            for (int x = 0; x < kWidth; ++x) {
                for (int c = 0; c < 3; ++c) {
                    const double code =
                        255.0 * response(radianceAt(x, y, c) * seconds) + noise * (noise > 0.0 ? gauss() : 0.0);
                    exposure.codes.push_back(static_cast<std::uint8_t>(std::clamp(std::floor(code + 0.5), 0.0, 255.0)));
                }
            }
        }
        series.push_back(std::move(exposure));
    }
    return series;
}

double trueLogExposure(const Response& response, double code) {
    double low = 0.0;
    double high = 100.0;
    for (int i = 0; i < 200; ++i) {
        const double middle = 0.5 * (low + high);
        (response(middle) * 255.0 < code ? low : high) = middle;
    }
    return std::log(0.5 * (low + high));
}

// The codes between the 5th and 95th percentile of the exposures that are neither black nor white.
std::pair<int, int> middleCodes(const std::vector<Exposure>& series) {
    std::vector<std::uint8_t> codes;
    for (const Exposure& exposure : series) {
        std::copy_if(exposure.codes.begin(), exposure.codes.end(), std::back_inserter(codes),
                     [](std::uint8_t z) { return z > 0 && z < 255; });
    }
    std::sort(codes.begin(), codes.end());
    return {codes[codes.size() / 20], codes[codes.size() - 1 - codes.size() / 20]};
}

// What a code stands for: the mean of the logarithms of the exposures that show it, relative to kMidCode's. With
// noise, or where codes are coarse, that is another value than the middle of its interval.
LogResponse meanLogExposures(const std::vector<Exposure>& series) {
    LogResponse sum{};
    LogResponse count{};
    for (const Exposure& exposure : series) {
        for (int y = 0; y < kHeight; ++y) {
            for (int x = 0; x < kWidth; ++x) {
                const std::size_t z = exposure.codes[static_cast<std::size_t>(y * kWidth + x) * 3];
                sum[z] += std::log(radianceAt(x, y, 0) * exposure.seconds);
                count[z] += 1.0;
            }
        }
    }
    for (std::size_t z = 0; z < sum.size(); ++z) {
        sum[z] /= count[z];
    }
    const double shift = sum[kMidCode];
    std::for_each(sum.begin(), sum.end(), [shift](double& value) { value -= shift; });
    return sum;
}

LogResponse trueLogExposures(const Response& response) {
    LogResponse truth{};
    for (int z = 0; z < kCodes; ++z) {
        truth[static_cast<std::size_t>(z)] = trueLogExposure(response, z) - trueLogExposure(response, kMidCode);
    }
    return truth;
}

double curveError(const LogResponse& curve, const LogResponse& truth, std::pair<int, int> codes) {
    double largest = 0.0;
    for (auto z = static_cast<std::size_t>(codes.first); z <= static_cast<std::size_t>(codes.second); ++z) {
        largest = std::max(largest, std::abs(std::expm1(curve[z] - truth[z])));
    }
    return largest;
}

// Largest relative error over the pixels between the 5th and the 95th percentile of radiance, which rises along x.
double radianceError(const FloatImage& map, const Response& response) {
    const double scale = std::exp(trueLogExposure(response, kMidCode));
    double largest = 0.0;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = kWidth / 20; x < kWidth - kWidth / 20; ++x) {
            for (int c = 0; c < 3; ++c) {
                largest = std::max(largest, std::abs(map.at(x, y, c) * scale / radianceAt(x, y, c) - 1.0));
            }
        }
    }
    return largest;
}

ResponseFit fitted(const std::vector<Exposure>& series) {
    const Result<ResponseFit> fit = fitResponse(series);
    EXPECT_TRUE(fit.has_value());
    return fit ? *fit : ResponseFit{};
}

// Measured: curve 0.5 % and 0.8 %, radiance 1.6 % and 1.5 %, of the worst code and pixel; what is left is the rounding
// to 8 bits.
TEST(RadianceMap, RecoversKnownResponsesWithinTwoPercent) {
    for (const Response& response : {Response(gammaResponse), Response(cameraResponse)}) {
        const std::vector<Exposure> series = seriesOf(response);
        const ResponseFit fit = fitted(series);
        const std::pair<int, int> codes = middleCodes(series);
        EXPECT_LT(codes.first, 12);
        EXPECT_GT(codes.second, 220);
        for (const LogResponse& curve : fit.response) {
            EXPECT_TRUE(std::is_sorted(curve.begin(), curve.end()));
            EXPECT_EQ(curve[kMidCode], 0.0);
            EXPECT_LT(curveError(curve, trueLogExposures(response), codes), 0.02);
        }
        EXPECT_LT(radianceError(mergeExposures(series, fit.response, MergeRule::Weighted).rgba, response), 0.02);
        EXPECT_LT(fit.residual[0], 0.01);
    }
}

// A linear sensor's dark codes are too coarse to have one exposure, its radiances are not.
TEST(RadianceMap, RecoversRadianceFromALinearSensor) {
    const std::vector<Exposure> series = seriesOf(linearResponse);
    EXPECT_LT(radianceError(mergeExposures(series, fitted(series).response, MergeRule::Weighted).rgba, linearResponse),
              0.02);
}

TEST(RadianceMap, RecoversResponsesFromNoiseOfOneCode) {
    for (const Response& response : {Response(gammaResponse), Response(cameraResponse)}) {
        const std::vector<Exposure> series = seriesOf(response, 1.0);
        EXPECT_LT(curveError(fitted(series).response[0], meanLogExposures(series), middleCodes(series)), 0.02);
    }
}

// The photograph nearest to mid-range alone: codes of about 90 to 180, so half a code is 1.3 % of gamma's exposure.
TEST(RadianceMap, NearestTakesOnePhotographPerPixel) {
    const std::vector<Exposure> series = seriesOf(gammaResponse);
    const CameraResponse response = fitted(series).response;
    const RadianceMap map = mergeExposures(series, response, MergeRule::Nearest);
    EXPECT_LT(radianceError(map.rgba, gammaResponse), 0.03);
    const int x = 100;
    const int y = 10;
    bool found = false;
    for (const Exposure& exposure : series) {
        const int code = exposure.codes[static_cast<std::size_t>(y * kWidth + x) * 3];
        const double radiance = std::exp(response[0][static_cast<std::size_t>(code)]) / exposure.seconds;
        found = found || static_cast<float>(radiance) == map.rgba.at(x, y, 0);
    }
    EXPECT_TRUE(found);
}

// Two photographs of three pixels: never white or black, white in both, black in both.
TEST(RadianceMap, WhatNoPhotographMeasuresIsBoundedAndCounted) {
    CameraResponse response;
    for (LogResponse& curve : response) {
        for (int z = 0; z < kCodes; ++z) {
            curve[static_cast<std::size_t>(z)] = (z - kMidCode) / 100.0;
        }
    }
    const std::vector<Exposure> series{{3, 1, {60, 60, 60, 255, 255, 255, 0, 0, 0}, 0.5},
                                       {3, 1, {128, 128, 128, 255, 255, 255, 0, 0, 0}, 1.0}};
    for (const MergeRule rule : {MergeRule::Weighted, MergeRule::Nearest}) {
        const RadianceMap map = mergeExposures(series, response, rule);
        EXPECT_EQ(map.white, 1U);
        EXPECT_EQ(map.black, 1U);
        EXPECT_FLOAT_EQ(map.rgba.at(1, 0, 0), static_cast<float>(std::exp(1.27) / 0.5));  // of the shorter one
        EXPECT_FLOAT_EQ(map.rgba.at(2, 0, 0), static_cast<float>(std::exp(-1.28)));       // of the longer one
    }
    EXPECT_EQ(mergeExposures(series, response, MergeRule::Nearest).rgba.at(0, 0, 0), 1.0F);
    // Weights 60 and 127.
    const double mean = (60.0 * (-0.68 + std::log(2.0)) + 127.0 * 0.0) / 187.0;
    EXPECT_FLOAT_EQ(mergeExposures(series, response, MergeRule::Weighted).rgba.at(0, 0, 0),
                    static_cast<float>(std::exp(mean)));
}

TEST(RadianceMap, SameSeriesGivesTheSameBitsInAnyOrderOfTheFiles) {
    std::vector<Exposure> series = seriesOf(cameraResponse, 1.0);
    const ResponseFit once = fitted(series);
    EXPECT_EQ(once.response, fitted(series).response);
    std::reverse(series.begin(), series.end());
    const ResponseFit reversed = fitted(series);
    for (std::size_t z = 0; z < kCodes; ++z) {
        EXPECT_NEAR(reversed.response[0][z], once.response[0][z], 1e-9);  // sums in another order
    }
}

TEST(RadianceMap, ImpossibleSeriesAreRefusedInWords) {
    const auto refusal = [](const std::vector<Exposure>& series) {
        const Result<ResponseFit> fit = fitResponse(series);
        EXPECT_FALSE(fit.has_value());
        return fit ? std::string() : fit.error().message;
    };
    const Exposure grey{1, 1, {100, 100, 100}, 1.0};
    EXPECT_NE(refusal({grey}).find("two photographs"), std::string::npos);
    EXPECT_NE(refusal({grey, grey}).find("same exposure time"), std::string::npos);
    EXPECT_NE(refusal({grey, {2, 1, {1, 1, 1, 1, 1, 1}, 2.0}}).find("2 x 1"), std::string::npos);
    EXPECT_NE(refusal({grey, {1, 1, {200, 200, 200}, 0.0}}).find("positive"), std::string::npos);
    EXPECT_NE(refusal({grey, {1, 1, {200, 200, 200}, std::nan("")}}).find("positive"), std::string::npos);
    EXPECT_NE(refusal({grey, {1, 1, {255, 255, 255}, 2.0}}).find("neither black nor white"), std::string::npos);
    EXPECT_EQ(fitResponse(std::vector<Exposure>{grey, {1, 1, {150, 150, 150}, 2.0}}, {-1.0}).error().kind,
              Error::Kind::BadInput);
    // Hardly any data: smoothness fills the rest, and the curve still rises.
    const Result<ResponseFit> little = fitResponse(std::vector<Exposure>{grey, {1, 1, {150, 150, 150}, 2.0}});
    ASSERT_TRUE(little.has_value());
    EXPECT_TRUE(std::is_sorted(little->response[1].begin(), little->response[1].end()));
    EXPECT_NEAR(little->response[1][150] - little->response[1][100], std::log(2.0), 1e-3);
}

}  // namespace
}  // namespace umbriel
