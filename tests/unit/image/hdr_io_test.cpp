#include "common/image/hdr_io.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>

#include "common/image/image_reader.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

FloatImage writtenAndRead(const FloatImage& picture, HdrRepairs* repairs = nullptr) {
    const test::TemporaryFolder folder;
    const Result<HdrRepairs> written = writeHdr(folder / "a.hdr", picture);
    EXPECT_TRUE(written.has_value());
    if (written && repairs != nullptr) {
        *repairs = *written;
    }
    const Result<LayeredImage> read = readImage(folder / "a.hdr");
    EXPECT_TRUE(read.has_value()) << (read ? "" : read.error().message);
    return read ? read->rgba : FloatImage();
}

// Widths on both sides of what can be run-length encoded, values over the whole range of the format, runs and noise.
RC_GTEST_PROP(HdrIo, IsOffByAtMostOne255thOfThePixelsLargestChannel, ()) {
    const int width = *rc::gen::element(1, 7, 8, 9, 127, 128, 129, 300);
    std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
    FloatImage picture = makeRgbaImage(width, 3);
    const int range = static_cast<int>(random() % 250);
    for (float& sample : picture.samples()) {
        const bool same = random() % 4 != 0;
        const int exponent = same ? 3 : static_cast<int>(random() % static_cast<unsigned>(range + 1)) - range / 2;
        const float mantissa = same ? 0.75F : 0.5F + static_cast<float>(random() % 8388608) / 16777216.0F;
        sample = std::ldexp(mantissa, exponent);
    }
    const FloatImage read = writtenAndRead(picture);
    RC_ASSERT(read.width() == width && read.height() == 3);
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < width; ++x) {
            const float* in = picture.pixel(x, y);
            const float* out = read.pixel(x, y);
            const double largest = std::max({in[0], in[1], in[2]});
            for (int c = 0; c < 3; ++c) {
                RC_ASSERT(std::abs(static_cast<double>(in[c]) - static_cast<double>(out[c])) <= largest / 255.0);
            }
            RC_ASSERT(out[3] == 1.0F);
        }
    }
}

// A power of two loses nothing, and what was read once is written again as it is.
TEST(HdrIo, KeepsWhatTheFormatCanHold) {
    FloatImage picture = makeRgbaImage(16, 1);
    for (int x = 0; x < 16; ++x) {
        picture.at(x, 0, 0) = std::ldexp(1.0F, 8 * x - 60);
        picture.at(x, 0, 1) = picture.at(x, 0, 0) / 128.0F;
        picture.at(x, 0, 3) = 1.0F;
    }
    const FloatImage once = writtenAndRead(picture);
    EXPECT_TRUE(test::sameBits(once, picture));
    EXPECT_TRUE(test::sameBits(writtenAndRead(once), once));
}

TEST(HdrIo, RoundsUpIntoTheNextExponent) {
    FloatImage picture = makeRgbaImage(8, 1);
    picture.at(0, 0, 0) = std::nextafter(2.0F, 0.0F);
    // The largest channel rounds up to 2, so that the steps double to 1/64.
    picture.at(1, 0, 0) = 255.8F / 128.0F;
    picture.at(1, 0, 1) = 3.0F / 256.0F * 2.0F;
    const FloatImage read = writtenAndRead(picture);
    EXPECT_EQ(read.at(0, 0, 0), 2.0F);
    EXPECT_EQ(read.at(1, 0, 0), 2.0F);
    EXPECT_EQ(read.at(1, 0, 1), 2.0F / 64.0F);  // half a step of 1/64 off: more than 1/256 of the largest
}

