#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

// Two eyes see one shadow: what one sees lit and the other one dark is no more than geometry itself shows so.
class Stereo : public ModuleTest {
 protected:
    static constexpr PixelSize kWall{640, 400};
    struct EyePicture {
        View view;
        WallImage position, normal, factor;
        std::vector<std::uint8_t> isDarkInTruth;
        std::vector<std::uint8_t> judgedAt;
    };

    void addOtherEye() {
        other = scene->create<Viewport>("other");
        scene->edit(other).set<&Viewport::root>(root).set<&Viewport::reuseMaps>(false);
        scene->edit(window).append<&Window::viewports>(other);
    }
    void lookWithBothEyes(const glm::dvec3& eye, const glm::dvec3& target) {
        const glm::dvec3 apart(0.065, 0, 0);
        look(eye, target);
        const auto left = scene->find(viewport)->camera.get();
        look(eye + apart, target + apart);
        scene->edit(other).set<&Viewport::camera>(scene->find(viewport)->camera.get());
        scene->edit(viewport).set<&Viewport::camera>(left);
    }
    void use(ShadowMode mode, ShadowFitMode fit, std::uint32_t mapSize) {
        for (const Ref<Viewport> each : {viewport, other})
            scene->edit(each).set<&Viewport::shadowMode>(mode).set<&Viewport::shadowFit>(fit).set<&Viewport::mapSize>(
                mapSize);
    }
    std::vector<EyePicture> bothEyes() {
        const WallViews both = resolved(kWall);
        std::vector<EyePicture> eyes;
        for (const View& view : both.views) {
            WallViews one = both;
            one.views = {view};
            auto images = drawWall(one);
            EXPECT_EQ(images.size(), 4u);
            if (images.size() != 4) return {};
            EyePicture eye;
            eye.view = view;
            eye.position = std::move(images[1]);
            eye.normal = std::move(images[2]);
            eye.factor = std::move(images[3]);
            const std::size_t pixels = std::size_t(kWall.width) * std::size_t(kWall.height);
            eye.isDarkInTruth.resize(pixels);
            eye.judgedAt.resize(pixels);
            for (std::size_t i = 0; i < pixels; ++i) {
                const float* n = &eye.normal.values[eye.normal.channels * i];
                const glm::dvec3 normal(n[0], n[1], n[2]);
                if (glm::dot(normal, normal) < 0.5) continue;
                const glm::dvec3 point = worldOf(eye, i);
                glm::dvec3 toLight = -lightDirection;
                double reach = 1e30;
                if (lightPlace != LightPlace::Directional) {
                    reach = glm::distance(lightPosition, point);
                    toLight = (lightPosition - point) / reach;
                }
                if (glm::dot(normal, toLight) < 0.1) continue;
                eye.judgedAt[i] = 1;
                eye.isDarkInTruth[i] = isDark(point + normal * 3e-5, toLight, reach);
            }
            eyes.push_back(std::move(eye));
        }
        return eyes;
    }
    static glm::dvec3 worldOf(const EyePicture& eye, std::size_t i) {
        const std::size_t channels = eye.position.channels;
        return eye.view.eyeWorld + glm::dvec3(eye.position.values[channels * i], eye.position.values[channels * i + 1],
                                              eye.position.values[channels * i + 2]);
    }
    // Shares of the points that one eye sees on another side than all four pixels around their place in the other.
    struct Rivalry {
        double result = 0.0, truth = 0.0;
        std::size_t points = 0;
    };
    static Rivalry rivalry(const std::vector<EyePicture>& eyes) {
        Rivalry rivalry;
        std::size_t results = 0, truths = 0;
        const EyePicture &from = eyes[0], &to = eyes[1];
        for (std::size_t i = 0; i < from.judgedAt.size(); ++i) {
            if (!from.judgedAt[i]) continue;
            const glm::dvec3 world = worldOf(from, i);
            const glm::dvec4 clip =
                to.view.clipFromView * glm::dvec4(to.view.viewFromWorld * (world - to.view.eyeWorld), 1.0);
            const double x = (clip.x / clip.w * 0.5 + 0.5) * kWall.width - 0.5,
                         y = (clip.y / clip.w * 0.5 + 0.5) * kWall.height - 0.5;
            const int left = int(std::floor(x)), bottom = int(std::floor(y));
            if (left < 0 || bottom < 0 || left + 1 >= kWall.width || bottom + 1 >= kWall.height) continue;
            bool same = true, resultAlone = true, truthAlone = true;
            for (int k = 0; k < 4 && same; ++k) {
                const std::size_t j =
                    std::size_t(bottom + k / 2) * std::size_t(kWall.width) + std::size_t(left + k % 2);
                const float* n = &to.normal.values[to.normal.channels * j];
                const glm::dvec3 normal(n[0], n[1], n[2]);
                // On one surface: a pixel is at most 0.3 m there.
                same = to.judgedAt[j] && std::abs(glm::dot(normal, worldOf(to, j) - world)) < 1e-3;
                if (!same) break;
                resultAlone = resultAlone && (from.factor.values[from.factor.channels * i] > 0.5f) !=
                                                 (to.factor.values[to.factor.channels * j] > 0.5f);
                truthAlone = truthAlone && from.isDarkInTruth[i] != to.isDarkInTruth[j];
            }
            if (!same) continue;
            ++rivalry.points;
            results += resultAlone;
            truths += truthAlone;
        }
        rivalry.result = double(results) / double(std::max<std::size_t>(rivalry.points, 1));
        rivalry.truth = double(truths) / double(std::max<std::size_t>(rivalry.points, 1));
        return rivalry;
    }
    Rivalry measured(const char* light, ShadowMode mode, ShadowFitMode fit, std::uint32_t mapSize) {
        use(mode, fit, mapSize);
        const Rivalry result = rivalry(bothEyes());
        std::printf("%s, module %d%s: %.4f %% of %zu points, truth %.4f %%\n", light, int(mode),
                    fit == ShadowFitMode::PerView ? ", per view" : "", 100 * result.result, result.points,
                    100 * result.truth);
        EXPECT_GT(result.points, 80000u);
        return result;
    }
    Ref<Viewport> other;
};

TEST_F(Stereo, TheUnionFitShowsBothEyesTheSameShadowsForEveryModule) {
    for (const bool lamp : {false, true}) {
        SetUp();
        addOtherEye();
        buildTown(30.0, 60);
        if (lamp)
            finishScene(LightPlace::Point, {1.3, 7.1, 10.7}, {0, -1, 0}, 0.0f, 0.05f);
        else
            finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3}, 0.0f, 0.01f);
        lookWithBothEyes({0, 6, 26}, {0, 0, 4});
        for (const ShadowMode mode : kMapModes) {
            const Rivalry result = measured(lamp ? "lamp" : "sun", mode, ShadowFitMode::Union, 1024);
            EXPECT_LE(result.result, result.truth + 0.0005) << int(mode);
        }
    }
}

// What the union is for, and that the measure sees it: each eye's own warp has other texels.
TEST_F(Stereo, AFitForEachEyeIsSeen) {
    addOtherEye();
    buildTown(30.0, 60);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    lookWithBothEyes({0, 6, 26}, {0, 0, 4});
    const Rivalry together = measured("sun", ShadowMode::LightSpacePerspective, ShadowFitMode::Union, 256);
    const Rivalry apart = measured("sun", ShadowMode::LightSpacePerspective, ShadowFitMode::PerView, 256);
    EXPECT_LE(together.result, together.truth + 0.0005);
    EXPECT_GT(apart.result, apart.truth + 0.0005);
}

}  // namespace
}  // namespace umbriel
