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

// Many round solids in one geometry, whose clusters turn away as wholes.
class RoundSolidsTest : public DrawTest {
 protected:
    static constexpr PixelSize kWall{240, 180};

    static Mesh balls(int count) {
        Mesh mesh;
        for (int i = 0; i < count; ++i) {
            const glm::vec3 centre(2.2f * float(i % 6) - 5.5f, 1.0f + 0.3f * float(i % 3), 2.2f * float(i / 6) - 4.4f);
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            constexpr std::uint32_t kRings = 8, kSectors = 12;
            for (std::uint32_t ring = 0; ring <= kRings; ++ring)
                for (std::uint32_t sector = 0; sector <= kSectors; ++sector) {
                    const float polar = 3.14159265f * float(ring) / float(kRings);
                    const float around = 6.2831853f * float(sector % kSectors) / float(kSectors);
                    const float across = ring == 0 || ring == kRings ? 0.0f : std::sin(polar);
                    const glm::vec3 normal(across * std::cos(around), across * std::sin(around), std::cos(polar));
                    mesh.positions.push_back(centre + 0.9f * normal);
                    mesh.normals.push_back(normal);
                    if (ring == kRings || sector == kSectors) continue;
                    const std::uint32_t a = first + ring * (kSectors + 1) + sector;
                    const std::uint32_t b = a + kSectors + 1;
                    if (ring > 0) mesh.indices.insert(mesh.indices.end(), {a, b, a + 1});
                    if (ring + 1 < kRings) mesh.indices.insert(mesh.indices.end(), {a + 1, b, b + 1});
                }
        }
        return mesh;
    }
    void build(bool drawsBacks, const glm::mat3& linear, const glm::dvec3& offset) {
        SetUp();
        sun = scene->create<DirectionalLight>("sun");
        const Ref<Node> all = lit(root, sun, kTravels, glm::vec3(3.0f));
        const auto look = material({0.8f, 0.7f, 0.6f, 1});
        scene->edit(look).set<&Material::doubleSided>(true);
        if (drawsBacks) scene->edit(look).set<&Material::alphaMode>(AlphaMode::Mask).set<&Material::alphaCutoff>(0.0f);
        const glm::mat3 flat(glm::rotate(glm::mat4(1), -1.5707963f, glm::vec3(1, 0, 0)));
        node(placed(all, offset, linear * flat), geometry(gridMesh(8.0f, 8), look));
        node(placed(all, offset, linear), geometry(balls(30), look));
    }
    static constexpr glm::vec3 kTravels{-0.5f, -1.0f, -0.4f};
    Ref<DirectionalLight> sun;
};

TEST_F(RoundSolidsTest, PicturesDoNotChangeWhereClustersTurnAway) {
    const glm::mat3 mirrored(-1, 0, 0, 0, 1, 0, 0, 0, 1);
    const glm::mat3 uneven(1.3f, 0.2f, 0, 0, 0.6f, 0.1f, -0.3f, 0, 0.9f);
    struct Case {
        const char* name;
        glm::mat3 linear;
        double scale;
        glm::dvec3 offset;
        bool orthographic;
        TileMode tiles;
    };
    const Case cases[] = {{"as it is", glm::mat3(1), 1.0, {0, 0, 0}, false, TileMode::Exact},
                          {"mirrored", mirrored, 1.0, {0, 0, 0}, false, TileMode::Exact},
                          {"uneven", uneven, 1.0, {0, 0, 0}, false, TileMode::Offset},
                          {"orthographic", uneven, 1.0, {0, 0, 0}, true, TileMode::Offset},
                          {"mirrored, orthographic", mirrored, 1.0, {0, 0, 0}, true, TileMode::Exact},
                          {"far from the origin", uneven, 1.0, {1e6, 3e5, -1e6}, false, TileMode::Exact},
                          {"small", mirrored * uneven, 1e-3, {0, 0, 0}, false, TileMode::Exact},
                          {"large", uneven, 1e4, {0, 0, 0}, false, TileMode::Exact}};
    for (const Case& one : cases) {
        const auto picture = [&](bool drawsBacks) {
            build(drawsBacks, one.linear * static_cast<float>(one.scale), one.offset);
            View view = lookAt(one.offset + one.scale * glm::dvec3(7, 5, 10), one.offset, 1.0, kWall);
            view.nearDistance *= one.scale;
            view.clipFromView[3][2] *= one.scale;
            if (one.orthographic) {
                view.orthographic = true;
                view.clipFromView = glm::dmat4(1.0);
                view.clipFromView[0][0] = 0.12;
                view.clipFromView[1][1] = 0.16;
                view.clipFromView[2][2] = 0.02;
                view.clipFromView[3][2] = 1.0;
            }
            view.fits = {fitSphere(sun.id, kTravels, one.offset, 12.0 * one.scale, 256)};
            WallViews wall = wallViews(view);
            wall.tiles = one.tiles;
            return drawColour(wall);
        };
        statistics = {};
        const WallImage both = picture(true);
        const std::uint64_t bothTriangles = statistics.triangles;
        statistics = {};
        const WallImage fronts = picture(false);
        EXPECT_LT(static_cast<double>(statistics.triangles), 0.95 * static_cast<double>(bothTriangles)) << one.name;
        ASSERT_EQ(both.values.size(), fronts.values.size());
        std::size_t differing = 0;
        for (std::size_t i = 0; i + 3 < both.values.size(); i += 4) {
            bool isOther = false;
            for (std::size_t c = 0; c < 4; ++c) isOther |= std::abs(both.values[i + c] - fronts.values[i + c]) > 1e-5f;
            differing += isOther;
        }
        // As of boxes.
        EXPECT_LE(differing, 4u) << one.name;
        const auto drawn = std::count_if(both.values.begin(), both.values.end(), [](float v) { return v != 0.0f; });
        EXPECT_GT(drawn, 20000) << one.name;  // something is seen
    }
}

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
