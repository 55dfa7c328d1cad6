#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cmath>
#include <iostream>

#include "common/image/exr_io.h"
#include "common/image/image_reader.h"
#include "common/image/isolated_reader.h"
#include "common/image/png_io.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

using test::TemporaryFolder;

LayeredImage sample() {
    LayeredImage image;
    image.rgba = makeRgbaImage(24, 20);
    for (std::size_t i = 0; i < image.rgba.samples().size(); ++i) {
        image.rgba.samples()[i] = static_cast<float>(i % 97) / 50.0F;
    }
    UintImage ids(24, 20, {"node", "primitive"});
    ids.at(3, 4, 1) = 0xffffffffU;
    image.layers.push_back({"ids", std::move(ids)});
    image.texts["umbriel.scene"] = "demo:city";
    image.numbers["umbriel.fov"] = 45.0F;
    return image;
}

// A Radiance file, flat (not run-length encoded), of one colour.
std::string radiance(int width, int height) {
    std::string content =
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) + " +X " + std::to_string(width) + "\n";
    for (int i = 0; i < width * height; ++i) {
        content += std::string{'\x80', '\x40', '\x20', '\x81'};  // 128, 64, 32 times 2^(129 - 136)
    }
    return content;
}

void expectBadInput(const Result<LayeredImage>& result, const std::filesystem::path& path) {
    ASSERT_FALSE(result.has_value()) << path << ": " << result->width() << " x " << result->height();
    EXPECT_EQ(result.error().kind, Error::Kind::BadInput) << result.error().message;
    EXPECT_NE(result.error().message.find(path.string()), std::string::npos) << result.error().message;
}

TEST(ImageReader, RadianceFilesAreLinearAndOpaque) {
    const TemporaryFolder directory;
    test::writeContent(directory / "a.hdr", radiance(3, 2));
    const Result<LayeredImage> read = readImage(directory / "a.hdr");
    ASSERT_TRUE(read.has_value()) << read.error().message;
    ASSERT_EQ(read->width(), 3);
    ASSERT_EQ(read->height(), 2);
    for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < 3; ++x) {
            EXPECT_EQ(read->rgba.at(x, y, 0), 1.0F);
            EXPECT_EQ(read->rgba.at(x, y, 1), 0.5F);
            EXPECT_EQ(read->rgba.at(x, y, 2), 0.25F);
            EXPECT_EQ(read->rgba.at(x, y, 3), 1.0F);
        }
    }
    ImageLimits limits;
    limits.pixels = 5;
    expectBadInput(readImage(directory / "a.hdr", limits), directory / "a.hdr");
}

TEST(ImageReader, WhatIsNoPictureIsBadInput) {
    const TemporaryFolder directory;
    expectBadInput(readImage(directory / "missing.exr"), directory / "missing.exr");
    expectBadInput(readImage(directory.path()), directory.path());
    expectBadInput(readImage("/dev/zero"), "/dev/zero");
    ASSERT_EQ(::mkfifo((directory / "pipe.exr").c_str(), 0600), 0);
    expectBadInput(readImage(directory / "pipe.exr"), directory / "pipe.exr");
    for (const std::string& content : {std::string(), std::string("#"), std::string("hello"), std::string(100, '\0'),
                                       std::string("\x76\x2f\x31\x01"), std::string("\x89PNG\r\n\x1a\n"),
                                       std::string("#?RADIANCE\n"), radiance(3, 2).substr(0, 60)}) {
        test::writeContent(directory / "file", content);
        expectBadInput(readImage(directory / "file"), directory / "file");
        expectBadInput(readImageIsolated(directory / "file"), directory / "file");
    }
    ImageLimits limits;
    limits.fileBytes = 4;
    test::writeContent(directory / "file", radiance(3, 2));
    expectBadInput(readImage(directory / "file", limits), directory / "file");
}

TEST(IsolatedReader, GivesWhatTheReaderGives) {
    const TemporaryFolder directory;
    ASSERT_TRUE(writeExr(directory / "a.exr", sample()).has_value());
    const Result<LayeredImage> direct = readImage(directory / "a.exr");
    const Result<LayeredImage> isolated = readImageIsolated(directory / "a.exr");
    ASSERT_TRUE(direct.has_value() && isolated.has_value());
    EXPECT_TRUE(test::sameBits(direct->rgba, isolated->rgba));
    ASSERT_NE(isolated->uintLayer("ids"), nullptr);
    EXPECT_TRUE(test::sameBits(*direct->uintLayer("ids"), *isolated->uintLayer("ids")));
    EXPECT_EQ(direct->texts, isolated->texts);
    EXPECT_EQ(direct->numbers, isolated->numbers);
}

TEST(IsolatedReader, WaitingIsBounded) {
    const TemporaryFolder directory;
    ASSERT_TRUE(writeExr(directory / "a.exr", sample()).has_value());
    IsolationLimits limits;
    limits.processorTime = std::chrono::seconds(0);  // nothing can be done in it
    const Result<LayeredImage> read = readImageIsolated(directory / "a.exr", limits);
    expectBadInput(read, directory / "a.exr");
}

