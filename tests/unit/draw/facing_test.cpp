#include "server/draw/facing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "server/draw/mesh_layout.h"

namespace umbriel {
namespace {

struct Mesh {
    std::vector<glm::vec3> positions;
    std::vector<std::uint32_t> indices;
    void addTriangle(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
        for (const glm::vec3& corner : {a, b, c}) {
            indices.push_back(static_cast<std::uint32_t>(positions.size()));
            positions.push_back(corner);
        }
    }
    void addQuad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d) {
        addTriangle(a, b, c);
        addTriangle(a, c, d);
    }
};

// The same numbers with every library.
class Random {
 public:
    explicit Random(std::uint64_t seed) : _engine(seed) {}
    double between(double low, double high) {
        return low + (high - low) * static_cast<double>(_engine() >> 11) / 9007199254740992.0;
    }
    double power(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
    int below(int count) { return static_cast<int>(between(0.0, count)); }
    glm::dvec3 direction() {
        const double z = between(-1.0, 1.0);
        const double around = between(0.0, 6.283185307179586);
        return {std::sqrt(1.0 - z * z) * std::cos(around), std::sqrt(1.0 - z * z) * std::sin(around), z};
    }
    glm::dmat3 rotation() {
        const glm::dvec3 z = direction();
        const glm::dvec3 x = glm::normalize(glm::cross(z, direction()));
        return {x, glm::cross(z, x), z};
    }

 private:
    std::mt19937_64 _engine;
};

// Convex and closed: an ellipsoid by rings around z, or a box, turned.
void addSolid(Mesh& mesh, Random& random, const glm::dvec3& centre) {
    const glm::dvec3 radii(random.between(0.2, 1.0), random.between(0.2, 1.0), random.between(0.2, 1.0));
    const glm::dmat3 turned = random.rotation();
    if (random.below(3) == 0) {
        const auto at = [&](int x, int y, int z) {
            return glm::vec3(centre + turned * (radii * glm::dvec3(2 * x - 1, 2 * y - 1, 2 * z - 1)));
        };
        mesh.addQuad(at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0));
        mesh.addQuad(at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1));
        mesh.addQuad(at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1));
        mesh.addQuad(at(0, 1, 0), at(0, 1, 1), at(1, 1, 1), at(1, 1, 0));
        mesh.addQuad(at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0));
        mesh.addQuad(at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1));
        return;
    }
    const int rings = 4 + random.below(6);
    const int sectors = 5 + random.below(12);
    const auto at = [&](int ring, int sector) {
        const double polar = 3.141592653589793 * ring / rings;
        const double around = 6.283185307179586 * (sector % sectors) / sectors;
        const double across = ring == 0 || ring == rings ? 0.0 : std::sin(polar);
        const glm::dvec3 place(across * std::cos(around), across * std::sin(around), std::cos(polar));
        return glm::vec3(centre + turned * (radii * place));
    };
    for (int ring = 0; ring < rings; ++ring)
        for (int sector = 0; sector < sectors; ++sector) {
            if (ring > 0) mesh.addTriangle(at(ring, sector), at(ring + 1, sector), at(ring, sector + 1));
            if (ring + 1 < rings)
                mesh.addTriangle(at(ring, sector + 1), at(ring + 1, sector), at(ring + 1, sector + 1));
        }
}

// The clusters of an object as the server lays it out.
struct Object {
    TriangleOrder order;
    std::vector<Cluster> clusters;
    Box box;
    explicit Object(const Mesh& mesh) : order(orderTriangles(mesh.indices, mesh.positions, true)) {
        SolidParts solids = solidPartsOf(order.indices, mesh.positions);
        moveSolidsFirst(order, solids);
        const std::vector<std::uint32_t> sizes = sortSolidsByFacing(order, solids, mesh.positions);
        clusters = clustersOf(order.indices, mesh.positions, sizes);
        markSolids(clusters, solids, order.indices, mesh.positions);
        for (const Cluster& cluster : clusters) box.add(cluster.box);
    }
};

glm::vec4 inFloats(const glm::mat4& matrix, const glm::vec4& point) {
    glm::vec4 result;
    for (int i = 0; i < 4; ++i)
        result[i] =
            ((matrix[0][i] * point.x + matrix[1][i] * point.y) + matrix[2][i] * point.z) + matrix[3][i] * point.w;
    return result;
}

