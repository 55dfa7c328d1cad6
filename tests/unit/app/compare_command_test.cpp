#include "client/app/compare_command.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/image/exr_io.h"
#include "common/image/png_io.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

using nlohmann::json;
using test::TemporaryFolder;

struct Outcome {
    int code = -1;
    std::string out;
    std::string err;
};

Outcome run(const CompareOptions& options) {
    std::ostringstream out;
    std::ostringstream err;
    const int code = runCompare(options, out, err);
    return {code, out.str(), err.str()};
}

LayeredImage grey(int width, int height) {
    LayeredImage image;
    image.rgba = FloatImage(width, height, {"R", "G", "B", "A"}, 0.5F);
    return image;
}

std::vector<std::string> keysOf(const json& object) {
    std::vector<std::string> keys;
    for (const auto& [key, value] : object.items()) {
        keys.push_back(key);
    }
    return keys;
}

TEST(CompareCommand, JsonHasTheContractsKeys) {
    const TemporaryFolder directory;
    LayeredImage image = grey(8, 4);
    ASSERT_TRUE(writeExr(directory / "a.exr", image).has_value());
    image.rgba.at(7, 0, 1) = 0.75F;
    image.rgba.at(0, 0, 3) = 0.0F;
    ASSERT_TRUE(writeExr(directory / "b.exr", image).has_value());
    const Outcome outcome = run({directory / "a.exr", directory / "b.exr", 0.0, true, {}});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.err, "");
    const json result = json::parse(outcome.out);
    EXPECT_EQ(keysOf(result), (std::vector<std::string>{"bit_differing", "differing", "holes", "mae", "max",
                                                        "over_8_255", "pixels", "rmse"}));
    EXPECT_EQ(result["pixels"], 32);
    EXPECT_EQ(result["differing"], 2);
    EXPECT_EQ(result["bit_differing"], 2);
    EXPECT_EQ(result["over_8_255"], 2);
    EXPECT_EQ(result["holes"], 1);
    EXPECT_EQ(result["max"], 0.25);
    EXPECT_EQ(result["mae"], 0.25 / 96);
    EXPECT_EQ(result["rmse"], std::sqrt(0.0625 / 96));
}

TEST(CompareCommand, TilesAreCutByTheGridRuleFromTheLowerLeft) {
    const TemporaryFolder directory;
    LayeredImage image = grey(7, 5);
    ASSERT_TRUE(writeExr(directory / "a.exr", image).has_value());
    image.rgba.at(6, 4, 0) = 1.0F;  // bottom right: column 2, row 0
    image.rgba.at(0, 0, 0) = 1.0F;  // top left: column 0, row 1
    ASSERT_TRUE(writeExr(directory / "b.exr", image).has_value());
    const Outcome outcome = run({directory / "a.exr", directory / "b.exr", 0.0, true, std::array{3, 2}});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const json result = json::parse(outcome.out);
    ASSERT_EQ(result["tiles"].size(), 6U);
    int pixels = 0;
    for (const json& tile : result["tiles"]) {
        pixels += tile["pixels"].get<int>();
        const bool hit = (tile["column"] == 2 && tile["row"] == 0) || (tile["column"] == 0 && tile["row"] == 1);
        EXPECT_EQ(tile["differing"], hit ? 1 : 0) << tile;
    }
    EXPECT_EQ(pixels, 35);
    const json& last = result["tiles"][5];
    EXPECT_EQ(last["x"], 4);  // floor(2 * 7 / 3)
    EXPECT_EQ(last["width"], 3);
    EXPECT_EQ(last["y"], 2);  // floor(5 / 2)
    EXPECT_EQ(last["height"], 3);
}

TEST(CompareCommand, NonFiniteSamplesAreReportedAndLeaveJsonSound) {
    const TemporaryFolder directory;
    LayeredImage image = grey(2, 1);
    ASSERT_TRUE(writeExr(directory / "a.exr", image).has_value());
    image.rgba.at(0, 0, 0) = std::nanf("");
    image.rgba.at(1, 0, 0) = INFINITY;
    ASSERT_TRUE(writeExr(directory / "b.exr", image).has_value());
    const json result = json::parse(run({directory / "a.exr", directory / "b.exr", 0.0, true, {}}).out);
    EXPECT_EQ(result["non_finite"], 2);
    EXPECT_EQ(result["differing"], 2);
    EXPECT_EQ(result["max"], 0.0);
}

TEST(CompareCommand, LayersAreListed) {
    const TemporaryFolder directory;
    LayeredImage image = grey(2, 1);
    image.layers.push_back({"ids", UintImage(2, 1, {"node"})});
    image.layers.push_back({"light.k\xff", FloatImage(2, 1, {"factor"})});  // no UTF-8
    ASSERT_TRUE(writeExr(directory / "a.exr", image).has_value());
    image.layers.pop_back();
    std::get<UintImage>(image.layers[0].image).at(1, 0, 0) = 3;
    ASSERT_TRUE(writeExr(directory / "b.exr", image).has_value());
    const json result = json::parse(run({directory / "a.exr", directory / "b.exr", 0.0, true, {}}).out);
    ASSERT_EQ(result["layers"].size(), 2U);
    EXPECT_EQ(result["layers"][0], (json{{"name", "ids"}, {"type", "uint"}, {"in", "both"}, {"bit_differing", 1}}));
    EXPECT_EQ(result["layers"][1]["in"], "a");
    const Outcome table = run({directory / "a.exr", directory / "b.exr", 0.0, false, std::array{2, 1}});
    EXPECT_EQ(table.code, 0);
    EXPECT_NE(table.out.find("layer ids (uint): bit_differing 1"), std::string::npos) << table.out;
    EXPECT_NE(table.out.find("only in A"), std::string::npos) << table.out;
}