TEST(IsolatedReader, LeavesNoProcessAndNoFileOpen) {
    const TemporaryFolder directory;
    test::writeContent(directory / "a.hdr", radiance(30, 20));
    test::writeContent(directory / "bad.hdr", "#?RADIANCE\n");
    const auto openFiles = [] {
        return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                             std::filesystem::directory_iterator());
    };
    const auto before = openFiles();
    for (int i = 0; i < 20; ++i) {
        EXPECT_TRUE(readImageIsolated(directory / "a.hdr").has_value());
        EXPECT_FALSE(readImageIsolated(directory / "bad.hdr").has_value());
    }
    EXPECT_EQ(openFiles(), before);
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);  // ECHILD: every child was waited for
}

// A header that promises more than the limits is refused for what it says, before anything of that size is touched.
TEST(HostilePictures, LiesAboutTheSizeAreRefused) {
    const TemporaryFolder directory;
    test::writeContent(directory / "a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\nabcd");
    expectBadInput(readImage(directory / "a.hdr"), directory / "a.hdr");

    ASSERT_TRUE(writeExr(directory / "a.exr", sample()).has_value());
    const std::string exr = test::contentOf(directory / "a.exr");
    const std::size_t window = exr.find(std::string("dataWindow\0box2i\0", 17)) + 17 + 4;
    ASSERT_LT(window, exr.size());
    for (const std::uint32_t edge : {0x7fffffffU, 0x0001ffffU, 0x00020000U, 0xffffffffU, 0x80000000U}) {
        for (const std::size_t corner : {8U, 12U}) {  // xMax, yMax
            std::string lie = exr;
            std::memcpy(lie.data() + window + corner, &edge, 4);
            test::writeContent(directory / "lie.exr", lie);
            SCOPED_TRACE(std::to_string(edge) + " at " + std::to_string(corner));
            expectBadInput(readImageIsolated(directory / "lie.exr"), directory / "lie.exr");
        }
    }

    ASSERT_TRUE(writePng(directory / "a.png", sample().rgba).has_value());
    const std::string png = test::contentOf(directory / "a.png");
    for (const char byte : {'\x7f', '\x01'}) {
        std::string lie = png;
        lie[16] = byte;  // the width's highest byte; its checksum is wrong then, too
        test::writeContent(directory / "lie.png", lie);
        expectBadInput(readImageIsolated(directory / "lie.png"), directory / "lie.png");
    }
}

TEST(HostilePictures, CutOffFilesAreBadInputAtEveryLength) {
    const TemporaryFolder directory;
    ASSERT_TRUE(writeExr(directory / "a.exr", sample()).has_value());
    ASSERT_TRUE(writePng(directory / "a.png", sample().rgba).has_value());
    for (const std::string name : {"a.exr", "a.png"}) {
        const std::string content = test::contentOf(directory / name);
        // Every length near the start, where the header is, and a sample of the others.
        for (std::size_t length = 0; length < content.size(); length += length < 64 ? 1 : 131) {
            test::writeContent(directory / "cut", content.substr(0, length));
            expectBadInput(readImage(directory / "cut"), directory / "cut");
        }
    }
}

// Exit codes of a child that decodes one file.
enum Outcome { Loaded = 0, Refused = 10, Unsound = 11 };

int outcomeOf(const Result<LayeredImage>& result, const std::filesystem::path& path) {
    if (result) {
        return result->width() > 0 && result->height() > 0 ? Loaded : Unsound;
    }
    return result.error().message.find(path.string()) != std::string::npos ? Refused : Unsound;
}

// Damaged pictures of our own: no outcome is prescribed (a flipped bit of a sample is still a picture), only that there
// is one. A crash inside a decoding library shows as the child's signal.
TEST(HostilePictures, DamagedFilesAlwaysGiveAResult) {
    const TemporaryFolder directory;
    ASSERT_TRUE(writeExr(directory / "a.exr", sample()).has_value());
    ASSERT_TRUE(writePng(directory / "a.png", sample().rgba).has_value());
    test::writeContent(directory / "a.hdr", radiance(24, 20));
    std::mt19937_64 random(11);
    for (const std::string name : {"a.exr", "a.png", "a.hdr"}) {
        const std::string content = test::contentOf(directory / name);
        for (int i = 0; i < 60; ++i) {
            std::string damaged = content;
            for (int hits = 1 + static_cast<int>(random() % 4); hits > 0; --hits) {
                // Half of the hits in the first 300 bytes: headers.
                const std::size_t range =
                    random() % 2 == 0 ? std::min<std::size_t>(300, damaged.size()) : damaged.size();
                damaged[random() % range] = static_cast<char>(random());
            }
            const std::filesystem::path path = directory / "damaged";
            test::writeContent(path, damaged);
            const Result<LayeredImage> result = readImageIsolated(path);
            ASSERT_NE(outcomeOf(result, path), Unsound) << name << " #" << i;
        }
    }
}

