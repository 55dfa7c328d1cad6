#include "client/session/shadow_warp.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/unit/session/test_views.h"

namespace umbriel {
namespace {

using test::isSeen;
using test::mapped;
using test::viewFrom;

constexpr ShadowMode kWarps[] = {ShadowMode::Perspective, ShadowMode::LightSpacePerspective, ShadowMode::Trapezoid};
const Box3d kTown{{-60, 0, -60}, {60, 8, 60}};

ShadowFitRequest requestFor(ShadowMode mode, std::uint32_t mapSize = 1024) {
    ShadowFitRequest request;
    request.mode = request.map = mode;
    request.mapSize = mapSize;
    return request;
}

// Texels that a square of a metre across the light covers around a point, as an area.
double texelsPerSquareMetre(const ShadowFit& fit, const glm::dvec3& world) {
    const double step = 1e-4;
    const glm::dvec3 here = mapped(fit, world);
    const glm::dvec2 x = glm::dvec2(mapped(fit, world + step * fit.worldFromLight[0]) - here) / step;
    const glm::dvec2 y = glm::dvec2(mapped(fit, world + step * fit.worldFromLight[1]) - here) / step;
    return std::abs(x.x * y.y - x.y * y.x) * 0.25 * fit.mapSize * fit.mapSize;
}

bool isOnMap(const ShadowFit& fit, const glm::dvec3& world) {
    const glm::dvec4 clip = fit.clipFromWorld * glm::dvec4(world, 1.0);
    const double inner = 1.0 - 2.0 / fit.mapSize + 1e-6;
    return clip.w > 0.0 && std::abs(clip.x) <= inner * clip.w && std::abs(clip.y) <= inner * clip.w && clip.z >= 0.0 &&
           clip.z <= clip.w * (1.0 + 1e-9);
}

// Whatever is seen is on the map, in front of it; depth is never warped.
void checkHolds(bool spot) {
    const auto unit = [] { return *rc::gen::inRange(-1000, 1001) * 0.001; };
    const double scale = std::pow(10.0, *rc::gen::inRange(-3, 5));
    const Box3d box{scale * kTown.lower, scale * kTown.upper};
    std::vector<View> views;
    for (int i = *rc::gen::inRange(1, 4); i > 0; --i) {
        const glm::dvec3 eye = scale * 70.0 * glm::dvec3(unit(), 0.3 * unit() + 0.2, unit());
        const glm::dvec3 target = scale * 60.0 * glm::dvec3(unit(), 0.1 * unit(), unit());
        RC_PRE(glm::distance(eye, target) > 0.1 * scale);
        views.push_back(viewFrom(eye, target, *rc::gen::element(0.05, 0.8, 2.0, 3.1), scale * 0.01));
    }
    const ShadowMode mode = *rc::gen::elementOf(std::vector<ShadowMode>(std::begin(kWarps), std::end(kWarps)));
    const ShadowFitRequest request = requestFor(mode, *rc::gen::element(64u, 512u, 4096u));
    const glm::dvec3 position = scale * glm::dvec3(70 * unit(), 40 + 30 * unit(), 70 * unit());
    const glm::dvec3 direction = spot ? glm::dvec3(unit(), -1.0, unit()) : glm::dvec3(unit(), unit(), unit());
    RC_PRE(glm::length(direction) > 0.01);
    const double outer = *rc::gen::element(0.1, 0.5, 1.2);
    const auto fit = spot ? fitSpot(position, direction, outer, 0.0, box, views, request)
                          : fitDirectional(direction, box, views, request);
    for (int i = 0; i < 100; ++i) {
        const glm::dvec3 receiver = scale * glm::dvec3(60 * unit(), 4 + 4 * unit(), 60 * unit());
        bool seen = false;
        for (const View& view : views) seen = seen || isSeen(view, receiver);
        const glm::dvec3 fromLight = receiver - position;
        if (spot && (glm::dot(fromLight, glm::normalize(direction)) < std::cos(outer) * glm::length(fromLight) ||
                     glm::length(fromLight) < 0.1 * scale))
            seen = false;
        if (!seen) continue;
        RC_ASSERT(fit.has_value());
        RC_ASSERT(isOnMap(*fit, receiver));
        // A ray of light is a point of the map, whatever the warp.
        const glm::dvec3 towards = spot ? glm::normalize(position - receiver) : -glm::normalize(direction);
        const glm::dvec3 there = mapped(*fit, receiver), above = mapped(*fit, receiver + 0.1 * scale * towards);
        RC_ASSERT(glm::distance(glm::dvec2(there), glm::dvec2(above)) < 1e-6);
        RC_ASSERT(above.z > there.z);
    }
}
RC_GTEST_PROP(ShadowWarp, DirectionalHoldsWhatIsSeen, ()) {
    checkHolds(false);
}
RC_GTEST_PROP(ShadowWarp, SpotHoldsWhatIsSeen, ()) {
    checkHolds(true);
}

TEST(ShadowWarp, NearReceiversGetMoreOfTheMap) {
    const View view = viewFrom({0, 2, 55}, {0, 0, 0});
    const glm::dvec3 direction(0.5, -0.7, -0.2);
    const auto plain = fitDirectional(direction, kTown, {&view, 1}, requestFor(ShadowMode::Standard));
    for (const ShadowMode mode : kWarps) {
        const auto fit = fitDirectional(direction, kTown, {&view, 1}, requestFor(mode));
        ASSERT_TRUE(fit && plain);
        EXPECT_GT(texelsPerSquareMetre(*fit, {0, 0, 45}), 3.0 * texelsPerSquareMetre(*plain, {0, 0, 45}))
            << static_cast<int>(mode);
        EXPECT_LT(texelsPerSquareMetre(*fit, {0, 0, -55}), texelsPerSquareMetre(*plain, {0, 0, -55}));
    }
}

// The light turns through the view's direction and on past its opposite, and every sixth of it in steps of 0.1 degrees:
// the texels at three places change a little from step to step, and no pop marks the directions where a warp has no
// answer. The trapezoid and the perspective map come out of their uniform limit faster.
TEST(ShadowWarp, NothingPopsWhileTheLightTurnsThroughTheView) {
    const View view = viewFrom({0, 6, 55}, {0, 0, 0});
    const glm::dvec3 forward = glm::normalize(glm::dvec3(0, -6, -55));
    const glm::dvec3 side = glm::normalize(glm::cross(forward, {0.3, 1, 0}));
    for (const ShadowMode mode : kWarps) {
        double last[3] = {};
        double largest = 0.0;
        for (int i = -50; i <= 1850; ++i) {
            const double angle = i * 0.1 * std::numbers::pi / 180.0;
            const glm::dvec3 direction = std::cos(angle) * forward + std::sin(angle) * side;
            const auto fit = fitDirectional(direction, kTown, {&view, 1}, requestFor(mode));
            ASSERT_TRUE(fit) << angle;
            const glm::dvec3 places[] = {{0, 0, 40}, {3, 1, 0}, {-8, 4, -50}};
            for (int k = 0; k < 3; ++k) {
                ASSERT_TRUE(isOnMap(*fit, places[k]));
                const double texels = texelsPerSquareMetre(*fit, places[k]);
                ASSERT_TRUE(std::isfinite(texels) && texels > 0.0);
                if (i > -50) largest = std::max(largest, std::abs(std::log(texels / last[k])));
                last[k] = texels;
            }
        }
        std::printf("mode %d: texels per square metre change by at most %.1f %% in 0.1 degrees\n",
                    static_cast<int>(mode), 100.0 * std::expm1(largest));
        // Snapped uniform fits take their steps of 2^(1/8) a side; nothing else may be larger than two of them.
        EXPECT_LT(largest, std::log(std::exp2(0.5)));
    }
}

TEST(ShadowWarp, AlongTheViewItIsTheUniformMap) {
    for (const double towards : {1.0, -1.0})
        for (const double gamma : {0.0, 1e-8}) {
            const View view = viewFrom({0, 30, 0.001}, {0, 0, 0});
            const glm::dvec3 direction(gamma, -towards, 0.0);
            for (const ShadowMode mode : kWarps) {
                const auto fit = fitDirectional(direction, kTown, {&view, 1}, requestFor(mode));
                ASSERT_TRUE(fit);
                const double a = texelsPerSquareMetre(*fit, {5, 0, 5}), b = texelsPerSquareMetre(*fit, {-5, 0, -5});
                EXPECT_NEAR(a / b, 1.0, 0.1) << static_cast<int>(mode);
            }
        }
}

TEST(ShadowWarp, EveryAxisAndTheViewsOwnAxesWork) {
    const View view = viewFrom({0, 2, 50}, {0, 2, 0});
    for (const glm::dvec3& direction :
         {glm::dvec3(1, 0, 0), glm::dvec3(-1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1),
          glm::dvec3(0, 0, -1), glm::dvec3(1e-7, -1, 0), glm::dvec3(1, 1e-7, 0), glm::dvec3(0, 1e-7, -1)})
        for (const ShadowMode mode : kWarps) {
            const auto fit = fitDirectional(direction, kTown, {&view, 1}, requestFor(mode));
            ASSERT_TRUE(fit);
            EXPECT_TRUE(isOnMap(*fit, {0, 1, 20}));
        }
}

// Near to far from 1e-4 to 1e7, fields of view from slivers to nearly all, off-axis frusta of 10 : 1.
TEST(ShadowWarp, AnyFrustumGivesAFiniteMap) {
    for (const ShadowMode mode : kWarps) {
        for (const double nearDistance : {1e-4, 1e-2, 1.0, 40.0})
            for (const double fovY : {1e-3, 0.8, 3.1}) {
                const View view = viewFrom({0, 2, 50}, {0, 2, 0}, fovY, nearDistance);
                const auto fit = fitDirectional({0.4, -1, 0.3}, kTown, {&view, 1}, requestFor(mode));
                ASSERT_TRUE(fit);
                EXPECT_TRUE(isOnMap(*fit, {0, 2, 0}));
            }
        View sideways = viewFrom({0, 2, 50}, {0, 2, 0});
        sideways.clipFromView = reversedFrustum(-0.1, 1.0, -0.05, 0.5, 0.1);
        const auto fit = fitDirectional({0.4, -1, 0.3}, kTown, {&sideways, 1}, requestFor(mode));
        ASSERT_TRUE(fit);
        // The middle of its picture.
        EXPECT_TRUE(isOnMap(*fit, {0.45 * 20 / 0.1 * 0.1, 2, 48}));
    }
}

// A flat floor, a point, nothing at all.
TEST(ShadowWarp, DegenerateScenesHaveAMapOrNone) {
    const View view = viewFrom({0, 3, 20}, {0, 0, 0});
    for (const ShadowMode mode : kWarps) {
        for (const Box3d& box :
             {Box3d{{-5, 0, -5}, {5, 0, 5}}, Box3d{{0, 0, -5}, {0, 0, 5}}, Box3d{{0, 0, 0}, {0, 0, 0}}}) {
            const auto fit = fitDirectional({0.4, -1, 0.3}, box, {&view, 1}, requestFor(mode));
            ASSERT_TRUE(fit);
            EXPECT_TRUE(isFinite(fit->clipFromWorld));
        }
        EXPECT_FALSE(fitDirectional({0.4, -1, 0.3}, Box3d{}, {&view, 1}, requestFor(mode)));
        EXPECT_FALSE(fitDirectional({0, 0, 0}, kTown, {&view, 1}, requestFor(mode)));
    }
}

// Walls all around: no direction is forward, so nothing is warped.
TEST(ShadowWarp, ViewsAllAroundHaveTheUniformMap) {
    std::vector<View> views;
    for (const glm::dvec3& axis : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 0, 0), glm::dvec3(0, 0, 1), glm::dvec3(0, 0, -1),
                                   glm::dvec3(0, 1, 0), glm::dvec3(0, -1, 0)})
        views.push_back(viewFrom({0, 3, 0}, glm::dvec3(0, 3, 0) + axis, 1.5707));
    for (const ShadowMode mode : kWarps) {
        const auto fit = fitDirectional({0.4, -1, 0.3}, kTown, views, requestFor(mode));
        ASSERT_TRUE(fit);
        EXPECT_NEAR(texelsPerSquareMetre(*fit, {30, 0, 30}) / texelsPerSquareMetre(*fit, {-30, 0, -30}), 1.0, 1e-6);
    }
    // Up to and past 180 degrees the parts stay on the map.
    for (int count = 2; count <= 5; ++count)
        for (const ShadowMode mode : kWarps) {
            const auto fit =
                fitDirectional({0.4, -1, 0.3}, kTown, std::span(views).first(std::size_t(count)), requestFor(mode));
            ASSERT_TRUE(fit);
            EXPECT_TRUE(isOnMap(*fit, {30, 3, 0}));
            EXPECT_TRUE(isOnMap(*fit, {-30, 3, 0}));
        }
}

