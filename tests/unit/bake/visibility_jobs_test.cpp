#include "server/bake/visibility_jobs.h"

#include <gtest/gtest.h>

#include "common/visibility/bake_job.h"
#include "common/visibility/mesh.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel {
namespace {

using namespace visibility;

template <class Element>
wire::Blob blobOf(const std::vector<Element>& elements, std::uint64_t name) {
    wire::Blob blob{{}, MultiStorage(sizeof(Element))};
    blob.data.resize(elements.size());
    blob.data.write(0, std::as_bytes(std::span(elements)));
    blob.ref = {{name, 0}, sizeof(Element), blob.data.byteSize()};
    return blob;
}

class Work final : public JobWork {
 public:
    Bytes description;
    std::vector<wire::Blob> contents;
    int slicesLeft = 1 << 30;
    int slices = 0;
    std::optional<Duration> cost;
    std::span<const std::byte> payload() const override { return description; }
    std::span<const wire::Blob> blobs() const override { return contents; }
    bool alive(float) override {
        ++slices;
        return --slicesLeft >= 0;
    }
    void setProcessorTime(Duration time) override { cost = time; }
};

class VisibilityJobs : public ::testing::Test {
 protected:
    VisibilityJobs() {
        job.settings.mapping = {MappingKind::HemiSphere, 32};
        job.meshHash = mesh.hash;
        job.directionHash = directionHash(job.settings.mapping);
        work.contents = {blobOf(loaded.positions, 1), blobOf(loaded.indices, 2)};
    }
    Result<std::vector<std::byte>> run(const char* kind) {
        work.description = encodeBakeJob(job);
        return handlers.at(kind)(work);
    }
    Result<std::vector<std::byte>> shard(std::uint64_t first, std::uint64_t count) {
        job.firstRow = first;
        job.rowCount = count;
        return run(kShardJob);
    }

    Mesh loaded = test::cloth(50, 50);
    BakeMesh mesh = *prepare(loaded);
    BakeJob job;
    Work work;
    std::map<std::string, JobHandler> handlers = visibilityJobs(3);
};

TEST_F(VisibilityJobs, AShardIsWhatTheLibraryMakes) {
    const auto ready = run(kPrepareJob);
    ASSERT_TRUE(ready) << ready.error().message;
    const auto readiness = decodeReadiness(*ready);
    ASSERT_TRUE(readiness);
    EXPECT_EQ(readiness->slots, 3u);
    EXPECT_EQ(readiness->meshHash, mesh.hash);
    const auto baker = Baker::create(mesh, job.settings);
    EXPECT_EQ(readiness->bakeClass, (*baker)->header().bakeClass);
    const std::uint64_t rows = mesh.rows.size();
    ASSERT_GT(rows, 2048u);
    for (const auto& [first, count] : {std::pair<std::uint64_t, std::uint64_t>{0, 1024}, {1024, 1024}, {0, rows}}) {
        const auto bytes = shard(first, count);
        ASSERT_TRUE(bytes) << bytes.error().message;
        EXPECT_EQ(*bytes, *(*baker)->shard(first, count)) << first;
    }
    // Slices of 32 rows at 1024 directions: of two blocks, and of all.
    EXPECT_GE(work.slices, static_cast<int>(64 + rows / 32));
}

TEST_F(VisibilityJobs, AStoppedShardEndsWithinASlice) {
    work.slicesLeft = 5;
    const auto stopped = shard(0, 2048);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(work.slices, 6);
}

TEST_F(VisibilityJobs, WhatCannotBeIsRefusedWithAReason) {
    const std::uint64_t rows = mesh.rows.size();
    const std::vector<std::pair<std::uint64_t, std::uint64_t>> noShards{
        {0, 0}, {1, 1024}, {0, 1000}, {0, rows + 1}, {1 << 20, 1024}, {1024, ~std::uint64_t{0}}};
    for (const auto& [first, count] : noShards) EXPECT_FALSE(shard(first, count)) << first << " " << count;
    job.meshHash = {1, 1};
    EXPECT_NE(run(kPrepareJob).error().message.find("differently"), std::string::npos);
    job.meshHash = mesh.hash;
    job.directionHash = {1, 1};
    EXPECT_FALSE(run(kPrepareJob));
    job.directionHash = directionHash(job.settings.mapping);

    const auto sound = work.contents;
    work.contents.pop_back();
    EXPECT_FALSE(run(kPrepareJob));
    work.contents = {sound[1], sound[0]};
    EXPECT_FALSE(run(kPrepareJob));
    auto indices = loaded.indices;
    indices[7] = 1'000'000'000;
    work.contents = {sound[0], blobOf(indices, 3)};
    EXPECT_FALSE(run(kPrepareJob));
    auto positions = loaded.positions;
    positions[3].y = std::numeric_limits<float>::quiet_NaN();
    work.contents = {blobOf(positions, 4), sound[1]};
    EXPECT_FALSE(run(kPrepareJob));
    work.contents = {blobOf(std::vector<glm::vec3>(), 5), blobOf(std::vector<std::uint32_t>(), 6)};
    EXPECT_FALSE(run(kPrepareJob));
    work.description = Bytes(10);
    EXPECT_FALSE(handlers.at(kShardJob)(work));
    // It can still bake.
    work.contents = sound;
    EXPECT_TRUE(shard(0, 1024));
}

}  // namespace
}  // namespace umbriel
