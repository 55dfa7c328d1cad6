#include "client/app/orbit.h"

#include <gtest/gtest.h>

#include <numbers>

namespace umbriel {
namespace {

void expectNear(const glm::dvec3& a, const glm::dvec3& b, double tolerance) {
    EXPECT_LE(glm::distance(a, b), tolerance) << a.x << ' ' << a.y << ' ' << a.z;
}

TEST(Orbit, StartsWhereTheEyeIs) {
    for (const glm::dvec3 eye : {glm::dvec3(3, 4, 5), glm::dvec3(-1, -2, 0.5), glm::dvec3(1e6, 1, -1e6)})
        expectNear(Orbit::around({1, 1, 1}, eye).eye(), eye, 1e-9 * glm::length(eye));
}

TEST(Orbit, AHalfTurnLooksFromTheOtherSide) {
    Orbit orbit = Orbit::around({0, 0, 0}, {0, 0, 2});
    orbit.turn(1.0, 0.0);
    expectNear(orbit.eye(), {0, 0, -2}, 1e-12);
}

TEST(Orbit, NeverReachesThePolesWhereUpIsUndefined) {
    Orbit orbit = Orbit::around({0, 0, 0}, {0, 5, 0});
    EXPECT_LT(orbit.elevation, std::numbers::pi / 2);
    orbit.turn(0.0, -10.0);
    EXPECT_LT(orbit.elevation, std::numbers::pi / 2);
    orbit.pan(0.1, 0.1);
    EXPECT_TRUE(std::isfinite(orbit.eye().x + orbit.eye().y + orbit.eye().z));
}

TEST(Orbit, ApproachingNeverPassesTheCentre) {
    Orbit orbit = Orbit::around({0, 0, 0}, {0, 0, 1});
    orbit.approach(1e9);
    EXPECT_GT(orbit.distance, 0.0);
    orbit.approach(1);
    EXPECT_GT(orbit.distance, 0.0);
}

TEST(Orbit, PanningMovesAcrossTheViewAndKeepsTheDistance) {
    Orbit orbit = Orbit::around({0, 0, 0}, {0, 0, 4});
    orbit.pan(0.25, 0.0);
    expectNear(orbit.centre, {-1, 0, 0}, 1e-12);
    EXPECT_DOUBLE_EQ(orbit.distance, 4.0);
}

}  // namespace
}  // namespace umbriel
