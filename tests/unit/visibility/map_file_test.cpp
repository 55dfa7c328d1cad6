#include "common/visibility/map_file.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstring>
#include <iterator>

#include "common/visibility/bake.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel::visibility {
namespace {

struct Sample {
    BakeMesh mesh;
    Bytes whole;
    std::vector<Bytes> shards;
};

const Sample& sample() {
    static const Sample made = [] {
        Sample s{*prepare(test::cloth(60, 40)), {}, {}};  // 2400 rows
        BakeSettings settings;
        settings.mapping = {MappingKind::HemiSphere, 8};
        settings.contents =
            static_cast<std::uint32_t>(MapContent::Mask) | static_cast<std::uint32_t>(MapContent::Distance);
        const auto baker = Baker::create(s.mesh, settings);
        s.whole = *(*baker)->shard(0, 2400);
        for (const std::uint64_t first : {0, 1024, 2048}) {
            s.shards.push_back(*(*baker)->shard(first, std::min<std::uint64_t>(1024, 2400 - first)));
        }
        return s;
    }();
    return made;
}

// A reader that accepts must give back what was baked.
bool readsAsTheSame(std::span<const std::byte> bytes) {
    const auto file = MapFile::open(bytes, "damaged");
    if (!file || !file->verify() || !file->belongsTo(sample().mesh.hash)) return false;
    const auto rows = file->vertexRows(2400);
    if (!rows || *rows != sample().mesh.vertexRow) return false;
    const auto good = MapFile::open(sample().whole, "good");
    for (std::size_t block = 0; block < 3; ++block) {
        for (const MapContent content : {MapContent::Mask, MapContent::Distance}) {
            const auto raw = file->read(block, content);
            if (!raw || *raw != *good->read(block, content)) return false;
        }
    }
    return true;
}

TEST(MapFile, HeaderIsWhereTheFormatSays) {
    const Bytes& f = sample().whole;
    const auto u32 = [&](std::size_t at) {
        std::uint32_t value;
        std::memcpy(&value, &f[at], 4);
        return value;
    };
    EXPECT_EQ(std::memcmp(f.data(), "UMVIS\x1a\r\n", 8), 0);
    EXPECT_EQ(u32(8), 1u);            // version
    EXPECT_EQ(u32(12), 256u);         // bytes of the header
    EXPECT_EQ(u32(16), 2400u);        // rows
    EXPECT_EQ(u32(40), 2400u);        // vertices
    EXPECT_EQ(u32(48), 2u);           // HemiSphere
    EXPECT_EQ(u32(52), 8u);           // its size
    EXPECT_EQ(u32(64), 0x00000100u);  // vertex frame, 1 is open, lowest bit first, exact
    EXPECT_EQ(u32(68), 3u);           // mask and distance
    EXPECT_EQ(u32(80), 64u);          // pixels
    EXPECT_EQ(u32(84), 1024u);        // rows in a block
    EXPECT_EQ(u32(216), 6u);          // blocks
    EXPECT_EQ(u32(232), f.size());
    EXPECT_TRUE(readsAsTheSame(f));
}

RC_GTEST_PROP(MapFile, EveryFlippedBitIsNoticed, ()) {
    Bytes damaged = sample().whole;
    const auto at = *rc::gen::inRange<std::size_t>(0, damaged.size());
    damaged[at] ^= static_cast<std::byte>(1 << *rc::gen::inRange(0, 8));
    RC_ASSERT(!readsAsTheSame(damaged));
}

TEST(MapFile, EveryFlippedByteOfTheHeaderIsNoticed) {
    for (std::size_t at = 0; at < 256; ++at) {
        Bytes damaged = sample().whole;
        damaged[at] ^= std::byte{0x40};
        EXPECT_FALSE(MapFile::open(damaged, "damaged")) << at;
    }
}

TEST(MapFile, EveryTruncationIsNoticed) {
    const Bytes& f = sample().whole;
    for (std::size_t size = 0; size < f.size(); size += size < 600 ? 1 : 997) {
        EXPECT_FALSE(MapFile::open(std::span(f).first(size), "short")) << size;
    }
    Bytes longer = f;
    longer.push_back(std::byte{0});
    EXPECT_FALSE(MapFile::open(longer, "long"));
}

// A file whose checksums are right and whose counts lie: nothing may be believed that the bytes do not hold.
TEST(MapFile, LiesAboutCountsAreRefusedBeforeMemoryIsTaken) {
    const auto lie = [](std::size_t at, std::uint64_t value, std::size_t size) {
        Bytes f = sample().whole;
        std::memcpy(&f[at], &value, size);
        // The checksum is made right again, over the tables where the liar says they are.
        const std::size_t head = 256 + 6 * 48;
        std::uint64_t vertexBytes;
        std::memcpy(&vertexBytes, &f[224], 8);
        const std::size_t covered =
            std::min<std::size_t>(f.size(), head + std::min<std::uint64_t>(vertexBytes, f.size() - head));
        std::memset(&f[248], 0, 8);
        const std::uint64_t sum = hash64(std::span(f).first(covered));
        std::memcpy(&f[248], &sum, 8);
        return f;
    };
    struct Field {
        const char* what;
        std::size_t at, size;
        std::uint64_t value;
    };
    for (const Field& field : std::vector<Field>{{"rows", 16, 8, 1ull << 40},
                                                 {"rows", 16, 8, 1ull << 31},
                                                 {"rows of the file", 32, 8, 1ull << 31},
                                                 {"first row", 24, 8, 1024},
                                                 {"vertices", 40, 8, 1ull << 40},
                                                 {"size", 52, 4, 512},
                                                 {"size", 52, 4, 0xfffffffe},
                                                 {"contents", 68, 4, 0},
                                                 {"contents", 68, 4, 15},
                                                 {"far", 72, 8, 0},
                                                 {"pixels", 80, 4, 1u << 30},
                                                 {"rows in a block", 84, 4, 1u << 30},
                                                 {"blocks", 216, 8, 1ull << 60},
                                                 {"vertex table", 224, 8, ~0ull},
                                                 {"file", 232, 8, 1ull << 60},
                                                 {"offset of a block", 256, 8, ~0ull},
                                                 {"bytes of a block", 264, 8, ~0ull},
                                                 {"raw bytes of a block", 272, 8, 1ull << 40},
                                                 {"content of a block", 296, 4, 2},
                                                 {"rows of a block", 300, 4, 1u << 30}}) {
        EXPECT_FALSE(MapFile::open(lie(field.at, field.value, field.size), "liar")) << field.what;
    }
    // More vertices than there are: the caller's number decides.
    const Bytes f = lie(40, 1ull << 31, 8);
    const auto file = MapFile::open(f, "liar");
    EXPECT_TRUE(!file || !file->vertexRows(2400));
    // Who has no mesh to compare with finds the table of another length.
    EXPECT_TRUE(!file || !file->verify());
}

TEST(MapFile, ATableThatNamesRowsBeyondTheMeshIsNotSound) {
    const auto baker = Baker::create(sample().mesh, BakeSettings());
    std::vector<EncodedBlock> blocks;
    for (std::uint32_t block = 0; block < 3; ++block)
        std::ranges::move((*baker)->block(block), std::back_inserter(blocks));
    const auto sound = [&](std::size_t vertex, std::uint32_t row) {
        std::vector<std::uint32_t> rows = sample().mesh.vertexRow;
        rows[vertex] = row;
        const Bytes file = *assembleShard((*baker)->header(), rows, blocks);
        return static_cast<bool>(MapFile::open(file, "table")->verify());
    };
    EXPECT_TRUE(sound(0, kNoRow));
    EXPECT_TRUE(sound(2399, 2399));
    EXPECT_FALSE(sound(0, 2400));
    EXPECT_FALSE(sound(2399, kNoRow - 1));
}

TEST(MapFile, AnotherMeshIsRefusedInWords) {
    const auto file = MapFile::open(sample().whole, "dress.umvis");
    const auto other = prepare(test::plate(3));
    const auto answer = file->belongsTo(other->hash);
    ASSERT_FALSE(answer);
    EXPECT_NE(answer.error().message.find("dress.umvis: made for another mesh"), std::string::npos);
    EXPECT_FALSE(MapFile::open(std::as_bytes(std::span("#?RADIANCE")), "sky.hdr"));
}

TEST(MapFile, ShardsMustFitTogether) {
    const auto open = [](const Bytes& bytes) { return *MapFile::open(bytes, "shard"); };
    const auto& s = sample().shards;
    EXPECT_EQ(*merge(std::vector{open(s[2]), open(s[0]), open(s[1])}), sample().whole);
    EXPECT_FALSE(merge(std::vector<MapFile>{}));
    EXPECT_FALSE(merge(std::vector{open(s[0]), open(s[1])}));  // the end is missing
    EXPECT_FALSE(merge(std::vector{open(s[1]), open(s[2])}));  // the beginning
    EXPECT_FALSE(merge(std::vector{open(s[0]), open(s[2])}));  // the middle
    EXPECT_FALSE(merge(std::vector{open(s[0]), open(s[1]), open(s[1]), open(s[2])}));
    EXPECT_FALSE(open(s[1]).vertexRows(2400));

    BakeSettings other;
    other.mapping = {MappingKind::HemiSphere, 8};
    other.contents = 3;
    other.farShare = 0.5;
    const Bytes far = *bakeShard(sample().mesh, other, 1024, 1024);
    EXPECT_FALSE(merge(std::vector{open(s[0]), open(far), open(s[2])}));
    // Said of another bake first, whatever its rows are and whoever baked it.
    MapHeader stranger = MapFile::open(far, "far")->header();
    stranger.bakeClass = "another machine";
    const auto elsewhere = Baker::create(sample().mesh, other);
    for (const std::uint64_t row : {0, 1024, 2048}) {
        stranger.firstRow = row;
        stranger.rowCount = std::min<std::uint64_t>(1024, 2400 - row);
        const Bytes part = *assembleShard(stranger, sample().mesh.vertexRow,
                                          (*elsewhere)->block(static_cast<std::uint32_t>(row / 1024)));
        const auto refused = merge(std::vector{open(s[0]), open(part), open(s[2])});
        ASSERT_FALSE(refused);
        EXPECT_NE(refused.error().message.find("not of the same bake"), std::string::npos) << refused.error().message;
    }

    // Of another class: only when asked for.
    other.farShare = BakeSettings().farShare;
    const auto baker = Baker::create(sample().mesh, other);
    MapHeader header = (*baker)->header();
    header.bakeClass = "another machine";
    header.firstRow = 1024;
    header.rowCount = 1024;
    const Bytes foreign = *assembleShard(header, {}, (*baker)->block(1));
    const std::vector mixed{open(s[0]), open(foreign), open(s[2])};
    EXPECT_FALSE(merge(mixed));
    const auto merged = merge(mixed, true);
    ASSERT_TRUE(merged);
    EXPECT_EQ(MapFile::open(*merged, "mixed")->header().bakeClass, "mixed");
    EXPECT_EQ(MapFile::open(*merged, "mixed")->header().contentHash, open(sample().whole).header().contentHash);
}

}  // namespace
}  // namespace umbriel::visibility
