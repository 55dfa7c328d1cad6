#include "common/image/png_io.h"

#include <gtest/gtest.h>
#include <png.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "common/image/display.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

using test::TemporaryFolder;

std::vector<std::uint8_t> anyBytes(std::size_t count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<std::uint8_t> bytes(count);
    for (std::uint8_t& byte : bytes) {
        byte = static_cast<std::uint8_t>(random());
    }
    return bytes;
}

TEST(Png, OpaqueCodesSurviveTheFileTwice) {
    const TemporaryFolder directory;
    const std::vector<std::uint8_t> bytes = anyBytes(17 * 9 * 3, 3);
    ASSERT_TRUE(writePngBytes(directory / "a.png", 17, 9, 3, bytes).has_value());
    const Result<LayeredImage> read = readPng(directory / "a.png");
    ASSERT_TRUE(read.has_value()) << read.error().message;
    ASSERT_EQ(read->width(), 17);
    ASSERT_EQ(read->height(), 9);
    for (std::size_t i = 0; i < 17 * 9; ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            EXPECT_EQ(displayByte(read->rgba.samples()[i * 4 + c], 1.0), bytes[i * 3 + c]);
        }
        EXPECT_EQ(read->rgba.samples()[i * 4 + 3], 1.0F);
    }
    ASSERT_TRUE(writePng(directory / "b.png", read->rgba).has_value());
    EXPECT_EQ(test::contentOf(directory / "a.png"), test::contentOf(directory / "b.png"));
    EXPECT_EQ(directory.names(), (std::vector<std::string>{"a.png", "b.png"}));
}

TEST(Png, PremultipliedColourShowsOverBlackUnlessAlphaIsAskedFor) {
    const TemporaryFolder directory;
    FloatImage image = makeRgbaImage(3, 1);
    image.samples() = {0.5F, 0.25F, 0.125F, 0.5F, 1.0F, 1.0F, 1.0F, 0.0F, std::nanf(""), 2.0F, -1.0F, 1.0F};
    ASSERT_TRUE(writePng(directory / "black.png", image).has_value());
    ASSERT_TRUE(writePng(directory / "alpha.png", image, {0.0, true}).has_value());
    const Result<LayeredImage> black = readPng(directory / "black.png");
    const Result<LayeredImage> alpha = readPng(directory / "alpha.png");
    ASSERT_TRUE(black.has_value() && alpha.has_value());
    // 0.5 linear is code 188, 0.25 is 137, 0.125 is 99 (sRGB by hand: 0.73536, 0.53710, 0.38857 times 255).
    EXPECT_EQ(black->rgba.at(0, 0, 0), linearFromSrgbByte(188));
    EXPECT_EQ(black->rgba.at(0, 0, 1), linearFromSrgbByte(137));
    EXPECT_EQ(black->rgba.at(0, 0, 2), linearFromSrgbByte(99));
    EXPECT_EQ(black->rgba.at(0, 0, 3), 1.0F);
    EXPECT_EQ(black->rgba.at(1, 0, 0), 1.0F);
    EXPECT_EQ(black->rgba.at(2, 0, 0), 0.0F);
    EXPECT_EQ(black->rgba.at(2, 0, 1), 1.0F);
    EXPECT_EQ(black->rgba.at(2, 0, 2), 0.0F);
    // Straight 1, 0.5, 0.25 under 128 / 255.
    EXPECT_EQ(alpha->rgba.at(0, 0, 3), 128.0F / 255.0F);
    EXPECT_EQ(alpha->rgba.at(0, 0, 0), 128.0F / 255.0F);
    EXPECT_EQ(alpha->rgba.at(0, 0, 1), linearFromSrgbByte(188) * (128.0F / 255.0F));
    EXPECT_EQ(alpha->rgba.at(1, 0, 0), 0.0F);
}

TEST(Png, ExposureIsAppliedBeforeEncoding) {
    const TemporaryFolder directory;
    FloatImage image = makeRgbaImage(1, 1);
    image.samples() = {0.25F, 4.0F, 0.0625F, 1.0F};
    ASSERT_TRUE(writePng(directory / "a.png", image, {1.0, false}).has_value());
    const Result<LayeredImage> read = readPng(directory / "a.png");
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->rgba.at(0, 0, 0), linearFromSrgbByte(188));
    EXPECT_EQ(read->rgba.at(0, 0, 1), 1.0F);
    EXPECT_EQ(read->rgba.at(0, 0, 2), linearFromSrgbByte(99));
}

