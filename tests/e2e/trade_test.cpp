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
    const std::string scene = folder / "box.obj";
    writeFile(scene,
              "v -5 0 5\nv 5 0 5\nv 5 0 -5\nv -5 0 -5\nv -1 1 1\nv 1 1 1\nv 1 1 -1\nv -1 1 -1\nf 1 2 3\nf 1 3 4\nf 5 6 "
              "7\nf 5 7 8\n");
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
