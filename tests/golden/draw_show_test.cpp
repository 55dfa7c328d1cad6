#include "common/wall/shadow_show.h"
#include "tests/golden/draw_fixture.h"

namespace umbriel {
namespace {

constexpr std::uint32_t kFactors =
    static_cast<std::uint32_t>(Layer::Colour) | static_cast<std::uint32_t>(Layer::LightFactors);
constexpr double kRadius = 4.0;  // of what the map covers
// Of the map, texels; no texel of it ends at the middle of a pixel of the walls below.
constexpr std::uint32_t kSide = 150;

// What a viewport shows of how its shadows are made. A floor of 4 x 4 m, seen from above at 1 cm a pixel, in light that
// falls at 45 degrees; with or without a plate of 1 m a metre above it.
class ShowTest : public DrawTest {
 protected:
    void build(bool withPlate) {
        light = scene->create<DirectionalLight>("sun");
        const Ref<Node> below = lit(root, light, kTravels);
        const auto white = material({1, 1, 1, 1}, ReflectionModel::Lambert);
        node(below, geometry(gridMesh(2.0f), white));
        if (withPlate) node(placed(below, {-1, 0, 1}), geometry(gridMesh(0.5f), white));
    }
    View look(PixelSize wall = {400, 300}) const {
        View view = flatView(4.0, wall);
        view.fits = {fitSphere(light.id, glm::dvec3(kTravels), {0, 0, 0}, kRadius, kSide)};
        return view;
    }
    void show(ShadowShow what) { scene->edit(viewport).set<&Viewport::show>(what); }
    // Where the middle of a pixel of the shown map lies on the plane across the light, in metres along the map's axes.
    glm::dvec2 acrossAt(int x, int y, PixelSize wall) const {
        const ShowLayout layout = showLayoutOf({0, 0, wall.width, wall.height}, 1);
        const double texelX = std::floor((x + 0.5 - layout.x) / layout.side * kSide);
        const double texelY = std::floor((y + 0.5 - layout.y) / layout.side * kSide);
        return glm::dvec2(texelX + 0.5, texelY + 0.5) * (2.0 * kRadius / kSide) - kRadius;
    }
    // Of a ray of light, where it meets the plane at this height.
    glm::dvec3 meets(glm::dvec2 across, double height) const {
        const glm::dmat3 axes(lookingAlong(kTravels));
        const glm::dvec3 start = axes[0] * across.x + axes[1] * across.y;
        return start + axes[2] * ((height - start.z) / axes[2].z);
    }
    // How near to the light, from 0 where the map ends to 1 where it begins.
    double nearness(const glm::dvec3& point) const {
        return 0.5 + 0.5 * glm::dot(point, glm::dmat3(lookingAlong(kTravels))[2]) / kRadius;
    }
    static double outside(const glm::dvec3& p, double x, double half) {
        return std::max(std::abs(p.x - x), std::abs(p.y)) - half;
    }

