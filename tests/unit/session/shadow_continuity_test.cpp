#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "client/session/shadow_warp.h"
#include "tests/unit/session/test_views.h"

namespace umbriel {
namespace {

using test::viewFrom;

// Each warp is swept through the place where its formula has none: a hundred times finer steps must move the map a
// hundred times less. A switch from one formula to another would move it as much however fine the step.
constexpr ShadowMode kWarps[] = {ShadowMode::Perspective, ShadowMode::LightSpacePerspective, ShadowMode::Trapezoid};
constexpr const char* nameOf(ShadowMode mode) {
    return mode == ShadowMode::Perspective ? "psm" : mode == ShadowMode::Trapezoid ? "trapez" : "lisp";
}
const Box3d kTown{{-60, 0, -60}, {60, 8, 60}};
constexpr double kTexels = 1024.0;

glm::dmat3 warpOf(const LightBody& body, ShadowMode mode, float range = 0.3f) {
    ShadowFitRequest request;
    request.mode = request.map = mode;
    request.range = range;
    return mode == ShadowMode::Perspective             ? perspectiveWarp(body, request)
           : mode == ShadowMode::LightSpacePerspective ? lispWarp(body, request)
                                                       : trapezoidWarp(body, request);
}

// Where places of the world lie on a map that the warp spreads over the body, in texels; without the steps of snapped
// uniform maps, which are there to keep them still.
using Places = std::array<glm::dvec2, 4>;
using Places3 = std::array<glm::dvec3, 4>;
constexpr Places3 kTownPlaces = {glm::dvec3(0, 0, 40), {3, 1, 0}, {-8, 4, -50}, {20, 0, 10}};
constexpr Places3 kConePlaces = {glm::dvec3(0, 0, 0), {3, 1, -5}, {-6, 2, -8}, {8, 0, -3}};

Places placesOn(const LightBody& body, const glm::dmat3& warp, const Places3& places = kTownPlaces) {
    glm::dvec2 lower(std::numeric_limits<double>::infinity()), upper = -lower;
    const auto place = [&](const glm::dvec3& pointLight) {
        const glm::dvec3 m = warp * glm::dvec3(body.across(pointLight), 1.0);
        EXPECT_GT(m.z, 0.0);
        return glm::dvec2(m) / m.z;
    };
    for (const glm::dvec3& point : body.points) {
        lower = glm::min(lower, place(point));
        upper = glm::max(upper, place(point));
    }
    Places result;
    for (std::size_t i = 0; i < places.size(); ++i)
        result[i] = (place((places[i] - body.originWorld) * body.worldFromLight) - lower) / (upper - lower) * kTexels;
    return result;
}

// How far the farthest place has moved. A map turned by a quarter or mirrored has the same texels.
double moved(const Places& from, const Places& to) {
    double least = std::numeric_limits<double>::infinity();
    for (int symmetry = 0; symmetry < 8; ++symmetry) {
        double farthest = 0.0;
        for (std::size_t k = 0; k < to.size(); ++k) {
            glm::dvec2 place = to[k];
            if (symmetry & 1) place.x = kTexels - place.x;
            if (symmetry & 2) place.y = kTexels - place.y;
            if (symmetry & 4) std::swap(place.x, place.y);
            farthest = std::max(farthest, glm::distance(place, from[k]));
        }
        least = std::min(least, farthest);
    }
    return least;
}

// The farthest that a place moves in one step, over `steps` steps around the middle.
double largestMove(const std::function<std::optional<Places>(double)>& at, double middle, double step, int steps) {
    double largest = 0.0;
    std::optional<Places> last;
    for (int i = -steps; i <= steps; ++i) {
        const auto here = at(middle + i * step);
        EXPECT_TRUE(here);
        if (!here) return std::numeric_limits<double>::infinity();
        if (last) largest = std::max(largest, moved(*last, *here));
        last = here;
    }
    EXPECT_TRUE(std::isfinite(largest));
    return largest;
}

// step: coarse. Snaps that a bound allows for a step of it are bounded apart, by mostTexels.
void checkContinuous(const char* what, ShadowMode mode, const std::function<std::optional<Places>(double)>& at,
                     double middle, double step, double mostTexels) {
    const double coarse = largestMove(at, middle, step, 20);
    const double fine = largestMove(at, middle, step / 100, 40);
    const double finest = largestMove(at, middle, step / 10000, 40);
    std::printf("%-34s %-7s %9.4f texels a step of %g, %9.6f of %g, %11.8f of %g\n", what, nameOf(mode), coarse, step,
                fine, step / 100, finest, step / 10000);
    EXPECT_LE(coarse, mostTexels) << what;
    EXPECT_LE(fine, 0.03 * coarse + 1e-6) << what;
    EXPECT_LE(finest, 3e-4 * coarse + 1e-6) << what;
}

TEST(ShadowContinuity, ThroughTheViewsDirectionAndItsOppositeAndAcrossIt) {
    const View view = viewFrom({0, 6, 55}, {0, 0, 0});
    const glm::dvec3 forward = glm::normalize(glm::dvec3(0, -6, -55));
    const glm::dvec3 side = glm::normalize(glm::cross(forward, {0.3, 1, 0}));
    for (const ShadowMode mode : kWarps)
        for (const double degrees : {0.0, 0.5, 1.0, 2.0, 5.0, 11.5, 90.0, 179.0, 180.0})
            checkContinuous(("light at " + std::to_string(degrees) + " degrees").c_str(), mode,
                            [&](double angle) -> std::optional<Places> {
                                const double radians = angle * std::numbers::pi / 180.0;
                                const auto body =
                                    directionalBody(std::cos(radians) * forward + std::sin(radians) * side, kTown,
                                                    {&view, 1}, ShadowFitMode::Union);
                                if (!body) return std::nullopt;
                                return placesOn(*body, warpOf(*body, mode));
                            },
                            degrees, 0.1, 40.0);
}

TEST(ShadowContinuity, OfTheTrapezoidThroughARangeOfFourFifths) {
    const View view = viewFrom({0, 2, 55}, {0, 0, 0});
    const auto body = directionalBody({0.7, -0.7, 0}, kTown, {&view, 1}, ShadowFitMode::Union);
    ASSERT_TRUE(body);
    checkContinuous(
        "range", ShadowMode::Trapezoid,
        [&](double range) -> std::optional<Places> {
            return placesOn(*body, warpOf(*body, ShadowMode::Trapezoid, static_cast<float>(range)));
        },
        0.8, 0.01, 20.0);
}

// The eye walks towards and through what it sees: the virtual camera's slide sets in where its plane at infinity comes
// too near, and the near end reaches the limit of what counts as near.
TEST(ShadowContinuity, WhileThePlaneAtInfinityPassesTheBody) {
    for (const ShadowMode mode : kWarps)
        for (const double z : {200.0, 120.0, 90.0, 75.0, 66.0, 62.0, 50.0})
            checkContinuous(
                ("eye at " + std::to_string(z) + " m").c_str(), mode,
                [&](double at) -> std::optional<Places> {
                    const View view = viewFrom({0, 6, at}, {0, 0, at - 60.0});
                    const auto body = directionalBody({0.5, -0.7, -0.3}, kTown, {&view, 1}, ShadowFitMode::Union);
                    if (!body) return std::nullopt;
                    return placesOn(*body, warpOf(*body, mode));
                },
                z, 0.05, 20.0);
}

// A spot: the eye rises past the lamp, and past the plane through it across its axis, where the eye's picture on the
// light's plane runs through infinity.
TEST(ShadowContinuity, OfASpotWhileTheEyeRisesPastTheLamp) {
    const glm::dvec3 lamp(0, 20, 0);
    for (const ShadowMode mode : kWarps)
        for (const double height : {5.0, 15.0, 20.0, 25.0, 40.0})
            checkContinuous(
                ("eye at " + std::to_string(height) + " m, lamp at 20").c_str(), mode,
                [&](double at) -> std::optional<Places> {
                    const View view = viewFrom({0, at, 30}, {0, 0, -5}, 1.0);
                    const auto body = spotBody(lamp, {0, -1, -0.05}, 0.9, 0.0, kTown, {&view, 1}, ShadowFitMode::Union);
                    if (!body) return std::nullopt;
                    return placesOn(*body, warpOf(*body, mode), kConePlaces);
                },
                height, 0.05, 20.0);
}

}  // namespace
}  // namespace umbriel
