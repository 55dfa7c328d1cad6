#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "common/trace/double_hit.h"
#include "common/trace/enlarged.h"
#include "common/trace/fan.h"
#include "common/trace/grid_scene.h"
#include "common/trace/ray_scene.h"
#include "common/trace/triangles.h"

namespace umbriel::trace {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();

rc::Gen<glm::dvec3> point() {
    return rc::gen::map(
        rc::gen::tuple(rc::gen::inRange(-1000, 1001), rc::gen::inRange(-1000, 1001), rc::gen::inRange(-1000, 1001)),
        [](const std::tuple<int, int, int>& t) {
            return glm::dvec3(std::get<0>(t), std::get<1>(t), std::get<2>(t)) / 100.0;
        });
}

TEST(DoubleHit, MeetsTheTriangleItLooksAt) {
    const glm::dvec3 a(0, 0, 2), b(1, 0, 2), c(0, 1, 2);
    EXPECT_DOUBLE_EQ(*hitDistance({0.2, 0.2, 1}, a, b, c), 2.0);
    EXPECT_DOUBLE_EQ(*hitDistance({0.2, 0.2, 1}, a, c, b), 2.0);  // from either side
    EXPECT_FALSE(hitDistance({-0.2, -0.2, -1}, a, b, c));         // behind
    EXPECT_FALSE(hitDistance({0.6, 0.6, 1}, a, b, c));
    EXPECT_FALSE(
        hitDistance({1, 0, 0}, glm::dvec3(1, -1, 0), glm::dvec3(1, 1, 0), glm::dvec3(2, 0, 0)));  // in its plane
}

// Whatever is rounded, a ray through a shared edge meets one of the two triangles.
RC_GTEST_PROP(DoubleHit, NothingSlipsThroughASharedEdge, ()) {
    const glm::dvec3 a = *point(), b = *point(), c = *point(), d = *point();
    const double s = *rc::gen::inRange(0, 1001) / 1000.0;
    const glm::dvec3 through = a + (b - a) * s;
    // c and d on different sides of the edge as the ray sees it.
    const glm::dvec3 plane = glm::cross(a, b);
    RC_PRE(glm::dot(plane, c) * glm::dot(plane, d) < 0.0);
    RC_PRE(std::abs(glm::dot(a, glm::cross(b - a, c - a))) > 1e-3);
    RC_PRE(std::abs(glm::dot(a, glm::cross(b - a, d - a))) > 1e-3);
    RC_PRE(s > 0.0 && s < 1.0);
    RC_ASSERT(hitDistance(through, a, b, c) || hitDistance(through, b, a, d));
}

RC_GTEST_PROP(Enlarged, HoldsTheTriangleWithItsMargin, ()) {
    const glm::dvec3 a = *point(), b = *point(), c = *point();
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    RC_PRE(glm::length(normal) > 1e-6);
    const double margin = 0.001;
    Enlarged out;
    appendEnlarged(a, b, c, 7, margin, out);
    RC_ASSERT(out.original.size() == out.sure.size() && out.corners.size() == 3 * out.sure.size());
    // Points up to almost a margin outside the edges are inside one of the pieces.
    const double u = *rc::gen::inRange(0, 1001) / 1000.0;
    const glm::dvec3 n = glm::normalize(normal);
    const glm::dvec3 corners[] = {a, b, c};
    for (int k = 0; k < 3; ++k) {
        const glm::dvec3 p = corners[k], q = corners[(k + 1) % 3];
        const glm::dvec3 outside = p + (q - p) * u + glm::normalize(glm::cross(q - p, n)) * (0.98 * margin);
        bool inside = false;
        for (std::size_t t = 0; t < out.sure.size(); ++t) {
            const glm::dvec3 x(out.corners[3 * t]), y(out.corners[3 * t + 1]), z(out.corners[3 * t + 2]);
            const glm::dvec3 m = glm::cross(y - x, z - x);
            const double area = glm::dot(m, m);
            const double wa = glm::dot(glm::cross(y - outside, z - outside), m) / area;
            const double wb = glm::dot(glm::cross(z - outside, x - outside), m) / area;
            inside = inside || (wa >= -1e-5 && wb >= -1e-5 && 1.0 - wa - wb >= -1e-5);
        }
        RC_ASSERT(inside);
    }
}

TEST(Normalise, MovesWithoutRounding) {
    std::vector<glm::vec3> far;
    for (int i = 0; i < 100; ++i) far.emplace_back(5000.0f + 0.01f * i, -3.0f + 0.02f * i, 1e-9f * i);
    const NormalisedPositions n = normalise(far);
    for (std::size_t i = 0; i < far.size(); ++i) {
        EXPECT_EQ(glm::dvec3(n.positions[i]) / n.scale + n.centre, glm::dvec3(far[i])) << i;
        EXPECT_LE(glm::length(n.positions[i]), 2.0f * 2.0f);
    }
    EXPECT_NE(n.centre.x, 0.0);
    EXPECT_GE(n.diagonal, 1.0);
    EXPECT_LT(n.diagonal, 2.0 + 1e-12);
    EXPECT_EQ(normalise(std::vector<glm::vec3>{{3, 4, 5}}).diagonal, 0.0);
}

// Two walls rising at 45 degrees: a direction is blocked when it is lower than they are.
TEST(Fan, BlocksWhatLiesUnderItsWedges) {
    Fan fan;
    const Origin origin;                                         // normal z
    const std::vector<glm::dvec3> edges{{1, -1, 1}, {1, 1, 1}};  // a triangle in the plane x = z
    fan.reset(origin, edges);
    EXPECT_TRUE(fan.blocks({1, 0, 0.5}, false));
    EXPECT_FALSE(fan.blocks({1, 0, 1.5}, false));
    EXPECT_FALSE(fan.blocks({-1, 0, 0.1}, false));
    EXPECT_TRUE(fan.blocks({1, 0, -0.5}, false));  // from above, everything under the wall
    // From below the same wall stands between the eye and what is over it.
    EXPECT_FALSE(fan.blocks({1, 0, 0.5}, true));
    EXPECT_TRUE(fan.blocks({1, 0, 1.5}, true));
    EXPECT_FALSE(fan.blocks({1, 0, -0.5}, true));
}

RC_GTEST_PROP(Fan, PacketsAgreeWithSingleDirections, ()) {
    Origin origin;
    origin.normal = glm::normalize(glm::vec3(*point()) + glm::vec3(0, 0, 0.003f));
    DirectionPackets set;
    std::vector<glm::dvec3> edges;
    for (int i = 0; i < 5; ++i) {
        edges.push_back(*point());
        edges.push_back(*point());
    }
    for (std::uint32_t i = 0; i < 64; ++i) {
        // Some exactly along edges, where single precision cannot tell.
        const glm::vec3 d = i < 10 ? glm::vec3(edges[i]) : glm::vec3(*point());
        const float length = glm::length(d) > 0 ? glm::length(d) : 1.0f;
        set.x.push_back(d.x / length);
        set.y.push_back(d.y / length);
        set.z.push_back(d.z / length);
        set.pixel.push_back(i);
    }
    set.lowerBegin = 32;
    Fan fan;
    fan.reset(origin, edges);
    std::vector<std::uint8_t> blocked(set.packets());
    fan.blocked(set, blocked);
    for (std::size_t lane = 0; lane < 64; ++lane) {
        const glm::dvec3 d(worldDirection(origin, set.x[lane], set.y[lane], set.z[lane]));
        RC_ASSERT(((blocked[lane / 8] >> (lane % 8) & 1) != 0) == fan.blocks(d, lane >= 32));
    }
}

// A roof over the origin's own triangle: rays that reach it within the limit are blocked, by tree and by grid alike.
TEST(Scenes, FarLimitIsADistanceAlongTheRay) {
    const std::vector<glm::vec3> positions{{-0.1f, -0.1f, 0}, {0.1f, -0.1f, 0}, {0, 0.1f, 0},
                                           {-5, -5, 1},       {5, -5, 1},       {0, 8, 1}};
    const std::vector<glm::uvec3> corners{{0, 1, 2}, {3, 4, 5}};
    DirectionPackets set;
    for (std::uint32_t i = 0; i < 8; ++i) {
        const double angle = 0.2 * i;
        set.x.push_back(static_cast<float>(std::sin(angle)));
        set.y.push_back(0.0f);
        set.z.push_back(static_cast<float>(std::cos(angle)));
        set.pixel.push_back(i == 5 ? kNoPixel : i);
    }
    set.lowerBegin = 8;
    const std::uint32_t own[] = {0};
    const Origin origin{2, {0, 0, 1}, glm::mat3(1.0f)};
    const GridScene grid({positions, corners});
    GridScene::Tracer gridTracer(grid);
    for (const double far : {0.5, 1.01, 1.2, 2.0, kEndless}) {
        std::uint8_t expected = 0;
        for (std::uint32_t i = 0; i < 8; ++i) {
            const double distance = 1.0 / std::cos(0.2 * i);
            if (i != 5 && distance <= far && std::tan(0.2 * i) < 3.0) expected |= static_cast<std::uint8_t>(1u << i);
        }
        std::uint8_t blocked[1];
        gridTracer.blocked(origin, own, set, far, blocked);
        EXPECT_EQ(blocked[0], expected) << far;
        for (const Guard guard : {Guard::Exact, Guard::Fast, Guard::FastFan}) {
            const auto scene = RayScene::create({positions, corners}, guard, 1);
            RayScene::Tracer tracer(**scene);
            tracer.blocked(origin, own, set, far, blocked);
            EXPECT_EQ(blocked[0], expected) << far << " guard " << static_cast<int>(guard);
        }
    }
}

// Needles and slivers become rectangles; rays must still meet exactly the triangles they are.
TEST(Scenes, NeedlesAreMetExactly) {
    const float thin = 1e-7f;
    const std::vector<glm::vec3> positions{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}, {-1, 0, 1}, {1, 0, 1}, {0, thin, 1}};
    const std::vector<glm::uvec3> corners{{0, 1, 2}, {3, 4, 5}};
    DirectionPackets set;
    for (std::uint32_t i = 0; i < 8; ++i) {
        // From the corner (-1, -1, 0) towards the needle and around it.
        const glm::dvec3 target(-0.5, thin * (i * 0.25 - 0.75), 1.0);
        const glm::vec3 d(glm::normalize(target - glm::dvec3(positions[0])));
        set.x.push_back(d.x);
        set.y.push_back(d.y);
        set.z.push_back(d.z);
        set.pixel.push_back(i);
    }
    set.lowerBegin = 8;
    const std::uint32_t own[] = {0};
    const Origin origin{0, {0, 0, 1}, glm::mat3(1.0f)};
    const auto scene = RayScene::create({positions, corners}, Guard::Exact, 1);
    RayScene::Tracer tracer(**scene);
    std::uint8_t blocked[1];
    tracer.blocked(origin, own, set, kEndless, blocked);
    for (std::uint32_t i = 0; i < 8; ++i) {
        const glm::dvec3 d(worldDirection(origin, set.x[i], set.y[i], set.z[i]));
        const auto corner = [&](int k) { return glm::dvec3(positions[k]) - glm::dvec3(positions[0]); };
        EXPECT_EQ((blocked[0] >> i & 1) != 0, hitDistance(d, corner(3), corner(4), corner(5)).has_value()) << i;
    }
}

}  // namespace
}  // namespace umbriel::trace
