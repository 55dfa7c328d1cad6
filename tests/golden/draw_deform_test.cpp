#include <algorithm>
#include <cmath>

#include "common/scene/deformation.h"
#include "shaders/formula_cpp.h"
#include "tests/golden/draw_fixture.h"

namespace umbriel {
namespace {

constexpr PixelSize kWall{161, 121};

// A sheet whose upper half hangs on a second joint, lit by a light with a shadow, above a floor.
class DeformTest : public DrawTest {
 protected:
    void build(bool vertexNormals = true, const glm::dvec3& origin = glm::dvec3(0.0)) {
        const auto sun = scene->create<DirectionalLight>("sun");
        all = lit(root, sun, {-0.4f, -1.0f, -0.5f}, glm::vec3(3.0f));
        floorNode(origin);
        mesh = gridMesh(1.0f, 8);
        if (!vertexNormals) mesh.normals.clear();
        look = material({0.9f, 0.6f, 0.3f, 1});
        // It glows, as its upper half turns away from the sun: black on black, a third of its pixels would be compared with
        // nothing.
        scene->edit(look).set<&Material::doubleSided>(true).set<&Material::emission>(glm::vec3(0.1f));
        hip = scene->create<Transform>();
        knee = scene->create<Transform>();
        scene->edit(hip).set<&Transform::translation>(origin);
        const Ref<Node> hipNode = node(all, hip);
        const Ref<Node> kneeNode = node(hipNode, knee);
        skin = scene->create<Skin>();
        scene->edit(skin)
            .assign<&Skin::joints>({hipNode, kneeNode})
            .assign<&Skin::inverseBinds>(std::vector<glm::mat4>(2, glm::mat4(1.0f)));
        view = lookAt(origin + glm::dvec3(2, 2.5, 5), origin + glm::dvec3(0, 0, 0), 0.9, kWall);
        sunFit = fitSphere(sun.id, {-0.4, -1, -0.5}, origin, 4.0, 128);
    }
    void floorNode(const glm::dvec3& origin) {
        const glm::mat3 flat(glm::rotate(glm::mat4(1), -1.5707963f, glm::vec3(1, 0, 0)));
        node(placed(all, origin + glm::dvec3(0, -1.2, 0), flat), geometry(gridMesh(3.0f, 4), material({1, 1, 1, 1})));
    }
    Ref<DeformedGeometry> addSkinned() {
        const auto rest = geometry(mesh, look);
        std::vector<std::uint16_t> joints;
        std::vector<glm::vec4> weights;
        for (const glm::vec3& p : mesh.positions) {
            const float upper = std::clamp(p.y + 0.5f, 0.0f, 1.0f);
            joints.insert(joints.end(), {0, 1, 0, 0});
            weights.push_back({1.0f - upper, upper, 0, 0});
        }
        scene->edit(rest).assign<&Geometry::joints>(joints).assign<&Geometry::jointWeights>(weights);
        const auto core = scene->create<DeformedGeometry>();
        scene->edit(core).set<&DeformedGeometry::geometry>(rest).set<&DeformedGeometry::skin>(skin);
        skinnedNode = node(placed(all, {77, 88, 99}), core);  // where a skinned geometry's own node stands is nothing
        return core;
    }
    // The same sheet, bent here, in double.
    Mesh bent(const glm::dmat3& turn, const glm::dvec3& shift) const {
        namespace f = formula_f64;
        Mesh result = mesh;
        for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
            const double upper = std::clamp(mesh.positions[i].y + 0.5f, 0.0f, 1.0f);
            const f::AffineMap unmoved{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};
            const f::AffineMap map = f::sumOfMaps(f::weightedMap(unmoved, 1.0 - upper),
                                                  f::weightedMap({turn[0], turn[1], turn[2], shift}, upper));
            result.positions[i] = glm::vec3(f::mappedPoint(map, glm::dvec3(mesh.positions[i])));
            if (!mesh.normals.empty())
                result.normals[i] = glm::vec3(f::mappedSurfaceNormal(map, glm::dvec3(mesh.normals[i])));
        }
        return result;
    }
    WallViews shadowed(std::uint32_t layers = static_cast<std::uint32_t>(Layer::Colour),
                       TileMode mode = TileMode::Exact) const {
        WallViews views = wallViews(view, mode, 1, layers);
        views.views[0].fits = {sunFit};
        return views;
    }
    // Pixels that differ by more than 2/255: edges may fall on either side of a pixel's centre.
    static std::size_t visiblyDiffering(const WallImage& a, const WallImage& b) {
        std::size_t count = 0;
        for (int y = 0; y < a.size.height; ++y)
            for (int x = 0; x < a.size.width; ++x) {
                int largest = 0;
                for (int c = 0; c < 3; ++c)
                    largest = std::max(largest, std::abs(encoded(a.at(x, y)[c]) - encoded(b.at(x, y)[c])));
                count += largest > 2;
            }
        return count;
    }

