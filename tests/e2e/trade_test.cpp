// umbriel trade as a user runs it.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/e2e/run_program.h"

namespace umbriel::e2e {
namespace {

using json = nlohmann::json;

const std::vector<std::string> kSmall = {"--size",      "192x108", "--techniques", "none,std",
                                         "--map-sizes", "64,512",  "--frames",     "1"};

std::vector<std::string> with(std::vector<std::string> first, const std::vector<std::string>& more) {
    first.insert(first.end(), more.begin(), more.end());
    return first;
}

// A box over a floor.
std::string boxScene(const TemporaryFolder& folder) {
    const std::string scene = folder / "box.obj";
    writeFile(scene,
              "v -5 0 5\nv 5 0 5\nv 5 0 -5\nv -5 0 -5\nv -1 1 1\nv 1 1 1\nv 1 1 -1\nv -1 1 -1\nf 1 2 3\nf 1 3 4\nf 5 6 "
              "7\nf 5 7 8\n");
    return scene;
}

TEST(Trade, MapsOfMoreTexelsHaveLessErrorAndAllRowsAreThere) {
    TemporaryFolder folder;
    const Outcome outcome =
        run("umbriel",
            with({"trade", "demo:palms", "--json", "--out", folder / "t.html", "--out", folder / "t.csv"}, kSmall));
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    const json result = json::parse(outcome.out);
    ASSERT_EQ(result["rows"].size(), 3u);
    double none = 0.0, coarse = 0.0, fine = 0.0;
    for (const json& row : result["rows"]) {
        EXPECT_EQ(row["map_size"].is_null(), row["technique"] == "none");
        if (row["technique"] == "none")
            none = row["error"];
        else
            (row["map_size"] == 64 ? coarse : fine) = row["error"];
        EXPECT_DOUBLE_EQ(row["error"].get<double>(), row["leak"].get<double>() + row["acne"].get<double>());
        EXPECT_GT(row["cpu_ms"].get<double>(), 0.0);
        EXPECT_EQ(row["map_bytes"],
                  row["technique"] == "none" ? 0 : 4 * row["map_size"].get<int>() * row["map_size"].get<int>());
    }
    EXPECT_LT(fine, coarse);
    EXPECT_LT(fine, none);
    EXPECT_GT(result["judged_share"].get<double>(), 0.8);
    EXPECT_GT(std::filesystem::file_size(folder / "t.html"), 10000u);
    EXPECT_GT(std::filesystem::file_size(folder / "t.csv"), 300u);
}

TEST(Trade, ErrorsAreTheSameToTheLastBitEveryTime) {
    std::vector<json> results;
    for (int i = 0; i < 2; ++i) {
        const Outcome outcome = run("umbriel", with({"trade", "demo:palms", "--json", "--light-size", "0.02"}, kSmall));
        ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
        results.push_back(json::parse(outcome.out));
    }
    for (std::size_t row = 0; row < results[0]["rows"].size(); ++row)
        for (const char* key :
             {"technique", "map_size", "error", "leak", "acne", "rmse", "edge_median_px", "edge_p95_px", "delta_e"})
            EXPECT_EQ(results[0]["rows"][row][key], results[1]["rows"][row][key]) << key;
}

TEST(Trade, AStoredChoiceIsTakenByRenderAndAWantedErrorThatNothingKeepsIsAFailure) {
    TemporaryFolder folder;
    const std::string scene = boxScene(folder);
    const std::vector<std::string> light = {"--light", "dir:0.5,-1,-0.2"};
    const Outcome chosen =
        run("umbriel", with(with({"trade", scene, "--max-error", "0.02", "--store", "--json"}, kSmall), light));
    ASSERT_EQ(chosen.exitCode, 0) << chosen.err;
    ASSERT_TRUE(std::filesystem::exists(scene + ".umtrade.json"));
    const auto shadowed = [&](const std::vector<std::string>& more) {
        const Outcome outcome = run("umbriel", with(with({"render", scene, "--size", "96x54", "--json"}, light), more));
        EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
        return json::parse(outcome.out)["frames"][0]["servers"][0]["shadow_triangles"].get<int>() > 0;
    };
    EXPECT_TRUE(shadowed({}));
    EXPECT_FALSE(shadowed({"--shadow", "none"}));
    EXPECT_TRUE(shadowed({"--frame-budget", "100000"}));
    EXPECT_EQ(run("umbriel", with(with({"trade", scene, "--max-error", "0"}, kSmall), light)).exitCode, 1);
    writeFile(scene + ".umtrade.json", "{}");
    const Outcome broken = run("umbriel", {"render", scene, "--size", "96x54", "--json"});
    EXPECT_EQ(broken.exitCode, 2);
    EXPECT_NE(broken.err.find("umtrade.json"), std::string::npos) << broken.err;
}

TEST(Trade, LightMapsAreMeasuredByWhatTheyAreBakedFrom) {
    TemporaryFolder folder;
    const std::string scene = boxScene(folder);
    const std::vector<std::string> light = {"--light", "dir:0.5,-1,-0.2"};
    const auto measured = [&](const std::vector<std::string>& more) {
        const Outcome outcome =
            run("umbriel", with(with({"trade", scene, "--json", "--size", "192x108", "--frames", "1", "--techniques",
                                      "light-map,light-map:rays,light-map:std,light-map:pcf", "--map-sizes", "64"},
                                     light),
                                more));
        EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
        return outcome.exitCode == 0 ? json::parse(outcome.out)["rows"] : json::array();
    };
    // With two eyes and lights of another size than the file's, too.
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{},
          std::vector<std::string>{"--stereo", "pair", "--light-size", "0.05", "--light-samples", "16"}}) {
        const json rows = measured(more);
        ASSERT_EQ(rows.size(), 4u);
        EXPECT_EQ(rows[2]["technique"], "light-map:std");
        EXPECT_EQ(rows[0]["error"], rows[1]["error"]);
        EXPECT_EQ(rows[0]["rmse"], rows[1]["rmse"]);
        // A map of 2048 texels is as good as rays for so few of the atlas, but not its filter, nor for soft light.
        EXPECT_NE(rows[2]["rmse"], rows[3]["rmse"]);
        if (!more.empty()) EXPECT_NE(rows[0]["rmse"], rows[2]["rmse"]);
        for (const json& row : rows) {
            // Where no texel is true, standard maps of 64 texels would be drawn.
            EXPECT_EQ(row["map_bytes"], rows[0]["map_bytes"]);
            EXPECT_LT(row["error"].get<double>(), 0.02) << row;
        }
    }
    const Outcome refused = run("umbriel", with({"trade", scene, "--techniques", "light-map:lisp"}, light));
    EXPECT_EQ(refused.exitCode, 2);
    EXPECT_NE(refused.err.find("technique 'light-map:lisp': lisp: its map is warped"), std::string::npos)
        << refused.err;
}

