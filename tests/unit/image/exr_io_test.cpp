#include "common/image/exr_io.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/base/hash.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

using test::TemporaryFolder;

ImageLayer floatLayer(std::string name, int width, int height, std::vector<std::string> channels, std::mt19937_64& random) {
    FloatImage image(width, height, std::move(channels));
    test::fillWithAnyBits(image, random);
    return {std::move(name), std::move(image)};
}

// The layers a render writes, any bits in them.
LayeredImage renderLike(int width, int height, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    LayeredImage image;
    image.rgba = makeRgbaImage(width, height);
    test::fillWithAnyBits(image.rgba, random);
    image.layers.push_back(floatLayer("depth", width, height, {"Z"}, random));
    UintImage ids(width, height, {"node", "primitive"});
    test::fillWithAnyBits(ids, random);
    image.layers.push_back({"ids", std::move(ids)});
    image.layers.push_back(floatLayer("light.key.warm", width, height, {"factor"}, random));
    image.layers.push_back(floatLayer("normal", width, height, {"X", "Y", "Z"}, random));
    image.layers.push_back(floatLayer("position", width, height, {"X", "Y", "Z"}, random));
    image.texts["umbriel.scene"] = "demo:city";
    image.numbers["umbriel.exposure"] = -0.5F;
    return image;
}

void expectSame(const LayeredImage& a, const LayeredImage& b) {
    EXPECT_TRUE(test::sameBits(a.rgba, b.rgba));
    ASSERT_EQ(a.layers.size(), b.layers.size());
    for (std::size_t i = 0; i < a.layers.size(); ++i) {
        EXPECT_EQ(a.layers[i].name, b.layers[i].name);
        ASSERT_EQ(a.layers[i].isUint(), b.layers[i].isUint());
        if (a.layers[i].isUint()) {
            EXPECT_TRUE(test::sameBits(std::get<UintImage>(a.layers[i].image), std::get<UintImage>(b.layers[i].image)));
        } else {
            EXPECT_TRUE(
                test::sameBits(std::get<FloatImage>(a.layers[i].image), std::get<FloatImage>(b.layers[i].image)))
                << a.layers[i].name;
        }
    }
    EXPECT_EQ(a.texts, b.texts);
    EXPECT_EQ(a.numbers, b.numbers);
}

TEST(Exr, EveryBitSurvivesTheFile) {
    const TemporaryFolder directory;
    // Sizes around the 16 rows of a ZIP block, and one pixel.
    for (const auto& [width, height] : {std::pair{1, 1}, {3, 15}, {5, 16}, {7, 17}, {127, 71}}) {
        const LayeredImage image = renderLike(width, height, static_cast<std::uint64_t>(width));
        ASSERT_TRUE(writeExr(directory / "a.exr", image).has_value());
        const Result<LayeredImage> read = readExr(directory / "a.exr");
        ASSERT_TRUE(read.has_value()) << read.error().message;
        expectSame(image, *read);
    }
    EXPECT_EQ(directory.names(), std::vector<std::string>{"a.exr"});
}

TEST(Exr, TopRowOfMemoryIsTheTopRowOfTheFile) {
    const TemporaryFolder directory;
    LayeredImage image;
    image.rgba = makeRgbaImage(1, 2);
    image.rgba.at(0, 0, 0) = 5.0F;
    ASSERT_TRUE(writeExr(directory / "a.exr", image).has_value());
    Imf::InputFile file((directory / "a.exr").c_str());
    std::array<float, 2> red{};
    Imf::FrameBuffer buffer;
    buffer.insert("R", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(red.data()), 4, 4));
    file.setFrameBuffer(buffer);
    file.readPixels(0, 1);  // EXR: y grows downwards
    EXPECT_EQ(red, (std::array<float, 2>{5.0F, 0.0F}));
    EXPECT_EQ(file.header().compression(), Imf::ZIP_COMPRESSION);
    EXPECT_EQ(file.header().channels().findChannel("R")->type, Imf::FLOAT);
    EXPECT_EQ(file.header().find("capDate"), file.header().end());
}

