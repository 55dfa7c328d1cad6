#include "client/bake/light_map_bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/scene/light_map.h"
#include "tests/unit/atlas/light_map_meshes.h"

namespace umbriel {
namespace {

LightMapOptions optionsOf(std::uint32_t size, int samples = 4, int threads = 2) {
    LightMapOptions options;
    options.size = size;
    options.samples = samples;
    options.threads = threads;
    return options;
}

// How many of n points, at the middles of n equal parts of [from, from + width], lie within [low, high].
int pointsWithin(double from, double width, int n, double low, double high) {
    int count = 0;
    for (int i = 0; i < n; ++i) {
        const double at = from + width * (i + 0.5) / n;
        count += at > low && at < high ? 1 : 0;
    }
    return count;
}

// The shadow of a square that floats above a floor is that square, moved along the light.
TEST(LightMapBake, ASquareOverAFloorGivesEachTexelTheShareOfItsPointsThatTheSquaresShadowLeaves) {
    const double height = 3.0, half = 1.13, floorHalf = 8.0;
    const glm::dvec3 travel(0.41, -1.0, -0.27);
    const LightMapScene scene = sceneOf({squareMesh(floorHalf, 0.0), squareMesh(half, height)}, 1);
    const LightMapLight sun{true, {}, glm::normalize(travel), 0.0};
    for (const int samples : {1, 2, 4, 5}) {
        const auto baked = bakeLightMap(scene.surfaces, std::span(&sun, 1), *scene.rays, optionsOf(256, samples));
        ASSERT_TRUE(baked) << baked.error().message;
        // The floor's texels, found by looking them up as the shader does.
        const glm::dvec3 moved = travel * (height / -travel.y);
        const std::size_t chart = 3 * std::size_t{baked->places[0]};
        ASSERT_EQ(baked->places[0], baked->places[1]);
        const glm::vec4 range = baked->charts[chart + 2];
        const int side = static_cast<int>(std::lround(range.z - range.x)) + 1;
        ASSERT_GT(side, 150);
        const double metres = 2.0 * floorHalf / side;
        std::size_t partial = 0;
        for (int z = 0; z < side; ++z)
            for (int x = 0; x < side; ++x) {
                const double left = -floorHalf + x * metres, back = -floorHalf + z * metres;
                const glm::vec2 place =
                    placeOf(*baked, 0, glm::vec3(glm::dvec3(left + 0.5 * metres, 0.0, back + 0.5 * metres)));
                const auto texel = static_cast<std::size_t>(place.y) * 256 + static_cast<std::size_t>(place.x);
                const int dark = pointsWithin(left, metres, samples, moved.x - half, moved.x + half) *
                                 pointsWithin(back, metres, samples, moved.z - half, moved.z + half);
                const double share = 1.0 - static_cast<double>(dark) / (samples * samples);
                ASSERT_EQ(baked->texels[texel], static_cast<int>(share * 255.0 + 0.5)) << x << ", " << z;
                partial += dark > 0 && dark < samples * samples ? 1 : 0;
            }
        EXPECT_EQ(partial > 0, samples > 1);
    }
}

// A disc that a straight edge covers by a share: of a circle of radius 1, what lies beyond x.
double beyond(double x) {
    x = std::clamp(x, -1.0, 1.0);
    return (std::acos(x) - x * std::sqrt(1.0 - x * x)) / std::numbers::pi;
}

TEST(LightMapBake, TheSunsPenumbraAlongAnEdgeIsTheShareOfItsDisc) {
    // A roof whose edge is x = 0, high above the floor; the sun stands in the zenith.
    ChartMesh roof;
    roof.positions = {{-6, 4, 6}, {0, 4, 6}, {0, 4, -6}, {-6, 4, -6}};
    roof.triangles = {{0, 1, 2}, {0, 2, 3}};
    const LightMapScene scene = sceneOf({squareMesh(3.0, 0.0), roof}, 1);
    const double radius = 0.2;
    const LightMapLight sun{true, {}, {0, -1, 0}, radius};
    LightMapOptions options = optionsOf(256, 2);
    options.lightSamples = 16;
    const auto baked = bakeLightMap(scene.surfaces, std::span(&sun, 1), *scene.rays, options);
    ASSERT_TRUE(baked);
    const double width = 4.0 * std::tan(radius);
    double worst = 0.0;
    for (int i = 0; i < 60; ++i)
        for (const double z : {-1.7, 0.1, 2.2}) {
            const double x = -1.5 + 3.0 * (i + 0.5) / 60;
            const double expected = beyond(-x / width);
            const double found = lookUp(*baked, 0, z < x ? 0 : 1, glm::vec3(glm::dvec3(x, 0.0, z)));
            worst = std::max(worst, std::abs(found - expected));
        }
    // 1024 rays a texel, stratified; a texel is a fortieth of the penumbra, over which bilinear weights cut its bends.
    EXPECT_LT(worst, 0.03);
}

TEST(LightMapBake, ALampsShadowEndsAtTheLampNotBehindIt) {
    const LightMapScene scene = sceneOf({squareMesh(4.0, 0.0), squareMesh(1.0, 3.0)}, 2);
    const LightMapLight lamps[] = {{false, {0, 2, 0}, {0, -1, 0}, 0.0}, {false, {0, 6, 0}, {0, -1, 0}, 0.0}};
    const auto baked = bakeLightMap(scene.surfaces, lamps, *scene.rays, optionsOf(64));
    ASSERT_TRUE(baked);
    for (const double at : {0.3, 1.4, 2.6}) {
        const glm::vec3 point(glm::dvec3(at, 0.0, 0.1));
        EXPECT_EQ(lookUp(*baked, 0, 0, point), 1.0);
        EXPECT_EQ(lookUp(*baked, 1, 0, point), at < 2.0 ? 0.0 : 1.0);
    }
}

// The upper lid of a box shuts the light out of it; what is looked up at its faces, up to their edges and beyond where
// a pixel's middle lies outside, is of that face alone.
TEST(LightMapBake, NothingLeaksAcrossTheBordersOfACubesCharts) {
    for (const std::uint32_t size : {16u, 37u, 128u}) {
        const LightMapScene scene = sceneOf({cubeMesh(2.0)}, 1);
        const LightMapLight sun{true, {}, glm::normalize(glm::dvec3(0.3, -1.0, 0.2)), 0.0};
        const auto baked = bakeLightMap(scene.surfaces, std::span(&sun, 1), *scene.rays, optionsOf(size));
        ASSERT_TRUE(baked);
        const ChartMesh& cube = scene.surfaces[0].mesh;
        std::size_t lit = 0;
        for (std::size_t t = 0; t < cube.triangles.size(); ++t) {
            const glm::dvec3 a = cube.positions[cube.triangles[t].x], b = cube.positions[cube.triangles[t].y],
                             c = cube.positions[cube.triangles[t].z];
            const bool facesSun = glm::dot(glm::cross(b - a, c - a), sun.directionWorld) < 0.0;
            lit += facesSun;
            for (int i = -3; i <= 33; ++i)
                for (int k = -3; k <= 33; ++k) {
                    const glm::dvec3 point = a + (b - a) * (i / 30.0) + (c - a) * (k / 30.0);
                    ASSERT_EQ(lookUp(*baked, 0, t, glm::vec3(point)), facesSun ? 1.0 : 0.0)
                        << size << " texels, triangle " << t << ", " << i << ", " << k;
                }
        }
        EXPECT_EQ(lit, 6u);
    }
}

TEST(LightMapBake, NothingLeaksAcrossTheBordersOfASpheresCharts) {
    const LightMapScene scene = sceneOf({sphereMesh(1.0, 32, 16)}, 1);
    const glm::dvec3 travel = glm::normalize(glm::dvec3(0.3, -1.0, 0.2));
    const LightMapLight sun{true, {}, travel, 0.0};
    const auto baked = bakeLightMap(scene.surfaces, std::span(&sun, 1), *scene.rays, optionsOf(256));
    ASSERT_TRUE(baked);
    ASSERT_GT(baked->chartCount, 4u);
    const ChartMesh& sphere = scene.surfaces[0].mesh;
    std::size_t judged = 0;
    for (std::size_t t = 0; t < sphere.triangles.size(); ++t)
        for (int i = 0; i <= 10; ++i)
            for (int k = 0; k <= 10 - i; ++k) {
                const glm::dvec3 a = sphere.positions[sphere.triangles[t].x],
                                 b = sphere.positions[sphere.triangles[t].y],
                                 c = sphere.positions[sphere.triangles[t].z];
                const glm::dvec3 point = a + (b - a) * (i / 10.0) + (c - a) * (k / 10.0);
                const double cosine = -glm::dot(glm::normalize(point), travel);
                // A facet turns by 0.2 from its neighbours, and a texel is as wide again at this size.
                if (std::abs(cosine) < 0.35) continue;
                ++judged;
                ASSERT_EQ(lookUp(*baked, 0, t, glm::vec3(point)), cosine > 0.0 ? 1.0 : 0.0) << "triangle " << t;
            }
    EXPECT_GT(judged, 30000u);
}

TEST(LightMapBake, IsTheSameForAnyNumberOfThreads) {
    ChartMesh ball = sphereMesh(1.0, 20, 10);
    for (glm::dvec3& p : ball.positions) p.y += 2.0;
    const LightMapScene scene = sceneOf({squareMesh(4.0, 0.0), ball}, 2);
    const LightMapLight lights[] = {{true, {}, glm::normalize(glm::dvec3(0.3, -1, 0)), 0.03},
                                    {false, {1, 5, 1}, {0, -1, 0}, 0.0}};
    const auto one = bakeLightMap(scene.surfaces, lights, *scene.rays, optionsOf(96, 3, 1));
    ASSERT_TRUE(one);
    for (const int threads : {2, 5}) {
        const auto many = bakeLightMap(scene.surfaces, lights, *scene.rays, optionsOf(96, 3, threads));
        ASSERT_TRUE(many);
        EXPECT_EQ(one->texels, many->texels);
        EXPECT_EQ(one->places, many->places);
        EXPECT_EQ(one->charts, many->charts);
        EXPECT_EQ(one->rays, many->rays);
    }
}

// A metre is one texel or less: a texel of each face, and of the walls as thin as a hair one each.
TEST(LightMapBake, ChartsThatAreSmallerThanATexelStillHaveTheirOwnFactor) {
    std::vector<ChartMesh> meshes = {squareMesh(100.0, 0.0)};
    for (int i = 0; i < 20; ++i) {
        ChartMesh hair;
        const double x = -90.0 + 9.0 * i;
        hair.positions = {{x, 5, 0}, {x + 1e-4, 5, 0}, {x + 1e-4, 5, -1}, {x, 5, -1}};
        hair.triangles = {{0, 1, 2}, {0, 2, 3}};
        meshes.push_back(hair);
    }
    const LightMapScene scene = sceneOf(meshes, 1);
    const LightMapLight sun{true, {}, {0, -1, 0}, 0.0};
    const auto baked = bakeLightMap(scene.surfaces, std::span(&sun, 1), *scene.rays, optionsOf(16));
    ASSERT_TRUE(baked);
    for (std::size_t i = 0; i < 20; ++i)
        EXPECT_EQ(lookUp(*baked, 0, 2 + 2 * i, glm::vec3(meshes[1 + i].positions[0])), 1.0) << i;
}

TEST(LightMapBake, AnAtlasWithFewerTexelsThanChartsIsRefused) {
    const LightMapScene scene = sceneOf({cubeMesh(1.0)}, 1);
    const LightMapLight sun;
    const auto refused = bakeLightMap(scene.surfaces, std::span(&sun, 1), *scene.rays, optionsOf(2));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, Error::Kind::BadInput);
    EXPECT_TRUE(bakeLightMap(scene.surfaces, std::span(&sun, 1), *scene.rays, optionsOf(3)));
}

// Where texture coordinates are unique, each triangle has a function of its own, which agrees with its neighbours'.
TEST(LightMapBake, TextureCoordinatesThatCurveAreContinuousOverEdges) {
    ChartMesh sphere = sphereMesh(1.0, 16, 8);
    for (std::size_t i = 0; i < sphere.positions.size(); i += 4) {
        const auto column = static_cast<double>((i / 4) % 16), row = static_cast<double>((i / 4) / 16);
        for (const glm::dvec2 corner : {glm::dvec2(0, 0), glm::dvec2(0, 1), glm::dvec2(1, 1), glm::dvec2(1, 0)})
            sphere.texCoords.emplace_back((column + corner.x) / 16.0, (row + corner.y) / 8.0);
    }
    ASSERT_TRUE(areUnique(sphere));
    const LightMapScene scene = sceneOf({sphere}, 1);
    const LightMapLight sun{true, {}, {0, -1, 0}, 0.0};
    const auto baked = bakeLightMap(scene.surfaces, std::span(&sun, 1), *scene.rays, optionsOf(128));
    ASSERT_TRUE(baked);
    for (std::size_t t = 0; t < sphere.triangles.size(); ++t) {
        const glm::vec4 range = baked->charts[3 * baked->places[t] + 2];
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t vertex = sphere.triangles[t][k];
            const glm::vec2 place = placeOf(*baked, t, glm::vec3(sphere.positions[vertex]));
            // One island over the whole square, stretched to the chart's texels.
            const glm::dvec2 expected(
                std::clamp(sphere.texCoords[vertex].x * (range.z + range.x), double(range.x), double(range.z)), 0.0);
            EXPECT_NEAR(place.x, expected.x, 1e-2) << t;
        }
    }
}

