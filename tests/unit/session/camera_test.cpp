#include "client/session/camera.h"

#include <cmath>
#include <numbers>

#include "common/math/projection.h"
#include "tests/unit/session/scene_fixture.h"

namespace umbriel {
namespace {

class Camera : public SceneFixture {};

void expectNear(const glm::dmat4& a, const glm::dmat4& b, double tolerance) {
    for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) EXPECT_NEAR(a[c][r], b[c][r], tolerance) << c << "," << r;
}

TEST_F(Camera, PerspectiveStandsAtItsBeaconAndTakesTheRegionsAspect) {
    const auto camera = aspect.create<PerspectiveCamera>();
    // A quarter turn about y and a scale, which does not count.
    const Ref<Node> beacon = placed(root, {1e6, 2, 3}, glm::mat3(0, 0, -5, 0, 5, 0, 5, 0, 0));
    aspect.edit(camera)
        .set<&PerspectiveCamera::beacon>(beacon)
        .set<&PerspectiveCamera::fovY>(1.0)
        .set<&PerspectiveCamera::nearDistance>(0.5);
    const auto view = resolve(any(camera));
    ASSERT_TRUE(view);
    EXPECT_EQ(view->eyeWorld, glm::dvec3(1e6, 2, 3));
    EXPECT_EQ(view->viewFromWorld, glm::transpose(glm::dmat3(0, 0, -1, 0, 1, 0, 1, 0, 0)));
    expectNear(view->clipFromView, reversedPerspective(1.0, 16.0 / 9.0, 0.5), 1e-15);
    EXPECT_EQ(view->nearDistance, 0.5);
    EXPECT_EQ(view->region, (PixelRect{0, 0, 1600, 900}));
    const glm::dvec3 ahead = project(*view, {1e6 - 10, 2, 3});
    EXPECT_NEAR(ahead.x, 0.0, 1e-9);
    EXPECT_NEAR(ahead.z, 0.05, 1e-9);
}

TEST_F(Camera, OrthographicShowsItsExtents) {
    const auto camera = aspect.create<OrthographicCamera>();
    aspect.edit(camera)
        .set<&OrthographicCamera::beacon>(placed(root, {0, 0, 5}))
        .set<&OrthographicCamera::halfWidth>(4.0)
        .set<&OrthographicCamera::halfHeight>(2.0)
        .set<&OrthographicCamera::farDistance>(10.0);
    const auto view = resolve(any(camera));
    ASSERT_TRUE(view);
    EXPECT_TRUE(view->orthographic);
    EXPECT_EQ(project(*view, {4, -2, 5}), glm::dvec3(1, -1, 1));
    EXPECT_EQ(project(*view, {0, 0, -5}), glm::dvec3(0, 0, 0));
}

TEST_F(Camera, MatrixCameraDrawsWhatItsMatricesSay) {
    const auto camera = aspect.create<MatrixCamera>();
    const Ref<Node> beacon = placed(root, {7, 0, 0});
    // A view matrix that mirrors and scales as well, and an off-axis projection.
    const glm::dmat4 viewFromBeacon = glm::scale(glm::dmat4(1.0), {-2, 3, 1.5}) *
                                      glm::lookAt(glm::dvec3(1, 2, 8), glm::dvec3(0), glm::dvec3(0, 1, 0));
    const glm::dmat4 openGl = glm::frustum(-0.2, 0.1, -0.05, 0.15, 0.25, 60.0);
    aspect.edit(camera)
        .set<&MatrixCamera::beacon>(beacon)
        .set<&MatrixCamera::viewFromBeacon>(viewFromBeacon)
        .set<&MatrixCamera::clipFromView>(openGl);
    const auto view = resolve(any(camera));
    ASSERT_TRUE(view);
    const glm::dmat3 identity = view->viewFromWorld * glm::transpose(view->viewFromWorld);
    for (int c = 0; c < 3; ++c) EXPECT_LT(glm::distance(identity[c], glm::dmat3(1.0)[c]), 1e-14);
    EXPECT_NEAR(glm::determinant(view->viewFromWorld), 1.0, 1e-14);
    EXPECT_LT(glm::distance(view->eyeWorld, glm::dvec3(8, 2, 8)), 1e-12);
    for (const glm::dvec3& world : {glm::dvec3(7, 0, 0), glm::dvec3(6, 1, -3), glm::dvec3(7.5, 0.4, 2)}) {
        const glm::dvec4 clip = openGl * viewFromBeacon * glm::dvec4(world - glm::dvec3(7, 0, 0), 1.0);
        const glm::dvec3 seen = project(*view, world);
        EXPECT_NEAR(seen.x, clip.x / clip.w, 1e-10);
        EXPECT_NEAR(seen.y, clip.y / clip.w, 1e-10);
        EXPECT_NEAR(seen.z, 0.5 - 0.5 * clip.z / clip.w, 1e-10);
    }
}

TEST_F(Camera, StereoEyesAgreeInThePlaneOfZeroParallax) {
    const auto camera = aspect.create<PerspectiveCamera>();
    aspect.edit(camera).set<&PerspectiveCamera::nearDistance>(0.1);
    const auto eyeView = [&](Eye eye) {
        const auto stereo = aspect.create<StereoCameraDecorator>();
        aspect.edit(stereo)
            .set<&StereoCameraDecorator::camera>(any(camera))
            .set<&StereoCameraDecorator::eye>(eye)
            .set<&StereoCameraDecorator::separation>(0.07)
            .set<&StereoCameraDecorator::zeroParallax>(2.0);
        return *resolve(any(stereo));
    };
    const View left = eyeView(Eye::Left), right = eyeView(Eye::Right), middle = *resolve(any(camera));
    EXPECT_EQ(left.eye, Eye::Left);
    EXPECT_NEAR(right.eyeWorld.x - left.eyeWorld.x, 0.07, 1e-15);
    for (const glm::dvec3& onScreen : {glm::dvec3(0.4, -0.2, -2), glm::dvec3(-1, 0.6, -2)})
        for (const View& view : {left, right})
            EXPECT_LT(glm::distance(project(view, onScreen), project(middle, onScreen)), 1e-12);
    // Nearer things are further right for the left eye; at infinity the eyes differ by their separation on the screen.
    EXPECT_GT(project(left, {0, 0, -1}).x, project(right, {0, 0, -1}).x);
    const double screenWidth = 2.0 * 2.0 * std::tan(0.5 * 0.785398163397448) * 16.0 / 9.0;
    EXPECT_NEAR(project(right, {0, 0, -1e9}).x - project(left, {0, 0, -1e9}).x, 2.0 * 0.07 / screenWidth, 1e-8);
}

TEST_F(Camera, TileDecoratorsCropAndNestWithStereoInAnyOrder) {
    const auto camera = aspect.create<PerspectiveCamera>();
    aspect.edit(camera).set<&PerspectiveCamera::nearDistance>(0.1).set<&PerspectiveCamera::aspect>(2.0);
    const auto tile = [&](Ref<Container> inner) {
        const auto made = aspect.create<TileCameraDecorator>();
        aspect.edit(made)
            .set<&TileCameraDecorator::camera>(inner)
            .set<&TileCameraDecorator::left>(0.5)
            .set<&TileCameraDecorator::bottom>(0.25);
        return any(made);
    };
    const auto stereo = [&](Ref<Container> inner) {
        const auto made = aspect.create<StereoCameraDecorator>();
        aspect.edit(made).set<&StereoCameraDecorator::camera>(inner).set<&StereoCameraDecorator::eye>(Eye::Right);
        return any(made);
    };
    expectNear(resolve(tile(any(camera)))->clipFromView,
               cropped(reversedPerspective(0.785398163397448, 2.0, 0.1), 0.5, 0.25, 1.0, 1.0), 1e-14);
    const View a = *resolve(tile(stereo(any(camera)))), b = *resolve(stereo(tile(any(camera))));
    expectNear(a.clipFromView, b.clipFromView, 1e-14);
    EXPECT_EQ(a.eyeWorld, b.eyeWorld);
}

TEST_F(Camera, ImpossibleCamerasAreRefusedByName) {
    const auto camera = aspect.create<PerspectiveCamera>("front");
    const auto message = [&](Ref<Container> ref) {
        const auto view = resolve(ref);
        return view ? std::string() : view.error().message;
    };
    for (const double fov : {0.0, -1.0, std::numbers::pi, 4.0, double(NAN)}) {
        aspect.edit(camera).set<&PerspectiveCamera::fovY>(fov);
        EXPECT_NE(message(any(camera)).find("\"front\""), std::string::npos) << fov;
    }
    aspect.edit(camera).set<&PerspectiveCamera::fovY>(1.0).set<&PerspectiveCamera::nearDistance>(-1.0);
    EXPECT_NE(message(any(camera)), "");
    aspect.edit(camera).set<&PerspectiveCamera::nearDistance>(5.0).set<&PerspectiveCamera::farDistance>(5.0);
    EXPECT_NE(message(any(camera)), "");
    EXPECT_NE(message(any(root)), "");
    EXPECT_NE(message(Ref<Container>()), "");
    const auto circle = aspect.create<TileCameraDecorator>("circle");
    aspect.edit(circle).set<&TileCameraDecorator::camera>(any(circle));
    EXPECT_NE(message(any(circle)).find("circle"), std::string::npos);
    const auto ortho = aspect.create<OrthographicCamera>();
    aspect.edit(ortho).set<&OrthographicCamera::halfWidth>(0.0);
    EXPECT_NE(message(any(ortho)), "");
    const auto matrix = aspect.create<MatrixCamera>();
    aspect.edit(matrix).set<&MatrixCamera::clipFromView>(glm::dmat4(0.0));
    EXPECT_NE(message(any(matrix)), "");
}

TEST_F(Camera, FieldsOfViewFromThousandthsToNearly180Degrees) {
    addBox({-1, -1, -1}, {1, 1, 1});
    const auto camera = aspect.create<PerspectiveCamera>();
    aspect.edit(camera).set<&PerspectiveCamera::beacon>(placed(root, {0, 0, 1e3}));
    for (const double degrees : {1e-3, 1.0, 90.0, 179.0}) {
        aspect.edit(camera).set<&PerspectiveCamera::fovY>(glm::radians(degrees));
        const auto view = resolve(any(camera));
        ASSERT_TRUE(view) << degrees;
        const double top = std::tan(0.5 * glm::radians(degrees)) * 1e3;
        EXPECT_NEAR(project(*view, {0, top, 0}).y, 1.0, 1e-9);
    }
}

TEST(AutomaticNear, LiesBeforeTheSceneAndIsAPowerOfTwo) {
    const Box3d box{{-1, -1, -1}, {1, 1, 1}};
    for (const double scale : {1e-6, 1.0, 1e6})
        for (const double distance : {0.0, 0.5, 2.0, 100.0, 1e5}) {
            const Box3d scaled{scale * box.lower, scale * box.upper};
            const double nearDistance = automaticNear(scaled, {0, 0, scale * distance}, {0, 0, -1});
            EXPECT_GT(nearDistance, 0.0);
            EXPECT_EQ(std::exp2(std::round(std::log2(nearDistance))), nearDistance);
            if (distance > 1.0) {
                EXPECT_LE(nearDistance, std::max(0.9 * scale * (distance - 1.0), scaled.diagonal() / 8192.0));
            }
            EXPECT_LE(nearDistance, std::max(scale * distance, scaled.diagonal() / 8192.0));
        }
    EXPECT_EQ(automaticNear(Box3d{}, {0, 0, 0}, {0, 0, -1}), 0.125);
    EXPECT_GT(automaticNear({glm::dvec3(0), glm::dvec3(0)}, {0, 0, 0}, {0, 0, -1}), 0.0);
}

TEST_F(Camera, FrameAllShowsTheWholeSceneAndFillsThePicture) {
    for (const double scale : {1e-3, 1.0, 1e4})
        for (const double aspectRatio : {0.3, 1.0, 3.0})
            for (const glm::dvec3& size :
                 {glm::dvec3(1, 1, 1), glm::dvec3(10, 0.1, 1), glm::dvec3(0, 5, 0), glm::dvec3(1, 0, 1)}) {
                const glm::dvec3 centre = scale * glm::dvec3(100, 5, -7);
                const Box3d box{centre - 0.5 * scale * size, centre + 0.5 * scale * size};
                const auto camera = addCamera(aspect, "all", frameAll(box, 0.8, aspectRatio));
                ASSERT_TRUE(camera);
                const auto view = resolveCamera(aspect, any(*camera), Hierarchy(aspect, root),
                                                {0, 0, static_cast<int>(1000 * aspectRatio), 1000}, box);
                ASSERT_TRUE(view);
                double largest = 0.0;
                for (int i = 0; i < 8; ++i) {
                    const glm::dvec3 seen = project(*view, box.corner(i));
                    largest = std::max({largest, std::abs(seen.x), std::abs(seen.y)});
                    EXPECT_GT(seen.z, 0.0);
                    EXPECT_LE(seen.z, 1.0);
                }
                EXPECT_LT(largest, 0.99);
                EXPECT_GT(largest, 0.7);
            }
}

TEST_F(Camera, CommandLineCamerasRefuseWhatCannotBe) {
    EXPECT_FALSE(addCamera(aspect, "x", {{1, 2, 3}, {1, 2, 3}, {0, 1, 0}, 1.0}));
    EXPECT_FALSE(addCamera(aspect, "x", {{1, 2, 3}, {0, 0, 0}, {0, 1, 0}, 0.0}));
    EXPECT_FALSE(addCamera(aspect, "x", {{1, 2, 3}, {0, 0, 0}, {0, 1, 0}, 3.2}));
    EXPECT_FALSE(addCamera(aspect, "x", {{1, INFINITY, 3}, {0, 0, 0}, {0, 1, 0}, 1.0}));
    const auto down = addCamera(aspect, "x", {{0, 9, 0}, {0, 0, 0}, {0, 1, 0}, 1.0});
    ASSERT_TRUE(down);
    const auto view = resolve(any(*down));
    ASSERT_TRUE(view);
    EXPECT_LT(glm::distance(glm::dvec2(project(*view, {0, -3, 0})), glm::dvec2(0.0)), 1e-6);
}

}  // namespace
}  // namespace umbriel
