#include "client/app/hdr_command.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/image/display.h"
#include "common/image/exr_io.h"
#include "common/image/image_reader.h"
#include "common/image/png_io.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 32;

double radianceAt(int x, int y) {
    return 0.05 * std::pow(100.0, (x + static_cast<double>(y) / kHeight) / kWidth);
}

std::uint8_t codeAt(int x, int y, double seconds) {
    return static_cast<std::uint8_t>(
        std::floor(255.0 * std::min(std::pow(radianceAt(x, y) * seconds, 1.0 / 2.2), 1.0) + 0.5));
}

// A series of PNG files, white at exposure 1, gamma 2.2.
class HdrCommand : public ::testing::Test {
 protected:
    HdrCommand() {
        for (const double seconds : kSeconds) {
            std::vector<std::uint8_t> codes;
            for (int y = 0; y < kHeight; ++y) {
                for (int x = 0; x < kWidth; ++x) {
                    codes.insert(codes.end(), 3, codeAt(x, y, seconds));
                }
            }
            options.photographs.push_back(folder / ("p" + std::to_string(options.photographs.size()) + ".png"));
            EXPECT_TRUE(writePngBytes(options.photographs.back(), kWidth, kHeight, 3, codes).has_value());
        }
        options.times = "1/16,1/8,0.25,1/2,1,2,4,8";
    }

    int run() {
        out.str("");
        err.str("");
        return runHdr(options, out, err);
    }

    void expectRefusal(const std::string& words) {
        EXPECT_EQ(run(), 2) << words;
        EXPECT_NE(err.str().find(words), std::string::npos) << err.str();
        EXPECT_EQ(out.str(), "");
    }

    static constexpr double kSeconds[] = {1.0 / 16, 1.0 / 8, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0};
    test::TemporaryFolder folder;
    HdrOptions options;
    std::ostringstream out;
    std::ostringstream err;
};

TEST_F(HdrCommand, WritesTheRadianceMapWithItsCurve) {
    options.outs = {folder / "map.exr", folder / "map.hdr", folder / "map.png"};
    options.json = true;
    ASSERT_EQ(run(), 0) << err.str();
    const auto json = nlohmann::json::parse(out.str());
    EXPECT_EQ(json["size"], nlohmann::json({kWidth, kHeight}));
    EXPECT_EQ(json["photographs"].size(), 8U);
    EXPECT_EQ(json["photographs"][0]["seconds"], 1.0 / 16);
    EXPECT_EQ(json["merge"], "weighted");
    EXPECT_EQ(json["white"], 0);
    EXPECT_EQ(json["response"]["red"].size(), 256U);
    EXPECT_EQ(json["response"]["green"][128], 0.0);
    EXPECT_EQ(json["files"].size(), 3U);

    const Result<LayeredImage> exr = readExr(folder / "map.exr");
    ASSERT_TRUE(exr.has_value());
    const double scale = std::pow(128.0 / 255.0, 2.2);  // the exposure of code 128
    for (const int x : {10, 48, 90}) {
        EXPECT_NEAR(exr->rgba.at(x, 16, 1) * scale / radianceAt(x, 16), 1.0, 0.02) << x;
    }
    std::istringstream curve(exr->texts.at("umbriel.response.red"));
    for (int z = 0; z < 256; ++z) {
        double value = 0.0;
        ASSERT_TRUE(curve >> value);
        EXPECT_NEAR(value, json["response"]["red"][static_cast<std::size_t>(z)].get<double>(), 1e-7);
    }
    EXPECT_EQ(exr->texts.at("umbriel.times"), "0.0625 0.125 0.25 0.5 1 2 4 8");
    EXPECT_EQ(exr->texts.at("umbriel.merge"), "weighted");

    const Result<LayeredImage> hdr = readImage(folder / "map.hdr");
    ASSERT_TRUE(hdr.has_value());
    EXPECT_NEAR(hdr->rgba.at(48, 16, 0) / exr->rgba.at(48, 16, 0), 1.0, 1.0 / 255.0);
    // The logarithmic mean comes to 0.18 before Reinhard's curve.
    const double exposed = exr->rgba.at(48, 16, 0) * std::exp2(json["exposure"].get<double>());
    const Result<LayeredImage> png = readImage(folder / "map.png");
    ASSERT_TRUE(png.has_value());
    EXPECT_EQ(displayByte(png->rgba.at(48, 16, 0), 1.0),
              displayByte(static_cast<float>(exposed / (1.0 + exposed)), 1.0));
    EXPECT_NEAR(exposed, 0.18, 0.01);
}

