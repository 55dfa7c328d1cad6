#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <memory>
#include <optional>

#include "tests/e2e/run_program.h"

namespace umbriel::e2e {
namespace {

// A display of this test's own; tests of windows are skipped where Xvfb is not installed.
class View : public testing::Test {
   protected:
    void SetUp() override {
        if (::access("/usr/bin/Xvfb", X_OK) != 0) GTEST_SKIP() << "needs Xvfb (package xvfb)";
        // Xvfb looks for a free display number itself and prints it on a line of its own, after a complaint in words for
        // each number that another one took while it looked. One that finds none ends.
        std::optional<std::string> number;
        for (int attempt = 0; attempt < 5 && !number; ++attempt) {
            _xvfb = std::make_unique<Background>(
                "/usr/bin/Xvfb",
                std::vector<std::string>{"-displayfd", "1", "-screen", "0", "640x480x24", "-nolisten", "tcp"});
            number = _xvfb->waitForLine([](const std::string& line) {
                return !line.empty() && line.find_first_not_of("0123456789") == std::string::npos;
            });
        }
        ASSERT_TRUE(number) << _xvfb->printed();
#if defined(__SANITIZE_ADDRESS__)
        // The X server's GL driver leaks 112 bytes and is unloaded before they are counted, so no suppression can name it.
        ::setenv("ASAN_OPTIONS", "detect_leaks=0", 1);
#endif
        ::setenv("DISPLAY", (":" + *number).c_str(), 1);
    }
    void TearDown() override {
        ::unsetenv("DISPLAY");
        if (_xvfb) _xvfb->terminate();  // a killed one would leave its socket and its lock behind
    }

    std::unique_ptr<Background> _xvfb;
};

TEST_F(View, ShowsFramesInAWindowAndCloses) {
    const Outcome outcome = run("umbriel", {"view", "demo:car", "--size", "320x180", "--shadow", "std", "--frames", "5"});
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_TRUE(outcome.err.empty()) << outcome.err;
}

TEST_F(View, AWindowMayShowATiledWall) {
    const Outcome outcome = run("umbriel", {"view", "demo:spheres?n=4", "--size", "320x180", "--grid", "2x2", "--local", "2", "--frames", "3"});
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
}

TEST(ViewWithoutDisplay, IsAFailureInWords) {
    ::unsetenv("DISPLAY");
    ::unsetenv("WAYLAND_DISPLAY");
    const Outcome outcome = run("umbriel", {"view", "demo:car"});
    EXPECT_EQ(outcome.exitCode, 1);
    EXPECT_NE(outcome.err.find("window"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace umbriel::e2e
