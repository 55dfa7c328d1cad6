#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "common/image/display.h"
#include "common/image/exr_io.h"
#include "common/image/png_io.h"
#include "tests/e2e/run_program.h"
#include "tests/support/reserved_port.h"
#include "tests/support/wait_until.h"

namespace umbriel::e2e {
namespace {

using nlohmann::json;

json compare(const std::string& a, const std::string& b) {
    const Outcome outcome = run("umbriel", {"compare", a, b, "--json"});
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    return outcome.exitCode == 0 ? json::parse(outcome.out) : json::object();
}

void render(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "render");
    const Outcome outcome = run("umbriel", arguments);
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
}

TEST(Render, WritesAWholePictureOfADemoWithCoverage) {
    const TemporaryFolder folder;
    render({"demo:spheres?n=9", "--size", "160x90", "--out", folder / "a.exr"});
    const auto image = readExr(folder / "a.exr");
    ASSERT_TRUE(image);
    EXPECT_EQ(image->width(), 160);
    EXPECT_EQ(image->height(), 90);
    std::size_t covered = 0;
    for (int y = 0; y < 90; ++y)
        for (int x = 0; x < 160; ++x) covered += image->rgba.at(x, y, 3) == 1.0f ? 1 : 0;
    EXPECT_GT(covered, 160u * 90u / 20u);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.exr"});  // nothing else is left behind
}

// One wall of many servers is the picture one server draws: bit for bit in exact mode.
TEST(Render, ExactTilesAreBitEqualToOneServer) {
    for (const char* scene : {"demo:city?n=60", "demo:car"}) {
        for (const char* samples : {"1", "4"}) {
            const TemporaryFolder folder;
            const std::vector<std::string> common{scene, "--size", "317x179", "--shadow", "std", "--tiles", "exact", "--samples", samples};
            const auto with = [&](const std::string& grid, const std::string& out) {
                auto arguments = common;
                arguments.insert(arguments.end(), {"--grid", grid, "--out", out});
                render(arguments);
            };
            with("1x1", folder / "one.exr");
            with("3x2", folder / "wall.exr");
            const json difference = compare(folder / "one.exr", folder / "wall.exr");
            EXPECT_EQ(difference["bit_differing"], 0) << scene << " samples " << samples;
            EXPECT_EQ(difference["pixels"], 317 * 179);
        }
    }
}

// What is only looked at comes in half floats, whoever draws it; what keeps more in floats.
TEST(Render, ColoursHaveTheBitsThatTheirFilesShow) {
    const TemporaryFolder folder;
    const auto with = [&](std::vector<std::string> arguments, const std::string& out) {
        arguments.insert(arguments.begin(),
                         {"demo:city?n=60", "--size", "317x179", "--shadow", "std", "--tiles", "exact"});
        arguments.insert(arguments.end(), {"--out", folder / out});
        render(arguments);
        return readFile(folder / out);
    };
    const std::string half = with({"--colour-bits", "16"}, "half.png");
    const std::string whole = with({"--colour-bits", "32"}, "whole.png");
    EXPECT_EQ(with({}, "default.png"), half);
    EXPECT_EQ(with({}, "default.exr"), with({"--colour-bits", "32"}, "whole.exr"));
    EXPECT_NE(with({"--colour-bits", "16"}, "half.exr"), readFile(folder / "default.exr"));
    EXPECT_EQ(with({"--exposure", "9"}, "far.png"), with({"--exposure", "9", "--colour-bits", "32"}, "farWhole.png"));
    // A level apart at most: a step of a half is a ninth of one at white, and less in darks.
    const json difference = compare(folder / "half.png", folder / "whole.png");
    EXPECT_LE(difference["differing"].get<int>(), 317 * 179 / 9);
    const auto a = readPng(folder / "half.png"), b = readPng(folder / "whole.png");
    ASSERT_TRUE(a && b);
    for (std::size_t i = 0; i < a->rgba.samples().size(); ++i)
        ASSERT_LE(std::abs(displayByte(a->rgba.samples()[i], 1.0) - displayByte(b->rgba.samples()[i], 1.0)), 1);
    for (const char* bits : {"8", "16"})
        EXPECT_EQ(with({"--colour-bits", bits, "--grid", "2x2"}, std::string(bits) + "wall.exr"),
                  with({"--colour-bits", bits}, std::string(bits) + "one.exr"));
}

// The default mode has no holes, and few pixels whose last bits cross a rounding border (bounds of the cluster spec).
TEST(Render, OffsetTilesDifferInLastBitsOnly) {
    const TemporaryFolder folder;
    for (const char* grid : {"1x1", "3x2"})
        render({"demo:city?n=60", "--size", "317x179", "--shadow", "std", "--grid", grid, "--out", folder / (std::string(grid) + ".exr")});
    const json difference = compare(folder / "1x1.exr", folder / "3x2.exr");
    EXPECT_EQ(difference["holes"], 0);
    EXPECT_LE(difference["differing"].get<int>(), 317 * 179 * 0.0005);
    EXPECT_LE(difference["over_8_255"].get<int>(), 5);
}

TEST(Render, TwoRunsGiveTheSameFile) {
    const TemporaryFolder folder;
    for (const char* name : {"a.exr", "b.exr"})
        render({"demo:cloth", "--size", "160x90", "--grid", "2x1", "--shadow", "std", "--out", folder / name});
    EXPECT_EQ(readFile(folder / "a.exr"), readFile(folder / "b.exr"));
}

TEST(Render, FewerServersThanTilesGiveTheSamePicture) {
    const TemporaryFolder folder;
    for (const char* servers : {"1", "3", "6"})
        render({"demo:car", "--size", "160x90", "--grid", "3x2", "--local", servers, "--out", folder / (std::string(servers) + ".exr")});
    EXPECT_EQ(readFile(folder / "1.exr"), readFile(folder / "6.exr"));
    EXPECT_EQ(readFile(folder / "3.exr"), readFile(folder / "6.exr"));
}

TEST(Render, JsonReportsFramesAndServers) {
    const Outcome outcome = run("umbriel", {"render", "demo:car", "--size", "160x90", "--grid", "2x1", "--frames", "3", "--json"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    const json report = json::parse(outcome.out);
    ASSERT_EQ(report["frames"].size(), 3u);
    for (const json& frame : report["frames"]) {
        for (const char* key : {"frame", "entries", "change_bytes", "servers"}) EXPECT_TRUE(frame.contains(key)) << key;
        ASSERT_EQ(frame["servers"].size(), 2u);
        for (const json& server : frame["servers"])
            for (const char* key : {"name", "bytes", "view_bytes", "draw_ms", "wait_ms", "triangles", "digest"})
                EXPECT_TRUE(server.contains(key)) << key;
        EXPECT_EQ(frame["servers"][0]["digest"], frame["servers"][1]["digest"]);
    }
    // Views and fits travel when they change; the car's camera stands still, its shadow fit is not asked for.
    EXPECT_GT(report["frames"][0]["servers"][0]["view_bytes"], 0);
    EXPECT_EQ(report["frames"][2]["servers"][0]["view_bytes"], 0);
    EXPECT_LT(report["frames"][2]["change_bytes"], report["frames"][0]["change_bytes"]);
}

// What the eyes see is one scene: the shadows of a single eye are fitted to both, so it equals its half of the pair.
TEST(Render, EachEyeOfAPairEqualsItsOwnRender) {
    const TemporaryFolder folder;
    for (const char* eyes : {"pair", "left", "right"})
        render({"demo:car", "--size", "160x90", "--grid", "2x1", "--shadow", "std", "--stereo", eyes, "--wall-size", "3.2x1.8", "--out",
                folder / (std::string(eyes) + ".exr")});
    EXPECT_EQ(readFile(folder / "pair.left.exr"), readFile(folder / "left.exr"));
    EXPECT_EQ(readFile(folder / "pair.right.exr"), readFile(folder / "right.exr"));
    EXPECT_GT(compare(folder / "left.exr", folder / "right.exr")["differing"], 0);
    // Without a distance between them the eyes see the same.
    render({"demo:car", "--size", "160x90", "--stereo", "pair", "--eye-separation", "0", "--out", folder / "none.exr"});
    EXPECT_EQ(compare(folder / "none.left.exr", folder / "none.right.exr")["bit_differing"], 0);
}

TEST(Render, OptionsMayStandBeforeTheSceneAndHaveNegativeValues) {
    const TemporaryFolder folder;
    render({"--light", "dir:-1,-2,-1", "--eye", "-4,2,4", "--target", "-1,0,0", "--size", "32x18", "--out", folder / "a.exr", "--out",
            folder / "a.png", "demo:car"});
    EXPECT_EQ(folder.names(), (std::vector<std::string>{"a.exr", "a.png"}));
}

TEST(Render, SequencesGoToNumberedFiles) {
    const TemporaryFolder folder;
    render({"demo:car", "--size", "64x36", "--frames", "3", "--out", folder / "x.%04d.exr"});
    ASSERT_EQ(folder.names().size(), 3u);
    // The car moves.
    EXPECT_GT(compare(folder / folder.names()[0], folder / folder.names()[2])["differing"], 0);
}

TEST(Render, ExplainShowsShadowPassesOnlyWhenShadowsAreOn) {
    const Outcome off = run("umbriel", {"render", "demo:car", "--size", "64x36", "--explain"});
    const Outcome on = run("umbriel", {"render", "demo:car", "--size", "64x36", "--explain", "--shadow", "std"});
    ASSERT_EQ(off.exitCode, 0) << off.err;
    ASSERT_EQ(on.exitCode, 0) << on.err;
    EXPECT_EQ(off.out.find("shadow map"), std::string::npos) << off.out;
    EXPECT_NE(on.out.find("shadow map"), std::string::npos) << on.out;
}

// More light in a shadow than beside it, or less than none: the nearest that there can be, and said.
TEST(Render, ImpossibleShadowColoursAreTheNearestPossible) {
    const TemporaryFolder folder;
    const auto drawn = [&](const std::string& name, const std::string& colour) {
        const Outcome outcome = run("umbriel", {"render", "demo:car", "--size", "64x48", "--shadow", "std",
                                                "--shadow-set", "shadowColor=" + colour, "--out", folder / name});
        EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
        return outcome.err;
    };
    EXPECT_NE(drawn("given.exr", "7,-3,0.5").find("shadowColor of 7,-3,0.5 is not possible, 1,0,0.5 is used"),
              std::string::npos);
    EXPECT_EQ(drawn("possible.exr", "1,0,0.5"), "");
    EXPECT_EQ(readFile(folder / "given.exr"), readFile(folder / "possible.exr"));
}

TEST(Render, AnUnlitSceneHasNoShadowPassEvenIfShadowsAreOn) {
    const Outcome outcome = run("umbriel", {"render", "demo:car", "--size", "64x36", "--explain", "--shadow", "std", "--light", "none"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_EQ(outcome.out.find("shadow"), std::string::npos) << outcome.out;
    EXPECT_EQ(outcome.out.find("directional"), std::string::npos) << outcome.out;
}

TEST(Render, AValidFileWithNothingToDrawGivesTheBackgroundAndAWarning) {
    const TemporaryFolder folder;
    writeFile(folder / "empty.gltf", R"({"asset": {"version": "2.0"}})");
    const Outcome outcome = run("umbriel", {"render", folder / "empty.gltf", "--size", "8x8", "--background", "0.25,0.5,1", "--out",
                                            folder / "a.exr"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("nothing to draw"), std::string::npos) << outcome.err;
    const auto image = readExr(folder / "a.exr");
    ASSERT_TRUE(image);
    for (int channel = 0; channel < 4; ++channel) {
        const float expected[] = {0.25f, 0.5f, 1.0f, 1.0f};
        EXPECT_EQ(image->rgba.at(3, 5, channel), expected[channel]);
    }
}

// Embedded servers end with their client, however it ends.
TEST(Render, ServersEndWithAClientThatIsKilled) {
    std::vector<int> servers;
    {
        const Background client("umbriel", {"render", "demo:car", "--size", "64x36", "--grid", "2x1", "--frames", "1000000", "--quiet"});
        ASSERT_TRUE(test::waitUntil([&] { return (servers = childrenOf(client.pid())).size() >= 2; }));
        ::kill(client.pid(), SIGKILL);  // the process alone, not its group
        for (const int server : servers)
            EXPECT_TRUE(test::waitUntil([&] { return isZombie(server); })) << "server " << server << " is still there";
    }
}

TEST(Render, LayersArriveInTheFile) {
    const TemporaryFolder folder;
    render({"demo:spheres?n=4", "--size", "64x36", "--grid", "2x1", "--layers", "depth,position,normal,ids", "--out", folder / "a.exr"});
    const auto image = readExr(folder / "a.exr");
    ASSERT_TRUE(image);
    for (const char* name : {"depth", "position", "normal"}) EXPECT_NE(image->floatLayer(name), nullptr) << name;
    EXPECT_NE(image->uintLayer("ids"), nullptr);
}

TEST(Render, RadianceFilesHoldTheColoursOfTheExr) {
    const TemporaryFolder folder;
    render({"demo:spheres?n=4", "--size", "64x36", "--out", folder / "a.exr", "--out", folder / "a.hdr"});
    const Outcome compared = run("umbriel", {"compare", folder / "a.exr", folder / "a.hdr", "--json"});
    ASSERT_EQ(compared.exitCode, 0) << compared.err;
    const auto image = readExr(folder / "a.exr");
    ASSERT_TRUE(image);
    float largest = 0.0f;
    for (int y = 0; y < 36; ++y)
        for (int x = 0; x < 64; ++x)
            for (int c = 0; c < 3; ++c) largest = std::max(largest, image->rgba.at(x, y, c));
    // A channel is off by at most 1/255 of its pixel's largest.
    EXPECT_LE(json::parse(compared.out)["max"].get<double>(), largest / 255.0) << compared.out;
    EXPECT_GT(largest, 0.1f) << "there is something to compare";
}

struct BadCase {
    const char* what;
    std::vector<std::string> arguments;
    const char* said;  // part of the message
};

TEST(Render, WrongUsageIsRefusedWithCodeTwoAndOneMessage) {
    const TemporaryFolder folder;
    const std::vector<BadCase> cases{
        {"unknown option", {"--frobnicate"}, "frobnicate"},
        {"size zero", {"--size", "0x720"}, "--size"},
        {"negative size", {"--size", "-1x5"}, "-1x5"},
        {"grid finer than pixels", {"--size", "4x4", "--grid", "5x1"}, "--grid"},
        {"grid zero", {"--grid", "0x1"}, "--grid"},
        {"samples", {"--samples", "3"}, "--samples"},
        {"colour bits", {"--colour-bits", "10"}, "--colour-bits"},
        {"fov", {"--fov", "180"}, "--fov"},
        {"eye is target", {"--eye", "1,2,3", "--target", "1,2,3"}, "--eye"},
        {"nan", {"--eye", "nan,0,0"}, "--eye"},
        {"light", {"--light", "dir:0,0,0"}, "--light"},
        {"shadow", {"--shadow", "magic"}, "--shadow"},
        {"tiles", {"--tiles", "round"}, "--tiles"},
        {"frames without a pattern", {"--frames", "2", "--out", folder / "x.exr"}, "%04d"},
        {"suffix", {"--out", folder / "x.jpg"}, ".exr"},
        {"no folder", {"--out", folder / "nowhere/x.exr"}, "nowhere"},
        {"both servers", {"--servers", "localhost:1", "--local", "2"}, "--local"},
        {"camera", {"--camera", "no such camera"}, "no such camera"},
        {"fps", {"--fps", "0"}, "--fps"},
        {"negative frames", {"--frames", "-1"}, "--frames: '-1': expected a whole number, 0 or more"},
        {"half a frame", {"--frames", "1.5"}, "--frames: '1.5': expected a whole number, 0 or more"},
        {"frames beyond numbers", {"--frames", "99999999999999999999"}, "--frames: '99999999999999999999' is too large"},
        {"negative map", {"--map-size", "-512"}, "--map-size: '-512': expected a whole number, 0 or more"},
        {"eyes of a picture without", {"--eye-separation", "0.1"}, "--stereo"},
        {"layers", {"--layers", "depth,magic"}, "--layers"},
        {"log level", {"--log-level", "loud"}, "--log-level"},
        {"a picture beyond memory", {"--size", "1000000x1000000", "--out", folder / "x.exr"}, "--size"},
    };
    for (const BadCase& bad : cases) {
        std::vector<std::string> arguments{"render", "demo:car"};
        arguments.insert(arguments.end(), bad.arguments.begin(), bad.arguments.end());
        const Outcome outcome = run("umbriel", arguments);
        EXPECT_EQ(outcome.exitCode, 2) << bad.what << ": " << outcome.err;
        EXPECT_NE(outcome.err.find(bad.said), std::string::npos) << bad.what << ": " << outcome.err;
        EXPECT_TRUE(outcome.out.empty()) << bad.what;
    }
    EXPECT_TRUE(folder.names().empty());
}

TEST(Render, MissingAndBrokenScenesAreRefusedByName) {
    const TemporaryFolder folder;
    writeFile(folder / "empty.glb", "");
    writeFile(folder / "garbage.gltf", "{\"asset\": 3");
    for (const std::string& scene : {folder / "missing.glb", folder / "empty.glb", folder / "garbage.gltf", std::string("demo:nothing"),
                                     folder.path().string()}) {
        const Outcome outcome = run("umbriel", {"render", scene, "--out", folder / "x.exr"});
        EXPECT_EQ(outcome.exitCode, 2) << scene << ": " << outcome.err;
        EXPECT_NE(outcome.err.find(scene.substr(scene.rfind('/') + 1)), std::string::npos) << outcome.err;
    }
    EXPECT_EQ(folder.names().size(), 2u);
}

TEST(Render, AnUnreachableServerIsNamed) {
    const test::ReservedPort nobody;
    const std::string address = "127.0.0.1:" + std::to_string(nobody.number());
    const Outcome outcome = run("umbriel", {"render", "demo:car", "--size", "64x36", "--servers", "left=" + address,
                                            "--connect-timeout", "0.5", "--json"});
    EXPECT_EQ(outcome.exitCode, 1) << outcome.err;
    EXPECT_NE(outcome.err.find("left"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find(address), std::string::npos) << outcome.err;
}

TEST(Render, ServersBeyondLoopbackAreRefusedUnlessAllowed) {
    const Outcome outcome = run("umbriel", {"render", "demo:car", "--size", "64x36", "--servers", "192.0.2.1:7420"});
    EXPECT_EQ(outcome.exitCode, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("--insecure-lan"), std::string::npos) << outcome.err;
}

TEST(Render, AServerWithAnotherNameIsRefusedAndTheRightOneServesTwoClients) {
    const Background server("umbriel-server", {"--name", "left", "--listen", "127.0.0.1:0", "--log-level", "info"});
    const std::string address = server.waitForAddress();
    ASSERT_FALSE(address.empty()) << server.printed();
    const Outcome wrong = run("umbriel", {"render", "demo:car", "--size", "64x36", "--servers", "right=" + address});
    EXPECT_EQ(wrong.exitCode, 1) << wrong.err;
    EXPECT_NE(wrong.err.find("left"), std::string::npos) << wrong.err;
    EXPECT_NE(wrong.err.find("right"), std::string::npos) << wrong.err;
    for (int i = 0; i < 2; ++i) {
        const Outcome right = run("umbriel", {"render", "demo:car", "--size", "64x36", "--servers", "left=" + address, "--json"});
        EXPECT_EQ(right.exitCode, 0) << right.err;
    }
}

// Root may mount a file system of 64 KiB; elsewhere this cannot be tried.
TEST(Render, AFullDiskLeavesNothingHalfWritten) {
    const TemporaryFolder folder;
    if (::mount("none", folder.path().c_str(), "tmpfs", 0, "size=64k") != 0) GTEST_SKIP() << "needs the right to mount a small file system";
    const Outcome outcome = run("umbriel", {"render", "demo:city?n=60", "--size", "640x360", "--out", folder / "x.exr"});
    const auto left = folder.names();
    ::umount(folder.path().c_str());
    EXPECT_EQ(outcome.exitCode, 1) << outcome.err;
    EXPECT_NE(outcome.err.find("x.exr"), std::string::npos) << outcome.err;
    EXPECT_TRUE(left.empty());
}

TEST(Doctor, SaysWhatWorks) {
    const Outcome outcome = run("umbriel", {"doctor", "--json"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.out << outcome.err;
    EXPECT_TRUE(json::parse(outcome.out)["works"]);
}

TEST(Programs, SayTheirVersionAndExplainThemselves) {
    for (const char* program : {"umbriel", "umbriel-server"}) {
        EXPECT_EQ(run(program, {"--version"}).exitCode, 0) << program;
        const Outcome help = run(program, {"--help"});
        EXPECT_EQ(help.exitCode, 0) << program;
        EXPECT_NE(help.out.find("Example"), std::string::npos) << program;
    }
    EXPECT_EQ(run("umbriel", {}).exitCode, 2);
}

}  // namespace
}  // namespace umbriel::e2e