TEST_F(HdrCommand, SameInputGivesTheSameBytes) {
    options.outs = {folder / "a.exr"};
    ASSERT_EQ(run(), 0);
    const std::string first = out.str();
    options.outs = {folder / "b.exr"};
    ASSERT_EQ(run(), 0);
    EXPECT_EQ(test::contentOf(folder / "a.exr"), test::contentOf(folder / "b.exr"));
    EXPECT_NE(first.find("8 photographs, 96 x 32 pixels"), std::string::npos) << first;
}

TEST_F(HdrCommand, TimesComeFromAFileToo) {
    options.outs = {folder / "a.exr"};
    ASSERT_EQ(run(), 0);
    std::string lines = "# name seconds aperture\n\n";
    for (int i = 7; i >= 0; --i) {
        lines += "p" + std::to_string(i) + ".png " + std::to_string(kSeconds[i]) + " 5.6  # comment\n";
    }
    test::writeContent(folder / "times.txt", lines);
    options.times = "@" + (folder / "times.txt").string();
    options.outs = {folder / "b.exr"};
    ASSERT_EQ(run(), 0) << err.str();
    EXPECT_EQ(test::contentOf(folder / "a.exr"), test::contentOf(folder / "b.exr"));
    options.photographs.push_back(folder / "other.png");
    expectRefusal("says nothing of 'other.png'");
    test::writeContent(folder / "times.txt", "p0.png soon\n");
    expectRefusal("line 1");
    options.times = "@" + (folder / "none.txt").string();
    expectRefusal("none.txt");
}

// The same attributes that a JPEG's EXIF becomes, in EXR files of the same codes.
TEST_F(HdrCommand, TimesComeFromThePhotographs) {
    options.outs = {folder / "a.exr"};
    options.merge = "nearest";
    ASSERT_EQ(run(), 0);
    const auto writeWithTags = [this](std::size_t i, float aperture) {
        const Result<LayeredImage> read = readPng(folder / ("p" + std::to_string(i) + ".png"));
        ASSERT_TRUE(read.has_value());
        LayeredImage image = *read;
        image.numbers = {{"expTime", static_cast<float>(kSeconds[i])}, {"aperture", aperture}};
        options.photographs[i] = folder / ("p" + std::to_string(i) + ".exr");
        ASSERT_TRUE(writeExr(options.photographs[i], image).has_value());
    };
    for (std::size_t i = 0; i < options.photographs.size(); ++i) {
        writeWithTags(i, 5.6F);
    }
    options.times.clear();
    options.outs = {folder / "b.exr"};
    ASSERT_EQ(run(), 0) << err.str();
    EXPECT_EQ(test::contentOf(folder / "a.exr"), test::contentOf(folder / "b.exr"));
    writeWithTags(3, 8.0F);
    expectRefusal("another aperture (8 instead of 5.6)");
    options.photographs[2] = folder / "p2.png";
    writeWithTags(3, 5.6F);
    expectRefusal("does not say its exposure time");
}

// Any times give some map; those in the reverse order that of the negative.
TEST_F(HdrCommand, TimesInAnotherOrderThanThePhotographsAreRefused) {
    options.outs = {folder / "a.exr"};
    options.times = "8,4,2,1,1/2,0.25,1/8,1/16";
    expectRefusal("p0.png' of 8 s is darker than '");
    EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
}

TEST_F(HdrCommand, WrongUsageIsRefusedInWordsAndWritesNothing) {
    options.outs = {folder / "a.exr"};
    const HdrOptions good = options;
    options.merge = "mean";
    expectRefusal("weighted or nearest");
    options = good;
    options.toneMapping = "film";
    expectRefusal("reinhard");
    options = good;
    options.times = "1,2";
    expectRefusal("2 times for 8 photographs");
    options = good;
    for (const char* times : {"1/0,1", "x", "-1", "1/30s", "", "nan", "1,,2"}) {
        options.times = std::string("1,") + times;
        EXPECT_EQ(run(), 2) << times;
    }
    options = good;
    options.outs = {folder / "a.jpg"};
    expectRefusal(".exr, .hdr or .png");
    options = good;
    options.photographs.resize(1);
    expectRefusal("two photographs");
    options = good;
    options.photographs[5] = folder / "missing.png";
    expectRefusal("missing.png");
    options = good;
    options.exposure = std::nan("");
    expectRefusal("EV");
    options = good;
    options.smoothness = 0.0;
    expectRefusal("smoothness");
    options = good;
    ASSERT_TRUE(writePngBytes(folder / "p4.png", 1, 1, 3, std::vector<std::uint8_t>{1, 2, 3}).has_value());
    expectRefusal("1 x 1");
    LayeredImage linear;
    linear.rgba = FloatImage(kWidth, kHeight, {"R", "G", "B", "A"}, 0.5F);
    ASSERT_TRUE(writeExr(folder / "p4.png", linear).has_value());
    expectRefusal("8 bits");
    EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
}

}  // namespace
}  // namespace umbriel
