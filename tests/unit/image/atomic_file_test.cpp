#include "common/image/atomic_file.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include "common/image/exr_io.h"
#include "common/image/png_io.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

using test::TemporaryFolder;

std::span<const std::byte> bytesOf(const std::string& text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

// Incompressible, so that the file is as large as the picture.
LayeredImage noise(int width, int height) {
    LayeredImage image;
    image.rgba = makeRgbaImage(width, height);
    std::mt19937_64 random(7);
    for (float& sample : image.rgba.samples()) {
        sample = static_cast<float>(random() >> 40) / static_cast<float>(1 << 24);
    }
    return image;
}

TEST(AtomicFile, NothingIsVisibleBeforeCommit) {
    const TemporaryFolder directory;
    Result<std::unique_ptr<AtomicFile>> file = AtomicFile::create(directory / "picture");
    ASSERT_TRUE(file.has_value());
    EXPECT_TRUE((*file)->write(bytesOf("hello")));
    EXPECT_FALSE(std::filesystem::exists(directory / "picture"));
    EXPECT_TRUE((*file)->commit().has_value());
    EXPECT_EQ(test::contentOf(directory / "picture"), "hello");
    EXPECT_EQ(directory.names(), std::vector<std::string>{"picture"});
}

TEST(AtomicFile, AbandonedFileLeavesTheOldOne) {
    const TemporaryFolder directory;
    test::writeContent(directory / "picture", "old");
    {
        Result<std::unique_ptr<AtomicFile>> file = AtomicFile::create(directory / "picture");
        ASSERT_TRUE(file.has_value());
        (*file)->write(bytesOf("new"));
    }
    EXPECT_EQ(test::contentOf(directory / "picture"), "old");
    EXPECT_EQ(directory.names(), std::vector<std::string>{"picture"});
}

TEST(AtomicFile, SeekingBackOverwrites) {
    const TemporaryFolder directory;
    Result<std::unique_ptr<AtomicFile>> file = AtomicFile::create(directory / "picture");
    ASSERT_TRUE(file.has_value());
    (*file)->write(bytesOf("0123456789"));
    (*file)->seek(2);
    (*file)->write(bytesOf("xy"));
    EXPECT_EQ((*file)->position(), 4U);
    (*file)->seek(10);
    (*file)->write(bytesOf("!"));
    ASSERT_TRUE((*file)->commit().has_value());
    EXPECT_EQ(test::contentOf(directory / "picture"), "01xy456789!");
}

TEST(AtomicFile, TwoWritersOfOneNameDoNotMix) {
    const TemporaryFolder directory;
    auto first = AtomicFile::create(directory / "picture");
    auto second = AtomicFile::create(directory / "picture");
    ASSERT_TRUE(first.has_value() && second.has_value());
    (*first)->write(bytesOf("first"));
    (*second)->write(bytesOf("second"));
    EXPECT_TRUE((*second)->commit().has_value());
    EXPECT_TRUE((*first)->commit().has_value());
    EXPECT_EQ(test::contentOf(directory / "picture"), "first");
    EXPECT_EQ(directory.names(), std::vector<std::string>{"picture"});
}

TEST(AtomicFile, SymbolicLinkStaysALink) {
    const TemporaryFolder directory;
    test::writeContent(directory / "target", "old");
    std::filesystem::create_symlink("target", directory / "link");
    auto file = AtomicFile::create(directory / "link");
    ASSERT_TRUE(file.has_value());
    (*file)->write(bytesOf("new"));
    ASSERT_TRUE((*file)->commit().has_value());
    EXPECT_TRUE(std::filesystem::is_symlink(directory / "link"));
    EXPECT_EQ(test::contentOf(directory / "target"), "new");
}

TEST(AtomicFile, DevicesAndDirectoriesAreNotReplaced) {
    const TemporaryFolder directory;
    std::filesystem::create_directory(directory / "folder");
    for (const std::filesystem::path& path : {std::filesystem::path("/dev/full"), directory / "folder"}) {
        const auto file = AtomicFile::create(path);
        ASSERT_FALSE(file.has_value());
        EXPECT_EQ(file.error().kind, Error::Kind::BadInput);
        EXPECT_NE(file.error().message.find(path.string()), std::string::npos) << file.error().message;
    }
    struct stat status {};
    ASSERT_EQ(::stat("/dev/full", &status), 0);
    EXPECT_TRUE(S_ISCHR(status.st_mode));
}

TEST(PictureFiles, MissingDirectoryIsAFailureNamingThePath) {
    const TemporaryFolder directory;
    const std::filesystem::path exr = directory / "missing/picture.exr";
    const std::filesystem::path png = directory / "missing/picture.png";
    const Result<void> exrResult = writeExr(exr, noise(4, 4));
    const Result<void> pngResult = writePng(png, noise(4, 4).rgba);
    ASSERT_FALSE(exrResult.has_value());
    ASSERT_FALSE(pngResult.has_value());
    EXPECT_NE(exrResult.error().message.find(exr.string()), std::string::npos);
    EXPECT_NE(pngResult.error().message.find(png.string()), std::string::npos);
    EXPECT_TRUE(directory.names().empty());
}

// Exit codes of the children below.
constexpr int kAsExpected = 0;
constexpr int kCannotRun = 77;

// Writes both kinds of file where there is no room for them: each must fail with the path in its message, leave the
// old file and nothing else.
int writeWithoutRoom(const TemporaryFolder& directory, int size) {
    for (const std::string name : {"picture.exr", "picture.png"}) {
        const std::filesystem::path path = directory / name;
        const LayeredImage image = noise(size, size);
        const Result<void> result =
            name.ends_with("exr") ? writeExr(path, image) : writePng(path, image.rgba, {0.0, true});
        if (result || result.error().kind != Error::Kind::Failure ||
            result.error().message.find(path.string()) == std::string::npos) {
            return 1;
        }
        if (test::contentOf(path) != "old") {
            return 2;
        }
    }
    return directory.names() == std::vector<std::string>{"picture.exr", "picture.png"} ? kAsExpected : 3;
}

// The quota error EFBIG comes in the same place as ENOSPC would. Both a file that fails in the middle and one whose
// only failing write is the last (the buffer of AtomicFile is 1 MiB).
TEST(PictureFiles, AreNotLeftHalfWrittenWhenTheQuotaIsReached) {
    for (const int size : {64, 600}) {
        const TemporaryFolder directory;
        const int status = test::statusOfChild([&] {
            test::writeContent(directory / "picture.exr", "old");
            test::writeContent(directory / "picture.png", "old");
            std::signal(SIGXFSZ, SIG_IGN);
            const rlimit limit{8192, 8192};
            ::setrlimit(RLIMIT_FSIZE, &limit);
            return writeWithoutRoom(directory, size);
        });
        EXPECT_EQ(status, 0) << "exit code " << WEXITSTATUS(status) << ", picture of " << size;
    }
}

// ENOSPC on a file system of 64 KiB, where the machine lets us mount one.
TEST(PictureFiles, AreNotLeftHalfWrittenWhenTheDiskIsFull) {
    const TemporaryFolder directory;
    const int status = test::statusOfChild([&] {
        if (::unshare(CLONE_NEWNS) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) {
            return kCannotRun;
        }
        if (::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
            ::mount("tmpfs", directory.path().c_str(), "tmpfs", 0, "size=64k") != 0) {
            return kCannotRun;
        }
        test::writeContent(directory / "picture.exr", "old");
        test::writeContent(directory / "picture.png", "old");
        return writeWithoutRoom(directory, 300);
    });
    if (WIFEXITED(status) && WEXITSTATUS(status) == kCannotRun) {
        GTEST_SKIP() << "no file system can be mounted here";
    }
    EXPECT_EQ(status, 0) << "exit code " << WEXITSTATUS(status);
}

}  // namespace
}  // namespace umbriel