// Of processors, by processes that have ended.
double childrensSeconds() {
    rusage usage{};
    ::getrusage(RUSAGE_CHILDREN, &usage);
    return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

std::vector<std::filesystem::path> sharedFiles() {
    std::vector<std::filesystem::path> files;
    if (const char* shared = std::getenv("UMBRIEL_SHARED")) {
        const std::filesystem::path folder = std::filesystem::path(shared) / "data/bad/exr";
        if (std::filesystem::is_directory(folder)) {
            for (const auto& entry : std::filesystem::directory_iterator(folder)) {
                files.push_back(entry.path());
            }
        }
    }
    std::sort(files.begin(), files.end());
    return files;
}

// Fuzzers' finds in OpenEXR. Each must give an answer within 2 GiB and 10 s of a processor, whatever the library does
// on the way. The reader's deadline by the clock is twice its limit on processor time: 10 s at most for files as small
// as these.
TEST(HostilePictures, FuzzersFindsEndWithAnAnswer) {
    const std::vector<std::filesystem::path> files = sharedFiles();
    if (files.empty()) {
        GTEST_SKIP() << "UMBRIEL_SHARED names no folder with data/bad/exr";
    }
    int loaded = 0;
    for (const std::filesystem::path& path : files) {
        const double before = childrensSeconds();
        // The reader's own child within a child of ours: what the former should survive, the latter reports.
        const int status = test::statusOfChild([&path] {
            if (!test::kSanitized) {
                const rlimit memory{rlim_t{2} << 30, rlim_t{2} << 30};
                ::setrlimit(RLIMIT_AS, &memory);
            }
            return outcomeOf(readImageIsolated(path), path);
        });
        ASSERT_TRUE(WIFEXITED(status)) << path << ": signal " << WTERMSIG(status);
        EXPECT_NE(WEXITSTATUS(status), Unsound) << path;
        loaded += WEXITSTATUS(status) == Loaded ? 1 : 0;
        EXPECT_LT(childrensSeconds() - before, 10.0) << path;
    }
    RecordProperty("loaded", loaded);
    std::cout << files.size() << " files, " << loaded << " of them loaded\n";
}

// The same without the isolation, to know what it is for: a crash inside OpenEXR is named, and is a failure only of
// files that this library version is known to survive.
TEST(HostilePictures, FuzzersFindsDoNotCrashTheLibraryItself) {
    const std::vector<std::filesystem::path> files = sharedFiles();
    if (files.empty()) {
        GTEST_SKIP() << "UMBRIEL_SHARED names no folder with data/bad/exr";
    }
    for (const std::filesystem::path& path : files) {
        const int status = test::statusOfChild([&path] {
            if (!test::kSanitized) {
                const rlimit memory{rlim_t{2} << 30, rlim_t{2} << 30};
                ::setrlimit(RLIMIT_AS, &memory);
            }
            const rlimit time{10, 10};
            ::setrlimit(RLIMIT_CPU, &time);
            return outcomeOf(readImage(path), path);
        });
        EXPECT_TRUE(WIFEXITED(status)) << path << ": signal " << WTERMSIG(status) << " inside the decoder";
        EXPECT_TRUE(!WIFEXITED(status) || WEXITSTATUS(status) == Loaded || WEXITSTATUS(status) == Refused)
            << path << ": " << WEXITSTATUS(status);
    }
}

// Files that are odd but sound do load, with every value they are known for.
TEST(HostilePictures, OddButSoundFilesLoad) {
    const char* shared = std::getenv("UMBRIEL_SHARED");
    const std::filesystem::path folder = std::filesystem::path(shared != nullptr ? shared : "") / "data/bad/exr";
    if (shared == nullptr || !std::filesystem::exists(folder / "AllHalfValues.exr")) {
        GTEST_SKIP() << "UMBRIEL_SHARED names no folder with data/bad/exr";
    }
    // All 65536 halves: 2 x 1023 of them are NaN, two infinite.
    const Result<LayeredImage> halves = readImageIsolated(folder / "AllHalfValues.exr");
    ASSERT_TRUE(halves.has_value()) << halves.error().message;
    EXPECT_EQ(halves->rgba.pixelCount(), 65536U);
    int nans = 0;
    int infinities = 0;
    for (std::size_t i = 0; i < halves->rgba.pixelCount(); ++i) {
        nans += std::isnan(halves->rgba.samples()[i * 4]) ? 1 : 0;
        infinities += std::isinf(halves->rgba.samples()[i * 4]) ? 1 : 0;
    }
    EXPECT_EQ(nans, 2046);
    EXPECT_EQ(infinities, 2);
    EXPECT_TRUE(readImageIsolated(folder / "WideFloatRange.exr").has_value());
    EXPECT_TRUE(readImageIsolated(folder / "BrightRingsNanInf.exr").has_value());
}

}  // namespace
}  // namespace umbriel