// Any kind of file libpng can write, by its simplified interface.
void writeForeign(const std::filesystem::path& path, png_uint_32 format, int width, int height, const void* samples,
                  const void* colormap = nullptr, png_uint_32 colors = 0) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(width);
    image.height = static_cast<png_uint_32>(height);
    image.format = format;
    image.colormap_entries = colors;
    ASSERT_NE(png_image_write_to_file(&image, path.c_str(), 0, samples, 0, colormap), 0) << image.message;
}

TEST(Png, GreyPaletteAndGreyAlphaBecomeColour) {
    const TemporaryFolder directory;
    const std::vector<std::uint8_t> grey{0, 188};
    writeForeign(directory / "grey.png", PNG_FORMAT_GRAY, 2, 1, grey.data());
    const std::vector<std::uint8_t> palette{255, 0, 0, 0, 188, 0};
    const std::vector<std::uint8_t> indices{1, 0};
    writeForeign(directory / "palette.png", PNG_FORMAT_RGB_COLORMAP, 2, 1, indices.data(), palette.data(), 2);
    const std::vector<std::uint8_t> greyAlpha{255, 51, 0, 255};
    writeForeign(directory / "ga.png", PNG_FORMAT_GA, 2, 1, greyAlpha.data());

    const Result<LayeredImage> fromGrey = readPng(directory / "grey.png");
    const Result<LayeredImage> fromPalette = readPng(directory / "palette.png");
    const Result<LayeredImage> fromGreyAlpha = readPng(directory / "ga.png");
    ASSERT_TRUE(fromGrey.has_value() && fromPalette.has_value() && fromGreyAlpha.has_value());
    const float half = linearFromSrgbByte(188);
    EXPECT_EQ(fromGrey->rgba.samples(), (std::vector<float>{0, 0, 0, 1, half, half, half, 1}));
    EXPECT_EQ(fromPalette->rgba.samples(), (std::vector<float>{0, half, 0, 1, 1, 0, 0, 1}));
    EXPECT_EQ(fromGreyAlpha->rgba.samples(), (std::vector<float>{0.2F, 0.2F, 0.2F, 0.2F, 0, 0, 0, 1}));
}

// 16-bit samples by libpng's full interface, since the simplified one only takes linear light. Interlaced on demand.
void writeSixteen(const std::filesystem::path& path, int width, int height, int interlace,
                  const std::vector<std::uint16_t>& rgb) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, file);
    png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 16, PNG_COLOR_TYPE_RGB,
                 interlace, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    png_set_swap(png);
    std::vector<png_bytep> rows;
    for (int y = 0; y < height; ++y) {
        rows.push_back(
            reinterpret_cast<png_bytep>(const_cast<std::uint16_t*>(&rgb[static_cast<std::size_t>(y * width) * 3])));
    }
    png_write_image(png, rows.data());
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    std::fclose(file);
}

TEST(Png, SixteenBitsKeepTheirPrecision) {
    const TemporaryFolder directory;
    std::vector<std::uint16_t> codes;
    for (int i = 0; i < 13 * 11 * 3; ++i) {
        codes.push_back(static_cast<std::uint16_t>(i * 152));
    }
    for (const int interlace : {PNG_INTERLACE_NONE, PNG_INTERLACE_ADAM7}) {
        writeSixteen(directory / "a.png", 13, 11, interlace, codes);
        const Result<LayeredImage> read = readPng(directory / "a.png");
        ASSERT_TRUE(read.has_value()) << read.error().message;
        for (std::size_t i = 0; i < codes.size(); ++i) {
            EXPECT_EQ(read->rgba.samples()[i / 3 * 4 + i % 3], static_cast<float>(linearFromSrgb(codes[i] / 65535.0)));
        }
    }
}

TEST(Png, LimitsHoldAtTheirValueAndNotBeyond) {
    const TemporaryFolder directory;
    ASSERT_TRUE(writePngBytes(directory / "a.png", 10, 6, 3, anyBytes(180, 1)).has_value());
    ImageLimits limits;
    limits.pixels = 60;
    limits.bytes = 60 * (16 + 4);  // floats and libpng's rows
    EXPECT_TRUE(readPng(directory / "a.png", limits).has_value());
    limits.pixels = 59;
    EXPECT_FALSE(readPng(directory / "a.png", limits).has_value());
    limits.pixels = 60;
    --limits.bytes;
    EXPECT_FALSE(readPng(directory / "a.png", limits).has_value());
}

TEST(Png, EmptyPictureIsBadInput) {
    const TemporaryFolder directory;
    EXPECT_FALSE(writePng(directory / "a.png", makeRgbaImage(0, 4)).has_value());
    EXPECT_TRUE(directory.names().empty());
}

}  // namespace
}  // namespace umbriel
