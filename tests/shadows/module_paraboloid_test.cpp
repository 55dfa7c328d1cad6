#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

// The worst scene for two paraboloids, whose maps are right at vertices only: a lamp 0.1 m above a ground of two
// triangles, 40 m wide, whose common edge passes below it; posts around, thin and near, and walls to the horizon.
class Paraboloid : public ModuleTest {
 protected:
    void buildGround() {
        block({-20, -1, -20}, {20, 0, 20});
        for (int i = 0; i < 9; ++i) {
            const double angle = 0.7 * i, far = 0.15 + 0.09 * i;
            const glm::dvec3 at(far * std::cos(angle), 0, far * std::sin(angle));
            block(at - glm::dvec3(0.01, 0, 0.015), at + glm::dvec3(0.01, 0.03 + 0.01 * i, 0.015));
        }
        block({-15, 0, -8}, {15, 3, -7.5});
        block({6, 0, -7}, {6.3, 2, 15});
        block({-3, 0, -3}, {-2.6, 0.5, -2.6});
        block({2, 0.05, -3}, {3, 0.4, -2.5});
    }
    // A rod past the lamp, from one horizon to the other, 0.1 m away from it: its shadow is a straight band.
    void buildRod() {
        block({-20, -1, -20}, {20, 0, 20});
        block({-20, 0.05, 0.11}, {20, 0.06, 0.12});
    }
    Errors at(ShadowMode mode, std::uint32_t mapSize) {
        edgeMetres = 0.03;  // a texel of 2048 on the ground, a metre from the lamp: 4 mm as wide, ten times as long
        scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::mapSize>(mapSize);
        const Errors errors = measure();
        std::printf("%-10s %5u texels: error %.3f %% = leak %.3f + acne %.3f, inner %.4f; %zu judged, %zu dark\n",
                    mode == ShadowMode::Cube ? "cube" : "paraboloid", mapSize, 100 * errors.error, 100 * errors.leak,
                    100 * errors.acne, 100 * errors.inner, errors.judged, errors.dark);
        return errors;
    }
    // innerSlack: of the share of pixels that are wrong far from an edge.
    void expectNearTheCube(double innerSlack) {
        for (const std::uint32_t mapSize : {512u, 1024u, 2048u}) {
            const Errors cube = at(ShadowMode::Cube, mapSize);
            const Errors halves = at(ShadowMode::DualParaboloid, mapSize);
            EXPECT_LE(halves.error, 2.5 * cube.error + 0.0005) << mapSize;
            EXPECT_LE(halves.inner, 3.0 * cube.inner + innerSlack) << "holes at " << mapSize;
        }
    }
};

TEST_F(Paraboloid, AGroundOfTwoTrianglesUnderTheLampIsNoWorseThanWithACube) {
    buildGround();
    finishScene(LightPlace::Point, {0.013, 0.1, 0.021}, {0, -1, 0});
    for (const auto& [eye, target] : {std::pair(glm::dvec3(0.3, 1.6, 0.9), glm::dvec3(0, 0, 0)),
                                      std::pair(glm::dvec3(1.0, 1.2, 6.0), glm::dvec3(0, 0.6, -7))}) {
        look(eye, target);
        expectNearTheCube(1e-4);
    }
}

TEST_F(Paraboloid, ARodPastTheLampCastsAStraightBand) {
    buildRod();
    finishScene(LightPlace::Point, {0.013, 0.1, 0.021}, {0, -1, 0});
    look({0.2, 1.2, 0.9}, {0, 0, 0.2});
    expectNearTheCube(2e-4);
}

// The lamp in the line of an edge, and in the plane of a face: no way between opposite directions, and no area.
TEST_F(Paraboloid, ALampOnAnEdgeOrInAFaceLosesNothingElse) {
    // The last two lie in upright faces, which the halves see as arcs and not as lines through their middles.
    for (const glm::dvec3& at_ : {glm::dvec3(0, 0.5, 0), glm::dvec3(0.5, 0.5, 0.1), glm::dvec3(0, 0.5, 0.7),
                                  glm::dvec3(-0.5, 0.45, 0), glm::dvec3(0, 0.45, -0.4)}) {
        SetUp();
        block({-10, -1, -10}, {10, 0, 10});
        block({-10, 0.4, -1}, {0, 0.5, 0});
        finishScene(LightPlace::Point, at_, {0, -1, 0});
        look({1.5, 3, 2}, {0, 0, 0});
        const Errors cube = at(ShadowMode::Cube, 1024);
        const Errors halves = at(ShadowMode::DualParaboloid, 1024);
        EXPECT_LE(halves.error, 2.5 * cube.error + 0.0005);
    }
}

// A renderer that numbers the vertices of all patches of a draw with 16 bits (Mesa's in software) gives triangles
// beyond 65536 of them other patches' corners: walls get holes, and shadows fall where nothing stands. Each of these
// faces is divided into up to 64 parts an edge, 3169 vertices a triangle, and all are one geometry.
TEST_F(Paraboloid, AHallOfLargeFacesInOneGeometryIsNoWorseThanWithACube) {
    isOneGeometry = true;
    block({-5, -0.2, -4}, {5, 0, 4});
    block({-5, 3, -4}, {5, 3.2, 4});
    block({-5, 0, -4.2}, {5, 3, -4});
    block({-5, 0, 4}, {5, 3, 4.2});
    block({-5.2, 0, -4}, {-5, 3, 4});
    block({5, 0, -4}, {5.2, 3, 4});
    for (int i = 0; i < 12; ++i)
        block({-4.9, 0.25 * i, -3.9 + 0.3 * (i % 3)}, {4.9, 0.25 * i + 0.03, -3.7 + 0.3 * (i % 3)});
    block({-2.8, 0.72, 0.5}, {-1.2, 0.76, 1.5});
    finishScene(LightPlace::Point, {0.3, 1.7, 0.2}, {0, -1, 0});
    look({-4.2, 1.7, 3.2}, {2, 0.9, -1.2}, 1.1);
    expectNearTheCube(1e-4);
}

}  // namespace
}  // namespace umbriel