// The focus range up to its limit, where 80 % of the map for 80 % of the depth is no warp at all.
TEST(ShadowWarp, TheTrapezoidGoesOverIntoTheUniformMap) {
    const View view = viewFrom({0, 2, 55}, {0, 0, 0});
    const glm::dvec3 near(0, 0, 45), far(0, 0, -50);
    double last = std::numeric_limits<double>::infinity();
    for (double range = 0.05; range < 0.8; range += 0.002) {
        ShadowFitRequest request = requestFor(ShadowMode::Trapezoid);
        request.range = static_cast<float>(range);
        const auto fit = fitDirectional({0.7, -0.7, 0}, kTown, {&view, 1}, request);
        ASSERT_TRUE(fit);
        const double ratio = texelsPerSquareMetre(*fit, near) / texelsPerSquareMetre(*fit, far);
        EXPECT_LE(ratio, last * 1.001) << range;  // ever less
        if (last < 1e300) {
            EXPECT_GT(ratio, 0.9 * last) << range;
        }
        last = ratio;
    }
    EXPECT_NEAR(last, 1.0, 0.05);
    ShadowFitRequest limit = requestFor(ShadowMode::Trapezoid);
    limit.range = 0.8f;
    const auto fit = fitDirectional({0.7, -0.7, 0}, kTown, {&view, 1}, limit);
    ASSERT_TRUE(fit);
    EXPECT_NEAR(texelsPerSquareMetre(*fit, near) / texelsPerSquareMetre(*fit, far), 1.0, 1e-3);
}

