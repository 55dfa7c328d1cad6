#include "client/session/shadow_fit.h"
#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

// Acne and lost shadow as curves over the sizes of the biases, for surfaces that the light meets straight to all but
// edge-on: the defaults must sit where both are flat. A fin stands on a floor; what it loses at its foot is the gap
// that lets things float. Its tip stays where it is, as biases move towards the light alone.
class BiasCurves : public ModuleTest {
 protected:
    static constexpr double kFin = 0.02;  // half its thickness, metres
    struct Point {
        double acne = 0.0;        // of the lit floor
        double lostTexels = 0.0;  // how far into the true shadow it is lit, in texels across the light
        double lostMetres = 0.0;  // the same on the floor
        std::size_t lit = 0, dark = 0;
    };
    void build(LightPlace place, double slope) {
        SetUp();
        const double tangent = std::tan(slope);
        // Its shadow is a metre and a half long, whatever the slope.
        finHeight = slope < 0.1 ? 1.0 : std::min(1.0, 1.5 / tangent);
        block({-4, -1, -4}, {4, 0, 4});
        block({-kFin, 0, -2.5}, {kFin, finHeight, 2.5});
        const glm::dvec3 direction(std::sin(slope), -std::cos(slope), 0.0);
        const glm::dvec3 lamp = -6.0 * direction;
        finishScene(place, lamp, direction, 0.6f);
        tipBehindFin =
            place == LightPlace::Directional ? finHeight * tangent : (kFin - lamp.x) * finHeight / (lamp.y - finHeight);
        look({0.75, 5, 0.4}, {0.75, 0, 0});
    }
    Point at(const WallViews& fitted, float normalOffset, float constantBias) {
        WallViews views = fitted;
        for (ShadowFit& each : views.views[0].fits) {
            each.normalOffset = normalOffset;
            each.constantBias = constantBias;
        }
        const ShadowFit& fit = views.views[0].fits.at(0);
        const auto images = drawWall(views);
        Point result;
        if (images.size() < 4) {
            ADD_FAILURE() << "layers are missing";
            return result;
        }
        const glm::dvec3 eye = views.views[0].eyeWorld;
        std::size_t acne = 0;
        for (int y = 0; y < views.wall.height; ++y)
            for (int x = 0; x < views.wall.width; ++x) {
                const float* n = images[2].at(x, y);
                const float* p = images[1].at(x, y);
                const glm::dvec3 normal = worldFromLocal[1];
                if (glm::dot(glm::dvec3(n[0], n[1], n[2]), normal) < 0.99) continue;
                const glm::dvec3 world = eye + glm::dvec3(p[0], p[1], p[2]);
                const glm::dvec3 local = world * worldFromLocal;
                if (std::abs(local.y) > 1e-4 || std::abs(local.z) > 1.5) continue;
                glm::dvec3 toLight = -lightDirection;
                double reach = 1e30;
                if (lightPlace != LightPlace::Directional) {
                    reach = glm::distance(lightPosition, world);
                    toLight = (lightPosition - world) / reach;
                    if (-glm::dot(toLight, lightDirection) < std::cos(spotCone) + 1e-2) continue;
                }
                const bool lit = images[3].at(x, y)[0] > 0.5f;
                const double cosine = glm::dot(toLight, normal);
                const double texel = fit.texelSize * (fit.perspective ? reach : 1.0);
                const double tip = kFin + tipBehindFin;
                const double inside = std::min(local.x - kFin, tip - local.x);  // the shadow, from its nearer end
                if (inside < 0.0) {
                    // What is lit within two texels of an edge is none of acne's business.
                    if (local.x > -kFin && inside > -2.0 * texel / std::max(cosine, 1e-4)) continue;
                    if (local.x > -2.0 * kFin && local.x < kFin) continue;
                    ++result.lit;
                    acne += !lit;
                } else {
                    ++result.dark;
                    if (!lit) continue;
                    result.lostMetres = std::max(result.lostMetres, inside);
                    result.lostTexels = std::max(result.lostTexels, inside * cosine / texel);
                }
            }
        result.acne = double(acne) / double(std::max<std::size_t>(result.lit, 1));
        return result;
    }
    double tipBehindFin = 0.0;  // where the shadow ends, metres
    // The defaults against the curves.
    void check(LightPlace place, ShadowMode mode);
    double finHeight = 1.0;
};

