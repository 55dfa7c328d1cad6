// umbriel bake --light-map, and what draws with it, as a user runs them.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/e2e/run_program.h"

namespace umbriel::e2e {
namespace {

using json = nlohmann::json;

// A crate on a floor.
void writeScene(const std::string& path, double crate = 0.0) {
    const std::string x0 = std::to_string(crate - 1.0), x1 = std::to_string(crate + 1.0);
    std::string text = "v -5 0 5\nv 5 0 5\nv 5 0 -5\nv -5 0 -5\n";
    for (const char* y : {"0.5", "2"})
        for (const char* z : {" 1\n", " -1\n"}) text += "v " + x0 + " " + y + z + "v " + x1 + " " + y + z;
    text +=
        "o floor\nf 1 2 3\nf 1 3 4\n"
        "o crate\nf 5 6 10 9\nf 8 7 11 12\nf 7 5 9 11\nf 6 8 12 10\nf 9 10 12 11\nf 7 8 6 5\n";
    writeFile(path, text);
}

const std::vector<std::string> kLight = {"--light", "dir:0.5,-1,-0.2"};

std::vector<std::string> with(std::vector<std::string> first, const std::vector<std::string>& more) {
    first.insert(first.end(), more.begin(), more.end());
    return first;
}

class LightMaps : public ::testing::Test {
 protected:
    LightMaps() : scene(folder / "crate.obj") { writeScene(scene); }

    Outcome bake(const std::vector<std::string>& more, const std::vector<std::string>& light = kLight) {
        return run("umbriel", with(with({"bake", scene}, light), more));
    }
    Outcome render(const std::vector<std::string>& more, const std::vector<std::string>& light = kLight) {
        return run(
            "umbriel",
            with(with({"render", scene, "--size", "160x90", "--eye", "0,6,9", "--target", "0,0,0"}, light), more));
    }
    void expectRefused(const Outcome& outcome, const std::string& about) {
        EXPECT_EQ(outcome.exitCode, 2) << outcome.err;
        EXPECT_NE(outcome.err.find(about), std::string::npos) << outcome.err;
    }