// Looks factors up of a function of the place in the atlas, on the triangles that were unwrapped.
class Painted final : public LightMapDrawer {
 public:
    Result<void> unwrap(std::vector<std::vector<glm::dvec2>> corners, std::uint32_t size) override {
        _size = size;
        _trianglesAt.assign(std::size_t{size} * size, {});
        for (const std::vector<glm::dvec2>& surface : corners)
            for (std::size_t t = 0; t + 2 < surface.size(); t += 3) {
                const std::array triangle{surface[t], surface[t + 1], surface[t + 2]};
                const auto texel = [&](const glm::dvec2& at) {
                    return glm::clamp(glm::ivec2(glm::floor(at)), 0, static_cast<int>(size) - 1);
                };
                const glm::ivec2 from = texel(glm::min(triangle[0], glm::min(triangle[1], triangle[2])));
                const glm::ivec2 to = texel(glm::max(triangle[0], glm::max(triangle[1], triangle[2])));
                for (int y = from.y; y <= to.y; ++y)
                    for (int x = from.x; x <= to.x; ++x) trianglesAt(x, y).push_back(triangle);
            }
        return {};
    }
    Result<std::vector<std::vector<float>>> lookUp(std::uint32_t x, std::uint32_t y, std::uint32_t side,
                                                   int samples) override {
        ++calls;
        if (calls > callsThatWork) return failure("the paint is used up");
        EXPECT_LT(x, _size);
        EXPECT_LT(y, _size);
        EXPECT_LE(side * static_cast<std::uint32_t>(samples), kDrawnPoints);
        const std::size_t width = side * static_cast<std::size_t>(samples);
        std::vector<std::vector<float>> factors(2, std::vector<float>(width * width, -1.0f));
        for (std::size_t i = 0; i < width * width; ++i) {
            const glm::dvec2 at(x + (static_cast<double>(i % width) + 0.5) / samples,
                                y + (static_cast<double>(i / width) + 0.5) / samples);
            if (!isCovered(at)) continue;
            factors[0][i] = static_cast<float>(factorAt(at));
            factors[1][i] = 0.25f;
        }
        return factors;
    }
    static double factorAt(const glm::dvec2& at) { return std::fmod(0.37 * at.x + 0.11 * at.y, 1.0); }
    bool isCovered(const glm::dvec2& at) {
        if (at.x >= _size || at.y >= _size) return false;
        for (const std::array<glm::dvec2, 3>& triangle : trianglesAt(static_cast<int>(at.x), static_cast<int>(at.y))) {
            int left = 0, right = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const glm::dvec2 edge = triangle[(k + 1) % 3] - triangle[k], to = at - triangle[k];
                const double area = edge.x * to.y - edge.y * to.x;
                left += area > 0.0;
                right += area < 0.0;
            }
            if (left == 3 || right == 3) return true;
        }
        return false;
    }

    int calls = 0;
    int callsThatWork = 1 << 30;

 private:
    std::vector<std::array<glm::dvec2, 3>>& trianglesAt(int x, int y) {
        return _trianglesAt[static_cast<std::size_t>(y) * _size + static_cast<std::size_t>(x)];
    }

    std::vector<std::vector<std::array<glm::dvec2, 3>>>
        _trianglesAt;  // those that may cover some of a texel, row by row
    std::uint32_t _size = 0;
};