// As rasterisers do: 1/256 of a pixel. The viewport's origin lies where a tile puts it.
struct Raster {
    glm::vec2 size;
    glm::vec2 origin;
    std::pair<std::int64_t, std::int64_t> snapped(const glm::vec4& clip) const {
        const float inverse = 1.0f / clip.w;
        const glm::vec2 ndc(clip.x * inverse, clip.y * inverse);
        const glm::vec2 window = ndc * (size * 0.5f) + (size * 0.5f + origin);
        return {std::llround(window.x * 256.0f), std::llround(window.y * 256.0f)};
    }
    // Twice the area, positive when wound counter-clockwise.
    std::int64_t area(const glm::vec4 (&clip)[3]) const {
        const auto a = snapped(clip[0]);
        const auto b = snapped(clip[1]);
        const auto c = snapped(clip[2]);
        return (b.first - a.first) * (c.second - a.second) - (b.second - a.second) * (c.first - a.first);
    }
};

struct Share {
    std::size_t dropped = 0;  // triangles
    std::size_t backs = 0;
    std::size_t wrong = 0;  // dropped although drawn
};

template <class ClipOf>
void judge(Share& share, const Object& object, const Mesh& mesh, const FacingTest& test, bool isMirrored,
           const Raster& raster, ClipOf&& clipOf) {
    for (const Cluster& cluster : object.clusters) {
        const bool isDropped = test.isTurnedAway(cluster.box, cluster.normals);
        for (std::size_t i = cluster.firstTriangle; i < cluster.firstTriangle + cluster.triangles; ++i) {
            glm::vec4 clip[3];
            for (std::size_t k = 0; k < 3; ++k) clip[k] = clipOf(mesh.positions[object.order.indices[3 * i + k]]);
            const bool isBefore = clip[0].w > 0.0f && clip[1].w > 0.0f && clip[2].w > 0.0f;
            const std::int64_t area = isBefore ? raster.area(clip) : 0;
            const bool isFront = isMirrored ? area < 0 : area > 0;
            share.dropped += isDropped;
            share.backs += isBefore && !isFront;
            share.wrong += isDropped && (!isBefore || isFront);
        }
    }
}

glm::dmat4 placementOf(Random& random, double scale, const glm::dvec3& translation) {
    const glm::dvec3 scales(random.power(0.3, 3.0), random.power(0.3, 3.0), random.power(0.3, 3.0));
    glm::dmat3 linear = random.rotation() * glm::dmat3(glm::scale(glm::dmat4(1.0), scale * scales)) * random.rotation();
    if (random.below(2) == 0) linear[0] = -linear[0];
    glm::dmat4 placement(linear);
    placement[3] = glm::dvec4(translation, 1.0);
    return placement;
}

View viewOf(Random& random, bool orthographic, double scale) {
    View view;
    view.region = {random.below(3000), random.below(2000), 40 + random.below(4000), 40 + random.below(3000)};
    view.viewFromWorld = random.rotation();
    view.orthographic = orthographic;
    view.clipFromView = glm::dmat4(0.0);
    const double high = std::tan(random.between(0.1, 1.2));
    view.clipFromView[0][0] = 1.0 / (high * random.between(0.5, 2.0));
    view.clipFromView[1][1] = 1.0 / high;
    if (orthographic) {
        view.clipFromView *= 0.2 / scale;
        view.clipFromView[3] = {random.between(-0.5, 0.5), random.between(-0.5, 0.5), 0.5, 1.0};
        view.clipFromView[2][2] = 1e-4 / scale;
    } else {
        view.clipFromView[2] = {random.between(-2.0, 2.0), random.between(-2.0, 2.0), 0.0, -1.0};  // off its axis
        view.clipFromView[3][2] = 1e-3 * scale;
    }
    return view;
}

Mesh meshOf(Random& random, const glm::dvec3& middle) {
    Mesh mesh;
    for (int i = 0; i < 24; ++i) addSolid(mesh, random, middle + random.between(0.0, 8.0) * random.direction());
    return mesh;
}

TEST(NormalCones, HoldEveryNormal) {
    Mesh mesh;
    mesh.addTriangle({0, 0, 0}, {0, 3, 0}, {0, 0, 4});  // +x
    mesh.addTriangle({0, 0, 0}, {0, 0, 4}, {3, 0, 0});  // +y
    mesh.addTriangle({0, 0, 0}, {3, 0, 0}, {0, 3, 0});  // +z
    const NormalCone one = normalConeOf(std::span(mesh.indices).first(3), mesh.positions);
    EXPECT_EQ(one.axis, glm::vec3(1, 0, 0));
    EXPECT_NEAR(one.sine, 0.0f, 1e-5f);
    EXPECT_GT(one.sine, 0.0f);
    EXPECT_NEAR(one.altitude, 2.4f, 1e-5f);  // of the sides 3, 4, 5
    const NormalCone all = normalConeOf(mesh.indices, mesh.positions);
    EXPECT_NEAR(glm::length(all.axis - glm::vec3(std::sqrt(1.0f / 3.0f))), 0.0f, 1e-6f);
    EXPECT_NEAR(all.sine, std::sqrt(2.0f / 3.0f), 1e-5f);
}