// 80 % of the map for the first share of the depth, where nothing limits the warp.
TEST(ShadowWarp, TheTrapezoidKeepsTheEightyPercentRule) {
    LightBody body;
    for (const double y : {0.0, 10.0})
        for (const double x : {-1.0, 1.0}) {
            body.points.push_back({x * (1.0 + 0.2 * y), y, -1.0});
            body.places.push_back({body.points.back(), 1.0 + y, 1.0});
        }
    body.smallest = 1e-6;
    for (const double range : {0.1, 0.3, 0.6}) {
        ShadowFitRequest request = requestFor(ShadowMode::Trapezoid);
        request.range = static_cast<float>(range);
        request.maxSideAngle = 3.0f;
        const glm::dmat3 warp = trapezoidWarp(body, request);
        const auto y = [&](double at) {
            const glm::dvec3 p = warp * glm::dvec3(0.0, at, 1.0);
            return p.y / p.z;
        };
        EXPECT_NEAR((y(10.0 * range) - y(0.0)) / (y(10.0) - y(0.0)), 0.8, 1e-6) << range;
    }
}

// Of things at two ends that the eye sees equally much of, the mean texel is smallest for the paper's n.
TEST(ShadowWarp, LispFindsThePapersOptimum) {
    for (const double z0 : {1.0, 2.0, 4.0}) {
        LightBody body;
        const double d = 10.0, z1 = z0 + 8.0;
        for (const double y : {0.0, d})
            for (const double x : {-1.0, 1.0}) {
                body.points.push_back({x, y, -1.0});
                body.places.push_back({body.points.back(), y == 0.0 ? z0 : z1, 1.0});
            }
        body.smallest = 1e-6;
        for (const float factor : {0.5f, 1.0f, 4.0f}) {
            ShadowFitRequest request = requestFor(ShadowMode::LightSpacePerspective);
            request.lispFactor = factor;
            const glm::dmat3 warp = lispWarp(body, request);
            const double n = 1.0 / warp[1][2] * (warp * glm::dvec3(0.0, 0.0, 1.0)).z;
            ASSERT_TRUE(std::isfinite(n));
            EXPECT_NEAR(n, double(factor) * d * (z0 + std::sqrt(z0 * z1)) / (z1 - z0), 1e-4 * n) << z0;
        }
        ShadowFitRequest uniform = requestFor(ShadowMode::LightSpacePerspective);
        uniform.lispFactor = std::numeric_limits<float>::infinity();
        EXPECT_TRUE(isAffine(lispWarp(body, uniform)));
    }
}