TEST(HdrIo, RepairsAndCountsWhatItCannotHold) {
    FloatImage picture = makeRgbaImage(8, 1);
    picture.at(0, 0, 0) = std::numeric_limits<float>::infinity();
    picture.at(1, 0, 0) = std::numeric_limits<float>::max();
    picture.at(2, 0, 0) = -1.0F;
    picture.at(3, 0, 0) = std::nanf("");
    picture.at(4, 0, 0) = kHdrMax;
    picture.at(5, 0, 0) = 0x1p-129F;
    picture.at(6, 0, 0) = 0x1p-128F;
    HdrRepairs repairs;
    const FloatImage read = writtenAndRead(picture, &repairs);
    EXPECT_EQ(repairs.tooLarge, 2U);
    EXPECT_EQ(repairs.negative, 1U);
    EXPECT_EQ(repairs.nan, 1U);
    const float expected[] = {kHdrMax, kHdrMax, 0.0F, 0.0F, kHdrMax, 0.0F, 0x1p-128F, 0.0F};
    for (int x = 0; x < 8; ++x) {
        EXPECT_EQ(read.at(x, 0, 0), expected[x]) << x;
    }
}

TEST(HdrIo, SamePictureGivesTheSameBytesAndRunsAreShort) {
    const test::TemporaryFolder folder;
    const FloatImage picture(1000, 100, {"R", "G", "B", "A"}, 0.3F);
    ASSERT_TRUE(writeHdr(folder / "a.hdr", picture).has_value());
    ASSERT_TRUE(writeHdr(folder / "b.hdr", picture).has_value());
    EXPECT_EQ(test::contentOf(folder / "a.hdr"), test::contentOf(folder / "b.hdr"));
    // 4 bytes mark a line, each of its 4 planes takes ceil(1000 / 127) = 8 runs of 2 bytes.
    const std::string header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100 +X 1000\n";
    EXPECT_EQ(test::contentOf(folder / "a.hdr").substr(0, header.size()), header);
    EXPECT_EQ(std::filesystem::file_size(folder / "a.hdr"), header.size() + 100 * (4 + 4 * 16));
    EXPECT_EQ(folder.names().size(), 2U);
}

// Programs of Radiance multiply pixels and say so in the header: radiance is what was there before. EXPOSURE lines add up.
TEST(HdrIo, WhatTheHeaderSaysOfTheExposureIsTakenBack) {
    const test::TemporaryFolder folder;
    const auto read = [&](const std::string& lines) {
        std::ofstream(folder / "a.hdr", std::ios::binary)
            << "#?RADIANCE\n" + lines + "FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + "\x80\x40\x20\x81" + "EXPO";
        return readImage(folder / "a.hdr");
    };
    const auto plain = read("");
    ASSERT_TRUE(plain);
    EXPECT_EQ(plain->rgba.at(0, 0, 0), 1.0F);
    for (const auto& [lines, scale] : {std::pair{"EXPOSURE=4\n", 0.25F},
                                       {"EXPOSURE= 0.5\r\n", 2.0F},
                                       {"EXPOSURE=4\nGAMMA=1\nEXPOSURE=+0.25\n", 1.0F},
                                       {"NOEXPOSURE=4\n", 1.0F}}) {
        const auto scaled = read(lines);
        ASSERT_TRUE(scaled) << lines;
        for (int c = 0; c < 3; ++c)
            EXPECT_EQ(scaled->rgba.at(0, 0, c), plain->rgba.at(0, 0, c) * scale) << lines << c;
        EXPECT_EQ(scaled->rgba.at(0, 0, 3), 1.0F);
    }
    for (const char* lines : {"EXPOSURE=0\n", "EXPOSURE=-1\n", "EXPOSURE=nan\n", "EXPOSURE=x\n", "EXPOSURE=1e400\n"}) {
        const auto refused = read(lines);
        ASSERT_FALSE(refused) << lines;
        EXPECT_NE(refused.error().message.find("exposure is no positive number"), std::string::npos)
            << refused.error().message;
    }
}

