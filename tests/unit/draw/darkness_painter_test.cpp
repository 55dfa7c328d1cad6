#include "server/draw/darkness_painter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/shadow/view_module.h"

namespace umbriel {
namespace {

View viewAt(const glm::dvec3& towards, bool orthographic) {
    View view;
    view.region = {0, 0, 400, 300};
    view.orthographic = orthographic;
    view.viewFromWorld = glm::dmat3(glm::lookAt(glm::dvec3(0), towards, glm::dvec3(0, 1, 0)));
    view.clipFromView = glm::dmat4(0.0);
    if (orthographic) {
        view.clipFromView[0][0] = 0.5;
        view.clipFromView[1][1] = 0.7;
        view.clipFromView[2][2] = 1.0 / 50;
        view.clipFromView[3][2] = view.clipFromView[3][3] = 1.0;
    } else {
        view.clipFromView[0][0] = 1.5;
        view.clipFromView[1][1] = 2.0;
        view.clipFromView[2][3] = -1.0;
        view.clipFromView[3][2] = 0.1;
    }
    return view;
}

class Random {
 public:
    explicit Random(unsigned seed) : _engine(seed) {}
    double real(double scale) { return scale * (static_cast<double>(_engine() % 200001) / 1e5 - 1.0); }
    glm::dvec3 point(double scale) {
        const double x = real(scale), y = real(scale), z = real(scale);
        return {x, y, z};
    }
    glm::dvec4 light(bool directional) {
        return directional ? glm::dvec4(glm::normalize(point(1.0) + glm::dvec3(0, 0.01, 0)), 0.0)
                           : glm::dvec4(point(6.0), 1.0);
    }

 private:
    std::mt19937 _engine;
};

bool isSeen(const View& view, const glm::dvec3& relative) {
    const glm::dvec4 clip = clipFromRelativeOf(view) * glm::dvec4(relative, 1.0);
    return clip.w > 0.0 && std::abs(clip.x) <= clip.w && std::abs(clip.y) <= clip.w && clip.z >= 0.0 &&
           clip.z <= clip.w;
}

// A box whose shadow reaches some visible point is never left out.
TEST(Darkness, ShadowsThatReachTheViewAreDrawn) {
    Random random(3);
    int reached = 0, missed = 0;
    for (int round = 0; round < 4000; ++round) {
        const View view = viewAt(random.point(1.0), round % 3 == 0);
        const Frustum frustum = tileFrustum(view, view.region, 1.0);
        const glm::dvec4 light = random.light(round % 2 == 0);
        glm::dmat4 place(1.0);
        place[3] = glm::dvec4(random.point(8.0), 1.0);
        const Box box{glm::vec3(-0.5f), glm::vec3(0.5f)};
        bool reaches = false;
        for (int i = 0; i < 60 && !reaches; ++i) {
            const glm::dvec3 inBox = glm::dvec3(place[3]) + random.point(0.5);
            const double t = std::abs(random.real(1.0)) * 12.0;
            reaches = isSeen(view, inBox + t * (light.w * inBox - glm::dvec3(light)));
        }
        const bool left = shadowMisses(frustum, box, place, light);
        EXPECT_FALSE(reaches && left) << round;
        reached += reaches;
        missed += left;
    }
    EXPECT_GT(reached, 300);
    EXPECT_GT(missed, 300) << "or nothing is ever saved";
}

// Whatever stands between the light and a point of the near rectangle may cover the eye.
TEST(Darkness, WhatStandsBeforeTheNearRectangleIsNoticed) {
    Random random(5);
    int clear = 0;
    for (int round = 0; round < 2000; ++round) {
        const View view = viewAt(random.point(1.0), false);
        const Frustum frustum = tileFrustum(view, view.region, 0.0);
        const glm::dvec4 light = random.light(round % 2 == 0);
        const auto& near = frustum.nearCorners;
        const double u = std::abs(random.real(1.0)), v = std::abs(random.real(1.0)), t = std::abs(random.real(1.0));
        const glm::dvec3 target = (1 - u) * ((1 - v) * near[0] + v * near[3]) + u * ((1 - v) * near[1] + v * near[2]);
        const glm::dvec3 towards = glm::dvec3(light) - light.w * target;
        glm::dmat4 place(0.2);
        place[3] = glm::dvec4(target + t * (light.w > 0.0 ? 1.0 : 9.0) * towards + random.point(0.1), 1.0);
        const Box box{glm::vec3(-1), glm::vec3(1)};
        EXPECT_TRUE(mayCoverEye(frustum, box, place, light)) << round;
        place[3] = glm::dvec4(random.point(20.0), 1.0);
        clear += !mayCoverEye(frustum, box, place, light);
    }
    EXPECT_GT(clear, 1500) << "or every caster is drawn the dear way";
}

// Flattened points lie on the plane, on the line from the light, in front of whoever looks.
TEST(Darkness, FlatteningFollowsTheLightOntoThePlane) {
    Random random(7);
    for (int round = 0; round < 500; ++round) {
        const glm::dvec4 light = random.light(round % 2 == 0);
        const glm::dvec4 plane(glm::normalize(random.point(1.0)), random.real(3.0));
        const auto flatten = flattening(plane, light);
        EXPECT_EQ(flatten.has_value(), glm::dot(plane, light) > 1e-9) << round;
        if (!flatten) continue;
        const glm::dvec3 between = light.w > 0.0 ? glm::dvec3(light) : 5.0 * glm::dvec3(light) + random.point(2.0);
        const glm::dvec3 foot = between - (glm::dot(glm::dvec3(plane), between) + plane.w) * glm::dvec3(plane);
        const glm::dvec3 point = glm::mix(foot, between, 0.4) + random.point(0.01);
        const glm::dvec4 flat = *flatten * glm::dvec4(point, 1.0);
        ASSERT_GT(flat.w, 0.0);
        const glm::dvec3 on = glm::dvec3(flat) / flat.w;
        EXPECT_NEAR(glm::dot(glm::dvec3(plane), on) + plane.w, 0.0, 1e-9 * (1.0 + glm::length(on)));
        const glm::dvec3 way = glm::normalize(light.w * point - glm::dvec3(light));
        EXPECT_NEAR(glm::length(glm::cross(way, on - point)), 0.0, 1e-9 * (1.0 + glm::length(on))) << round;
    }
    EXPECT_FALSE(flattening({0, 1, 0, 0}, {1, 0, 0, 0})) << "light along the plane";
    EXPECT_FALSE(flattening({0, 1, 0, 0}, {0, -2, 0, 1})) << "light below it";
}

}  // namespace
}  // namespace umbriel
