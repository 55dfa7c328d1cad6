#include "common/math/photometric_web.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>

namespace umbriel {
namespace {

constexpr double kPi = std::numbers::pi;

// Full sphere, `planes` + 1 planes (closed), values by a function of gamma and C.
template <class Function>
PhotometricWeb webOf(int angles, int planes, Function candela) {
    PhotometricWeb web;
    for (int j = 0; j < angles; ++j) {
        web.vertical.push_back(kPi * j / (angles - 1));
    }
    for (int i = 0; i <= planes; ++i) {
        web.horizontal.push_back(2.0 * kPi * i / planes);
        for (int j = 0; j < angles; ++j) {
            web.candela.push_back(static_cast<float>(
                candela(web.vertical[static_cast<std::size_t>(j)], web.horizontal[static_cast<std::size_t>(i)])));
        }
    }
    return web;
}

TEST(PhotometricWeb, UniformLightIsFourPiOfItsIntensity) {
    const PhotometricWeb web = webOf(19, 4, [](double, double) { return 100.0; });
    EXPECT_NEAR(web.luminousFlux(), 400.0 * kPi, 1e-9);
    EXPECT_EQ(web.maxIntensity(), 100.0);
    EXPECT_EQ(web.intensity(1.234, 5.678), 100.0);
    EXPECT_EQ(web.intensity(0.0, -100.0), 100.0);
    EXPECT_EQ(web.intensity(kPi, 2.0 * kPi), 100.0);
}

// A Lambertian disc of 1 cd emits pi lumens: exact up to the table's step, (pi / 180)^2 / 12 = 2.5e-5 at 1 degree.
TEST(PhotometricWeb, LambertianLightIsPiOfItsIntensity) {
    const PhotometricWeb web = webOf(181, 8, [](double gamma, double) { return std::max(std::cos(gamma), 0.0); });
    EXPECT_NEAR(web.luminousFlux() / kPi, 1.0, 1e-4);
    EXPECT_NEAR(web.intensity(kPi / 3.0, 1.0), 0.5, 1e-6);
}

TEST(PhotometricWeb, DirectionsFollowTheLightsFrame) {
    const PhotometricWeb web = webOf(
        19, 8, [](double gamma, double c) { return 10.0 + 5.0 * std::cos(gamma) + std::sin(gamma) * std::cos(c); });
    EXPECT_NEAR(web.intensityTowards({0, 0, -3}), 15.0, 1e-5);
    EXPECT_NEAR(web.intensityTowards({0, 0, 0.1}), 5.0, 1e-5);
    EXPECT_NEAR(web.intensityTowards({2, 0, 0}), 11.0, 1e-5);
    EXPECT_NEAR(web.intensityTowards({-2, 0, 0}), 9.0, 1e-5);
    EXPECT_NEAR(web.intensityTowards({0, 1, 0}), 10.0, 1e-5);
    EXPECT_NEAR(web.intensityTowards({0, -1, 0}), 10.0, 1e-5);
    const PhotometricWeb quarter = webOf(19, 8, [](double, double c) { return c > 1.5 && c < 1.6 ? 1.0 : 0.0; });
    EXPECT_NEAR(quarter.intensityTowards({0, 1, 0}), 1.0, 1e-6);  // C90 is +Y
    EXPECT_EQ(web.intensityTowards({0, 0, 0}), 0.0);
    EXPECT_EQ(web.intensityTowards({1e-300, 0, 0}), web.intensityTowards({1, 0, 0}));
    EXPECT_EQ(web.intensity(std::nan(""), 0.0), 0.0);
    EXPECT_EQ(web.intensity(1.0, std::nan("")), 0.0);
}

TEST(PhotometricWeb, IsDarkWhereNothingIsGiven) {
    PhotometricWeb half;
    half.vertical = {0.0, kPi / 2.0};
    half.horizontal = {0.0, 2.0 * kPi};
    half.candela = {2.0F, 1.0F, 2.0F, 1.0F};
    EXPECT_EQ(half.intensity(kPi / 2.0, 0.0), 1.0);
    EXPECT_EQ(half.intensity(std::nextafter(kPi / 2.0, 4.0), 0.0), 0.0);
    EXPECT_EQ(half.intensityTowards({1, 1, 0}), 1.0);
    EXPECT_EQ(half.intensityTowards({1, 1, 1e-6}), 0.0);
    EXPECT_EQ(PhotometricWeb().intensity(0.0, 0.0), 0.0);
    EXPECT_EQ(PhotometricWeb().luminousFlux(), 0.0);
}

// Between the values around it, the values themselves at the grid, no jump where C wraps; and the resampled grid
// agrees.
RC_GTEST_PROP(PhotometricWeb, IsBilinear, ()) {
    const auto seed = *rc::gen::inRange(0, 1000);
    const PhotometricWeb web =
        webOf(7, 6, [seed](double gamma, double c) { return 2.0 + std::sin(gamma * 3.0 + seed) * std::cos(c); });
    const int j = *rc::gen::inRange(0, 6);
    const int i = *rc::gen::inRange(0, 6);
    const auto plane = static_cast<std::size_t>(i);
    const auto angle = static_cast<std::size_t>(j);
    RC_ASSERT(std::abs(web.intensity(web.vertical[angle], web.horizontal[plane]) -
                       static_cast<double>(web.at(plane, angle))) < 1e-6);
    const double middle = web.intensity(0.5 * (web.vertical[angle] + web.vertical[angle + 1]),
                                        0.5 * (web.horizontal[plane] + web.horizontal[plane + 1]));
    const double mean =
        0.25 * (static_cast<double>(web.at(plane, angle)) + static_cast<double>(web.at(plane, angle + 1)) +
                static_cast<double>(web.at(plane + 1, angle)) + static_cast<double>(web.at(plane + 1, angle + 1)));
    RC_ASSERT(std::abs(middle - mean) < 1e-6);
    RC_ASSERT(std::abs(web.intensity(1.0, -1e-9) - web.intensity(1.0, 1e-9)) < 1e-6);
    const std::vector<float> grid = web.resampled(6, 7);
    RC_ASSERT(grid.size() == 42U);
    RC_ASSERT(std::abs(grid[angle * 6 + plane] - web.at(plane, angle)) < 1e-6F);
}

}  // namespace
}  // namespace umbriel