// Things anywhere: no other near distance makes the texels shorter on the mean.
RC_GTEST_PROP(ShadowWarp, LispsMeanTexelIsTheShortest, ()) {
    LightBody body;
    body.smallest = 1e-6;
    for (const double y : {0.0, 10.0})
        for (const double x : {-3.0, 3.0}) body.points.push_back({x, y, -1.0});
    for (int i = *rc::gen::inRange(3, 20); i > 0; --i) {
        const double x = *rc::gen::inRange(-300, 301) * 0.01, y = *rc::gen::inRange(0, 1001) * 0.01;
        body.places.push_back({{x, y, -1.0}, 1.0 + y, 1.0});
    }
    // Both ends, so that depth has a slope that nothing fades.
    for (const double y : {0.0, 10.0}) body.places.push_back({{0.0, y, -1.0}, 1.0 + y, 1.0});
    const auto meanTexel = [&](float factor) {
        ShadowFitRequest request = requestFor(ShadowMode::LightSpacePerspective);
        request.lispFactor = factor;
        const glm::dmat3 warp = lispWarp(body, request);
        // The direction that w grows in; along it a texel has w^2 of its length where w is 1, and the map 1 / (1 + s
        // d).
        const glm::dvec2 along(warp[0][2], warp[1][2]);
        if (along == glm::dvec2(0.0)) return 0.0;
        double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, sum = 0.0;
        for (const glm::dvec3& point : body.points) {
            const double w = (warp * glm::dvec3(body.across(point), 1.0)).z;
            lowest = std::min(lowest, w);
            highest = std::max(highest, w);
        }
        for (const LightBody::Place& place : body.places) {
            const double w = (warp * glm::dvec3(body.across(place.point), 1.0)).z / lowest;
            sum += w * w / place.depth;
        }
        return sum * lowest / highest;
    };
    const double best = meanTexel(1.0f);
    RC_PRE(best > 0.0);
    for (const float factor : {0.5f, 0.9f, 1.1f, 2.0f}) RC_ASSERT(meanTexel(factor) >= best * (1.0 - 1e-9));
}

