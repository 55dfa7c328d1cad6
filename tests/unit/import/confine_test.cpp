#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/landlock.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <functional>

#include "client/import/confine.h"
#include "tests/unit/import/gltf_maker.h"

namespace umbriel::test {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

// Whether something holds in a process that has been confined to the folder of a file.
bool holdsConfined(const std::string& file, const std::function<bool()>& question) {
    const pid_t process = fork();
    if (process == 0) {
        const bool confined = static_cast<bool>(confineProcess({}, file, 63));
        _exit(confined && question() ? 0 : 1);
    }
    int status = 0;
    waitpid(process, &status, 0);
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

bool canOpen(const std::string& path, int flags) {
    return open(path.c_str(), flags, 0600) >= 0;
}

TEST(Confine, FilesOfTheFolderAreReadAndNoOthers) {
    const TempFolder folder;
    const TempFolder outside;
    const std::string file = folder.write("scene.glb", "x");
    const std::string beside = folder.write("textures/a.png", "x");
    const std::string secret = outside.write("secret", "x");
    EXPECT_TRUE(holdsConfined(file, [&] { return canOpen(file, O_RDONLY) && canOpen(beside, O_RDONLY); }));
    if (syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION) < 1)
        GTEST_SKIP() << "this kernel has no Landlock";
    EXPECT_TRUE(holdsConfined(file, [&] { return !canOpen(secret, O_RDONLY); }));
    EXPECT_TRUE(holdsConfined(file, [&] { return !canOpen("/etc/passwd", O_RDONLY); }));
    EXPECT_TRUE(holdsConfined(file, [&] { return !canOpen(file, O_WRONLY); }));
    EXPECT_TRUE(holdsConfined(file, [&] { return !canOpen(folder.path("new"), O_WRONLY | O_CREAT); }));
    EXPECT_TRUE(holdsConfined(file, [&] { return unlink(file.c_str()) != 0; }));
}

TEST(Confine, AFileThatIsALinkToElsewhereCanBeRead) {
    const TempFolder folder;
    const TempFolder outside;
    const std::string target = outside.write("scene.glb", "x");
    const std::string link = folder.path("scene.glb");
    ASSERT_EQ(symlink(target.c_str(), link.c_str()), 0);
    EXPECT_TRUE(holdsConfined(link, [&] { return canOpen(link, O_RDONLY); }));
}

TEST(Confine, ThereIsNoNetworkAndNoOtherProgram) {
    if (kSanitized) GTEST_SKIP() << "sanitizers start helper programs";
    const TempFolder folder;
    const std::string file = folder.write("scene.glb", "x");
    EXPECT_TRUE(holdsConfined(file, [] { return socket(AF_INET, SOCK_STREAM, 0) < 0 && errno == EPERM; }));
    EXPECT_TRUE(holdsConfined(file, [] { return socket(AF_UNIX, SOCK_STREAM, 0) < 0; }));
    EXPECT_TRUE(holdsConfined(file, [] {
        char program[] = "/bin/true";
        char* arguments[] = {program, nullptr};
        return execv(program, arguments) < 0;
    }));
    EXPECT_TRUE(holdsConfined(file, [] { return kill(getppid(), 0) < 0; }));
}

TEST(Confine, LimitsAreThoseAskedFor) {
    const TempFolder folder;
    const std::string file = folder.write("scene.glb", "x");
    const auto limitOf = [](__rlimit_resource resource) {
        rlimit limit{};
        getrlimit(resource, &limit);
        return limit.rlim_cur;
    };
    EXPECT_TRUE(holdsConfined(file, [&] { return limitOf(RLIMIT_CPU) == 60 && limitOf(RLIMIT_CORE) == 0; }));
    EXPECT_TRUE(holdsConfined(file, [&] { return kSanitized || limitOf(RLIMIT_AS) == ImportLimits().processBytes; }));
}

}  // namespace
}  // namespace umbriel::test