TEST(Exr, SamePictureGivesTheSameBytes) {
    const TemporaryFolder directory;
    ASSERT_TRUE(writeExr(directory / "a.exr", renderLike(33, 40, 1)).has_value());
    ASSERT_TRUE(writeExr(directory / "b.exr", renderLike(33, 40, 1)).has_value());
    EXPECT_EQ(test::contentOf(directory / "a.exr"), test::contentOf(directory / "b.exr"));
    EXPECT_EQ(directory.names(), (std::vector<std::string>{"a.exr", "b.exr"}));
}

TEST(Exr, LayersAreFoundByNameAndType) {
    const LayeredImage image = renderLike(2, 2, 1);
    EXPECT_NE(image.floatLayer("depth"), nullptr);
    EXPECT_EQ(image.uintLayer("depth"), nullptr);
    EXPECT_NE(image.uintLayer("ids"), nullptr);
    EXPECT_EQ(image.floatLayer("nothing"), nullptr);
}

TEST(Exr, NamesThatCannotBeWrittenAreBadInput) {
    const TemporaryFolder directory;
    const auto messageFor = [&](const std::string& layer, const std::string& channel) {
        LayeredImage image;
        image.rgba = makeRgbaImage(1, 1);
        image.layers.push_back({layer, FloatImage(1, 1, {channel})});
        const Result<void> result = writeExr(directory / "a.exr", image);
        EXPECT_TRUE(!result && result.error().kind == Error::Kind::BadInput);
        return result ? "" : result.error().message;
    };
    EXPECT_NE(messageFor("", "R").find("two channels are called 'R'"), std::string::npos);
    messageFor("depth", "");
    messageFor("depth", "a.b");
    messageFor(std::string(255, 'l'), "Z");
    messageFor(std::string("a\0b", 3), "Z");
    LayeredImage image;
    image.rgba = makeRgbaImage(1, 1);
    image.texts["channels"] = "mine";
    EXPECT_FALSE(writeExr(directory / "a.exr", image).has_value());
    EXPECT_FALSE(writeExr(directory / "a.exr", LayeredImage{}).has_value());
    EXPECT_TRUE(directory.names().empty());
}

// What other programs write: HALF, tiles, a data window that does not start at 0, channels of our own choice.
void writeForeign(const std::filesystem::path& path, const Imath::Box2i& window, bool tiled,
                  const std::vector<std::string>& channels, Imf::PixelType type, int sampling = 1) {
    Imf::Header header(window, window);
    header.compression() = Imf::PIZ_COMPRESSION;
    const int width = window.max.x - window.min.x + 1;
    const int height = window.max.y - window.min.y + 1;
    std::vector<std::vector<float>> planes(channels.size());
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < channels.size(); ++c) {
        header.channels().insert(channels[c], Imf::Channel(type, sampling, sampling));
        for (int i = 0; i < width * height; ++i) {
            planes[c].push_back(static_cast<float>(i) + 0.25F * static_cast<float>(c));
        }
        // Slices say what memory holds: halves are made from it first.
    }
    std::vector<std::vector<half>> halves(channels.size());
    for (std::size_t c = 0; c < channels.size(); ++c) {
        if (type == Imf::HALF) {
            halves[c].assign(planes[c].begin(), planes[c].end());
            buffer.insert(channels[c],
                          Imf::Slice::Make(Imf::HALF, halves[c].data(), window, sizeof(half),
                                           sizeof(half) * static_cast<std::size_t>(width), sampling, sampling));
        } else {
            buffer.insert(channels[c],
                          Imf::Slice::Make(Imf::FLOAT, planes[c].data(), window, sizeof(float),
                                           sizeof(float) * static_cast<std::size_t>(width), sampling, sampling));
        }
    }
    if (tiled) {
        header.setTileDescription(Imf::TileDescription(4, 4, Imf::ONE_LEVEL));
        Imf::TiledOutputFile file(path.c_str(), header);
        file.setFrameBuffer(buffer);
        file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
    } else {
        Imf::OutputFile file(path.c_str(), header);
        file.setFrameBuffer(buffer);
        file.writePixels(height);
    }
}