// The bytes of a picture whose pixels are (x, y, 7) / 256 and whose lines are written as the first axis says, each as
// the second says: X to the right, Y upwards.
std::string laidOut(const std::string& first, const std::string& second, int width, int height) {
    const auto places = [&](const std::string& axis) {
        std::vector<int> all(static_cast<std::size_t>(axis[1] == 'X' ? width : height));
        std::iota(all.begin(), all.end(), 0);
        // Rows are numbered from the top.
        if (axis == "-X" || axis == "+Y") std::reverse(all.begin(), all.end());
        return all;
    };
    std::string bytes = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + first + " " + std::to_string(places(first).size()) +
                        " " + second + " " + std::to_string(places(second).size()) + "\n";
    for (const int line : places(first)) {
        const std::vector<int> along = places(second);
        std::array<std::string, 4> planes;
        for (const int at : along) {
            planes[0] += static_cast<char>(first[1] == 'X' ? line : at);
            planes[1] += static_cast<char>(first[1] == 'X' ? at : line);
            planes[2] += '\x07';
            planes[3] += '\x80';
        }
        const auto length = static_cast<char>(along.size());
        const bool isRunLength = along.size() >= 8;
        if (isRunLength) bytes += {'\2', '\2', '\0', length};
        for (std::size_t i = 0; i < along.size() && !isRunLength; ++i)
            for (const std::string& plane : planes) bytes += plane[i];
        for (const std::string& plane : planes)
            if (isRunLength) bytes += length + plane;
    }
    return bytes;
}

TEST(HdrIo, AllEightLayoutsGiveTheSamePicture) {
    const test::TemporaryFolder folder;
    // Scan lines that are flat, that are run-length encoded, and either as rows and columns differ.
    for (const auto& [width, height] : {std::pair{3, 2}, {11, 9}, {5, 12}, {9, 2}}) {
        for (const auto& [first, second] : {std::pair{"-Y", "+X"},
                                            {"-Y", "-X"},
                                            {"+Y", "+X"},
                                            {"+Y", "-X"},
                                            {"+X", "-Y"},
                                            {"+X", "+Y"},
                                            {"-X", "-Y"},
                                            {"-X", "+Y"}}) {
            std::ofstream(folder / "a.hdr", std::ios::binary) << laidOut(first, second, width, height);
            const auto read = readImage(folder / "a.hdr");
            ASSERT_TRUE(read) << first << second << ": " << read.error().message;
            ASSERT_EQ(read->rgba.width(), width) << first << second;
            ASSERT_EQ(read->rgba.height(), height) << first << second;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const float* pixel = read->rgba.pixel(x, y);
                    const std::vector<float> expected = {static_cast<float>(x) / 256.0F, static_cast<float>(y) / 256.0F,
                                                         7.0F / 256.0F, 1.0F};
                    EXPECT_EQ(std::vector<float>(pixel, pixel + 4), expected)
                        << first << second << ' ' << x << ' ' << y;
                }
        }
    }
}

TEST(HdrIo, OtherLayoutsAreRefused) {
    const test::TemporaryFolder folder;
    for (const char* line : {"-Y 1 +Y 2", "+X 1 -X 2", "-Z 1 +X 2", "-Y 1", "-Y1 +X2", "+X 1 2", "", "-X -Y 1"}) {
        std::ofstream(folder / "a.hdr", std::ios::binary) << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
                                                          << line << "\n12345678";
        const auto read = readImage(folder / "a.hdr");
        ASSERT_FALSE(read) << line;
        EXPECT_EQ(read.error().kind, Error::Kind::BadInput);
    }
}

TEST(HdrIo, EmptyPicturesAndBadPathsAreRefused) {
    const test::TemporaryFolder folder;
    EXPECT_EQ(writeHdr(folder / "a.hdr", makeRgbaImage(0, 5)).error().kind, Error::Kind::BadInput);
    EXPECT_FALSE(writeHdr(folder / "none" / "a.hdr", makeRgbaImage(1, 1)).has_value());
    EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace umbriel
