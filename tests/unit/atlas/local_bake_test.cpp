#include "client/bake/local_bake.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <random>
#include <thread>

#include "client/bake/ledger.h"
#include "client/bake/sha256.h"
#include "common/visibility/map_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel {
namespace {

namespace fs = std::filesystem;
using namespace visibility;

std::string contentOf(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void writeContent(const fs::path& path, const std::string& content) {
    std::ofstream(path, std::ios::binary) << content;
}

// A mesh of 8 blocks, and a folder of the test's own.
class LocalBake : public ::testing::Test {
 protected:
    LocalBake() { settings.mapping = {MappingKind::HemiSphere, 8}; }

    Result<LocalBakeOutcome> bake(const std::string& name, LocalBakeOptions options = {}) {
        options.out = folder / name;
        if (options.threads == 0) options.threads = 2;
        return bakeLocally(mesh, settings, options);
    }
    std::string baked(const std::string& name, const LocalBakeOptions& options = {}) {
        const auto outcome = bake(name, options);
        EXPECT_TRUE(outcome) << outcome.error().message;
        return contentOf(folder / name);
    }
    // The file as one call of the library makes it.
    std::string expected() {
        const auto bytes = bakeShard(mesh, settings, 0, mesh.rows.size(), 1);
        return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
    }
    // When a bake is killed: so long after so many blocks are done.
    struct Moment {
        std::uint64_t blocks = ~std::uint64_t{0};
        std::chrono::microseconds later{0};
    };
    // Bakes in a process of its own, which kills itself; its exit code, or -1.
    int bakeAndKill(const std::string& name, LocalBakeOptions options, Moment moment) {
        const pid_t child = ::fork();
        if (child == 0) {
            options.progress = [&](std::uint64_t done, std::uint64_t) {
                if (done != moment.blocks) return;
                const auto kill = [later = moment.later] {
                    std::this_thread::sleep_for(later);
                    ::kill(::getpid(), SIGKILL);
                };
                if (moment.later.count() == 0) kill();
                std::thread(kill).detach();
            };
            ::_exit(bake(name, options) ? 0 : 1);
        }
        int status = 0;
        ::waitpid(child, &status, 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    std::vector<std::string> names() const {
        std::vector<std::string> found;
        for (const auto& entry : fs::recursive_directory_iterator(folder.path()))
            found.push_back(entry.path().filename());
        return found;
    }

    umbriel::test::TemporaryFolder folder;
    BakeMesh mesh = *prepare(visibility::test::cloth(100, 80));
    BakeSettings settings;
};

TEST(Sha256Test, PublishedValues) {
    Sha256 sha;
    const std::string text = "abc";
    sha.add(std::as_bytes(std::span(text)));
    EXPECT_EQ(sha.finish(), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(Sha256().finish(), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST_F(LocalBake, SameBytesWhateverThreadsAndShards) {
    const std::string whole = expected();
    for (const int threads : {1, 2, 5}) {
        for (const std::uint32_t shards : {0u, 1u, 3u, 100u}) {
            const auto outcome = bake("maps.umvis", {.threads = threads, .shards = shards});
            ASSERT_TRUE(outcome) << outcome.error().message;
            EXPECT_EQ(contentOf(folder / "maps.umvis"), whole) << threads << " threads, " << shards << " shards";
            EXPECT_EQ(outcome->rays, mesh.rows.size() * pixelCount(settings.mapping));
            Sha256 sha;
            sha.add(std::as_bytes(std::span(whole)));
            EXPECT_EQ(outcome->sha256, sha.finish());
        }
    }
    EXPECT_EQ(names(), std::vector<std::string>{"maps.umvis"});
}

TEST_F(LocalBake, PartsMergeToTheSameBytes) {
    const std::string whole = expected();
    for (const std::uint32_t count : {1u, 3u, 7u}) {
        std::vector<fs::path> parts;
        for (std::uint32_t i = count; i-- > 0;) {
            const std::string name = "part" + std::to_string(i);
            baked(name, {.threads = 1 + static_cast<int>(i % 2), .part = ShardPart{i, count}});
            parts.push_back(folder / name);
        }
        const auto merged = mergeFiles(parts, folder / "merged.umvis", false);
        ASSERT_TRUE(merged) << merged.error().message;
        EXPECT_EQ(contentOf(folder / "merged.umvis"), whole) << count;
    }
    EXPECT_FALSE(bake("x", {.part = ShardPart{3, 3}}));
    EXPECT_FALSE(bake("x", {.part = ShardPart{0, 1000}}));
    EXPECT_FALSE(fs::exists(folder / "x"));
}

// No bake in this process before the forks: threads of libraries do not survive them.
TEST_F(LocalBake, KilledAtAnyMomentAndResumedIsTheSameFile) {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "forks, and starts threads in the child, which the thread sanitizer cannot follow";
#endif
    ASSERT_EQ(bakeAndKill("whole.umvis", {}, {}), 0);
    const std::string whole = contentOf(folder / "whole.umvis");
    std::mt19937 random(6);
    for (std::uint64_t trial = 0; trial < 6; ++trial) {
        const std::string name = "killed" + std::to_string(trial);
        const auto killed = [&](int threads, Moment moment) {
            const int code = bakeAndKill(name, {.threads = threads, .shards = 8, .resume = true}, moment);
            // Whole or not at all.
            if (fs::exists(folder / name)) {
                EXPECT_EQ(contentOf(folder / name), whole);
            }
            EXPECT_TRUE(code == 0 || code == -1) << code;
            return code != 0;
        };
        // Among the first six of eight blocks, for sure; then wherever it is by then, if it has not ended; then never.
        ASSERT_TRUE(killed(1, {trial}));
        bool isOpen = true;
        for (int threads = 1; isOpen && threads <= 3; ++threads)
            isOpen = killed(threads, {0, std::chrono::microseconds(1 + random() % 20'000)});
        if (isOpen) {
            EXPECT_FALSE(killed(2, {}));
        }
        EXPECT_EQ(contentOf(folder / name), whole);
        EXPECT_FALSE(fs::exists(folder / (name + ".bake"))) << testing::PrintToString(names());
    }
}

// An interrupted bake: everything is done but shard 1, which is begun, and shard 2, whose file is damaged.
TEST_F(LocalBake, ResumeBakesOnlyWhatIsMissingOrDamaged) {
    const std::string whole = expected();
    // A folder in place of the file stops the bake after its shards are written.
    LocalBakeOptions options{
        .shards = 4, .progress = [&](std::uint64_t, std::uint64_t) { fs::create_directory(folder / "maps.umvis"); }};
    ASSERT_FALSE(bake("maps.umvis", options));
    fs::remove(folder / "maps.umvis");
    const auto refused = bake("maps.umvis", {.shards = 4});
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("--resume"), std::string::npos);
    const fs::path damaged = folder / "maps.umvis.bake" / "shard-000002.umvis";
    std::string bytes = contentOf(damaged);
    bytes[bytes.size() - 3] ^= 1;
    writeContent(damaged, bytes);
    fs::remove(folder / "maps.umvis.bake" / "shard-000001.umvis");
    const auto outcome = bake("maps.umvis", {.shards = 4, .resume = true});
    ASSERT_TRUE(outcome) << outcome.error().message;
    EXPECT_EQ(outcome->redone, 2u);
    EXPECT_EQ(outcome->rays, 4 * kRowsPerBlock * pixelCount(settings.mapping));
    EXPECT_EQ(contentOf(folder / "maps.umvis"), whole);
}

TEST_F(LocalBake, LedgerOfAnotherMeshOrOtherSettingsIsRefused) {
    LocalBakeOptions options{
        .progress = [&](std::uint64_t, std::uint64_t) { fs::create_directory(folder / "maps.umvis"); }};
    ASSERT_FALSE(bake("maps.umvis", options));
    fs::remove(folder / "maps.umvis");
    settings.mapping.size = 10;
    auto refused = bake("maps.umvis", {.resume = true});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, Error::Kind::BadInput);
    EXPECT_NE(refused.error().message.find("its size is \"8\", now it is \"10\""), std::string::npos)
        << refused.error().message;
    settings.mapping.size = 8;
    const auto expectReason = [&](const BakeSettings& other, const std::string& reason) {
        const BakeSettings before = std::exchange(settings, other);
        refused = bake("maps.umvis", {.resume = true});
        settings = before;
        ASSERT_FALSE(refused);
        EXPECT_NE(refused.error().message.find(reason), std::string::npos) << refused.error().message;
    };
    BakeSettings other = settings;
    other.maker = MapMaker::Grid;
    expectReason(other, "its maker is \"rays\", now it is \"grid\"");
    other = settings;
    other.guard = trace::Guard::FastFan;
    expectReason(other, "its guard is \"exact\", now it is \"fast-fan\"");
    other = settings;
    other.farShare = 0.05;
    expectReason(other, "its far limit is \"none\", now it is \"5 %\"");
    other = settings;
    other.contents |= static_cast<std::uint32_t>(MapContent::Distance);
    expectReason(other, "its contents is \"masks\", now it is \"masks, distances\"");
    mesh = *prepare(visibility::test::cloth(100, 79));
    refused = bake("maps.umvis", {.resume = true});
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("its mesh is"), std::string::npos) << refused.error().message;
    writeContent(folder / "maps.umvis.bake" / "ledger.sqlite", "this is no database, whatever its name says");
    EXPECT_EQ(bake("maps.umvis", {.resume = true}).error().kind, Error::Kind::BadInput);
}

TEST_F(LocalBake, TheSecondOfTwoBakesIsRefusedAndHarmsNothing) {
    std::optional<Result<LocalBakeOutcome>> second;
    LocalBakeOptions options{.progress = [&](std::uint64_t done, std::uint64_t) {
        if (done == 1) second = bake("maps.umvis", {.resume = true});
    }};
    const std::string bytes = baked("maps.umvis", options);
    ASSERT_TRUE(second.has_value());
    ASSERT_FALSE(*second);
    EXPECT_EQ(second->error().kind, Error::Kind::BadInput);
    EXPECT_NE(second->error().message.find("another bake"), std::string::npos) << second->error().message;
    EXPECT_EQ(bytes, expected());
}

// A limit on file sizes stands in for a full disk: both end a write half-way.
TEST_F(LocalBake, DiskFullIsAnErrorAndResumable) {
    settings.mapping.size = 32;
    ::signal(SIGXFSZ, SIG_IGN);
    rlimit before{};
    ::getrlimit(RLIMIT_FSIZE, &before);
    rlimit small = before;
    small.rlim_cur = 48 * 1024;
    ::setrlimit(RLIMIT_FSIZE, &small);
    const auto full = bake("maps.umvis", {.shards = 1});
    ::setrlimit(RLIMIT_FSIZE, &before);
    ASSERT_FALSE(full);
    EXPECT_EQ(full.error().kind, Error::Kind::Failure);
    EXPECT_NE(full.error().message.find("--resume"), std::string::npos) << full.error().message;
    EXPECT_FALSE(fs::exists(folder / "maps.umvis"));
    EXPECT_EQ(baked("maps.umvis", {.shards = 1, .resume = true}), expected());
    EXPECT_EQ(names(), std::vector<std::string>{"maps.umvis"});
}

TEST_F(LocalBake, MergeRefusesWhatIsDamagedMissingOrAnother) {
    const std::string first = baked("a", {.part = ShardPart{0, 2}}), second = baked("b", {.part = ShardPart{1, 2}});
    const auto refused = [&](const std::vector<fs::path>& paths) {
        const auto merged = mergeFiles(paths, folder / "merged", false);
        EXPECT_FALSE(merged);
        EXPECT_EQ(merged.error().kind, Error::Kind::BadInput) << merged.error().message;
        EXPECT_FALSE(fs::exists(folder / "merged"));
    };
    refused({folder / "a"});
    refused({folder / "a", folder / "a", folder / "b"});
    refused({folder / "a", folder / "none"});
    for (const std::size_t bytes : {std::size_t{0}, std::size_t{100}, second.size() / 2, second.size() - 1}) {
        writeContent(folder / "c", second.substr(0, bytes));
        refused({folder / "a", folder / "c"});
    }
    for (const std::size_t at : {std::size_t{9}, std::size_t{300}, second.size() / 2, second.size() - 1}) {
        std::string flipped = second;
        flipped[at] ^= 4;
        writeContent(folder / "c", flipped);
        refused({folder / "a", folder / "c"});
    }
    mesh = *prepare(visibility::test::cloth(100, 81));
    baked("d", {.part = ShardPart{1, 2}});
    refused({folder / "a", folder / "d"});
}

}  // namespace
}  // namespace umbriel
