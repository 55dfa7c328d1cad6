#include "client/import/environment_import.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "common/image/exr_io.h"
#include "common/image/hdr_io.h"
#include "tests/unit/import/gltf_maker.h"

namespace umbriel::test {
namespace {

// 8 x 4, the texel right of the middle red, the top row green.
FloatImage markedPicture() {
    FloatImage image = makeRgbaImage(8, 4);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 8; ++x) {
            image.pixel(x, y)[0] = x == 6 ? 1.0f : 0.0f;
            image.pixel(x, y)[1] = y == 0 ? 1.0f : 0.0f;
            image.pixel(x, y)[3] = 1.0f;
        }
    return image;
}

TEST(EnvironmentImport, PicturesKeepTheirOrderUnlessTheFileSaysOtherwise) {
    const TempFolder folder;
    LayeredImage picture;
    picture.rgba = markedPicture();
    ASSERT_TRUE(writeExr(folder.path("plain.exr"), picture));
    ASSERT_TRUE(writeHdr(folder.path("plain.hdr"), picture.rgba));
    for (const char* name : {"plain.exr", "plain.hdr"}) {
        std::vector<std::string> notes;
        const auto loaded = loadPanorama(folder.path(name), notes);
        ASSERT_TRUE(loaded) << loaded.error().message;
        EXPECT_EQ(loaded->at(6, 2), glm::vec3(1, 0, 0)) << name;
        EXPECT_EQ(loaded->at(0, 0), glm::vec3(0, 1, 0)) << name;
        EXPECT_TRUE(notes.empty());
    }
}

TEST(EnvironmentImport, OtherShapesAreRefusedAndBadSamplesSaid) {
    const TempFolder folder;
    LayeredImage square;
    square.rgba = makeRgbaImage(4, 4);
    ASSERT_TRUE(writeExr(folder.path("square.exr"), square));
    std::vector<std::string> notes;
    const auto refused = loadPanorama(folder.path("square.exr"), notes);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("is 4x4 pixels; a panorama is twice as wide as high"), std::string::npos);
    EXPECT_FALSE(loadPanorama(folder.path("absent.hdr"), notes));
    EXPECT_FALSE(loadPanorama(folder.write("text.hdr", "no picture"), notes));

    LayeredImage bad;
    bad.rgba = markedPicture();
    bad.rgba.pixel(0, 0)[0] = -3.0f;
    bad.rgba.pixel(1, 0)[0] = std::nanf("");
    ASSERT_TRUE(writeExr(folder.path("bad.exr"), bad));
    const auto repaired = loadPanorama(folder.path("bad.exr"), notes);
    ASSERT_TRUE(repaired) << repaired.error().message;
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[0].find("1 samples are negative"), std::string::npos) << notes[0];
    EXPECT_NE(notes[1].find("1 samples are not finite"), std::string::npos) << notes[1];
    EXPECT_EQ(repaired->at(0, 0).x, 0.0f);
}

// OpenEXR's own pictures of one surrounding, once as `latlong` and once as `cube`, are one panorama; with the letters
// X, Y, Z along the axes that they name: looking along -Z, the axis X runs to the right.
TEST(EnvironmentImport, OpenExrsTwoMapsOfOneSurroundingAgree) {
    const char* shared = std::getenv("UMBRIEL_SHARED");
    const std::filesystem::path data = std::filesystem::path(shared ? shared : "") / "data" / "envmap";
    if (!shared || !std::filesystem::exists(data)) GTEST_SKIP() << "UMBRIEL_SHARED names no folder with data/envmap";
    for (const std::string name : {"Orientation", "WavyLines"}) {
        std::vector<std::string> notes;
        const auto latLong = loadPanorama((data / (name + "LatLong.exr")).string(), notes);
        const auto cube = loadPanorama((data / (name + "Cube.exr")).string(), notes);
        ASSERT_TRUE(latLong && cube);
        // Thin lines in both: averages over 1/32 of the height are compared.
        const auto average = [](const Panorama& from, int x, int y, int channel) {
            double sum = 0.0;
            const int step = from.rows / 32;
            for (int dy = 0; dy < step; ++dy)
                for (int dx = 0; dx < step; ++dx) sum += from.at(x * step + dx, y * step + dy)[channel];
            return sum / (step * step);
        };
        double difference = 0.0;
        double spread = 0.0;
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 64; ++x)
                for (int channel = 0; channel < 3; ++channel) {
                    difference += std::abs(average(*latLong, x, y, channel) - average(*cube, x, y, channel));
                    spread += std::abs(average(*latLong, x, y, channel) - average(*latLong, (x + 5) % 64, y, channel));
                }
        // What a turn by 28 degrees would give; the lines of one are the same from the far side.
        EXPECT_LT(difference, 0.25 * spread) << name;
    }
}

}  // namespace
}  // namespace umbriel::test