TEST(LightMapBake, DrawnTexelsAreTheMeansOfWhatWasDrawnOnTheirSurface) {
    LightMapScene scene = sceneOf({squareMesh(4.0, 0.0), sphereMesh(1.0, 8, 6)}, 2);
    scene.surfaces[1].lit[1] = 0;
    const LightMapLight lights[2] = {{true, {}, {0, -1, 0}, 0.0}, {true, {}, {0, -1, 0}, 0.0}};
    for (const auto& [size, samples] : {std::pair(96u, 1), std::pair(96u, 3), std::pair(150u, 16)}) {
        Painted painted;
        const auto baked = bakeLightMap(scene.surfaces, lights, *scene.rays, optionsOf(size, samples), &painted);
        ASSERT_TRUE(baked) << baked.error().message;
        EXPECT_EQ(painted.calls > 1, samples == 16);  // 128 texels at once
        const std::size_t texels = std::size_t{size} * size;
        std::uint64_t lookups = 0, covered = 0;
        for (std::size_t i = 0; i < texels; ++i) {
            double sum = 0.0;
            int points = 0;
            for (int k = 0; k < samples * samples; ++k) {
                const glm::dvec2 at(static_cast<double>(i % size) + (k % samples + 0.5) / samples,
                                    static_cast<double>(i / size) + (k / samples + 0.5) / samples);
                if (!painted.isCovered(at)) continue;
                sum += static_cast<double>(static_cast<float>(Painted::factorAt(at)));
                ++points;
            }
            lookups += static_cast<std::uint64_t>(points);
            covered += points > 0 ? 1 : 0;
            if (points > 0) {
                ASSERT_EQ(baked->texels[i], static_cast<int>(sum / points * 255.0 + 0.5)) << i;
            }
        }
        EXPECT_EQ(baked->lookups, lookups);
        EXPECT_EQ(baked->covered, covered);
        EXPECT_EQ(baked->rays, 0u);
        // The second light reaches the floor alone. What lies beside a surface is filled from it, never from others.
        EXPECT_EQ(std::lround(255.0 * lookUp(*baked, 1, 0, {0.5f, 0.0f, 0.5f})), 64);
        const auto sphere = static_cast<std::size_t>(baked->triangles[0]);
        for (std::size_t t = sphere; t < baked->places.size(); ++t) {
            if (baked->places[t] == LightMap::kNoChart) continue;
            const LightMapSurface& surface = scene.surfaces[1];
            const glm::uvec3 corner = surface.mesh.triangles[t - sphere];
            for (int k = 0; k < 3; ++k)
                EXPECT_EQ(lookUp(*baked, 1, t, glm::vec3(surface.objectPositions[corner[k]])), 1.0) << t;
        }
    }
}