TEST(NormalCones, OppositeOnesHaveNone) {
    Mesh mesh;
    mesh.addTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    mesh.addTriangle({0, 0, 0}, {0, 1, 0}, {1, 0, 0});
    EXPECT_EQ(normalConeOf(mesh.indices, mesh.positions).sine, 2.0f);
    // Without an area, but with three places: no winding can be told.
    Mesh line;
    line.addTriangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0});
    EXPECT_EQ(normalConeOf(line.indices, line.positions).sine, 2.0f);
}

TEST(Facing, WholeClustersOfABoxTurnAway) {
    Mesh mesh;
    mesh.addQuad({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});  // +z
    const NormalCone normals = normalConeOf(mesh.indices, mesh.positions);
    Box box;
    for (const glm::vec3& place : mesh.positions) box.add(place);
    View view;
    view.region = {0, 0, 1000, 1000};
    view.clipFromView = glm::dmat4(0.0);
    view.clipFromView[0][0] = view.clipFromView[1][1] = 1.0;
    view.clipFromView[2][3] = -1.0;
    view.clipFromView[3][2] = 0.1;
    const auto isTurnedAway = [&](const glm::dvec3& eye, const glm::dmat3& viewFromWorld, bool isMirrored = false) {
        view.viewFromWorld = viewFromWorld;
        const glm::dmat4 relativeFromObject = glm::translate(glm::dmat4(1.0), -eye);
        return FacingTest::ofView(view, relativeFromObject, box, isMirrored).isTurnedAway(box, normals);
    };
    const glm::dmat3 down(1.0);
    const glm::dmat3 up(glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, -1));
    EXPECT_FALSE(isTurnedAway({0.5, 0.5, 5}, down));
    EXPECT_TRUE(isTurnedAway({0.5, 0.5, -5}, up));
    EXPECT_FALSE(isTurnedAway({0.5, 0.5, -0.2}, up));  // the view cuts it
    EXPECT_FALSE(isTurnedAway({0.5, 0.5, 0}, up));
    EXPECT_TRUE(isTurnedAway({3, 0.5, -5}, up));
    // A view that turns it round itself is not understood, a mirrored object in it is.
    view.clipFromView[0][0] = -1.0;
    EXPECT_FALSE(isTurnedAway({0.5, 0.5, -5}, up));
    EXPECT_TRUE(isTurnedAway({0.5, 0.5, -5}, up, true));
}

// In double against float, at all scales, of objects far from their origin, and mirrored ones.
TEST(Facing, NothingThatAViewDrawsIsDropped) {
    Random random(7);
    for (const bool orthographic : {false, true}) {
        Share share;
        for (int round = 0; round < 150; ++round) {
            const double middleAway = round % 3 == 0 ? random.power(10.0, 1e6) : 0.0;
            const glm::dvec3 middle = middleAway * random.direction();
            const Mesh mesh = meshOf(random, middle);
            const Object object(mesh);
            const double scale = random.power(1e-3, 1e4);
            glm::dmat4 placement = placementOf(random, scale, glm::dvec3(0.0));
            const double away = round % 5 == 0 ? 5.0 : random.power(10.0, 1e3);
            placement[3] =
                glm::dvec4(away * scale * random.direction(), 1.0) - glm::dvec4(glm::dmat3(placement) * middle, 0.0);
            View view = viewOf(random, orthographic, scale);
            // Looks at it.
            const glm::dvec3 z = -glm::normalize(glm::dvec3(placement * glm::dvec4(middle, 1.0)));
            const glm::dvec3 x = glm::normalize(glm::cross(z, random.direction()));
            view.viewFromWorld = glm::transpose(glm::dmat3(x, glm::cross(z, x), z));
            if (!orthographic) view.clipFromView[2][0] = view.clipFromView[2][1] = random.between(-0.8, 0.8);
            const bool isMirrored = glm::determinant(glm::dmat3(placement)) < 0.0;
            const FacingTest test = FacingTest::ofView(view, placement, object.box, isMirrored);
            const Raster raster{{view.region.width, view.region.height}, {view.region.x - 700, view.region.y - 300}};
            const glm::mat4 relativeFromObject(placement);
            const glm::mat4 clipFromRelative(clipFromRelativeOf(view));
            judge(share, object, mesh, test, isMirrored, raster, [&](const glm::vec3& place) {
                const glm::vec4 relative = inFloats(relativeFromObject, glm::vec4(place, 1.0f));
                return inFloats(clipFromRelative, glm::vec4(glm::vec3(relative), 1.0f));
            });
        }
        EXPECT_EQ(share.wrong, 0u) << orthographic;
        // What is far away is too small to tell, and so is what has many places for one float.
        EXPECT_GT(static_cast<double>(share.dropped), 0.1 * static_cast<double>(share.backs)) << orthographic;
    }
}