// An EXR and the PNG made of it show the same: the PNG is the EXR's display transform.
TEST(CompareCommand, PictureAndItsPngDoNotDiffer) {
    const TemporaryFolder directory;
    LayeredImage image = grey(16, 16);
    for (int i = 0; i < 256; ++i) {
        image.rgba.at(i % 16, i / 16, 0) = static_cast<float>(i) / 200.0F;
        image.rgba.at(i % 16, i / 16, 3) = 1.0F;
    }
    ASSERT_TRUE(writeExr(directory / "a.exr", image).has_value());
    ASSERT_TRUE(writePng(directory / "a.png", image.rgba).has_value());
    const json result = json::parse(run({directory / "a.exr", directory / "a.png", 0.0, true, {}}).out);
    EXPECT_EQ(result["differing"], 0);
    EXPECT_GT(result["bit_differing"], 200);
}

TEST(CompareCommand, BadInputEndsWithTwoAndOneMessage) {
    const TemporaryFolder directory;
    ASSERT_TRUE(writeExr(directory / "a.exr", grey(4, 4)).has_value());
    ASSERT_TRUE(writeExr(directory / "small.exr", grey(4, 3)).has_value());
    test::writeContent(directory / "text.exr", "hello");
    const CompareOptions sound{directory / "a.exr", directory / "a.exr", 0.0, true, {}};
    const auto with = [&](auto change) {
        CompareOptions options = sound;
        change(options);
        return options;
    };
    for (const CompareOptions& options :
         {with([&](CompareOptions& o) { o.b = directory / "missing.exr"; }),
          with([&](CompareOptions& o) { o.a = directory / "text.exr"; }),
          with([&](CompareOptions& o) { o.b = directory / "small.exr"; }),
          with([&](CompareOptions& o) { o.a = directory.path(); }), with([&](CompareOptions& o) {
              o.grid = std::array{0, 1};
          }),
          with([&](CompareOptions& o) {
              o.grid = std::array{5, 1};
          }),
          with([&](CompareOptions& o) { o.exposure = NAN; })}) {
        const Outcome outcome = run(options);
        EXPECT_EQ(outcome.code, 2);
        EXPECT_EQ(outcome.out, "");
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    }
    EXPECT_EQ(run(sound).code, 0);
}

TEST(CompareCommand, OutputThatCannotBeWrittenIsAFailure) {
    const TemporaryFolder directory;
    ASSERT_TRUE(writeExr(directory / "a.exr", grey(4, 4)).has_value());
    std::ofstream full("/dev/full");
    std::ostringstream err;
    EXPECT_EQ(runCompare({directory / "a.exr", directory / "a.exr", 0.0, true, {}}, full, err), 1);
    EXPECT_NE(err.str(), "");
}

// White from column 10 on, and from column 13 on: 3 of 32 columns are more than the threshold apart.
TEST(CompareCommand, AllMeasuresComeOnRequestOnly) {
    const TemporaryFolder directory;
    LayeredImage a = grey(32, 16);
    LayeredImage b = a;
    for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 32; ++x) {
            for (int c = 0; c < 3; ++c) {
                a.rgba.at(x, y, c) = x < 10 ? 0.0F : 1.0F;
                b.rgba.at(x, y, c) = x < 13 ? 0.0F : 1.0F;
            }
        }
    }
    ASSERT_TRUE(writeExr(directory / "a.exr", a).has_value());
    ASSERT_TRUE(writeExr(directory / "b.exr", b).has_value());
    CompareOptions options{directory / "a.exr", directory / "b.exr", 0.0, true, {}};
    EXPECT_EQ(keysOf(json::parse(run(options).out)).size(), 8U);
    options.measures = "all";
    options.threshold = 0.5;
    const json all = json::parse(run(options).out);
    EXPECT_EQ(keysOf(all).size(), 12U);
    EXPECT_EQ(all["above_threshold"], json({{"threshold", 0.5}, {"pixels", 48}, {"share", 48.0 / 512.0}}));
    EXPECT_EQ(all["edge_displacement"]["edges_a"], 16);
    EXPECT_EQ(all["edge_displacement"]["a_to_b"]["median"], 3.0);
    EXPECT_EQ(all["edge_displacement"]["b_to_a"]["p95"], 3.0);
    EXPECT_NEAR(all["delta_e"]["mean"].get<double>(), 100.0 * 3.0 / 32.0, 1e-3);
    EXPECT_EQ(all["delta_e"]["median"], 0.0);
    // Beside the edge 0.6 + 0.1 of white, in the row next to it -0.1.
    EXPECT_NEAR(all["mach_band"]["max"].get<double>(), 0.7, 1e-6);
    EXPECT_NEAR(all["mach_band"]["overshoot"]["max"].get<double>(), 0.1, 1e-6);

    // No edge in B: no distance, which JSON says as null.
    ASSERT_TRUE(writeExr(directory / "flat.exr", grey(32, 16)).has_value());
    options.b = directory / "flat.exr";
    EXPECT_TRUE(json::parse(run(options).out)["edge_displacement"]["a_to_b"]["median"].is_null());

    options.json = false;
    EXPECT_NE(run(options).out.find("deltaE"), std::string::npos);
    options.measures = "basic";
    EXPECT_EQ(run(options).out.find("deltaE"), std::string::npos);
    options.measures = "most";
    EXPECT_EQ(run(options).code, 2);
    options.measures = "all";
    options.threshold = -1.0;
    EXPECT_EQ(run(options).code, 2);
}

}  // namespace
}  // namespace umbriel