constexpr float kOffsets[] = {0.0f, 0.2f, 0.4f, 0.5f, kNormalOffset, 0.7f, 1.2f, 4.0f};
constexpr float kConstants[] = {0.0f, kConstantBias, 0.5f, 2.0f, 10.0f};

void BiasCurves::check(LightPlace place, ShadowMode mode) {
    for (const double degrees : {0.0, 45.0, 80.0, 89.9}) {
        if (place != LightPlace::Directional && degrees > 89.0) continue;  // no floor below a lamp is so steep
        SCOPED_TRACE(std::to_string(degrees) + " degrees");
        build(place, degrees * 3.14159265358979 / 180.0);
        scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::mapSize>(1024u);
        const WallViews views = resolved({400, 300});
        ASSERT_FALSE(views.views[0].fits.empty());
        std::printf("%.1f degrees\n", degrees);
        const auto curve = [&](bool offsets, std::span<const float> sizes) {
            std::vector<Point> points;
            std::printf("  %-15s", offsets ? "normal offset" : "constant bias");
            for (const float size : sizes) {
                points.push_back(offsets ? at(views, size, kConstantBias) : at(views, kNormalOffset, size));
                std::printf(" %6.2f", double(size));
            }
            std::printf("\n  %-15s", "acne, %");
            for (const Point& point : points) std::printf(" %6.2f", 100 * point.acne);
            std::printf("\n  %-15s", "lost, texels");
            for (const Point& point : points) std::printf(" %6.2f", point.lostTexels);
            std::printf("\n");
            return points;
        };
        const auto byOffset = curve(true, kOffsets);
        const auto byConstant = curve(false, kConstants);
        ASSERT_GT(byOffset[0].lit, 5000u);
        // Gone from the exact half texel on, and with it nothing rounds back in.
        for (const std::size_t i : {3u, 4u, 5u, 6u, 7u}) EXPECT_LE(byOffset[i].acne, 1e-4) << kOffsets[i];
        for (const Point& point : byConstant) EXPECT_LE(point.acne, 1e-4);
        if (degrees == 0.0) continue;  // straight above, there is neither acne nor a shadow
        ASSERT_GT(byOffset[0].dark, 1000u);
        EXPECT_GT(byOffset[1].acne, 0.05) << "there is something to be cured of";
        // Beside the texel that a map is off anyway.
        if (degrees > 89.0) continue;  // the shadow itself is thinner than a texel
        EXPECT_LE(byOffset[4].lostTexels, 0.75) << "half a texel's diagonal, and rounding";
        EXPECT_LE(byOffset[5].lostTexels, byOffset[3].lostTexels + 0.1);
        EXPECT_LE(byConstant[2].lostTexels, byConstant[0].lostTexels + 0.5);
        if (degrees > 45.0) {
            EXPECT_GT(byOffset[7].lostTexels, 3.0 * byOffset[4].lostTexels) << "too much costs shadow";
            // Texels of a warped map are finer here than the one they are counted in.
            if (mode == ShadowMode::Standard) {
                EXPECT_GT(byOffset[7].lostTexels, byOffset[4].lostTexels + 1.0);
            }
        }
    }
}

TEST_F(BiasCurves, OfASunSitInTheirFlatPart) {
    check(LightPlace::Directional, ShadowMode::Standard);
}
TEST_F(BiasCurves, OfAWarpedMapSitInTheirFlatPart) {
    check(LightPlace::Directional, ShadowMode::LightSpacePerspective);
}
TEST_F(BiasCurves, OfASpotSitInTheirFlatPart) {
    check(LightPlace::Spot, ShadowMode::Standard);
}
TEST_F(BiasCurves, OfALampSitInTheirFlatPart) {
    check(LightPlace::Point, ShadowMode::Cube);
}

}  // namespace
}  // namespace umbriel