    TemporaryFolder folder;
    std::string scene;
};

TEST_F(LightMaps, AreBakedBesideTheSceneAndDrawnFromThere) {
    const Outcome baked = bake({"--light-map", "256", "--json", "--atlas", folder / "atlas.exr"});
    ASSERT_EQ(baked.exitCode, 0) << baked.err;
    const json report = json::parse(baked.out);
    EXPECT_EQ(report["size"], 256);
    EXPECT_EQ(report["lights"].size(), 1u);
    EXPECT_EQ(report["triangles"], 14);
    EXPECT_EQ(report["charts"], 7);
    EXPECT_GT(report["covered"].get<double>(), 0.7);
    EXPECT_EQ(report["bytes"], std::filesystem::file_size(scene + ".umlight"));
    EXPECT_TRUE(std::filesystem::exists(folder / "atlas.exr"));

    const Outcome drawn = render({"--shadow", "light-map", "--explain", "--json", "--out", folder / "a.exr"});
    ASSERT_EQ(drawn.exitCode, 0) << drawn.err;
    EXPECT_EQ(drawn.err.find("stale"), std::string::npos) << drawn.err;
    EXPECT_EQ(json::parse(drawn.out)["frames"][0]["servers"][0]["shadow_triangles"], 0);
    const Outcome lit = render({"--shadow", "none", "--out", folder / "none.exr"});
    ASSERT_EQ(lit.exitCode, 0) << lit.err;
    const Outcome compared = run("umbriel", {"compare", folder / "a.exr", folder / "none.exr", "--json"});
    EXPECT_GT(json::parse(compared.out)["bit_differing"].get<int>(), 100);

    const Outcome tiled = render(
        {"--shadow", "light-map", "--grid", "2x2", "--local", "2", "--tiles", "exact", "--out", folder / "tiles.exr"});
    ASSERT_EQ(tiled.exitCode, 0) << tiled.err;
    ASSERT_EQ(render({"--shadow", "light-map", "--tiles", "exact", "--out", folder / "whole.exr"}).exitCode, 0);
    const Outcome same = run("umbriel", {"compare", folder / "tiles.exr", folder / "whole.exr", "--json"});
    EXPECT_EQ(json::parse(same.out)["bit_differing"], 0);
}

TEST_F(LightMaps, AreTheSameBytesForAnyNumberOfThreads) {
    std::vector<std::string> bytes;
    for (const char* threads : {"1", "2", "5"}) {
        const Outcome baked = bake({"--light-map", "128", "--threads", threads, "--out", folder / "t.umlight"});
        ASSERT_EQ(baked.exitCode, 0) << baked.err;
        bytes.push_back(readFile(folder / "t.umlight"));
    }
    EXPECT_EQ(bytes[0], bytes[1]);
    EXPECT_EQ(bytes[0], bytes[2]);
}

TEST_F(LightMaps, OfALightThatMovedGiveStandardMapsAndOneWarning) {
    ASSERT_EQ(bake({"--light-map", "128"}).exitCode, 0);
    const std::vector<std::string> moved = {"--light", "dir:0.4,-1,-0.2"};
    const Outcome stale = render({"--shadow", "light-map", "--frames", "3", "--out", folder / "stale.%04d.exr"}, moved);
    ASSERT_EQ(stale.exitCode, 0) << stale.err;
    const std::size_t first = stale.err.find("stale");
    ASSERT_NE(first, std::string::npos) << stale.err;
    EXPECT_EQ(stale.err.find("stale", first + 1), std::string::npos) << stale.err;
    ASSERT_EQ(render({"--shadow", "std", "--out", folder / "std.exr"}, moved).exitCode, 0);
    const Outcome same = run("umbriel", {"compare", folder / "stale.0001.exr", folder / "std.exr", "--json"});
    EXPECT_EQ(json::parse(same.out)["bit_differing"], 0) << same.out;
}

TEST_F(LightMaps, OfACasterThatMovedGiveStandardMapsAndOneWarning) {
    ASSERT_EQ(bake({"--light-map", "128"}).exitCode, 0);
    writeScene(scene, 0.5);
    const Outcome stale = render({"--shadow", "light-map", "--out", folder / "stale.exr"});
    ASSERT_EQ(stale.exitCode, 0) << stale.err;
    EXPECT_NE(stale.err.find("the light map is stale: 1 of the 2 surfaces"), std::string::npos) << stale.err;
    ASSERT_EQ(render({"--shadow", "std", "--out", folder / "std.exr"}).exitCode, 0);
    const Outcome same = run("umbriel", {"compare", folder / "stale.exr", folder / "std.exr", "--json"});
    EXPECT_EQ(json::parse(same.out)["bit_differing"], 0) << same.out;
}

TEST_F(LightMaps, SizesThatCannotBeAreRefused) {
    for (const char* size : {"0", "-1", "32768", "4000000000"})
        expectRefused(bake({"--light-map", size}), "expected 1 to 32767");
    // Four pages of 256 MiB for each of two lights.
    expectRefused(bake({"--light-map", "32767"}, {"--light", "dir:0.5,-1,-0.2", "--light", "dir:-0.5,-1,-0.2"}),
                  "are 2048 MiB, more than the 1024");
    expectRefused(bake({"--light-map", "16385", "--atlas", folder / "atlas.exr"}), "--atlas: a picture has 16384");
    expectRefused(bake({"--light-map", "2"}), "too small for the 7 charts");
    expectRefused(bake({"--light-map", "x"}), "--light-map");
    expectRefused(bake({"--light-map", "64"}, {"--light", "none"}), "without any there is nothing to bake");
    EXPECT_FALSE(std::filesystem::exists(scene + ".umlight"));
}

// Two servers draw half of the texels each.
TEST_F(LightMaps, FromAModeAreTheSameBytesOnAnyNumberOfServersAndNearToThoseOfRays) {
    const auto baked = [&](const std::string& name, const std::vector<std::string>& more) {
        const Outcome outcome = bake(with({"--light-map", "128", "--json", "--atlas", folder / (name + ".exr"), "--out",
                                           folder / (name + ".umlight")},
                                          more));
        EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
        return outcome.exitCode == 0 ? json::parse(outcome.out) : json();
    };
    const json rays = baked("rays", {}), one = baked("one", {"--from", "std"});
    const json two = baked("two", {"--from", "std", "--local", "2"});
    ASSERT_TRUE(rays.is_object() && one.is_object() && two.is_object());
    EXPECT_EQ(rays["from"], "rays");
    EXPECT_EQ(rays["lookups"], 0);
    EXPECT_EQ(one["from"], "std");
    EXPECT_GT(one["lookups"].get<int>(), 100000);
    EXPECT_EQ(one["charts"], rays["charts"]);
    EXPECT_EQ(one["bytes"], rays["bytes"]);
    EXPECT_EQ(one["sha256"], two["sha256"]);
    EXPECT_EQ(readFile(folder / "one.umlight"), readFile(folder / "two.umlight"));
    const Outcome compared = run("umbriel", {"compare", folder / "rays.exr", folder / "one.exr", "--json"});
    const json difference = json::parse(compared.out);
    EXPECT_GT(difference["bit_differing"].get<int>(), 0);
    EXPECT_LT(difference["rmse"].get<double>(), 0.02) << compared.out;
    const Outcome drawn =
        render({"--shadow", "light-map", "--light-map", folder / "one.umlight", "--out", folder / "a.exr"});
    ASSERT_EQ(drawn.exitCode, 0) << drawn.err;
    EXPECT_EQ(drawn.err.find("stale"), std::string::npos) << drawn.err;
    // Fields count, too.
    const json wide = baked("wide", {"--from", "pcf", "--shadow-set", "filterWidth=24", "--map-size", "512"});
    const json narrow = baked("narrow", {"--from", "pcf", "--shadow-set", "filterWidth=2", "--map-size", "512"});
    ASSERT_TRUE(wide.is_object() && narrow.is_object());
    EXPECT_NE(wide["sha256"], narrow["sha256"]);
}

TEST_F(LightMaps, FromModesThatNeedAViewAreRefused) {
    for (const char* mode : {"lisp", "psm", "trapez"})
        expectRefused(bake({"--light-map", "64", "--from", mode}), "where the eye is");
    for (const char* mode : {"planar", "planar-stencil", "zpass", "zfail", "blob"})
        expectRefused(bake({"--light-map", "64", "--from", mode}), "in the picture of a view");
    for (const char* mode : {"none", "light-map"})
        expectRefused(bake({"--light-map", "64", "--from", mode}), "Expected rays, std, pcf");
    expectRefused(bake({"--light-map", "64", "--from", "std", "--map-size", "0"}), "--map-size 0");
    expectRefused(bake({"--light-map", "64", "--from", "std", "--local", "0"}), "--local 0");
    expectRefused(bake({"--light-map", "64", "--from", "std", "--shadow-set", "wishes=1"}), "wishes");
    expectRefused(bake({"--light-map", "2", "--from", "std"}), "too small for the 7 charts");
    expectRefused(bake({"--light-map", "64", "--map-size", "512"}), "rays have no shadow maps");
    EXPECT_FALSE(std::filesystem::exists(scene + ".umlight"));
}

TEST_F(LightMaps, ArgumentsThatMakeNoSenseAreRefused) {
    expectRefused(bake({"--light-map", "64", "--from", "wishes"}), "--from 'wishes'");
    expectRefused(bake({"--light-map", "64", "--samples", "0"}), "--samples 0");
    expectRefused(bake({"--light-map", "64", "--light-samples", "17"}), "--light-samples 17");
    expectRefused(bake({"--light-map", "64", "--out", folder / "a.png"}), ".umlight");
    expectRefused(bake({"--light-map", "64", "--moving", "nobody"}), "nobody");
    expectRefused(bake({"--light-map", "64", "--local", "2"}), "--local");
    // A scene without a light of its own gets the default sun; one with a light that casts nothing has nothing to bake.
    EXPECT_EQ(bake({"--light-map", "64"}, {}).exitCode, 0);
}

TEST_F(LightMaps, FilesOfNothingOfAnotherSceneOrDamagedAreRefused) {
    expectRefused(render({"--shadow", "light-map"}), "there is no");
    expectRefused(render({"--shadow", "light-map", "--light-map", folder / "nowhere.umlight"}), "nowhere.umlight");
    ASSERT_EQ(bake({"--light-map", "64"}).exitCode, 0);
    const std::string other = folder / "other.obj";
    writeFile(other, "v -2 0 2\nv 2 0 2\nv 2 0 -2\nf 1 2 3\n");
    const Outcome refused =
        run("umbriel", {"render", other, "--shadow", "light-map", "--light-map", scene + ".umlight"});
    expectRefused(refused, "another scene");
    const std::string whole = readFile(scene + ".umlight");
    writeFile(scene + ".umlight", whole.substr(0, whole.size() / 2));
    expectRefused(render({"--shadow", "light-map"}), "cut short or damaged");
    writeFile(scene + ".umlight", "not a light map");
    expectRefused(render({"--shadow", "light-map"}), "no light map");
}

TEST(LightMapTrade, HasARowWithTheBytesOfTheAtlas) {
    const Outcome outcome = run("umbriel", {"trade", "demo:palms", "--techniques", "none,light-map", "--map-sizes",
                                            "128,512", "--size", "192x108", "--frames", "1", "--json"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    const json result = json::parse(outcome.out);
    ASSERT_EQ(result["rows"].size(), 3u);
    std::map<int, json> rows;
    double none = 0.0;
    for (const json& row : result["rows"]) {
        if (row["technique"] == "none")
            none = row["error"];
        else
            rows[row["map_size"].get<int>()] = row;
    }
    ASSERT_EQ(rows.size(), 2u);
    EXPECT_LT(rows[512]["error"].get<double>(), rows[128]["error"].get<double>());
    EXPECT_LT(rows[512]["error"].get<double>(), none);
    for (const auto& [size, row] : rows) {
        EXPECT_GE(row["map_bytes"].get<int>(), size * size);
        EXPECT_LT(row["map_bytes"].get<int>(), size * size + 400000);
        EXPECT_GT(row["cpu_ms"].get<double>(), 0.0);
    }
}

// The car turns, the cones and the ground stay.
TEST(LightMapAnimation, WhatMovesKeepsTheMapAndItsShadowsMove) {
    TemporaryFolder folder;
    const Outcome baked = run("umbriel", {"bake", "demo:car", "--light-map", "256", "--out", folder / "car.umlight"});
    ASSERT_EQ(baked.exitCode, 0) << baked.err;
    const Outcome drawn =
        run("umbriel", {"render", "demo:car", "--shadow", "light-map", "--light-map", folder / "car.umlight", "--size",
                        "192x108", "--frames", "2", "--fps", "2", "--json", "--out", folder / "car.%04d.exr"});
    ASSERT_EQ(drawn.exitCode, 0) << drawn.err;
    EXPECT_EQ(drawn.err.find("stale"), std::string::npos) << drawn.err;
    const json frames = json::parse(drawn.out)["frames"];
    // Both maps at first, then only that of what moves: what stays is not drawn again.
    const int first = frames[0]["servers"][0]["shadow_triangles"], second = frames[1]["servers"][0]["shadow_triangles"];
    EXPECT_GT(second, 0);
    EXPECT_GT(first, second);
}

}  // namespace
}  // namespace umbriel::e2e
