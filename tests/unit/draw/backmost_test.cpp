#include "server/draw/backmost.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

namespace umbriel {
namespace {

Box box(const glm::vec3& minimum, const glm::vec3& maximum) {
    Box result;
    result.add(minimum);
    result.add(maximum);
    return result;
}

ShadowFit sun(const glm::dvec3& towards) {
    ShadowFit fit;
    const glm::dvec3 z = glm::normalize(towards);
    const glm::dvec3 x = glm::normalize(glm::cross(glm::dvec3(0.3, 0.5, 0.81), z));
    fit.worldFromLight = {x, glm::cross(z, x), z};
    return fit;
}

ShadowFit lamp(const glm::dvec3& at) {
    ShadowFit fit;
    fit.perspective = true;
    fit.positionWorld = at;
    return fit;
}

constexpr BoxFaces kBottom = 1 << 4;  // -z
constexpr BoxFaces kTop = 2 << 4;

TEST(Backmost, AFlatPartLiesUnderTheFaceOfTheWhole) {
    const Box whole = box({0, 0, 0}, {4, 4, 4});
    EXPECT_EQ(faceUnder(box({1, 1, 0}, {2, 2, 0}), whole), kBottom);
    EXPECT_EQ(faceUnder(box({1, 1, 4}, {2, 2, 4}), whole), kTop);
    EXPECT_EQ(faceUnder(box({4, 1, 1}, {4, 2, 2}), whole), 2);
    EXPECT_EQ(faceUnder(box({1, 1, 1}, {2, 2, 1}), whole), 0);  // flat, within
    EXPECT_EQ(faceUnder(box({0, 0, 0}, {4, 4, 1}), whole), 0);
    EXPECT_NE(faceUnder(box({1, 1, 2}, {2, 2, 2}), box({0, 0, 2}, {4, 4, 2})), 0);
}

TEST(Backmost, GroundIsWhereTheLightComesFromTheSceneSide) {
    const Box item = box({-5, -5, 0}, {5, 5, 3});
    const Box3d scene{{-5, -5, 0}, {5, 5, 3}};
    const glm::dmat4 still(1.0);
    EXPECT_EQ(backmostFaces(kBottom, item, still, scene, sun({0.4, 0.2, 0.9})), kBottom);
    EXPECT_EQ(backmostFaces(kBottom, item, still, scene, sun({0.4, 0.2, -0.9})), 0);  // it is above everything then
    EXPECT_EQ(backmostFaces(kTop, item, still, scene, sun({0.4, 0.2, -0.9})), kTop);
    EXPECT_EQ(backmostFaces(kBottom, item, still, scene, sun({1, 0, 0})), 0);  // along it
    EXPECT_EQ(backmostFaces(kBottom, item, still, scene, lamp({0, 0, 1})), kBottom);
    EXPECT_EQ(backmostFaces(kBottom, item, still, scene, lamp({0, 0, -1})), 0);
    EXPECT_EQ(backmostFaces(0, item, still, scene, sun({0, 0, 1})), 0);
}

TEST(Backmost, NothingThatHasAnythingBehindItIsGround) {
    const Box item = box({-5, -5, 0}, {5, 5, 3});
    EXPECT_EQ(backmostFaces(kBottom, item, glm::dmat4(1.0), {{-5, -5, -1e-3}, {5, 5, 3}}, sun({0, 0, 1})), 0);
    // Raised above what other things stand on.
    const glm::dmat4 raised = glm::translate(glm::dmat4(1.0), glm::dvec3(0, 0, 0.01));
    EXPECT_EQ(backmostFaces(kBottom, item, raised, {{-5, -5, 0}, {5, 5, 3.01}}, sun({0, 0, 1})), 0);
}

TEST(Backmost, HoldsTurnedMirroredScaledAndFarAway) {
    const Box item = box({-5, -5, 0}, {5, 5, 3});
    for (const double size : {1e-3, 1.0, 1e4})
        for (const double away : {0.0, 1e6})
            for (const double mirror : {1.0, -1.0}) {
                glm::dmat4 placed = glm::translate(glm::dmat4(1.0), glm::dvec3(away, -away, away));
                // z becomes x.
                placed = placed * glm::dmat4(0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1);
                placed = glm::scale(placed, glm::dvec3(size, mirror * size, size));
                Box3d scene;
                for (const glm::dvec3& corner : item.corners()) scene.include(glm::dvec3(placed * glm::dvec4(corner, 1.0)));
                EXPECT_EQ(backmostFaces(kBottom, item, placed, scene, sun({0.9, 0.1, 0.3})), kBottom) << size << away;
                EXPECT_EQ(backmostFaces(kBottom, item, placed, scene, sun({-0.9, 0.1, 0.3})), 0) << size << away;
            }
}

}  // namespace
}  // namespace umbriel