TEST(Trade, OfEverythingLeavesLightMapsOutWhereNoLightStays) {
    TemporaryFolder folder;
    const std::string scene = boxScene(folder);
    const std::vector<std::string> dark = {"trade",       scene,   "--light",  "none", "--size", "48x32",
                                           "--map-sizes", "32,64", "--frames", "1",    "--json"};
    const Outcome all = run("umbriel", dark);
    ASSERT_EQ(all.exitCode, 0) << all.err;
    std::size_t maps = 0;
    const json result = json::parse(all.out);
    for (const json& row : result["rows"]) {
        EXPECT_NE(row["technique"], "light-map");
        maps += row["technique"] == "std" ? 1 : 0;
    }
    EXPECT_EQ(maps, 2u);
    const std::size_t first = all.err.find("light-map is left out");
    ASSERT_NE(first, std::string::npos) << all.err;
    EXPECT_EQ(all.err.find("light-map is left out", first + 1), std::string::npos) << all.err;
    EXPECT_EQ(run("umbriel", with(dark, {"--techniques", "std,light-map"})).exitCode, 2);
}

TEST(Trade, SheetsShowTheTechniquesThatAreAskedFor) {
    TemporaryFolder folder;
    const std::string scene = boxScene(folder);
    const auto sheet = [&](const std::string& techniques, const std::string& name) {
        return run("umbriel", {"sheet", scene, "--light", "dir:0.5,-1,-0.2", "--size", "64x48", "--map-size", "64",
                               "--techniques", techniques, "--columns", "1", "--out", folder / name});
    };
    ASSERT_EQ(sheet("light-map,light-map:pcf", "two.png").exitCode, 0);
    ASSERT_EQ(sheet("none,light-map:pcf,std:scene", "three.png").exitCode, 0);
    const Outcome other = run("umbriel", {"compare", folder / "two.png", folder / "three.png", "--json"});
    EXPECT_EQ(other.exitCode, 2) << "as many pictures: " << other.out;
    const Outcome refused = sheet("light-map,wishes", "four.png");
    EXPECT_EQ(refused.exitCode, 2);
    EXPECT_NE(refused.err.find("wishes"), std::string::npos) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "four.png"));
}

