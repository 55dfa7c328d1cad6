#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/session/server_process.h"
#include "common/base/clock.h"
#include "tests/sim/random.h"
#include "tests/support/reserved_port.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/wait_until.h"

extern char** environ;

namespace umbriel {
namespace {

namespace fs = std::filesystem;

const fs::path kBin = UMBRIEL_BIN_DIR;
constexpr std::size_t kServers = 3;

std::string contentOf(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// umbriel, with what it says in a file.
class Program {
 public:
    Program(std::vector<std::string> arguments, const fs::path& log) {
        arguments.insert(arguments.begin(), (kBin / "umbriel").string());
        std::vector<char*> pointers;
        for (std::string& argument : arguments) pointers.push_back(argument.data());
        pointers.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        ::posix_spawn_file_actions_init(&actions);
        for (const int descriptor : {STDOUT_FILENO, STDERR_FILENO})
            ::posix_spawn_file_actions_addopen(&actions, descriptor, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
        if (::posix_spawn(&_pid, pointers[0], &actions, nullptr, pointers.data(), environ) != 0) _pid = 0;
        ::posix_spawn_file_actions_destroy(&actions);
    }
    ~Program() { kill(); }
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    bool hasEnded() {
        if (_pid != 0 && ::waitpid(_pid, &_status, WNOHANG) == _pid) _pid = 0;
        return _pid == 0;
    }
    int exitCode() const { return WIFEXITED(_status) ? WEXITSTATUS(_status) : -1; }
    void kill() {
        if (hasEnded()) return;
        ::kill(_pid, SIGKILL);
        ::waitpid(_pid, &_status, 0);
        _pid = 0;
    }

 private:
    pid_t _pid = 0;
    int _status = -1;
};

// Bakes on three real servers, of which one after the other is killed and started again at random moments, and so is
// the client, which resumes. UMBRIEL_CHAOS_BAKES of them (4). What a thread of one process makes is the file to expect.
TEST(BakeChaos, KilledServersAndClientsLeaveTheSameFile) {
    const char* wanted = std::getenv("UMBRIEL_CHAOS_BAKES");
    const int bakes = wanted ? std::atoi(wanted) : 4;
    const test::TemporaryFolder folder;
    const fs::path log = folder / "log";
    const std::vector<std::string> bake{"bake", "demo:cloth", "--size", "32", "--shards", "13"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), bake.begin(), bake.end());
        return more;
    };
    const auto say = [&] { return contentOf(log); };

    Program reference(with({"--threads", "2", "--out", folder / "reference.umvis"}), log);
    while (!reference.hasEnded()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ASSERT_EQ(reference.exitCode(), 0) << say();
    const std::string expected = contentOf(folder / "reference.umvis");

    std::vector<std::unique_ptr<ServerProcess>> servers(kServers);
    const test::ReservedPort ports[kServers];  // theirs while they are away, too
    std::string addresses;
    const auto start = [&](std::size_t i) {
        auto process = ServerProcess::start(
            kBin / "umbriel-server",
            {"--name", "s" + std::to_string(i), "--listen", "127.0.0.1:" + std::to_string(ports[i].number()),
             "--bake-threads", "1", "--bake-priority", "normal", "--log-level", "off"},
            {"LP_NUM_THREADS=0"});
        ASSERT_TRUE(process) << process.error().message;
        servers[i] = std::make_unique<ServerProcess>(std::move(*process));
    };
    for (std::size_t i = 0; i < kServers; ++i) {
        start(i);
        const auto port = servers[i]->waitForPort(test::kPatience);
        ASSERT_TRUE(port) << port.error().message;
        addresses += (i > 0 ? "," : "") + std::string("s") + std::to_string(i) + "=127.0.0.1:" + std::to_string(*port);
    }

    sim::Random random(11);
    int serverKills = 0, clientKills = 0;
    for (int number = 0; number < bakes; ++number) {
        const fs::path out = folder / ("maps" + std::to_string(number) + ".umvis");
        const std::vector<std::string> arguments =
            with({"--servers", addresses, "--audit", "20", "--resume", "--out", out});
        auto client = std::make_unique<Program>(arguments, log);
        int events = static_cast<int>(random.between(2, 6));
        const TimePoint end = SteadyClock().now() + test::kPatience;
        while (true) {
            const TimePoint next = SteadyClock().now() + std::chrono::milliseconds(random.between(50, 900));
            while (SteadyClock().now() < next && !client->hasEnded())
                std::this_thread::sleep_for(std::chrono::milliseconds(2));
            // Whole or not at all.
            if (fs::exists(out)) {
                EXPECT_EQ(contentOf(out), expected) << "bake " << number;
            }
            if (client->hasEnded()) break;
            ASSERT_LT(SteadyClock().now(), end) << "bake " << number << " does not end\n" << say();
            if (events-- <= 0) continue;
            if (random.between(0, 2) == 0) {
                ++clientKills;
                client->kill();
                client = std::make_unique<Program>(arguments, log);
            } else {
                ++serverKills;
                const auto victim = static_cast<std::size_t>(random.between(0, kServers - 1));
                ::kill(servers[victim]->pid(), SIGKILL);
                servers[victim].reset();
                start(victim);
            }
        }
        ASSERT_EQ(client->exitCode(), 0) << "bake " << number << "\n" << say();
        EXPECT_EQ(contentOf(out), expected) << "bake " << number;
        EXPECT_FALSE(fs::exists(out.string() + ".bake"));
    }
    std::printf("%d bakes, %d servers and %d clients killed\n", bakes, serverKills, clientKills);
}

}  // namespace
}  // namespace umbriel
