#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"

namespace umbriel {

// An embedded render server: a child process that serves this client only. It ends when its client leaves, and also
// when this process dies in any way: it watches the other end of a socket that only we hold.
class ServerProcess {
 public:
    // arguments: what follows the program's name; where to report is added here. environment: "NAME=value", on top of
    // ours.
    static Result<ServerProcess> start(const std::filesystem::path& program, std::vector<std::string> arguments,
                                       const std::vector<std::string>& environment);
    ServerProcess(ServerProcess&& other) noexcept
        : _pid(std::exchange(other._pid, 0)), _socket(std::exchange(other._socket, -1)) {}
    ServerProcess& operator=(ServerProcess&&) = delete;
    // Lets go of it, waits for its end, and kills it when that takes more than two seconds.
    ~ServerProcess();

    // Waits until it says on which loopback port it listens. An error when it ends or says nothing in that time; what
    // it had to say is on stderr.
    Result<std::uint16_t> waitForPort(Duration timeout);
    // Tells it to end, without waiting: many end at once.
    void letGo();
    pid_t pid() const { return _pid; }

 private:
    ServerProcess(pid_t pid, int socket) : _pid(pid), _socket(socket) {}

    pid_t _pid = 0;
    int _socket = -1;
};

}  // namespace umbriel
