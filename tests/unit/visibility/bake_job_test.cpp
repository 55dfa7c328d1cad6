#include "common/visibility/bake_job.h"

#include <gtest/gtest.h>

#include <limits>

namespace umbriel::visibility {
namespace {

BakeJob sample() {
    BakeJob job;
    job.settings.mapping = {MappingKind::SinglePlane, 16, 1.5};
    job.settings.guard = trace::Guard::FastFan;
    job.settings.farShare = 0.25;
    job.settings.contents =
        static_cast<std::uint32_t>(MapContent::Mask) | static_cast<std::uint32_t>(MapContent::Index);
    job.settings.environment = {64, 32};
    job.meshHash = {1, 2};
    job.directionHash = {3, 4};
    job.firstRow = 2048;
    job.rowCount = 1024;
    return job;
}

TEST(BakeJob, ComesBackAsItWas) {
    const Bytes bytes = encodeBakeJob(sample());
    const auto job = decodeBakeJob(bytes);
    ASSERT_TRUE(job) << job.error().message;
    EXPECT_EQ(encodeBakeJob(*job), bytes);
    EXPECT_EQ(job->settings.mapping.fovy, 1.5);
    EXPECT_EQ(job->settings.guard, trace::Guard::FastFan);
    EXPECT_EQ(job->meshHash, (Hash128{1, 2}));
    EXPECT_EQ(job->firstRow, 2048u);
}

TEST(BakeJob, AnyOtherLengthIsRefused) {
    Bytes bytes = encodeBakeJob(sample());
    for (std::size_t size = 0; size < bytes.size(); ++size)
        EXPECT_FALSE(decodeBakeJob(std::span(bytes).first(size))) << size;
    bytes.push_back({});
    EXPECT_FALSE(decodeBakeJob(bytes));
}

// What is taken is possible: nobody asks for a mapping that would fill the memory.
TEST(BakeJob, FlippedBitsAreRefusedOrMakePossibleSettings) {
    const Bytes bytes = encodeBakeJob(sample());
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        Bytes flipped = bytes;
        flipped[bit / 8] ^= std::byte{1} << (bit % 8);
        const auto job = decodeBakeJob(flipped);
        if (job) {
            EXPECT_TRUE(check(job->settings)) << bit;
        }
    }
    BakeJob job = sample();
    job.settings.farShare = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(decodeBakeJob(encodeBakeJob(job)));
    job.settings.farShare = -1.0;
    EXPECT_FALSE(decodeBakeJob(encodeBakeJob(job)));
}

TEST(BakeReadiness, ComesBackAsItWasAndNonsenseIsRefused) {
    const BakeReadiness ready{"Embree 3 avx2", 16, {1, 2}, {3, 4}};
    const Bytes bytes = encodeReadiness(ready);
    const auto back = decodeReadiness(bytes);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->bakeClass, ready.bakeClass);
    EXPECT_EQ(back->slots, 16u);
    EXPECT_EQ(back->meshHash, ready.meshHash);
    const std::size_t withoutText = bytes.size() - ready.bakeClass.size();
    for (std::size_t size = 0; size <= withoutText; ++size)
        EXPECT_FALSE(decodeReadiness(std::span(bytes).first(size))) << size;
    EXPECT_FALSE(decodeReadiness(encodeReadiness({"class", 0, {}, {}})));
    EXPECT_FALSE(decodeReadiness(encodeReadiness({"class", 1u << 30, {}, {}})));
    EXPECT_FALSE(decodeReadiness(encodeReadiness({"line\nbreak", 1, {}, {}})));
    EXPECT_FALSE(decodeReadiness(encodeReadiness({std::string(64, 'x'), 1, {}, {}})));
}

}  // namespace
}  // namespace umbriel::visibility
