#include "common/visibility/bake.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "common/visibility/half.h"
#include "common/visibility/map_maker.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel::visibility {
namespace {

const BakeMesh& cloth() {
    static const BakeMesh mesh = *prepare(test::cloth(80, 40));  // 3200 rows: three blocks and a rest
    return mesh;
}

BakeSettings settings(std::uint32_t size = 8) {
    BakeSettings s;
    s.mapping = {MappingKind::HemiSphere, size};
    return s;
}

TEST(Bake, BytesDoNotDependOnThreadsOrShards) {
    BakeSettings s = settings();
    s.contents = kAllContents;
    s.environment = {64, 32};
    for (const trace::Guard guard : {trace::Guard::Exact, trace::Guard::Fast}) {
        s.guard = guard;
        const auto baker = Baker::create(cloth(), s);
        ASSERT_TRUE(baker);
        ASSERT_EQ((*baker)->rowBlocks(), 4u);
        const auto whole = (*baker)->shard(0, 3200, 1);
        ASSERT_TRUE(whole);
        EXPECT_EQ(*(*baker)->shard(0, 3200, 3), *whole);
        EXPECT_EQ(*bakeShard(cloth(), s, 0, 3200, 2), *whole);
        for (const auto& cut : std::vector<std::vector<std::uint64_t>>{
                 {0, 1024, 3200}, {0, 2048, 3072, 3200}, {0, 1024, 2048, 3072, 3200}, {0, 3200}}) {
            std::vector<Bytes> shards;
            for (std::size_t i = 0; i + 1 < cut.size(); ++i) {
                // Each by a process of its own, as it were.
                shards.push_back(*bakeShard(cloth(), s, cut[i], cut[i + 1] - cut[i], static_cast<int>(i) + 1));
            }
            std::vector<MapFile> files;
            for (std::size_t i = shards.size(); i-- > 0;) files.push_back(*MapFile::open(shards[i], "shard"));
            const auto merged = merge(files);
            ASSERT_TRUE(merged) << merged.error().message;
            EXPECT_EQ(*merged, *whole);
        }
    }
}

TEST(Bake, FileHoldsWhatTheMakerFound) {
    BakeSettings s = settings(16);
    s.contents = static_cast<std::uint32_t>(MapContent::Mask) | static_cast<std::uint32_t>(MapContent::HitDistance) |
                 static_cast<std::uint32_t>(MapContent::Distance);
    const auto bytes = bakeShard(cloth(), s, 0, 3200, 2);
    ASSERT_TRUE(bytes);
    const auto file = MapFile::open(*bytes, "cloth.umvis");
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_TRUE(file->belongsTo(cloth().hash));
    EXPECT_TRUE(file->verify());
    EXPECT_EQ(*file->vertexRows(3200), cloth().vertexRow);
    EXPECT_EQ(file->header().mapping, s.mapping);
    EXPECT_TRUE(std::isinf(file->header().farShare));

    const auto scene = trace::RayScene::create(cloth().view(), trace::Guard::Exact, 1);
    trace::RayScene::Tracer tracer(**scene);
    const trace::DirectionPackets set = directionPackets(s.mapping);
    const MaskPacker packer(set);
    const std::uint32_t pixels = pixelCount(s.mapping);
    std::vector<std::uint8_t> blocked(set.packets()), mask(maskBytes(pixels));
    for (std::uint32_t row = 0; row < 3200; row += 97) {
        const trace::Origin o = origin(cloth(), row, DirectionFrame::Vertex);
        tracer.blocked(o, cloth().ownTriangles(o.position), set, std::numeric_limits<double>::infinity(), blocked);
        packer.pack(blocked, mask);
        const auto read = [&](MapContent content) {
            const std::size_t size = bytesPerRow(content, s.mapping);
            const Bytes block = *file->read(row / kRowsPerBlock, content);
            const auto at = std::span(block).subspan(row % kRowsPerBlock * size, size);
            return std::vector<std::uint8_t>(reinterpret_cast<const std::uint8_t*>(at.data()),
                                             reinterpret_cast<const std::uint8_t*>(at.data()) + size);
        };
        ASSERT_EQ(read(MapContent::Mask), mask);
        const auto distance = read(MapContent::Distance), hit = read(MapContent::HitDistance);
        for (std::uint32_t p = 0; p < pixels; ++p) {
            const auto half = [&](const std::vector<std::uint8_t>& from) {
                return fromHalf(static_cast<std::uint16_t>(from[2 * p] | from[2 * p + 1] << 8));
            };
            ASSERT_EQ(half(distance) > 0, isOpen(mask, p));
            ASSERT_EQ(std::isinf(half(hit)), isOpen(mask, p));
        }
    }
}

TEST(Bake, GridFindsTheSameBits) {
    for (const double far : {0.15, std::numeric_limits<double>::infinity()}) {
        BakeSettings s = settings(16);
        s.farShare = far;
        const auto rays = bakeShard(cloth(), s, 0, 3200, 2);
        s.maker = MapMaker::Grid;
        const auto grid = bakeShard(cloth(), s, 0, 3200, 2);
        ASSERT_TRUE(rays && grid);
        EXPECT_EQ(MapFile::open(*rays, "rays")->header().contentHash,
                  MapFile::open(*grid, "grid")->header().contentHash);
    }
}

TEST(Bake, ImpossibleSettingsAreRefused) {
    BakeSettings s = settings();
    s.farShare = 0.0;
    EXPECT_FALSE(check(s));
    s = settings();
    s.mapping.size = 7;
    EXPECT_FALSE(Baker::create(cloth(), s));
    s = settings();
    s.mapping = {MappingKind::Fibonacci, 64};
    s.contents = static_cast<std::uint32_t>(MapContent::Distance);
    EXPECT_FALSE(check(s));
    s = settings();
    s.contents = static_cast<std::uint32_t>(MapContent::Index);
    EXPECT_FALSE(check(s));  // no environment
    s = settings();
    s.maker = MapMaker::Gl;
    EXPECT_FALSE(Baker::create(cloth(), s));
    s.guard = trace::Guard::Fast;
    EXPECT_FALSE(check(s));
    s.maker = MapMaker::Grid;
    EXPECT_FALSE(check(s));
    s = settings();
    const auto baker = Baker::create(cloth(), s);
    for (const auto& [first, count] : std::vector<std::pair<std::uint64_t, std::uint64_t>>{
             {1, 1024}, {0, 1000}, {0, 4096}, {4096, 1}, {0, 0}, {1024, ~std::uint64_t{0}}}) {
        EXPECT_FALSE((*baker)->shard(first, count)) << first << " " << count;
    }
}

TEST(Half, RoundsToNearestEven) {
    for (std::uint32_t half = 0; half < 0x7c00; ++half) {
        const float value = fromHalf(static_cast<std::uint16_t>(half));
        EXPECT_EQ(toHalf(value), half);
        EXPECT_EQ(toHalf(-value), half | 0x8000);
        const float next = fromHalf(static_cast<std::uint16_t>(half + 1));
        if (std::isinf(next)) continue;
        const float middle = 0.5f * (value + next);  // exact in float
        EXPECT_EQ(toHalf(middle), half + (half & 1)) << value;
        EXPECT_EQ(toHalf(std::nextafter(middle, 0.0f)), half);
        EXPECT_EQ(toHalf(std::nextafter(middle, 1e30f)), half + 1);
    }
    EXPECT_EQ(toHalf(65519.0f), 0x7bff);
    EXPECT_EQ(toHalf(65520.0f), 0x7c00);
    EXPECT_EQ(toHalf(std::numeric_limits<float>::infinity()), 0x7c00);
    EXPECT_TRUE(std::isnan(fromHalf(toHalf(std::nanf("")))));
}

}  // namespace
}  // namespace umbriel::visibility
