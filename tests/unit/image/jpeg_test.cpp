#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "common/image/display.h"
#include "common/image/image_reader.h"
#include "common/image/isolated_reader.h"
#include "tests/unit/image/jpeg_files.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

// 8 x 8 blocks of one colour each: nothing for JPEG to lose but its colour rounding.
std::string blocks() {
    std::vector<std::uint8_t> codes;
    for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 32; ++x) {
            const int block = x / 8 + 4 * (y / 8);
            codes.insert(codes.end(), 3, static_cast<std::uint8_t>(block * 30 + 20));
        }
    }
    return test::jpegOf(32, 16, codes);
}

TEST(Jpeg, SamplesAreTheFilesCodesAsSrgb) {
    const test::TemporaryFolder folder;
    test::writeContent(folder / "a.jpg", blocks());
    const Result<LayeredImage> image = readImageIsolated(folder / "a.jpg");
    ASSERT_TRUE(image.has_value()) << image.error().message;
    ASSERT_EQ(image->width(), 32);
    ASSERT_EQ(image->height(), 16);
    for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 32; ++x) {
            for (int c = 0; c < 3; ++c) {
                EXPECT_NEAR(displayByte(image->rgba.at(x, y, c), 1.0), (x / 8 + 4 * (y / 8)) * 30 + 20, 1);
            }
            EXPECT_EQ(image->rgba.at(x, y, 3), 1.0F);
        }
    }
    EXPECT_TRUE(image->numbers.empty());
}

TEST(Jpeg, ExifTellsTheExposure) {
    const test::TemporaryFolder folder;
    test::writeContent(folder / "a.jpg", test::withExif(blocks(), 1, 8000, 56, 100));
    const Result<LayeredImage> image = readImageIsolated(folder / "a.jpg");
    ASSERT_TRUE(image.has_value()) << image.error().message;
    EXPECT_EQ(image->numbers.at("expTime"), 1.0F / 8000.0F);
    EXPECT_EQ(image->numbers.at("aperture"), 5.6F);
    EXPECT_EQ(image->numbers.at("isoSpeed"), 100.0F);
    test::writeContent(folder / "b.jpg", test::withExif(blocks(), 1, 0, 0, 0));
    EXPECT_TRUE(readImageIsolated(folder / "b.jpg")->numbers.empty());
}

TEST(Jpeg, EveryTruncationIsRefused) {
    const test::TemporaryFolder folder;
    const std::string whole = test::withExif(blocks(), 1, 30, 80, 200);
    for (std::size_t size = 4; size + 2 < whole.size(); size += 17) {  // without its last two bytes it is whole
        test::writeContent(folder / "a.jpg", whole.substr(0, size));
        const Result<LayeredImage> image = readImage(folder / "a.jpg");
        ASSERT_FALSE(image.has_value()) << size << " of " << whole.size();
        EXPECT_EQ(image.error().kind, Error::Kind::BadInput);
    }
}

TEST(Jpeg, DamageEndsWithAnAnswer) {
    const test::TemporaryFolder folder;
    const std::string whole = test::withExif(blocks(), 1, 30, 80, 200);
    std::mt19937_64 random(3);
    for (int i = 0; i < 60; ++i) {
        std::string damaged = whole;
        for (int j = 0; j < 5; ++j) {
            damaged[3 + random() % (damaged.size() - 3)] = static_cast<char>(random());
        }
        test::writeContent(folder / "a.jpg", damaged);
        const Result<LayeredImage> image = readImageIsolated(folder / "a.jpg");
        EXPECT_TRUE(image.has_value() || !image.error().message.empty());
    }
}

TEST(Jpeg, SizesBeyondTheLimitsAreRefused) {
    const test::TemporaryFolder folder;
    test::writeContent(folder / "a.jpg", blocks());
    ImageLimits limits;
    limits.pixels = 32 * 16 - 1;
    EXPECT_FALSE(readImage(folder / "a.jpg", limits).has_value());
    limits.pixels = 32 * 16;
    EXPECT_TRUE(readImage(folder / "a.jpg", limits).has_value());
}

TEST(Jpeg, PhotographsOfTheSharedSeriesLoad) {
    const char* shared = std::getenv("UMBRIEL_SHARED");
    if (shared == nullptr) {
        GTEST_SKIP() << "UMBRIEL_SHARED is not set";
    }
    const std::filesystem::path path = std::filesystem::path(shared) / "data/exposures/lumilab/IMG_6963.jpg";
    const Result<LayeredImage> image = readImageIsolated(path);
    ASSERT_TRUE(image.has_value()) << image.error().message;
    EXPECT_EQ(image->width(), 936);
    EXPECT_EQ(image->height(), 624);
}

}  // namespace
}  // namespace umbriel
