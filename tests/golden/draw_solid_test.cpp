#include "tests/golden/draw_fixture.h"

namespace umbriel {
namespace {

// Closed convex parts of two-sided surfaces are drawn without their backs. A mask that cuts nothing out keeps them.
class SolidsTest : public DrawTest {
 protected:
    static constexpr PixelSize kWall{240, 180};

    // Boxes, one of them mirrored, on an open floor, under the sun.
    void build(bool drawsBacks) {
        SetUp();
        sun = scene->create<DirectionalLight>("sun");
        const Ref<Node> all = lit(root, sun, kTravels, glm::vec3(3.0f));
        const auto look = material({0.8f, 0.7f, 0.6f, 1});
        scene->edit(look).set<&Material::doubleSided>(true);
        if (drawsBacks) scene->edit(look).set<&Material::alphaMode>(AlphaMode::Mask).set<&Material::alphaCutoff>(0.0f);
        const glm::mat3 flat(glm::rotate(glm::mat4(1), -1.5707963f, glm::vec3(1, 0, 0)));
        node(placed(all, {0, 0, 0}, flat), geometry(gridMesh(6.0f, 8), look));
        const auto box = geometry(boxMesh({0.6f, 0.9f, 0.4f}), look);
        for (int i = 0; i < 7; ++i) {
            glm::mat3 turned(glm::rotate(glm::mat4(1), 0.5f * float(i), glm::vec3(0.1f, 1, 0.2f)));
            if (i == 3) turned[0] = -turned[0];
            node(placed(all, {-3.0 + 1.1 * i, 0.8, -1.5 + 1.2 * (i % 3)}, turned), box);
        }
    }
    WallImage picture(const glm::dvec3& eye, const glm::dvec3& target) {
        View view = lookAt(eye, target, 0.9, kWall);
        view.fits = {fitSphere(sun.id, kTravels, {0, 0, 0}, 7, 256)};
        return drawColour(wallViews(view));
    }

    static constexpr glm::vec3 kTravels{-0.5f, -1.0f, -0.4f};
    Ref<DirectionalLight> sun;
};

TEST_F(SolidsTest, PicturesDoNotChangeWhereverTheEyeIs) {
    struct Case {
        const char* name;
        glm::dvec3 eye, target;
    };
    const Case cases[] = {{"outside", {4, 3, 6}, {0, 0.5, 0}},
                          {"in a box, which shows its inside", {-3.0, 0.8, -1.5}, {0, 0.9, 0}},
                          {"in the mirrored box", {0.3, 0.8, -1.5}, {3, 0.6, 2}},
                          {"before a box that the near plane cuts", {-3.0, 0.8, -1.05}, {-3.0, 0.8, -4.0}},
                          {"below the floor", {0.5, -3, 2}, {0, 0, 0}}};
    for (const Case& one : cases) {
        build(true);
        const WallImage both = picture(one.eye, one.target);
        build(false);
        const WallImage fronts = picture(one.eye, one.target);
        ASSERT_EQ(both.values.size(), fronts.values.size());
        std::size_t differing = 0;
        for (std::size_t i = 0; i + 3 < both.values.size(); i += 4) {
            bool isOther = false;
            for (std::size_t c = 0; c < 4; ++c) isOther |= std::abs(both.values[i + c] - fronts.values[i + c]) > 1e-5f;
            differing += isOther;
        }
        // On an outline a front and a back may have the same depth but for rounding: a pixel in thousands.
        EXPECT_LE(differing, 4u) << one.name;
    }
}

}  // namespace
}  // namespace umbriel
