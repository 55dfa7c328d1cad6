#include "common/scene/multi_field.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <set>

#include "common/scene/change_list.h"
#include "tests/support/random_scene.h"

namespace umbriel {
namespace {

std::size_t unsharedChunks(const MultiStorage& a, const MultiStorage& b) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.chunkCount(); ++i) count += !a.sharesChunk(i, b);
    return count;
}

std::vector<std::byte> contentOf(const MultiStorage& storage) {
    std::vector<std::byte> bytes(storage.byteSize());
    storage.read(0, bytes);
    return bytes;
}

TEST(MultiStorage, oneVertexOfAMillionCopiesOneChunk) {
    MultiStorage vertices(12);
    vertices.resize(1'000'000);
    for (std::size_t i = 0; i < vertices.size(); i += 100) {
        const glm::vec3 value(static_cast<float>(i));
        vertices.write(i, std::as_bytes(std::span(&value, 1)));
    }
    MultiStorage other = vertices;
    EXPECT_EQ(vertices.chunkCount(), 733u) << "1365 vertices of 12 bytes in 16 KiB";
    EXPECT_EQ(unsharedChunks(vertices, other), 0u);
    const glm::vec3 moved(-1);
    other.write(500'000, std::as_bytes(std::span(&moved, 1)));
    EXPECT_EQ(unsharedChunks(vertices, other), 1u);
    EXPECT_FALSE(vertices.equals(other));
    // Its own copy by now, so writing again costs nothing.
    const std::byte* address = other.element(500'001);
    other.write(500'001, std::as_bytes(std::span(&moved, 1)));
    EXPECT_EQ(other.element(500'001), address);
    other.copyFrom(vertices, 499'000, 3000);
    EXPECT_TRUE(vertices.equals(other));
    EXPECT_LE(unsharedChunks(vertices, other), 3u) << "chunks that lie inside the range are shared again";
}

TEST(MultiStorage, aShortFieldTakesOnlyItsElements) {
    MultiStorage three(12);
    three.resize(3);
    ASSERT_EQ(three.chunkCount(), 1u);
    EXPECT_EQ(three.chunk(0).size(), 36u);
}

TEST(MultiStorage, growingByMuchTakesOneChunkUntilItIsWritten) {
    MultiStorage zeros(4);
    zeros.resize(std::size_t{1} << 28);  // a GiB
    std::set<const std::byte*> chunks;
    for (std::size_t i = 0; i < zeros.chunkCount(); ++i) chunks.insert(zeros.chunk(i).data());
    EXPECT_LE(chunks.size(), 2u);
    const std::uint32_t one = 1;
    zeros.write(12345, std::as_bytes(std::span(&one, 1)));
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < 100'000; ++i) sum += *reinterpret_cast<const std::uint32_t*>(zeros.element(i));
    EXPECT_EQ(sum, 1u);
}

// Every block bears the hash of its bytes, whichever of them were kept from before.
bool hashesAreRight(const MultiStorage& storage) {
    for (std::size_t i = 0; i < storage.chunkCount(); ++i)
        for (std::size_t block = 0; block < storage.blocksOfChunk(i); ++block) {
            const auto rest = storage.chunk(i).subspan(block * Chunk::kBlockBytes);
            if (storage.blockHash(i, block) != hash128(rest.first(std::min(rest.size(), Chunk::kBlockBytes))))
                return false;
        }
    return true;
}

// Against a plain vector, with copies that must not notice what happens to the original.
RC_GTEST_PROP(MultiStorage, behavesLikeAVectorOfItsBytes, (std::uint64_t seed)) {
    test::Random random(seed);
    const auto elementSize = static_cast<std::uint32_t>(std::array{1, 4, 12, 24, 36, 128}[random.below(6)]);
    MultiStorage storage(elementSize);
    std::vector<std::byte> model;
    std::vector<std::pair<MultiStorage, std::vector<std::byte>>> copies;
    for (int step = 0; step < 30; ++step) {
        switch (random.below(5)) {
            case 0:
            case 1: {
                const std::size_t size = random.below(random.below(3) == 0 ? 60'000 / elementSize : 20);
                storage.resize(size);
                model.resize(size * elementSize);
                break;
            }
            case 2:
            case 3: {
                const std::size_t first = random.below(storage.size() + 1);
                const std::size_t count = random.below(storage.size() - first + 1);
                const auto bytes = random.bytes(count * elementSize);
                storage.write(first, bytes);
                std::copy(bytes.begin(), bytes.end(), model.begin() + static_cast<std::ptrdiff_t>(first * elementSize));
                RC_ASSERT(storage.holds(first, bytes));
                break;
            }
            default:
                if (!copies.empty() && random.below(2) == 0) {
                    const auto& [other, bytes] = copies[random.below(copies.size())];
                    const std::size_t common = std::min(other.size(), storage.size());
                    const std::size_t first = random.below(common + 1);
                    const std::size_t count = random.below(common - first + 1);
                    storage.copyFrom(other, first, count);
                    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(first * elementSize), count * elementSize,
                                model.begin() + static_cast<std::ptrdiff_t>(first * elementSize));
                } else
                    copies.emplace_back(storage, model);
        }
        RC_ASSERT(contentOf(storage) == model);
        RC_ASSERT(storage.holds(0, model));
        if (random.below(3) != 0) RC_ASSERT(hashesAreRight(storage));
        for (const auto& [copy, bytes] : copies) RC_ASSERT(contentOf(copy) == bytes && hashesAreRight(copy));
        MultiBuilder builder(elementSize, model.size());
        for (std::size_t at = 0; at < model.size();) {
            const std::size_t count = std::min<std::size_t>(1 + random.below(20'000), model.size() - at);
            builder.add(std::span(model).subspan(at, count));
            at += count;
        }
        RC_ASSERT(builder.missing() == 0u);
        const MultiStorage built = builder.take();
        RC_ASSERT(built.equals(storage) && hashesAreRight(built));
    }
}

TEST(MultiStorage, aLargeContentIsFilledInPlaceAndOutlivesItsBuilder) {
    constexpr std::size_t kBytes = 5'000'004;
    const auto valueAt = [](std::size_t i) { return static_cast<std::byte>(i * 7 + i / 251); };
    MultiStorage kept(12);
    {
        MultiBuilder builder(12, kBytes);
        for (std::size_t at = 0; builder.missing() > 0;) {
            std::array<std::span<std::byte>, 3> places;
            const std::size_t given = builder.room(places);
            std::size_t count = 0;
            for (std::size_t i = 0; i < given; ++i)
                for (std::size_t k = 0; k < places[i].size() && count < 20'000; ++k, ++count)
                    places[i][k] = valueAt(at++);
            builder.filled(count);
        }
        std::array<std::span<std::byte>, 3> places;
        EXPECT_EQ(builder.room(places), 0u);
        MultiStorage whole = builder.take();
        EXPECT_EQ(whole.byteSize(), kBytes);
        kept.resize(whole.size());
        kept.copyFrom(whole, 1365, whole.size() - 1365);
        const std::array<std::byte, 12> other{};
        whole.write(2000, other);  // in a chunk that the copy shares
    }
    std::size_t wrong = 0;
    for (std::size_t i = 1365 * 12; i < kBytes; ++i) wrong += kept.element(i / 12)[i % 12] != valueAt(i);
    EXPECT_EQ(wrong, 0u);
    EXPECT_TRUE(hashesAreRight(kept));
}

RC_GTEST_PROP(IndexRanges, areTheSetOfWhatWasAdded,
              (std::vector<std::pair<std::uint8_t, std::uint8_t>> additions, std::uint8_t limit)) {
    IndexRanges ranges;
    std::set<std::size_t> model;
    for (const auto& [first, count] : additions) {
        ranges.add(first, count % 16);
        for (std::size_t i = first; i < std::size_t{first} + count % 16; ++i) model.insert(i);
    }
    ranges.clampTo(limit);
    model.erase(model.lower_bound(limit), model.end());
    std::set<std::size_t> present;
    std::size_t end = 0;
    for (const IndexRange& range : ranges.ranges()) {
        RC_ASSERT(range.count > 0u);
        RC_ASSERT(&range == &ranges.ranges().front() || range.first > end);  // sorted, neither overlapping nor adjacent
        end = range.first + range.count;
        for (std::size_t i = range.first; i < end; ++i) present.insert(i);
    }
    RC_ASSERT(present == model);
    RC_ASSERT(ranges.elementCount() == model.size());
    RC_ASSERT(ranges.empty() == model.empty());
}

TEST(IndexRanges, beyondTheLimitTheSmallestGapsAreClosed) {
    IndexRanges ranges;
    std::set<std::size_t> model;
    for (std::size_t i = 0; i < 3 * IndexRanges::kMaxRanges; ++i) {
        const std::size_t first = i * 1000 + i * 7919 % 500;
        ranges.add(first, 3);
        for (std::size_t k = 0; k < 3; ++k) model.insert(first + k);
    }
    EXPECT_EQ(ranges.ranges().size(), IndexRanges::kMaxRanges);
    for (const std::size_t index : model) {
        const bool isIn = std::any_of(ranges.ranges().begin(), ranges.ranges().end(), [&](const IndexRange& range) {
            return index >= range.first && index < range.first + range.count;
        });
        ASSERT_TRUE(isIn) << index;
    }
    // One small gap among wide ones is the one that is closed.
    IndexRanges wide;
    for (std::size_t i = 0; i < IndexRanges::kMaxRanges; ++i) wide.add(i * 100, 1);
    wide.add(5002, 1);
    EXPECT_EQ(wide.ranges().size(), IndexRanges::kMaxRanges);
    EXPECT_EQ(wide.ranges()[50], (IndexRange{5000, 3}));
}

}  // namespace
}  // namespace umbriel