// On a ground the depth of what lies at a place of the map is a plane; the warp follows it, wherever the view looks.
TEST(ShadowWarp, TheWarpFollowsTheDepthOfWhatIsSeen) {
    for (const double angle : {0.0, 0.4, 1.3, -2.0}) {
        const glm::dvec2 along(std::cos(angle), std::sin(angle));
        LightBody body;
        body.smallest = 1e-6;
        body.axisLight = {0.0, 1.0, 0.0};
        for (const double y : {0.0, 5.0, 10.0})
            for (const double x : {-4.0, 0.0, 4.0}) {
                body.points.push_back({x, y, -1.0});
                body.places.push_back({body.points.back(), 40.0 + 2.0 * glm::dot(along, glm::dvec2(x, y)), 1.0});
            }
        for (const ShadowMode mode : {ShadowMode::LightSpacePerspective, ShadowMode::Trapezoid}) {
            const ShadowFitRequest request = requestFor(mode);
            const glm::dmat3 warp =
                mode == ShadowMode::Trapezoid ? trapezoidWarp(body, request) : lispWarp(body, request);
            ASSERT_FALSE(isAffine(warp));
            const glm::dvec2 grows = glm::normalize(glm::dvec2(warp[0][2], warp[1][2]));
            EXPECT_NEAR(glm::distance(grows, along), 0.0, 2e-3) << angle;
        }
    }
}

