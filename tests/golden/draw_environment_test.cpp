#include <algorithm>
#include <cmath>
#include <limits>

#include "common/light/environment_map.h"
#include "shaders/formula_cpp.h"
#include "tests/golden/draw_fixture.h"
#include "tests/support/panoramas.h"

namespace umbriel {
namespace {

namespace f = formula_f64;
constexpr PixelSize kWall{64, 48};

class EnvironmentTest : public DrawTest {
 protected:
    // Coloured by direction: 1 + d / 2 in each channel, so what is mirrored can be read off.
    static Panorama marked() {
        return panoramaOf(64, [](const glm::dvec3& d) { return 1.0 + 0.5 * d; });
    }
    Ref<Node> addLight(Ref<Node> parent, const Panorama& from) {
        light = scene->create<EnvironmentLight>("sky");
        scene->edit(light).set<&EnvironmentLight::map>(addEnvironmentMap(*scene, from, 32));
        return node(parent, light);
    }
    // The middle of a square that faces the eye straight on.
    glm::vec3 middleOfSquare(Ref<Material> look, const glm::mat3& turn = glm::mat3(1.0f)) {
        const Ref<Node> leaf = node(placed(lit, {0, 0, 0}, turn), geometry(gridMesh(4.0f, 4), look));
        const WallImage image = drawColour(wallViews(flatView(2.0, kWall)));
        scene->edit(leaf).set<&Node::visible>(false);
        const float* pixel = image.at(kWall.width / 2, kWall.height / 2);
        return {pixel[0], pixel[1], pixel[2]};
    }
    static void expectNear(const glm::vec3& seen, const glm::dvec3& expected, double tolerance, const char* what = "") {
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(seen[i], expected[i], tolerance) << what << " channel " << i;
    }