// Two slivers along two sides of a square that is a texel large, whose middle is on neither: rays find their factor.
TEST(LightMapBake, AChartThatNoPointOfADrawingLiesOnHasTheFactorOfItsRays) {
    ChartMesh slivers;
    slivers.positions = {{-3, 0, -3}, {3, 0, -3}, {3, 0, -2.9}, {3.1, 0, 3}};
    slivers.triangles = {{0, 2, 1}, {1, 2, 3}};
    const LightMapScene scene = sceneOf({squareMesh(400.0, -1.0), slivers, squareMesh(400.0, 2.0)}, 2);
    const LightMapLight lights[2] = {{true, {}, {0, -1, 0}, 0.0}, {true, {}, {0, 1, 0}, 0.0}};
    Painted painted;
    const auto baked = bakeLightMap(scene.surfaces, lights, *scene.rays, optionsOf(64, 1), &painted);
    ASSERT_TRUE(baked) << baked.error().message;
    EXPECT_EQ(lookUp(*baked, 0, 2, {3, 0, -2.95}), 0.0);  // below the roof
    EXPECT_EQ(lookUp(*baked, 1, 3, {3, 0, -2.95}), 0.0);  // above the floor
    EXPECT_EQ(baked->places[2], baked->places[3]);
    EXPECT_EQ(baked->rays, 0u);
}

TEST(LightMapBake, WhatKeepsTheDrawerFromDrawingIsTheError) {
    const LightMapScene scene = sceneOf({squareMesh(4.0, 0.0)}, 2);
    const LightMapLight lights[2] = {};
    Painted painted;
    painted.callsThatWork = 1;
    const auto baked = bakeLightMap(scene.surfaces, lights, *scene.rays, optionsOf(200, 16), &painted);
    ASSERT_FALSE(baked);
    EXPECT_EQ(baked.error().message, "the paint is used up");
}

}  // namespace
}  // namespace umbriel