// Ever smaller factors favour what is near ever more, to a limit: the border of a small map, or of a wide filter, does
// not reach over the horizon and make it the uniform one.
TEST(ShadowWarp, AStrongWarpIsLimitedNotGivenUp) {
    const View view = viewFrom({0, 2, 55}, {0, 0, 0});
    for (const std::uint32_t size : {64u, 512u, 4096u})
        for (const double border : {0.0, 32.0}) {
            double last = 1.0;
            for (const float factor : {8.0f, 1.0f, 0.25f, 0.03f, 1e-3f, 1e-9f}) {
                ShadowFitRequest request = requestFor(ShadowMode::LightSpacePerspective, size);
                request.lispFactor = factor;
                request.borderTexels = border;
                const auto fit = fitDirectional({0.7, -0.7, 0.1}, kTown, {&view, 1}, request);
                ASSERT_TRUE(fit);
                const double ratio = texelsPerSquareMetre(*fit, {0, 0, 45}) / texelsPerSquareMetre(*fit, {0, 0, -50});
                EXPECT_GE(ratio, last * (1.0 - 1e-6)) << size << " texels, factor " << factor;
                EXPECT_GT(ratio, 1.0);
                last = ratio;
            }
        }
}

TEST(ShadowWarp, AnOrthographicViewHasNoNearEnd) {
    View view = viewFrom({0, 10, 50}, {0, 0, 0});
    view.clipFromView = reversedOrthographic(-30, 30, -20, 20, 0.1, 500.0);
    view.orthographic = true;
    for (const ShadowMode mode : {ShadowMode::LightSpacePerspective, ShadowMode::Trapezoid}) {
        const auto fit = fitDirectional({0.4, -1, 0.3}, kTown, {&view, 1}, requestFor(mode));
        const auto plain = fitDirectional({0.4, -1, 0.3}, kTown, {&view, 1}, requestFor(ShadowMode::Standard));
        ASSERT_TRUE(fit && plain);
        EXPECT_EQ(fit->clipFromWorld, plain->clipFromWorld);
    }
}

// The eye on the light, before and behind it, on a face of its frustum.
TEST(ShadowWarp, SpotsWorkWhereverTheEyeIs) {
    const glm::dvec3 light(0, 20, 0);
    for (const glm::dvec3& eye : {light, glm::dvec3(0, 25, 0), glm::dvec3(0, 10, 0), glm::dvec3(10, 0.1, 0),
                                  glm::dvec3(0, 20.0 - 20.0 * 2e-5, 0), glm::dvec3(20 * std::tan(0.6), 0, 0)})
        for (const ShadowMode mode : kWarps) {
            const View view = viewFrom(eye, glm::dvec3(0, 0, -15), 1.0);
            const auto fit = fitSpot(light, {0, -1, 0}, 0.6, 0.0, kTown, {&view, 1}, requestFor(mode));
            if (!fit) continue;  // the view sees nothing in the cone
            EXPECT_TRUE(isFinite(fit->clipFromWorld));
            if (isSeen(view, {0, 0, -10})) {
                EXPECT_TRUE(isOnMap(*fit, {0, 0, -10}));
            }
        }
}

}  // namespace
}  // namespace umbriel