    Ref<EnvironmentLight> light;
    Ref<Node> lit;
};

// Of an even environment each model reflects its albedo.
TEST_F(EnvironmentTest, AnEvenEnvironmentIsAFurnace) {
    lit = addLight(root, panoramaOf(16, [](const glm::dvec3&) { return glm::dvec3(2.0); }));
    for (const ReflectionModel model :
         {ReflectionModel::BlinnPhong, ReflectionModel::Phong, ReflectionModel::PhongGated, ReflectionModel::Schlick,
          ReflectionModel::NormalisedPhong, ReflectionModel::GeneralSum, ReflectionModel::OpenGlSum}) {
        const auto look = material({0.5f, 0.25f, 0.125f, 1}, model);
        scene->edit(look).set<&Material::specular>(glm::vec3(0.25f)).set<&Material::shininess>(20.0f);
        expectNear(middleOfSquare(look), {1.5, 1.0, 0.75}, 1e-5, "k_s + k_d");
    }
    expectNear(middleOfSquare(material({0.5f, 0.25f, 0.125f, 1}, ReflectionModel::Lambert)), {1, 0.5, 0.25}, 1e-5);
    const std::vector<glm::vec3> shares = mirroredShares();
    for (const int row : {3, 16, 31}) {
        const auto look = material({1, 1, 1, 1}, ReflectionModel::MetallicRoughness);
        scene->edit(look).set<&Material::metallic>(1.0f).set<&Material::roughness>((float(row) + 0.5f) / 32.0f);
        const glm::vec3 share = shares[static_cast<std::size_t>(row * kReflectanceSide + kReflectanceSide - 1)];
        expectNear(middleOfSquare(look), glm::dvec3(2.0 * (share.x + share.y)), 1e-5, "a white metal");
        EXPECT_LE(share.x + share.y, 1.001f);
        scene->edit(look).set<&Material::metallic>(0.0f);
        const double dielectric = 0.04 * share.x + share.y + 0.96 * (1.0 - share.z);
        expectNear(middleOfSquare(look), glm::dvec3(2.0 * dielectric), 1e-5, "a white dielectric");
    }
}

// Seen along -z: a square turned by an angle a about y mirrors the direction 2 a from +z.
TEST_F(EnvironmentTest, MirrorsShowTheDirectionTheyFace) {
    lit = addLight(root, marked());
    const auto look = material({0, 0, 0, 1}, ReflectionModel::BlinnPhong);
    scene->edit(look).set<&Material::specular>(glm::vec3(1.0f)).set<&Material::shininess>(1e6f);
    for (const double a : {-0.7, -0.3, 0.0, 0.4, 0.75}) {
        const glm::mat3 turn(glm::rotate(glm::mat4(1), float(a), glm::vec3(0, 1, 0)));
        expectNear(middleOfSquare(look, turn), 1.0 + 0.5 * glm::dvec3(std::sin(2 * a), 0, std::cos(2 * a)), 0.01);
        const glm::mat3 tilt(glm::rotate(glm::mat4(1), float(a), glm::vec3(1, 0, 0)));
        expectNear(middleOfSquare(look, tilt), 1.0 + 0.5 * glm::dvec3(0, -std::sin(2 * a), std::cos(2 * a)), 0.01);
    }
    // The light's beacon turns the environment: a quarter about y brings what was at +x to -z, and what was at +z,
    // which the square mirrors, is now what was at -x... of the environment's own axes, +x holds the world's -z.
    const Ref<Node> beacon =
        placed(root, {0, 0, 0}, glm::mat3(glm::rotate(glm::mat4(1), 1.5707963f, glm::vec3(0, 1, 0))));
    scene->edit(light).set<&EnvironmentLight::beacon>(beacon);
    expectNear(middleOfSquare(look), {0.5, 1.0, 1.0}, 0.01, "turned");
    scene->edit(light).set<&EnvironmentLight::scale>(glm::vec3(3.0f));
    expectNear(middleOfSquare(look), {1.5, 3.0, 3.0}, 0.03, "scaled");
}

// Radiance 1 + d / 2 convolved by cos / pi is 1 + n / 3.
TEST_F(EnvironmentTest, DiffuseSurfacesAreConvolved) {
    lit = addLight(root, marked());
    const auto look = material({1, 1, 1, 1}, ReflectionModel::Lambert);
    for (const double a : {-0.7, 0.0, 0.6}) {
        const glm::mat3 turn(glm::rotate(glm::mat4(1), float(a), glm::vec3(0, 1, 0)));
        expectNear(middleOfSquare(look, turn), 1.0 + glm::dvec3(std::sin(a), 0, std::cos(a)) / 3.0, 0.005);
    }
}

TEST_F(EnvironmentTest, TheBackgroundShowsWhereOneLooks) {
    addLight(root, marked());
    const auto background = scene->create<EnvironmentBackground>();
    scene->edit(background).set<&EnvironmentBackground::light>(light);
    scene->edit(viewport).set<&Viewport::background>(Ref<Container>(background.id));
    for (const glm::dvec3 target : {glm::dvec3(0, 0, -1), glm::dvec3(1, 0, 0), glm::dvec3(1, 2, 3)}) {
        const View view = lookAt({1e6, 0, 0}, glm::dvec3(1e6, 0, 0) + target, 1.2, kWall);
        const WallImage image = drawColour(wallViews(view));
        for (const glm::ivec2 at : {glm::ivec2(0, 0), glm::ivec2(31, 23), glm::ivec2(63, 10), glm::ivec2(5, 47)}) {
            const glm::dvec2 ndc((at.x + 0.5) / kWall.width * 2 - 1, (at.y + 0.5) / kWall.height * 2 - 1);
            const glm::dvec3 inView(ndc.x / view.clipFromView[0][0], ndc.y / view.clipFromView[1][1], -1.0);
            const glm::dvec3 direction = glm::normalize(glm::transpose(view.viewFromWorld) * inView);
            const float* pixel = image.at(at.x, at.y);
            expectNear({pixel[0], pixel[1], pixel[2]}, 1.0 + 0.5 * direction, 0.01);
        }
    }
}

// Of two above each other the inner one counts; what is beside it keeps the outer; without either there is neither code
// nor background.
TEST_F(EnvironmentTest, TheInnermostLightCountsAndNoneCostsNothing) {
    const Ref<Node> outer = addLight(root, panoramaOf(8, [](const glm::dvec3&) { return glm::dvec3(1.0); }));
    const Ref<EnvironmentLight> outerLight = light;
    const Ref<Node> inner = addLight(outer, panoramaOf(8, [](const glm::dvec3&) { return glm::dvec3(4.0); }));
    const auto look = material({0.5f, 0.5f, 0.5f, 1}, ReflectionModel::Lambert);
    lit = inner;
    expectNear(middleOfSquare(look), glm::dvec3(2.0), 1e-5);
    lit = outer;
    expectNear(middleOfSquare(look), glm::dvec3(0.5), 1e-5);
    EXPECT_NE(renderer->explain().find("environment"), std::string::npos);
    scene->edit(light).set<&EnvironmentLight::on>(false);
    lit = inner;
    expectNear(middleOfSquare(look), glm::dvec3(0.5), 1e-5, "the inner one is off");
    scene->edit(outerLight).set<&EnvironmentLight::on>(false);
    expectNear(middleOfSquare(look), glm::dvec3(0.0), 0.0);
    EXPECT_EQ(renderer->explain().find("environment"), std::string::npos) << renderer->explain();
}

TEST_F(EnvironmentTest, TilesAgreeToTheBit) {
    lit = addLight(root, marked());
    const auto background = scene->create<EnvironmentBackground>();
    scene->edit(background).set<&EnvironmentBackground::light>(light);
    scene->edit(viewport).set<&Viewport::background>(Ref<Container>(background.id));
    for (int i = 0; i < 4; ++i) {
        const auto look = material({0.9f, 0.7f, 0.5f, 1}, ReflectionModel::MetallicRoughness);
        scene->edit(look).set<&Material::metallic>(float(i % 2)).set<&Material::roughness>(0.3f * float(i));
        node(placed(lit, {-1.8 + 1.2 * i, 0.2 * i, -0.3 * i},
                    glm::mat3(glm::rotate(glm::mat4(1), 0.7f * float(i), glm::vec3(0.3f, 1, 0)))),
             geometry(boxMesh({0.5f, 0.5f, 0.5f}), look));
    }
    const View view = lookAt({0.4, 0.8, 4.5}, {0, 0.2, 0}, 0.9, {201, 151});
    const WallImage whole = drawColour(wallViews(view));
    EXPECT_EQ(differingPixels(whole, drawColour(wallViews(view), 5, 3)), 0u);
    EXPECT_EQ(differingPixels(whole, drawColour(wallViews(view), 2, 2)), 0u);
}

// Per vertex, as per pixel: on a square, where both are the same.
TEST_F(EnvironmentTest, GouraudLooksUpAtTheVertices) {
    lit = addLight(root, panoramaOf(8, [](const glm::dvec3&) { return glm::dvec3(3.0); }));
    const auto look = material({0.5f, 0.5f, 0.5f, 1}, ReflectionModel::Lambert);
    const auto square = geometry(gridMesh(4.0f, 4), look);
    scene->edit(square).set<&Geometry::shading>(ShadingFrequency::Gouraud);
    node(lit, square);
    const WallImage image = drawColour(wallViews(flatView(2.0, kWall)));
    EXPECT_NEAR(image.at(20, 20)[0], 1.5f, 1e-5f);
}

TEST_F(EnvironmentTest, MapsThatDoNotFitCountAsAbsentAndBadTexelsAsBlack) {
    lit = addLight(root, panoramaOf(8, [](const glm::dvec3&) { return glm::dvec3(1.0); }));
    const auto look = material({0.5f, 0.5f, 0.5f, 1}, ReflectionModel::Lambert);
    const Ref<EnvironmentMap> map = scene->get(light).map;
    const std::vector<glm::vec3> good = scene->get(map).convolved.toVector();
    scene->edit(map).assign<&EnvironmentMap::convolved>(std::vector<glm::vec3>(7));
    expectNear(middleOfSquare(look), glm::dvec3(0.0), 0.0, "too short");
    scene->edit(map).assign<&EnvironmentMap::convolved>(good).set<&EnvironmentMap::levels>(0xffffffffu);
    expectNear(middleOfSquare(look), glm::dvec3(0.0), 0.0, "absurd levels");
    scene->edit(map).set<&EnvironmentMap::levels>(6u).assign<&EnvironmentMap::convolved>(
        std::vector<glm::vec3>(good.size(), glm::vec3(std::numeric_limits<float>::quiet_NaN())));
    expectNear(middleOfSquare(look), glm::dvec3(0.0), 0.0, "not numbers");
    scene->edit(map).assign<&EnvironmentMap::convolved>(good);
    expectNear(middleOfSquare(look), glm::dvec3(0.5), 1e-5, "whole again");
}

}  // namespace
}  // namespace umbriel