    Mesh mesh;
    Ref<Material> look;
    Ref<Node> all, skinnedNode;
    Ref<Transform> hip, knee;
    Ref<Skin> skin;
    View view;
    ShadowFit sunFit;
    const glm::dmat3 turn{glm::rotate(glm::dmat4(1.0), 0.9, glm::dvec3(1.0, 0.2, 0.0))};
    const glm::dvec3 shift{0.1, 0.2, -0.3};
};

// Surfaces, their shadow on the floor and on themselves, with vertex normals and with face normals: as the same
// geometry bent on the CPU. Not to the bit: float rounds the skinned vertices otherwise than double.
TEST_F(DeformTest, ASkinnedSheetLooksLikeOneBentByHand) {
    for (const bool vertexNormals : {true, false})
        for (const double far : {0.0, 1e6}) {
            SetUp();
            build(vertexNormals, {far, 0, -far});
            const Ref<DeformedGeometry> core = addSkinned();
            scene->edit(knee).set<&Transform::linear>(glm::mat3(turn)).set<&Transform::translation>(shift);
            const WallImage skinned = drawColour(shadowed());
            scene->edit(skinnedNode).set<&Node::visible>(false);
            const WallImage without = drawColour(shadowed());
            node(placed(all, {far, 0, -far}), geometry(bent(glm::dmat3(glm::mat3(turn)), shift), look));
            const WallImage byHand = drawColour(shadowed());
            EXPECT_LE(visiblyDiffering(skinned, byHand), 6u) << vertexNormals << " " << far;
            EXPECT_GT(visiblyDiffering(skinned, without), 1000u) << "the sheet is to be seen";
            static_cast<void>(core);
        }
}

// One colour a triangle, of the mean normal it has now.
TEST_F(DeformTest, FlatMeanShadingFollowsThePose) {
    build();
    addSkinned();
    scene->edit(knee).set<&Transform::linear>(glm::mat3(turn)).set<&Transform::translation>(shift);
    const auto shadeFlat = [&](ShadingFrequency shading) {
        for (const ContainerId id : scene->ids())
            if (scene->findAs<Geometry>(id)) scene->edit(Ref<Geometry>(id)).set<&Geometry::shading>(shading);
    };
    shadeFlat(ShadingFrequency::Flat);
    const WallImage firstVertex = drawColour(shadowed());
    shadeFlat(ShadingFrequency::FlatMean);
    const WallImage skinned = drawColour(shadowed());
    EXPECT_GT(visiblyDiffering(skinned, firstVertex), 100u);
    scene->edit(skinnedNode).set<&Node::visible>(false);
    node(placed(all, {0, 0, 0}), geometry(bent(glm::dmat3(glm::mat3(turn)), shift), look));
    shadeFlat(ShadingFrequency::FlatMean);
    EXPECT_LE(visiblyDiffering(skinned, drawColour(shadowed())), 6u);
}

TEST_F(DeformTest, AtRestItIsTheGeometryItself) {
    build();
    addSkinned();
    const WallImage skinned = drawColour(shadowed());
    scene->edit(skinnedNode).set<&Node::visible>(false);
    node(placed(all, {0, 0, 0}), geometry(mesh, look));
    // The light's cosine comes another way where vertices stay (shaders/snippet/passed_constants.glsl).
    EXPECT_EQ(pixelsBeyondRounding(skinned, drawColour(shadowed())), 0u);
}

// Every tile, every layer and the shadow map see the same vertices.
TEST_F(DeformTest, TilesAgreeToTheBit) {
    build(false);
    addSkinned();
    scene->edit(knee).set<&Transform::linear>(glm::mat3(turn)).set<&Transform::translation>(shift);
    const WallViews views = shadowed(0x3f, TileMode::Exact);
    const std::vector<WallImage> whole = drawWall(views);
    ASSERT_GE(whole.size(), 5u);
    expectEqualTiles(views, whole, {{5, 3}});
}

// Culling by the bounds of the pose: nothing of what is seen is missing, and a figure behind the eye is not drawn.
TEST_F(DeformTest, WhatLeavesTheViewIsNotDrawn) {
    build();
    addSkinned();
    drawColour(wallViews(view));
    const std::uint64_t seen = statistics.triangles;
    scene->edit(hip).set<&Transform::translation>(glm::dvec3(0, 0, 50));
    drawColour(wallViews(view));
    EXPECT_EQ(seen - statistics.triangles, mesh.indices.size() / 3);
}

// Along z by its second target, with the normals of a cylinder's slope; as the same geometry made so.
TEST_F(DeformTest, MorphTargetsAddUp) {
    build();
    const auto rest = geometry(mesh, look);
    const std::size_t count = mesh.positions.size();
    std::vector<glm::vec3> positions(2 * count), normals(2 * count);
    Mesh moved = mesh;
    for (std::size_t i = 0; i < count; ++i) {
        const float x = mesh.positions[i].x;
        positions[i] = {0, 1, 0};
        positions[count + i] = {0, 0, x * x};
        normals[count + i] = {-2 * x, 0, 0};
        moved.positions[i] += glm::vec3(0, 0.5f, 0.25f * x * x);
        moved.normals[i] = glm::normalize(glm::vec3(-0.5f * x, 0, 1));
    }
    scene->edit(rest).assign<&Geometry::morphPositions>(positions).assign<&Geometry::morphNormals>(normals);
    const auto morph = scene->create<MorphWeights>();
    scene->edit(morph).assign<&MorphWeights::weights>({0.5f, 0.25f});
    const auto core = scene->create<DeformedGeometry>();
    scene->edit(core).set<&DeformedGeometry::geometry>(rest).set<&DeformedGeometry::morph>(morph);
    const Ref<Node> leaf = node(placed(all, {0.25, 0, 0}), core);
    const WallImage morphed = drawColour(shadowed());
    scene->edit(morph).assign<&MorphWeights::weights>({0.5f, 0.0f});
    EXPECT_GT(visiblyDiffering(morphed, drawColour(shadowed())), 100u) << "weights that change are seen";
    scene->edit(leaf).set<&Node::visible>(false);
    node(placed(all, {0.25, 0, 0}), geometry(moved, look));
    EXPECT_LE(visiblyDiffering(morphed, drawColour(shadowed())), 6u);
}

// A mirrored figure shows its outside, lit from outside.
TEST_F(DeformTest, AMirroredFigureIsNotInsideOut) {
    build();
    mesh = boxMesh({0.5f, 0.5f, 0.5f});
    scene->edit(look).set<&Material::doubleSided>(false);
    addSkinned();
    const WallImage plain = drawColour(shadowed());
    const glm::mat3 mirror(-1, 0, 0, 0, 1, 0, 0, 0, 1);
    scene->edit(hip).set<&Transform::linear>(mirror);
    EXPECT_LE(visiblyDiffering(plain, drawColour(shadowed())), 6u) << "a cube is its own mirror image";
}

// What no GPU should see: joints without place, weights of nothing, numbers that are not; the picture stays finite.
TEST_F(DeformTest, HostileSkinsDrawFinitePictures) {
    build();
    const Ref<DeformedGeometry> core = addSkinned();
    const Ref<Geometry> rest = scene->get(core).geometry.get();
    const float nan = std::nanf("");
    std::vector<std::uint16_t> joints(mesh.positions.size() * 4, 65535);
    scene->edit(rest)
        .assign<&Geometry::joints>(joints)
        .assign<&Geometry::jointWeights>(std::vector<glm::vec4>(mesh.positions.size(), {nan, -1, 1e30f, 2}))
        .assign<&Geometry::morphPositions>(std::vector<glm::vec3>(mesh.positions.size(), glm::vec3(nan)));
    scene->edit(knee).set<&Transform::linear>(glm::mat3(nan));
    scene->edit(skin).assign<&Skin::inverseBinds>(std::vector<glm::mat4>(1, glm::mat4(0.0f)));
    WallImage image = drawColour(shadowed());
    EXPECT_TRUE(std::all_of(image.values.begin(), image.values.end(), [](float v) { return std::isfinite(v); }));
    // More joints than nodes, then a skin that is gone.
    scene->edit(skin).append<&Skin::joints>(Ref<Node>(ContainerId{123456}));
    image = drawColour(shadowed());
    scene->destroy(skin.id);
    image = drawColour(shadowed());
    EXPECT_TRUE(std::all_of(image.values.begin(), image.values.end(), [](float v) { return std::isfinite(v); }));
}

}  // namespace
}  // namespace umbriel
