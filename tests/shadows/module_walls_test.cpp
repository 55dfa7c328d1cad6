#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

class Walls : public ModuleTest {};

// A sun, a spot and a lamp among the houses, for every module.
TEST_F(Walls, TilesAreBitEqualToOneServerForEveryModule) {
    buildTown(30.0, 60);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3}, 0.0f, 0.02f);
    const auto lamp = scene->create<PointLight>("lamp");
    scene->edit(lamp)
        .set<&PointLight::beacon>(placed(root, toWorld({2, 6, 8})))
        .set<&PointLight::intensity>(glm::vec3(30.0f))
        .set<&PointLight::radius>(0.2f);
    const auto spot = scene->create<SpotLight>("spot");
    scene->edit(spot)
        .set<&SpotLight::beacon>(placed(root, toWorld({-12, 14, 12}), lookingAlong({0.7f, -0.7f, -0.5f})))
        .set<&SpotLight::intensity>(glm::vec3(200.0f))
        .set<&SpotLight::radius>(0.3f);
    // Both light what the sun lights: a chain of groups.
    const auto children = scene->find(root)->children.toVector();
    const Ref<Node> lampNode = scene->create<Node>(), spotNode = scene->create<Node>();
    scene->edit(lampNode).set<&Node::core>(Ref<Container>(lamp.id)).assign<&Node::children>(children);
    scene->edit(spotNode).set<&Node::core>(Ref<Container>(spot.id)).assign<&Node::children>(std::vector{lampNode});
    scene->edit(root).assign<&Node::children>(std::vector{spotNode});
    look({0, 4, 28}, {0, 1, 0});
    scene->edit(viewport).set<&Viewport::mapSize>(512u);
    const PixelSize wall{341, 227};
    for (const ShadowMode mode : kMapModes) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode);
        for (const TileMode tiles : {TileMode::Exact, TileMode::Offset}) {
            const WallViews views = resolved(wall, tiles);
            EXPECT_EQ(views.views[0].fits.size(), mode == ShadowMode::DualParaboloid ? 4u : 8u);
            const auto whole = drawWall(views);
            ASSERT_EQ(whole.size(), 6u);
            std::size_t dark = 0, lit = 0;
            for (std::size_t light = 3; light < 6; ++light)
                for (const float factor : whole[light].values) {
                    dark += factor < 0.5f;
                    lit += factor > 0.5f;
                }
            EXPECT_GT(dark, 3000u) << static_cast<int>(mode);
            EXPECT_GT(lit, 3000u) << static_cast<int>(mode);
            SCOPED_TRACE(static_cast<int>(mode));
            expectEqualTiles(views, whole, {{2, 2}, {4, 4}});
        }
    }
}

// Fits to what is really seen: computed once, by the client, from the frame's own scene, so tiles agree to the bit and
// a single frame is as good as the hundredth; and with less error than fits to the scene's box.
TEST_F(Walls, QualityModeFitsWarpsToWhatIsSeen) {
    block({-120, -1, -120}, {120, 0, 120});
    block({-2, 40, -110}, {2, 42, -108});  // makes the scene's box high and long
    for (int i = 0; i < 24; ++i)
        block({-6.0 + i % 8, 0, 2.0 * (i / 8)}, {-5.6 + i % 8, 0.6 + 0.1 * (i % 5), 2.0 * (i / 8) + 0.5});
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 7, 12}, {0, 0, 2}, 0.6);
    const PixelSize wall{300, 200};
    for (const ShadowMode mode : {ShadowMode::Trapezoid, ShadowMode::LightSpacePerspective, ShadowMode::Perspective}) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::mapSize>(256u);
        scene->edit(viewport).set<&Viewport::qualityMode>(false);
        const Errors plain = measure(wall);
        scene->edit(viewport).set<&Viewport::qualityMode>(true);
        const Errors tight = measure(wall);
        std::printf("module %d: %.3f %%, to what is seen %.3f %%\n", int(mode), 100 * plain.error, 100 * tight.error);
        EXPECT_LT(tight.error, 0.9 * plain.error) << int(mode);
        const WallViews views = resolved(wall, TileMode::Exact);
        const auto whole = drawWall(views);
        const auto tiled = drawWall(views, 2, 2);
        ASSERT_EQ(whole.size(), tiled.size());
        for (std::size_t i = 0; i < whole.size(); ++i) EXPECT_EQ(differingPixels(whole[i], tiled[i]), 0u) << names[i];
    }
}