TEST(Exr, ForeignFilesAreRead) {
    const TemporaryFolder directory;
    const Imath::Box2i window({-3, 5}, {5, 11});  // 9 x 7
    for (const bool tiled : {false, true}) {
        for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
            writeForeign(directory / "a.exr", window, tiled, {"B", "G", "R", "Z", "left.view.Y"}, type);
            const Result<LayeredImage> read = readExr(directory / "a.exr");
            ASSERT_TRUE(read.has_value()) << read.error().message;
            ASSERT_EQ(read->width(), 9);
            ASSERT_EQ(read->height(), 7);
            EXPECT_EQ(read->rgba.at(8, 6, 2), 62.0F);
            EXPECT_EQ(read->rgba.at(0, 1, 1), 9.25F);
            EXPECT_EQ(read->rgba.at(1, 0, 0), 1.5F);
            EXPECT_EQ(read->rgba.at(4, 4, 3), 1.0F);  // no alpha: opaque
            ASSERT_EQ(read->layers.size(), 2U);
            ASSERT_NE(read->floatLayer(""), nullptr);
            EXPECT_EQ(read->floatLayer("")->at(2, 0, 0), 2.75F);
            ASSERT_NE(read->floatLayer("left.view"), nullptr);
            EXPECT_EQ(read->floatLayer("left.view")->channels(), std::vector<std::string>{"Y"});
        }
    }
}

TEST(Exr, LoneLuminanceIsGrey) {
    const TemporaryFolder directory;
    writeForeign(directory / "a.exr", Imath::Box2i({0, 0}, {1, 0}), false, {"Y"}, Imf::FLOAT);
    const Result<LayeredImage> read = readExr(directory / "a.exr");
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->rgba.samples(), (std::vector<float>{0, 0, 0, 1, 1, 1, 1, 1}));
    EXPECT_TRUE(read->layers.empty());
}

TEST(Exr, SubsampledChannelsAreRefused) {
    const TemporaryFolder directory;
    writeForeign(directory / "a.exr", Imath::Box2i({0, 0}, {3, 3}), false, {"BY"}, Imf::FLOAT, 2);
    const Result<LayeredImage> read = readExr(directory / "a.exr");
    ASSERT_FALSE(read.has_value());
    EXPECT_NE(read.error().message.find("subsampled"), std::string::npos) << read.error().message;
}

TEST(Exr, NoFileSpeaksToTheTerminal) {
    const TemporaryFolder directory;
    writeForeign(directory / "a.exr", Imath::Box2i({0, 0}, {3, 3}), false, {"\x1b[2J\n"}, Imf::FLOAT, 2);
    const Result<LayeredImage> read = readExr(directory / "a.exr");
    ASSERT_FALSE(read.has_value());
    EXPECT_TRUE(read.error().message.ends_with("channel '?[2J?' is subsampled")) << read.error().message;
}

TEST(Exr, LimitsHoldAtTheirValueAndNotBeyond) {
    const TemporaryFolder directory;
    LayeredImage image;
    image.rgba = makeRgbaImage(10, 6);
    image.layers.push_back({"depth", FloatImage(10, 6, {"Z"})});
    ASSERT_TRUE(writeExr(directory / "a.exr", image).has_value());
    ImageLimits limits;
    limits.pixels = 60;
    limits.bytes = 60 * 5 * 4;
    limits.channels = 5;
    EXPECT_TRUE(readExr(directory / "a.exr", limits).has_value());
    for (auto tighten : {+[](ImageLimits& l) { --l.pixels; }, +[](ImageLimits& l) { --l.bytes; },
                         +[](ImageLimits& l) { --l.channels; }}) {
        ImageLimits tight = limits;
        tighten(tight);
        const Result<LayeredImage> read = readExr(directory / "a.exr", tight);
        ASSERT_FALSE(read.has_value());
        EXPECT_EQ(read.error().kind, Error::Kind::BadInput);
    }
}

}  // namespace
}  // namespace umbriel