TEST(Facing, NothingThatAMapHoldsIsDropped) {
    Random random(11);
    Share share;
    int droppedWarped = 0;  // of 75 maps
    for (int round = 0; round < 150; ++round) {
        const double middleAway = round % 3 == 0 ? random.power(10.0, 1e6) : 0.0;
        const glm::dvec3 middle = middleAway * random.direction();
        const Mesh mesh = meshOf(random, middle);
        const Object object(mesh);
        const double scale = random.power(1e-3, 1e4);
        glm::dmat4 placement = placementOf(random, scale, glm::dvec3(0.0));
        placement[3] = glm::dvec4(1e6 * random.direction() - glm::dmat3(placement) * middle, 1.0);
        ShadowFit fit;
        fit.mapSize = 64u << random.below(7);
        fit.worldFromLight = random.rotation();
        fit.clipFromWorld = glm::dmat4(glm::transpose(fit.worldFromLight));
        const double extent = scale * random.between(5.0, 60.0);
        const glm::dvec3 centre = fit.clipFromWorld * placement * glm::dvec4(middle, 1.0);
        fit.clipFromWorld = glm::scale(glm::dmat4(1.0), glm::dvec3(1.0 / extent, 1.0 / extent, 0.1 / extent)) *
                            glm::translate(glm::dmat4(1.0), -centre) * fit.clipFromWorld;
        if (round % 2 == 0) {
            // As the warps: places on the map by a homography whose w is positive all over it.
            const double strength = random.power(0.01, 0.95);
            const double split = random.between(-1.0, 1.0);
            glm::dmat4 warp(1.0);
            warp[0][3] = strength * split;
            warp[1][3] = strength * (1.0 - std::abs(split)) * (random.below(2) == 0 ? 1.0 : -1.0);
            fit.clipFromWorld = glm::inverse(warp) * fit.clipFromWorld;
        }
        const bool isMirrored = glm::determinant(glm::dmat3(placement)) < 0.0;
        const FacingTest test = FacingTest::ofMap(fit, placement, object.box, isMirrored);
        droppedWarped += round % 2 == 0 && std::ranges::any_of(object.clusters, [&](const Cluster& cluster) {
            return test.isTurnedAway(cluster.box, cluster.normals);
        });
        const auto side = static_cast<float>(fit.mapSize);
        const glm::mat4 clipFromObject(fit.clipFromWorld * placement);
        judge(share, object, mesh, test, isMirrored, {{side, side}, {0, 0}},
              [&](const glm::vec3& place) { return inFloats(clipFromObject, glm::vec4(place, 1.0f)); });
        fit.perspective = true;
        const FacingTest unknown = FacingTest::ofMap(fit, placement, object.box, isMirrored);
        for (const Cluster& cluster : object.clusters) ASSERT_FALSE(unknown.isTurnedAway(cluster.box, cluster.normals));
    }
    EXPECT_GT(droppedWarped, 40);
    EXPECT_EQ(share.wrong, 0u);
    EXPECT_GT(static_cast<double>(share.dropped), 0.1 * static_cast<double>(share.backs));
}

TEST(Facing, SortingKeepsEveryTriangleAndItsNumber) {
    Random random(3);
    Mesh mesh = meshOf(random, glm::dvec3(0.0));
    for (int i = 0; i < 300; ++i)  // of no solid
        mesh.addQuad({i, 0, -9}, {i + 1, 0, -9}, {i + 1, 1, -9}, {i, 1, -9});
    const Object object(mesh);
    const Object again(mesh);
    EXPECT_EQ(object.order.indices, again.order.indices);
    ASSERT_EQ(object.order.primitives.size(), mesh.indices.size() / 3);
    std::vector<bool> seen(mesh.indices.size() / 3, false);
    for (std::size_t i = 0; i < object.order.primitives.size(); ++i) {
        ASSERT_FALSE(seen[object.order.primitives[i]]);
        seen[object.order.primitives[i]] = true;
        for (std::size_t k = 0; k < 3; ++k)
            ASSERT_EQ(object.order.indices[3 * i + k], mesh.indices[3 * object.order.primitives[i] + k]);
    }
    std::uint32_t next = 0;
    for (const Cluster& cluster : object.clusters) {
        ASSERT_EQ(cluster.firstTriangle, next);
        ASSERT_GT(cluster.triangles, 0u);
        ASSERT_LE(cluster.triangles, kClusterTriangles);
        ASSERT_EQ(cluster.solids.empty(), next >= mesh.indices.size() / 3 - 600);
        next += cluster.triangles;
    }
    EXPECT_EQ(next, mesh.indices.size() / 3);
}

}  // namespace
}  // namespace umbriel