// What is stored is that a light map is cheapest; baking it is another command.
TEST(Trade, AStoredLightMapThatIsNotThereIsReplacedByTheNextOnTheFront) {
    TemporaryFolder folder;
    const std::string scene = boxScene(folder);
    const std::vector<std::string> light = {"--light", "dir:0.5,-1,-0.2"};
    const auto store = [&](const std::string& front) {
        writeFile(
            scene + ".umtrade.json",
            R"({"umbriel_trade": 1, "scene": "box", "chosen": )"
            R"({"technique": "light-map:pcf", "map_size": 64, "error": 0.01, "wall_ms": 1, "cpu_ms": 1}, "front": [)"
            R"({"technique": "light-map:pcf", "map_size": 64, "error": 0.01, "wall_ms": 1, "cpu_ms": 1})" +
                front + "]}");
    };
    const auto render = [&](const std::vector<std::string>& more = {}) {
        return run(
            "umbriel",
            with(with({"render", scene, "--size", "96x54", "--explain", "--out", folder / "a.exr"}, light), more));
    };
    const auto replaced = [&](const std::string& by) {
        const Outcome outcome = render();
        EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
        const std::size_t at = outcome.err.find("light-map:pcf 64 was chosen by umbriel trade");
        EXPECT_NE(at, std::string::npos) << outcome.err;
        EXPECT_EQ(outcome.err.find("warning", at), std::string::npos) << outcome.err;
        EXPECT_NE(outcome.err.find("Drawn with " + by), std::string::npos) << outcome.err;
        return outcome;
    };
    const std::string front = R"(, {"technique": "blob", "map_size": 512, "error": 0.03, "wall_ms": 2, "cpu_ms": 2},)"
                              R"( {"technique": "lisp", "map_size": 128, "error": 0.009, "wall_ms": 3, "cpu_ms": 3},)"
                              R"( {"technique": "lisp", "map_size": 256, "error": 0.002, "wall_ms": 4, "cpu_ms": 4})";
    store(front);
    EXPECT_NE(replaced("lisp 128").out.find("128x128"), std::string::npos);
    // Nothing else was measured: what light maps are where they are not true.
    store("");
    replaced("std 512");
    EXPECT_EQ(render({"--frame-budget", "10"}).exitCode, 2);
    // Asked for by name it stays an error.
    const Outcome named = render({"--shadow", "light-map"});
    EXPECT_EQ(named.exitCode, 2);
    EXPECT_NE(named.err.find("--shadow light-map: there is no"), std::string::npos) << named.err;
    store(front);
    EXPECT_EQ(render({"--frame-budget", "10"}).exitCode, 0);
    writeFile(scene + ".umlight", "damaged");
    replaced("lisp 128");
    EXPECT_EQ(render({"--light-map", scene + ".umlight"}).exitCode, 2);
    ASSERT_EQ(run("umbriel", with({"bake", scene, "--light-map", "64", "--from", "pcf"}, light)).exitCode, 0);
    const Outcome baked = render();
    EXPECT_EQ(baked.exitCode, 0);
    EXPECT_EQ(baked.err.find("Drawn with"), std::string::npos) << baked.err;
    EXPECT_NE(baked.out.find("R8 and charts 64x64"), std::string::npos) << baked.out;
}

TEST(Trade, WithoutAJudgedShadowNothingIsChosen) {
    TemporaryFolder folder;
    const std::string scene = folder / "floor.obj";
    writeFile(scene, "v -5 0 5\nv 5 0 5\nv 5 0 -5\nv -5 0 -5\nf 1 2 3\nf 1 3 4\n");
    const Outcome outcome =
        run("umbriel", with({"trade", scene, "--light", "none", "--max-error", "0.5", "--store"}, kSmall));
    EXPECT_EQ(outcome.exitCode, 1);
    EXPECT_NE(outcome.out.find("nothing is chosen"), std::string::npos) << outcome.out;
    EXPECT_EQ(folder.names(), std::vector<std::string>{"floor.obj"});
}

TEST(Trade, WhatCannotBeWrittenIsSaidBeforeAnythingIsMeasured) {
    TemporaryFolder folder;
    for (const std::string preset : {"", "table2"}) {
        std::vector<std::string> arguments{"trade", "demo:palms", "--out", folder / "nowhere/t.csv"};
        if (!preset.empty()) arguments.insert(arguments.end(), {"--preset", preset});
        // Nobody answers at this address, which would be said otherwise.
        const Outcome outcome = run("umbriel", with(arguments, {"--servers", "127.0.0.1:9"}));
        EXPECT_EQ(outcome.exitCode, 1);
        EXPECT_NE(outcome.err.find("nowhere"), std::string::npos) << outcome.err;
    }
}

TEST(Trade, WrongUsageIsRefusedInWords) {
    for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
             {"trade"},
             {"trade", "demo:palms", "--techniques", "magic"},
             {"trade", "demo:palms", "--techniques", "std:never"},
             {"trade", "demo:palms", "--map-sizes", "12,x"},
             {"trade", "demo:palms", "--map-sizes", "99999"},
             {"trade", "demo:palms", "--frames", "0"},
             {"trade", "demo:palms", "--max-error", "-1"},
             {"trade", "demo:palms", "--budget", "0"},
             {"trade", "demo:palms", "--flicker", "1"},
             {"trade", "demo:palms", "--light-size", "-1"},
             {"trade", "demo:palms", "--out", "x.txt"},
             {"trade", "demo:palms", "--judge", "no such node", "--size", "64x36", "--techniques", "none"},
             {"trade", "--preset", "magic"},
             {"render", "demo:palms", "--frame-budget", "10", "--size", "64x36"}}) {
        const Outcome outcome = run("umbriel", arguments);
        EXPECT_EQ(outcome.exitCode, 2) << testing::PrintToString(arguments) << outcome.err;
        EXPECT_FALSE(outcome.err.empty());
    }
}

}  // namespace
}  // namespace umbriel::e2e
