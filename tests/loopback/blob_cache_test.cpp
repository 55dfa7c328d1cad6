#include "server/session/blob_cache.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <future>
#include <thread>

#include "client/session/cluster.h"
#include "common/scene/core_types.h"
#include "common/scene/nodes.h"
#include "server/session/blob_folder.h"
#include "server/session/render_server.h"
#include "tests/support/fake_renderer.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/wait_until.h"

namespace umbriel {
namespace {

namespace fs = std::filesystem;

wire::Blob blobOf(std::size_t bytes, int value) {
    MultiStorage data(4);
    data.resize(bytes / 4);
    std::vector<int> values(bytes / 4);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = value + static_cast<int>(i);
    data.write(0, std::as_bytes(std::span(values)));
    return {{wire::hashOfBlob(data), 4, data.byteSize()}, data};
}

TEST(BlobCache, DropsWhatWasUsedLongestAgoAndOnlyWhenTrimmed) {
    BlobCache cache(250'000);
    std::vector<wire::Blob> blobs;
    for (int i = 0; i < 4; ++i) {
        blobs.push_back(blobOf(100'000, i * 1000));
        cache.put(blobs.back());
    }
    EXPECT_EQ(cache.bytes(), 400'000u) << "a frame may need all of them at once";
    cache.put(blobs[0]);
    EXPECT_EQ(cache.bytes(), 400'000u) << "what is there is not counted twice";
    cache.touch(blobs[0].ref.hash);
    cache.touch(Hash128{1, 2});
    cache.trim();
    EXPECT_EQ(cache.bytes(), 200'000u);
    EXPECT_TRUE(cache.find(blobs[0].ref.hash)) << "used last";
    EXPECT_FALSE(cache.find(blobs[1].ref.hash));
    EXPECT_FALSE(cache.find(blobs[2].ref.hash));
    EXPECT_TRUE(cache.find(blobs[3].ref.hash));
    cache.put(blobOf(1'000'000, 7));
    cache.trim();
    EXPECT_EQ(cache.bytes(), 0u) << "what is larger than the budget alone is not kept";
}

struct Folder : testing::Test {
    BlobFolder open(std::uint64_t limit = 1 << 30) {
        auto folder = BlobFolder::open(path, limit);
        EXPECT_TRUE(folder) << folder.error().message;
        return std::move(*folder);
    }
    std::vector<fs::path> files() const {
        std::vector<fs::path> all;
        for (const auto& entry : fs::directory_iterator(path)) all.push_back(entry.path());
        return all;
    }
    std::uint64_t bytes() const {
        std::uint64_t sum = 0;
        for (const auto& file : files()) sum += fs::file_size(file);
        return sum;
    }
    test::TemporaryFolder own;
    fs::path path = own / "blobs";
};

using BlobFolderTest = Folder;

TEST_F(BlobFolderTest, GivesBackWhatWasStoredAlsoToAnotherServer) {
    const auto blob = blobOf(1'000'000, 5);
    {
        auto folder = open();
        EXPECT_FALSE(folder.load(blob.ref));
        folder.store(blob);
        folder.store(blob);
    }
    EXPECT_EQ(files().size(), 1u);
    auto other = open();
    EXPECT_TRUE(other.has(blob.ref));
    const auto loaded = other.load(blob.ref);
    ASSERT_TRUE(loaded);
    EXPECT_EQ(loaded->ref, blob.ref);
    EXPECT_TRUE(loaded->data.equals(blob.data));
}

TEST_F(BlobFolderTest, ADamagedFileIsDeletedAndCanBeStoredAgain) {
    const auto blob = blobOf(100'000, 5);
    auto folder = open();
    const auto damage = [&](int how) {
        folder.store(blob);
        const fs::path file = files().front();
        if (how == 0) {
            std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
            stream.seekp(70'001);
            stream.put('\x55');
        } else {
            fs::resize_file(file, how == 1 ? 50'000 : 100'004);
        }
    };
    for (int how = 0; how < 3; ++how) {
        damage(how);
        EXPECT_FALSE(folder.load(blob.ref)) << how;
        EXPECT_TRUE(files().empty()) << how;
    }
    folder.store(blob);
    EXPECT_TRUE(folder.load(blob.ref));
}

TEST_F(BlobFolderTest, StaysWithinItsLimitAndKeepsWhatIsUsed) {
    auto folder = open(1'000'000);
    const auto kept = blobOf(100'000, -1);
    folder.store(kept);
    for (int i = 0; i < 40; ++i) {
        folder.store(blobOf(100'000, i * 1000));
        ASSERT_LE(bytes(), 1'000'000u);
        // An hour passes; a file system's own clock may tick in steps as long as all of this takes.
        for (const auto& file : files()) fs::last_write_time(file, fs::last_write_time(file) - std::chrono::hours(1));
        ASSERT_TRUE(folder.load(kept.ref)) << "after " << i;
    }
    EXPECT_GE(bytes(), 800'000u);
    folder.store(blobOf(1'100'000, 3));
    EXPECT_LE(bytes(), 1'000'000u) << "too large to be kept at all";
}

TEST_F(BlobFolderTest, ServersThatShareItNeverSeeHalfAFile) {
    std::vector<std::thread> servers;
    std::atomic<int> wrong = 0;
    for (int n = 0; n < 4; ++n)
        servers.emplace_back([&, n] {
            auto folder = open(600'000);
            for (int i = 0; i < 60; ++i) {
                const auto blob = blobOf(100'000, (i + n * 3) % 10 * 1000);
                if (i % 2) folder.store(blob);
                if (const auto loaded = folder.load(blob.ref); loaded && !loaded->data.equals(blob.data)) ++wrong;
                if (!folder.isWritable()) ++wrong;
            }
        });
    for (auto& server : servers) server.join();
    EXPECT_EQ(wrong, 0);
    for (const auto& file : files()) EXPECT_EQ(file.extension(), ".blob");
}

TEST_F(BlobFolderTest, WhatKilledServersLeftIsTakenAway) {
    open();
    const fs::path old = path / "1-2-3.part";
    const fs::path young = path / "1-2-4.part";
    for (const auto& file : {old, young}) std::ofstream(file) << "half";
    fs::last_write_time(old, fs::file_time_type::clock::now() - std::chrono::hours(1));
    open();
    EXPECT_FALSE(fs::exists(old));
    EXPECT_TRUE(fs::exists(young)) << "somebody may be writing it";
}

// A full disk, as far as a process can make one: files may not grow beyond a limit.
TEST_F(BlobFolderTest, AFullDiskCostsTheCacheAndNothingElse) {
    auto folder = open();
    const auto small = blobOf(4'000, 1);
    folder.store(small);
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit full{50'000, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
    folder.store(blobOf(1'000'000, 2));
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, handler);
    EXPECT_FALSE(folder.isWritable());
    EXPECT_EQ(files().size(), 1u) << "nothing half written stays";
    EXPECT_TRUE(folder.load(small.ref)) << "what is there is still of use";
}

TEST_F(BlobFolderTest, OneThatCannotBeUsedIsNamed) {
    std::ofstream(path) << "a file";
    const auto folder = BlobFolder::open(path / "below", 1);
    ASSERT_FALSE(folder);
    EXPECT_NE(folder.error().message.find(path.string()), std::string::npos) << folder.error().message;
}

// A wall of one server, which is a new one each time: what it has is in the folder.
struct Rejoin : Folder {
    Rejoin() {
        registerCoreTypes(types);
        for (int n = 0; n < 4; ++n) {
            const auto geometry = scene.create<Geometry>();
            std::vector<glm::vec3> positions(100'000, glm::vec3(static_cast<float>(n)));
            scene.edit(geometry).assign<&Geometry::positions>(positions);
        }
    }
    std::uint64_t bytesOfFirstFrame() {
        test::FakeRenderer renderer;
        std::promise<std::uint16_t> port;
        RenderServerOptions options;
        options.name = "left";
        options.build = "test";
        options.blobCache = path;
        options.listening = [&port](std::uint16_t value) { port.set_value(value); };
        RenderServer server(std::move(options), types, renderer);
        std::thread thread([&] { EXPECT_TRUE(server.run()); });
        std::uint64_t bytes = 0;
        {
            ClusterOptions wall;
            wall.connectTimeout = test::kPatience;
            wall.servers = {{"left", "127.0.0.1", port.get_future().get()}};
            auto cluster = Cluster::connect(wall, types, {{0, {0, 0, 10, 10}, Eye::Mono}});
            EXPECT_TRUE(cluster);
            WallViews views;
            views.wall = {10, 10};
            views.views.emplace_back();
            views.views.back().region = {0, 0, 10, 10};
            const auto frame = (*cluster)->frame(scene, views, 0.0, false);
            EXPECT_TRUE(frame) << frame.error().message;
            if (frame) bytes = frame->servers[0].bytes;
        }
        server.stop();
        thread.join();
        return bytes;
    }
    TypeRegistry types;
    IdSource ids;
    Aspect scene{types, ids};
};

TEST_F(Rejoin, OnlyWhatTheFolderLacksIsSentAgain) {
    EXPECT_GT(bytesOfFirstFrame(), 4'800'000u);
    EXPECT_EQ(files().size(), 4u);
    EXPECT_LT(bytesOfFirstFrame(), 20'000u);
    {
        std::fstream stream(files().front(), std::ios::in | std::ios::out | std::ios::binary);
        stream.seekp(1'000'000);
        stream.put('\x55');
    }
    const std::uint64_t again = bytesOfFirstFrame();
    EXPECT_GT(again, 1'200'000u) << "a damaged one is fetched";
    EXPECT_LT(again, 1'300'000u);
    EXPECT_LT(bytesOfFirstFrame(), 20'000u);
    fs::remove(files().front());
    EXPECT_LT(bytesOfFirstFrame(), 1'300'000u);
}

}  // namespace
}  // namespace umbriel