// The scene's fit does not know the camera.
TEST_F(Walls, TheScenesFitIsTheSameForEveryCamera) {
    buildTown(30.0, 10);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    for (const ShadowMode mode :
         {ShadowMode::Standard, ShadowMode::LightSpacePerspective, ShadowMode::Trapezoid, ShadowMode::Perspective}) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::shadowFit>(ShadowFitMode::Scene);
        look({0, 4, 28}, {0, 1, 0});
        const auto first = resolved({320, 200}).views[0].fits;
        look({-10, 14, 8}, {3, 1, 0}, 1.4);
        const auto second = resolved({320, 200}).views[0].fits;
        ASSERT_EQ(first.size(), 1u);
        EXPECT_EQ(first[0].clipFromWorld, second[0].clipFromWorld);
    }
}

// Seams of a cube: around a lamp, on surfaces that cross the faces' borders, no line of wrong pixels.
TEST_F(Walls, FacesOfACubeMeetWithoutASeam) {
    block({-6, -4, -6}, {6, -3, 6});  // floor
    block({-6, 3, -6}, {6, 4, 6});    // ceiling
    block({-6, -4, -7}, {6, 4, -6});  // walls
    block({-7, -4, -6}, {-6, 4, 6});
    block({6, -4, -6}, {7, 4, 6});
    for (int i = 0; i < 6; ++i) block({-3.0 + i, -3, -3.5}, {-2.7 + i, 2.5, -3.2});
    for (const ShadowMode mode : {ShadowMode::Standard, ShadowMode::PercentageCloser}) {
        if (mode != ShadowMode::Standard) {
            const auto kept = blocks;
            SetUp();
            blocks = kept;
        }
        // Axes of the cube are the world's: walls and floor cross the borders.
        finishScene(LightPlace::Point, {0, 0, 0}, {0, -1, 0});
        look({0.5, 0.3, 5.5}, {0, 0, -6}, 1.3);
        scene->edit(viewport)
            .set<&Viewport::shadowMode>(mode)
            .set<&Viewport::mapSize>(1024u)
            .set<&Viewport::filterWidth>(6.0f);
        const PixelSize wall{400, 300};
        const auto images = drawWall(resolved(wall));
        const Errors errors = errorsOf(images, wall);
        std::printf("cube, module %d: error %.3f %%, leak %.3f, acne %.3f of %zu, %zu dark\n", int(mode),
                    100 * errors.error, 100 * errors.leak, 100 * errors.acne, errors.judged, errors.dark);
        EXPECT_LT(errors.error, 0.004);
        EXPECT_GT(errors.dark, 2000u);
        // Within a texel of where two components of the direction are equal.
        const glm::dvec3 eye = resolved(wall).views[0].eyeWorld;
        std::size_t seam = 0, wrong = 0;
        for (int y = 0; y < wall.height; ++y)
            for (int x = 0; x < wall.width; ++x) {
                const float* p = images[1].at(x, y);
                const glm::dvec3 d = eye + glm::dvec3(p[0], p[1], p[2]) - lightPosition;
                glm::dvec3 a = glm::abs(d);
                std::sort(&a.x, &a.x + 3);
                if (a.z - a.y > 0.01 * a.z) continue;
                const float* n = images[2].at(x, y);
                const glm::dvec3 normal(n[0], n[1], n[2]);
                const glm::dvec3 toLight = -glm::normalize(d);
                if (glm::dot(normal, toLight) < 0.1) continue;
                ++seam;
                const bool dark = isDark(eye + glm::dvec3(p[0], p[1], p[2]) + normal * 1e-5, toLight, glm::length(d));
                wrong += dark != (images[3].at(x, y)[0] < 0.5f);
            }
        EXPECT_GT(seam, 300u);
        EXPECT_LE(wrong, seam / 100);
    }
}

}  // namespace
}  // namespace umbriel
