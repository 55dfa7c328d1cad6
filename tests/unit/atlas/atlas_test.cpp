#include "client/bake/atlas.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <set>

#include "common/image/exr_io.h"
#include "common/visibility/bake.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel {
namespace {

using namespace visibility;

struct Baked {
    BakeMesh mesh;
    Bytes bytes;
    MapFile file;
};

Baked bake(const Mapping& mapping, std::uint32_t contents, const Mesh& mesh) {
    Baked b{*prepare(mesh), {}, {}};
    BakeSettings s;
    s.mapping = mapping;
    s.contents = contents;
    if (contents & static_cast<std::uint32_t>(MapContent::Index)) s.environment = {64, 32};
    b.bytes = *bakeShard(b.mesh, s, 0, b.mesh.rows.size(), 2);
    b.file = *MapFile::open(b.bytes, "maps");
    return b;
}

const std::vector<Mapping> kMappings{{MappingKind::HemiCube, 6},   {MappingKind::SinglePlane, 8, 2.0},
                                     {MappingKind::HemiSphere, 8}, {MappingKind::Cube, 4},
                                     {MappingKind::Octahedral, 8}, {MappingKind::Fibonacci, 50}};

TEST(Atlas, EveryPixelHasAPlaceOfItsOwn) {
    for (const Mapping& m : kMappings) {
        std::set<std::pair<int, int>> places;
        const TilePlace size = tileSize(m);
        for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
            const TilePlace at = tilePlace(m, p);
            EXPECT_TRUE(at.x >= 0 && at.y >= 0 && at.x < size.x && at.y < size.y) << name(m.kind) << " " << p;
            EXPECT_TRUE(places.insert({at.x, at.y}).second) << name(m.kind) << " " << p;
        }
    }
}

// What hangs beside each other in a HemiCube's tile looks into neighbouring directions.
TEST(Atlas, HemiCubeSidesHangOnTheirEdges) {
    const Mapping m{MappingKind::HemiCube, 8};
    std::map<std::pair<int, int>, std::uint32_t> at;
    for (std::uint32_t p = 0; p < pixelCount(m); ++p) at[{tilePlace(m, p).x, tilePlace(m, p).y}] = p;
    for (const auto& [place, p] : at) {
        for (const auto& step : {std::pair{1, 0}, std::pair{0, 1}}) {
            const auto other = at.find({place.first + step.first, place.second + step.second});
            if (other == at.end()) continue;
            EXPECT_GT(glm::dot(direction(m, p), direction(m, other->second)), 0.95) << p << " " << other->second;
        }
    }
}

TEST(Atlas, ComesBackAsTheSameBytes) {
    const umbriel::test::TemporaryFolder folder;
    for (const Mapping& m : kMappings) {
        std::uint32_t contents =
            static_cast<std::uint32_t>(MapContent::Mask) | static_cast<std::uint32_t>(MapContent::HitDistance);
        if (m.kind != MappingKind::Fibonacci) contents |= static_cast<std::uint32_t>(MapContent::Distance);
        if (m.kind != MappingKind::Octahedral) contents |= static_cast<std::uint32_t>(MapContent::Index);
        const Baked b = bake(m, contents, visibility::test::cloth(40, 30));
        const auto picture = exportAtlas(b.file);
        ASSERT_TRUE(picture) << picture.error().message;
        const auto path = folder / "atlas.exr";
        ASSERT_TRUE(writeExr(path, *picture));
        const auto read = readExr(path);
        ASSERT_TRUE(read);
        const auto bytes = importAtlas(*read, b.mesh);
        ASSERT_TRUE(bytes) << bytes.error().message;
        EXPECT_EQ(*bytes, b.bytes) << name(m.kind);
        EXPECT_FALSE(importAtlas(*read, *prepare(visibility::test::cloth(41, 30))));
    }
}

// A point at the bottom of a fold sees a slit of the sky, one on its crest most of it, in every mapping, and distances
// grow away from the silhouette.
TEST(Atlas, FoldSeesASlitAndCrestMostOfTheSky) {
    const BakeMesh mesh = *prepare(visibility::test::accordion(6, 20, 0.2f));
    // The profile's walls rise to 1; the floor is at 0 between them.
    std::uint64_t bottom = 0, crest = 0;
    for (std::uint32_t row = 0; row < mesh.rows.size(); ++row) {
        const glm::vec3& p = mesh.positions[mesh.rows[row].position];
        if (std::abs(p.y - 1.0f) > 0.01f) continue;
        if (std::abs(p.x - 1.0f) < 0.01f && p.z == 0.0f) bottom = row;
        if (std::abs(p.x - 1.0f) < 0.01f && p.z == 1.0f) crest = row;
    }
    for (const Mapping& m : {Mapping{MappingKind::HemiCube, 16}, Mapping{MappingKind::SinglePlane, 32, 2.4},
                             Mapping{MappingKind::HemiSphere, 32}}) {
        const Baked b = bake(m, 3, visibility::test::accordion(6, 20, 0.2f));
        AtlasOptions options;
        options.rows = {bottom, crest};
        options.columns = 2;
        const auto picture = exportAtlas(b.file, options);
        ASSERT_TRUE(picture);
        const TilePlace tile = tileSize(m);
        double open[2] = {0, 0}, all = 0;
        for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
            const TilePlace at = tilePlace(m, p);
            for (int t = 0; t < 2; ++t) {
                if (picture->rgba.pixel(t * tile.x + at.x, tile.y - 1 - at.y)[0] > 0.5f) open[t] += cosineWeight(m, p);
            }
            all += cosineWeight(m, p);
        }
        EXPECT_GT(open[0] / all, 0.01) << name(m.kind);
        EXPECT_LT(open[0] / all, 0.5) << name(m.kind);
        EXPECT_GT(open[1] / all, open[0] / all + 0.15) << name(m.kind);
        const FloatImage* distance = picture->floatLayer("distance");
        ASSERT_NE(distance, nullptr);
    }
}