    static constexpr glm::vec3 kTravels{1, 0, -1};
    Ref<DirectionalLight> light;
};

TEST_F(ShowTest, TheMapShowsTheDistanceFromTheLight) {
    build(true);
    show(ShadowShow::ShadowMap);
    for (const PixelSize wall : {PixelSize{400, 300}, PixelSize{200, 260}}) {
        const auto images = drawWall(wallViews(look(wall)));
        ASSERT_EQ(images.size(), 1u);
        const ShowLayout layout = showLayoutOf({0, 0, wall.width, wall.height}, 1);
        EXPECT_EQ(layout.side, std::min(wall.width, wall.height));
        std::size_t plate = 0, floor = 0, nothing = 0;
        for (int y = 0; y < wall.height; ++y)
            for (int x = 0; x < wall.width; ++x) {
                const float* pixel = images[0].at(x, y);
                if (x < layout.x || x >= layout.x + layout.side || y < layout.y || y >= layout.y + layout.side) {
                    EXPECT_EQ(glm::vec3(pixel[0], pixel[1], pixel[2]), glm::vec3(0.0f));
                    continue;
                }
                const glm::dvec2 across = acrossAt(x, y, wall);
                const glm::dvec3 high = meets(across, 1.0), low = meets(across, 0.0);
                const double offPlate = outside(high, -1.0, 0.5), offFloor = outside(low, 0.0, 2.0);
                // A rasterised edge may lie 1/256 texel off.
                if (std::min(std::abs(offPlate), std::abs(offFloor)) < 1e-3) continue;
                if (offPlate > 0 && offFloor > 0) {
                    EXPECT_EQ(glm::vec3(pixel[0], pixel[1], pixel[2]), glm::vec3(0.0f, 0.0f, 0.25f)) << x << ", " << y;
                    ++nothing;
                    continue;
                }
                const glm::dvec3 point = offPlate < 0 ? high : low;
                (offPlate < 0 ? plate : floor) += 1;
                for (int channel = 0; channel < 3; ++channel)
                    EXPECT_NEAR(pixel[channel], nearness(point), 1e-5) << x << ", " << y;
            }
        EXPECT_GT(plate, 300u);
        EXPECT_GT(floor, 3000u);
        EXPECT_GT(nothing, 3000u);
    }
}

TEST_F(ShowTest, FactorsAreThoseOfTheLayerAndOneWhereNothingIs) {
    build(true);
    scene->edit(viewport).set<&Viewport::gauss>(5.0f);
    show(ShadowShow::FactorMap);
    const PixelSize wall{500, 300};  // the floor ends at 400: 0.5 m of nothing on either side
    View view = flatView(5.0, wall);
    view.fits = look().fits;
    const auto images = drawWall(wallViews(view, TileMode::Exact, 1, kFactors));
    ASSERT_EQ(images.size(), 2u);
    std::size_t dark = 0;
    for (int y = 0; y < wall.height; ++y)
        for (int x = 0; x < wall.width; ++x) {
            const bool isSurface = x >= 50 && x < 450;
            const float expected = isSurface ? images[1].at(x, y)[0] : 1.0f;
            dark += expected < 0.5f;
            ASSERT_EQ(images[0].at(x, y)[0], expected) << x << ", " << y;
            ASSERT_EQ(images[0].at(x, y)[2], expected);
        }
    EXPECT_GT(dark, 5000u);
}

TEST_F(ShowTest, TheColourMapHasNoShadows) {
    build(true);
    show(ShadowShow::ColorMap);
    const auto shown = drawWall(wallViews(look()));
    EXPECT_EQ(renderer->explain().find("shadow"), std::string::npos);
    show(ShadowShow::Picture);
    const auto picture = drawWall(wallViews(look()));
    scene->edit(viewport).set<&Viewport::shadowOn>(false);
    const auto plain = drawWall(wallViews(look()));
    EXPECT_EQ(differingPixels(shown[0], plain[0]), 0u);
    EXPECT_GT(differingPixels(shown[0], picture[0]), 5000u);
}

// The outline of the plate, a square from pixel 50 to 150 and from 100 to 200, and nothing else: the floor's border is
// the picture's.
TEST_F(ShowTest, EdgesLieBetweenThePixelsOfDifferentSurfaces) {
    build(true);
    show(ShadowShow::EdgeMap);
    const auto images = drawWall(wallViews(look()));
    for (int y = 0; y < 300; ++y)
        for (int x = 0; x < 400; ++x) {
            const bool right = (x == 49 || x == 149) && y >= 100 && y < 200;
            const bool above = (y == 99 || y == 199) && x >= 50 && x < 150;
            ASSERT_EQ(images[0].at(x, y)[0], right ? 1.0f : 0.0f) << x << ", " << y;
            ASSERT_EQ(images[0].at(x, y)[1], above ? 1.0f : 0.0f) << x << ", " << y;
        }
}

// Of the floor, what is in view: 4 x 2 m of it, whose hull on the map is read, texel by texel, and nothing else.
TEST_F(ShowTest, TheSeenAreaIsWhatTheWallReads) {
    build(false);
    show(ShadowShow::SeenArea);
    const PixelSize wall{400, 200};
    for (const TileMode mode : {TileMode::Exact, TileMode::Offset}) {
        const auto images = drawWall(wallViews(look(wall), mode));
        const double texel = 2.0 * kRadius / kSide;
        std::size_t seen = 0, unseen = 0;
        const ShowLayout layout = showLayoutOf({0, 0, wall.width, wall.height}, 1);
        for (int y = layout.y; y < layout.y + layout.side; ++y)
            for (int x = layout.x; x < layout.x + layout.side; ++x) {
                const float* pixel = images[0].at(x, y);
                const glm::dvec3 low = meets(acrossAt(x, y, wall), 0.0);
                // Metres beyond what is in view, across the light.
                const double off = std::max((std::abs(low.x) - 2.0) * std::sqrt(0.5), std::abs(low.y) - 1.0);
                const bool isSeen = pixel[1] > pixel[0] + 0.25f;
                // The normal offset moves lookups by half a texel.
                if (off < -1.5 * texel) {
                    EXPECT_TRUE(isSeen) << x << ", " << y;
                    ++seen;
                }
                if (off > 1.5 * texel) {
                    EXPECT_FALSE(isSeen) << x << ", " << y;
                    ++unseen;
                }
                const bool onFloor = outside(low, 0.0, 2.0) < -1e-3;
                if (onFloor) EXPECT_NEAR(pixel[0], 0.5 * nearness(low), 1e-5);
            }
        EXPECT_GT(seen, 2000u);
        EXPECT_GT(unseen, 10000u);
    }
}

}  // namespace
}  // namespace umbriel
