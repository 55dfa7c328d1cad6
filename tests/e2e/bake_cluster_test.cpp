// umbriel bake on render servers, as a user runs it.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/e2e/run_program.h"
#include "tests/support/reserved_port.h"

namespace umbriel::e2e {
namespace {

using json = nlohmann::json;
namespace fs = std::filesystem;

std::vector<std::string> bakeWith(const std::string& scene, const std::string& out, std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", scene, "--out", out, "--json"});
    return more;
}

TEST(BakeCluster, ServersThreadsAndProcessesMakeTheSameFile) {
    TemporaryFolder folder;
    const std::string scene = "demo:cloth";
    const std::vector<std::string> settings{"--size", "8", "--shards", "10"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), {"--size", "8"});
        return more;
    };
    const Outcome threads = run("umbriel", bakeWith(scene, folder / "threads", with({"--threads", "2"})));
    ASSERT_EQ(threads.exitCode, 0) << threads.err;
    const json expected = json::parse(threads.out);
    EXPECT_EQ(expected["servers"], 0);
    for (const int servers : {1, 2, 3, 5}) {
        const std::string out = folder / ("servers" + std::to_string(servers));
        const Outcome outcome =
            run("umbriel", bakeWith(scene, out, with({"--shards", "10", "--local", std::to_string(servers)})));
        ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
        const json report = json::parse(outcome.out);
        EXPECT_EQ(report["sha256"], expected["sha256"]) << servers;
        EXPECT_EQ(report["rays"], expected["rays"]);
        EXPECT_EQ(report["servers"], servers);
        EXPECT_EQ(report["shards"], 10);
        EXPECT_EQ(readFile(out), readFile(folder / "threads"));
    }
    std::vector<std::string> merge{"bake", "merge", "--out", folder / "merged", "--json"};
    for (int i = 0; i < 3; ++i) {
        const std::string part = folder / ("part" + std::to_string(i));
        ASSERT_EQ(run("umbriel", bakeWith(scene, part, with({"--shard", std::to_string(i) + "/3"}))).exitCode, 0);
        merge.push_back(part);
    }
    const Outcome merged = run("umbriel", merge);
    ASSERT_EQ(merged.exitCode, 0) << merged.err;
    EXPECT_EQ(json::parse(merged.out)["sha256"], expected["sha256"]);
}

// Two triangles on one edge from three sides, a triangle twice, one without area, vertices nobody uses.
constexpr const char* kOddMesh =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 1 0 0\nv 7 7 7\nv 2 0 0\n"
    "f 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 6 3\nf 1 2 8\nf 1 2 3\n";

TEST(BakeCluster, OddMeshesAreBakedAndBrokenOnesRefusedAsByThreads) {
    TemporaryFolder folder;
    writeFile(folder / "odd.obj", kOddMesh);
    ASSERT_EQ(run("umbriel", bakeWith(folder / "odd.obj", folder / "a", {"--size", "8"})).exitCode, 0);
    const Outcome odd = run("umbriel", bakeWith(folder / "odd.obj", folder / "b", {"--size", "8", "--local", "2"}));
    EXPECT_EQ(odd.exitCode, 0) << odd.err;
    EXPECT_EQ(readFile(folder / "a"), readFile(folder / "b"));

    writeFile(folder / "nan.obj", std::string("v nan 0 0\n") + kOddMesh);
    writeFile(folder / "lie.obj", std::string(kOddMesh) + "f 1 2 1000000000\n");
    writeFile(folder / "empty.obj", "v 0 0 0\n");
    for (const std::string file : {"nan.obj", "lie.obj", "empty.obj", "none.obj"}) {
        const Outcome outcome = run("umbriel", bakeWith(folder / file, folder / "c", {"--local", "2"}));
        EXPECT_EQ(outcome.exitCode, 2) << file << ": " << outcome.err;
        EXPECT_NE(outcome.err.find(file), std::string::npos) << outcome.err;
    }
    EXPECT_FALSE(fs::exists(folder / "c"));
    EXPECT_FALSE(fs::exists(folder / "c.bake"));
}