TEST(Atlas, WrongRequestsAreRefused) {
    const Baked b = bake({MappingKind::HemiSphere, 8}, 1, visibility::test::plate(4));
    AtlasOptions options;
    options.rows = {25};
    EXPECT_FALSE(exportAtlas(b.file, options));
    options.rows = {};
    options.showDistance = true;
    EXPECT_FALSE(exportAtlas(b.file, options));
    LayeredImage picture = *exportAtlas(b.file);
    for (const char* key : {"umvisMapping", "umvisSize", "umvisColumns", "umvisMesh", "umvisContents"}) {
        LayeredImage damaged = picture;
        damaged.texts.erase(key);
        EXPECT_FALSE(importAtlas(damaged, b.mesh)) << key;
        damaged.texts[key] = "4294967295";
        EXPECT_FALSE(importAtlas(damaged, b.mesh)) << key;
    }
    EXPECT_FALSE(importAtlas({makeRgbaImage(4, 4), {}, {}, {}}, b.mesh));
}

// Another program, or a lossy compression, must not become maps that nobody baked.
TEST(Atlas, ChangedValuesAreRefused) {
    const Baked b = bake({MappingKind::HemiSphere, 8}, kAllContents, visibility::test::cloth(20, 10));
    const LayeredImage picture = *exportAtlas(b.file);
    ASSERT_TRUE(importAtlas(picture, b.mesh));
    const auto refused = [&](auto change) {
        LayeredImage changed = picture;
        change(changed);
        const auto maps = importAtlas(changed, b.mesh);
        return !maps && maps.error().kind == Error::Kind::BadInput;
    };
    const auto layer = [](LayeredImage& p, const char* name) -> FloatImage& {
        for (auto& l : p.layers)
            if (l.name == name) return std::get<FloatImage>(l.image);
        std::abort();
    };
    EXPECT_TRUE(refused([](LayeredImage& p) { p.rgba.pixel(5, 3)[0] = 0.75f; }));
    EXPECT_TRUE(refused([](LayeredImage& p) { p.rgba.pixel(5, 3)[0] = std::nanf(""); }));
    EXPECT_TRUE(refused([&](LayeredImage& p) { layer(p, "distance").at(2, 2, 0) += 1e-6f; }));
    EXPECT_TRUE(refused([&](LayeredImage& p) { layer(p, "distance").at(2, 2, 0) = std::nanf(""); }));
    EXPECT_TRUE(refused([&](LayeredImage& p) { layer(p, "hit").at(2, 2, 0) = 1e30f; }));
    for (const std::uint32_t texel : {64u * 32u, 65536u, ~0u}) {
        EXPECT_TRUE(refused([&](LayeredImage& p) {
            for (auto& l : p.layers)
                if (auto* ids = std::get_if<UintImage>(&l.image)) ids->at(1, 1, 0) = texel;
        })) << texel;
    }
    EXPECT_TRUE(refused([](LayeredImage& p) { p.layers.pop_back(); }));
    EXPECT_TRUE(refused([](LayeredImage& p) { p.texts["umvisEnvironment"] = "65536x65536"; }));
    EXPECT_TRUE(refused([](LayeredImage& p) { p.texts["umvisMaker"] = "9"; }));
    EXPECT_TRUE(refused([](LayeredImage& p) { p.texts["umvisGuard"] = "9"; }));
    EXPECT_TRUE(refused([](LayeredImage& p) { p.texts["umvisFar"] = "-1"; }));
    EXPECT_TRUE(refused([](LayeredImage& p) { p.texts["umvisClass"] = std::string(64, 'x'); }));
    AtlasOptions grey;
    grey.showDistance = true;
    EXPECT_FALSE(importAtlas(*exportAtlas(b.file, grey), b.mesh));
    AtlasOptions two;
    two.rows = {3, 4};
    EXPECT_FALSE(importAtlas(*exportAtlas(b.file, two), b.mesh));
}

}  // namespace
}  // namespace umbriel
