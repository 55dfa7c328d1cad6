#include "client/bake/light_map_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/base/hash.h"
#include "tests/support/temporary_folder.h"

namespace umbriel {
namespace {

class LightMapFiles : public ::testing::Test {
 protected:
    LightMapFiles() {
        file.baked.size = 4;
        for (int i = 0; i < 32; ++i) file.baked.texels.push_back(static_cast<std::uint8_t>(7 * i));
        file.baked.triangles = {2, 1};
        file.baked.places = {0, 0, 0xffffffffu};
        file.baked.charts = {{1, 2, 3, 4}, {5, 6, 7, 8}, {0.5f, 0.5f, 3.5f, 3.5f}};
        file.lightStates = {11, 22};
        file.lightNames = {"sun", ""};
        file.states = {33, 44};
    }

    std::vector<char> bytes() const {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    void write(const std::vector<char>& content) const {
        std::ofstream(path, std::ios::binary).write(content.data(), static_cast<std::streamsize>(content.size()));
    }
    // With the right hash at the end.
    void writeSealed(std::vector<char> content) const {
        content.resize(content.size() - 16);
        const Hash128 hash = hash128(std::as_bytes(std::span(content)));
        for (const std::uint64_t part : {hash.low, hash.high})
            for (int i = 0; i < 8; ++i) content.push_back(static_cast<char>(part >> (8 * i)));
        write(content);
    }
    void expectBadInput(const std::string& about) const {
        const auto read = readLightMap(path);
        ASSERT_FALSE(read) << about;
        EXPECT_EQ(read.error().kind, Error::Kind::BadInput) << about;
        EXPECT_NE(read.error().message.find("a.umlight"), std::string::npos) << read.error().message;
    }

    test::TemporaryFolder folder;
    std::filesystem::path path = folder / "a.umlight";
    LightMapFile file;
};

TEST_F(LightMapFiles, ComeBackAsTheyWere) {
    ASSERT_TRUE(writeLightMap(path, file));
    const auto read = readLightMap(path);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->baked.size, 4u);
    EXPECT_EQ(read->baked.texels, file.baked.texels);
    EXPECT_EQ(read->baked.triangles, file.baked.triangles);
    EXPECT_EQ(read->baked.places, file.baked.places);
    EXPECT_EQ(read->baked.charts, file.baked.charts);
    EXPECT_EQ(read->lightStates, file.lightStates);
    EXPECT_EQ(read->lightNames, file.lightNames);
    EXPECT_EQ(read->states, file.states);
}

TEST_F(LightMapFiles, CutShortAnywhereAreRefused) {
    ASSERT_TRUE(writeLightMap(path, file));
    const std::vector<char> whole = bytes();
    for (std::size_t size = 0; size < whole.size(); ++size) {
        write({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
        expectBadInput(std::to_string(size) + " bytes");
    }
}

TEST_F(LightMapFiles, WithAnyBitChangedAreRefused) {
    ASSERT_TRUE(writeLightMap(path, file));
    const std::vector<char> whole = bytes();
    for (std::size_t at = 0; at < whole.size(); ++at) {
        std::vector<char> changed = whole;
        changed[at] = static_cast<char>(changed[at] ^ 4);
        write(changed);
        expectBadInput("byte " + std::to_string(at));
    }
}

// As somebody would write them who knows the hash.
TEST_F(LightMapFiles, ThatSayTheImpossibleAreRefused) {
    ASSERT_TRUE(writeLightMap(path, file));
    const std::vector<char> whole = bytes();
    // The counts: side, lights, surfaces, triangles, charts.
    for (std::size_t count = 0; count < 5; ++count)
        for (const unsigned char byte : {0x00, 0x01, 0x07, 0xff}) {
            std::vector<char> changed = whole;
            char& low = changed[8 + 4 * count];
            if (static_cast<unsigned char>(low) == byte) continue;
            low = static_cast<char>(byte);
            if (byte == 0xff) changed[8 + 4 * count + 3] = static_cast<char>(0xff);
            writeSealed(changed);
            expectBadInput("count " + std::to_string(count) + " = " + std::to_string(byte));
        }
    LightMapFile wrong = file;
    wrong.baked.places[1] = 1;  // of one chart
    ASSERT_TRUE(writeLightMap(path, wrong));
    expectBadInput("a chart that is not there");
    wrong = file;
    wrong.baked.charts[1].y = INFINITY;
    ASSERT_TRUE(writeLightMap(path, wrong));
    expectBadInput("a chart at infinity");
    wrong = file;
    wrong.baked.triangles[0] = 3;
    ASSERT_TRUE(writeLightMap(path, wrong));
    expectBadInput("triangles that do not add up");
}

TEST_F(LightMapFiles, ThatAreNotThereOrSomethingElseAreRefused) {
    expectBadInput("no file");
    std::filesystem::create_directories(path);
    expectBadInput("a folder");
    std::filesystem::remove_all(path);
    write({'#', ' ', 'a', ' ', 's', 'c', 'e', 'n', 'e'});
    expectBadInput("a text");
}

TEST(LightMapFileNames, LieBesideTheSceneOrHere) {
    EXPECT_EQ(lightMapFileOf("/a/b.gltf"), "/a/b.gltf.umlight");
    EXPECT_EQ(lightMapFileOf("demo:palms?n=3"), "demo-palms-n-3.umlight");
}

TEST(LightMapPictures, ShowTheFirstLightAndHoldAll) {
    LightMapFile file;
    file.baked.size = 2;
    file.baked.texels = {0, 51, 102, 255, 255, 0, 0, 0};
    file.lightStates = {1, 2};
    file.lightNames = {"sun", "lamp"};
    const LayeredImage picture = atlasPicture(file);
    EXPECT_EQ(picture.rgba.at(1, 0, 0), 0.2f);
    EXPECT_EQ(picture.rgba.at(0, 1, 2), 0.4f);
    ASSERT_TRUE(picture.floatLayer("light1"));
    EXPECT_EQ(picture.floatLayer("light1")->at(0, 0, 0), 1.0f);
    EXPECT_EQ(picture.texts.at("umbriel.light1"), "lamp");
}

}  // namespace
}  // namespace umbriel