TEST(BakeCluster, ArgumentsThatContradictAreRefused) {
    TemporaryFolder folder;
    const test::ReservedPort closed;
    const std::string server = "127.0.0.1:" + std::to_string(closed.number());
    const std::vector<std::vector<std::string>> wrong{{"--servers", server, "--local", "2"},
                                                      {"--servers", server, "--threads", "2"},
                                                      {"--local", "2", "--shard", "0/2"},
                                                      {"--local", "1000"},
                                                      {"--local", "2", "--audit", "101"}};
    for (const auto& arguments : wrong) {
        const Outcome outcome = run("umbriel", bakeWith("demo:cloth", folder / "x", arguments));
        EXPECT_EQ(outcome.exitCode, 2) << testing::PrintToString(arguments);
    }
    // Beyond loopback only if asked for; nobody there.
    EXPECT_EQ(run("umbriel", bakeWith("demo:cloth", folder / "x", {"--servers", "192.0.2.1:7420"})).exitCode, 2);
    const Outcome nobody = run("umbriel", bakeWith("demo:cloth", folder / "x", {"--servers", "gone=" + server}));
    EXPECT_EQ(nobody.exitCode, 1);
    EXPECT_NE(nobody.err.find("gone"), std::string::npos) << nobody.err;
    EXPECT_TRUE(folder.names().empty());
}

// A limit on file sizes stands in for a full disk. What is damaged while nobody looks is baked again.
TEST(BakeCluster, AfterAFullDiskAndDamageItGoesOn) {
    TemporaryFolder folder;
    const std::vector<std::string> settings{"--size", "16", "--local", "2"};
    ASSERT_EQ(run("umbriel", bakeWith("demo:cloth", folder / "whole", {"--size", "16"})).exitCode, 0);
    const std::string whole = readFile(folder / "whole");
    const std::string out = folder / "maps.umvis";
    const std::size_t blocks = whole.size() / 1024 * 3 / 4;  // shards fit, the file does not
    std::string command = "trap '' XFSZ; ulimit -f " + std::to_string(blocks) + "; exec umbriel";
    for (const std::string& argument : bakeWith("demo:cloth", out, settings)) command += " '" + argument + "'";
    const Outcome full = run("/bin/bash", {"-c", "PATH=" UMBRIEL_BIN_DIR ":$PATH; " + command});
    EXPECT_EQ(full.exitCode, 1) << full.out << full.err;
    EXPECT_NE(full.err.find("--resume"), std::string::npos) << full.err;
    EXPECT_FALSE(fs::exists(out));
    ASSERT_TRUE(fs::exists(out + ".bake"));

    // Without --resume nothing is overwritten; another mesh and other settings are refused.
    const auto resumed = [&](const std::string& scene, std::vector<std::string> more) {
        more.push_back("--resume");
        return run("umbriel", bakeWith(scene, out, more));
    };
    EXPECT_EQ(run("umbriel", bakeWith("demo:cloth", out, settings)).exitCode, 2);
    EXPECT_EQ(resumed("demo:cloth", {"--size", "8", "--local", "1"}).exitCode, 2);
    EXPECT_EQ(resumed("demo:city", {"--size", "16", "--local", "1"}).exitCode, 2);

    const auto shard = [&](int number) { return out + ".bake/shard-00000" + std::to_string(number) + ".umvis"; };
    std::string flipped = readFile(shard(2));
    flipped[flipped.size() / 2] ^= 1;
    writeFile(shard(2), flipped);
    writeFile(shard(3), readFile(shard(3)).substr(0, 300));
    writeFile(shard(4), readFile(shard(5)));
    fs::remove(shard(6));
    const Outcome done = resumed("demo:cloth", settings);
    ASSERT_EQ(done.exitCode, 0) << done.err;
    EXPECT_EQ(json::parse(done.out)["redone"], 4);
    EXPECT_EQ(readFile(out), whole);
    EXPECT_FALSE(fs::exists(out + ".bake"));
}

TEST(BakeCluster, RunningServersBakeForOneClientAfterTheOther) {
    TemporaryFolder folder;
    Background server("umbriel-server", {"--name", "left", "--listen", "127.0.0.1:0", "--bake-threads", "1"});
    const std::string address = server.waitForAddress();
    ASSERT_FALSE(address.empty()) << server.printed();
    for (const char* mapping : {"hemisphere", "octahedral"}) {
        const std::vector<std::string> settings{"--size", "8", "--mapping", mapping};
        auto there = settings;
        there.insert(there.end(), {"--servers", "left=" + address, "--distance"});
        auto here = settings;
        here.push_back("--distance");
        const Outcome outcome = run("umbriel", bakeWith("demo:cloth", folder / "there", there));
        ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
        ASSERT_EQ(run("umbriel", bakeWith("demo:cloth", folder / "here", here)).exitCode, 0);
        EXPECT_EQ(readFile(folder / "there"), readFile(folder / "here")) << mapping;
    }
    const Outcome misnamed = run("umbriel", bakeWith("demo:cloth", folder / "x", {"--servers", "right=" + address}));
    EXPECT_EQ(misnamed.exitCode, 1);
    EXPECT_NE(misnamed.err.find("right"), std::string::npos) << misnamed.err;
}

}  // namespace
}  // namespace umbriel::e2e
