#include "client/session/server_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <thread>
#include <utility>

extern char** environ;

namespace umbriel {
namespace {

// Where the child finds its end of the socket.
constexpr int kChildDescriptor = 3;

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
}

}  // namespace

Result<ServerProcess> ServerProcess::start(const std::filesystem::path& program, std::vector<std::string> arguments,
                                           const std::vector<std::string>& environment) {
    int sockets[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0)
        return failure(fmt::format("cannot start {}: {}", program.string(), std::strerror(errno)));
    arguments.insert(arguments.begin(), program.string());
    arguments.insert(arguments.end(), {"--embedded", "--report-port-fd", std::to_string(kChildDescriptor)});
    std::vector<std::string> variables;
    for (char** entry = environ; *entry; ++entry) {
        const std::string_view name = std::string_view(*entry).substr(0, std::string_view(*entry).find('='));
        bool replaced = false;
        for (const std::string& added : environment)
            replaced |= std::string_view(added).substr(0, added.find('=')) == name;
        if (!replaced) variables.emplace_back(*entry);
    }
    variables.insert(variables.end(), environment.begin(), environment.end());

    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, sockets[1], kChildDescriptor);
    pid_t pid = 0;
    const int error =
        ::posix_spawn(&pid, program.c_str(), &actions, nullptr, pointers(arguments).data(), pointers(variables).data());
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(sockets[1]);
    if (error != 0) {
        ::close(sockets[0]);
        return failure(fmt::format("cannot start {}: {}", program.string(), std::strerror(error)));
    }
    return ServerProcess(pid, sockets[0]);
}

void ServerProcess::letGo() {
    if (_socket >= 0) ::close(std::exchange(_socket, -1));
}

ServerProcess::~ServerProcess() {
    if (_pid == 0) return;
    letGo();
    for (int i = 0; i < 400; ++i) {
        if (::waitpid(_pid, nullptr, WNOHANG) != 0) return;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ::kill(_pid, SIGKILL);
    ::waitpid(_pid, nullptr, 0);
}

Result<std::uint16_t> ServerProcess::waitForPort(Duration timeout) {
    const TimePoint end = SteadyClock().now() + timeout;
    std::string text;
    while (text.size() < 16) {
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - SteadyClock().now()).count();
        pollfd waiting{_socket, POLLIN, 0};
        const int ready = left > 0 ? ::poll(&waiting, 1, static_cast<int>(left)) : 0;
        if (ready < 0 && errno == EINTR) continue;
        if (ready <= 0) return failure("an embedded render server did not start in time");
        char c = 0;
        if (::read(_socket, &c, 1) != 1) break;
        if (c == '\n') {
            std::uint16_t port = 0;
            const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), port);
            if (error != std::errc() || port == 0) break;
            return port;
        }
        text += c;
    }
    return failure("an embedded render server ended before it could be reached; see its messages above");
}

}  // namespace umbriel
