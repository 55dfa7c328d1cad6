#include "common/net/loopback_probe.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace umbriel::net {
namespace {

class Socket {
   public:
    explicit Socket(int fd) : _fd(fd) {}
    ~Socket() {
        if (_fd >= 0) ::close(_fd);
    }
    Socket(const Socket&) = delete;
    Socket& operator=(const Socket&) = delete;
    int fd() const { return _fd; }

   private:
    int _fd;
};

Error systemError(const char* what) {
    return failure(fmt::format("loopback: {}: {}; is the lo interface up?", what, std::strerror(errno)));
}

bool exchangeByte(int from, int to) {
    char byte = 'u';
    return ::send(from, &byte, 1, MSG_NOSIGNAL) == 1 && ::recv(to, &byte, 1, 0) == 1 && byte == 'u';
}

}  // namespace

Result<std::string> probeLoopback() {
    const Socket listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof(address);
    auto* generic = reinterpret_cast<sockaddr*>(&address);  // what the socket API asks for
    if (listener.fd() < 0 || ::bind(listener.fd(), generic, length) != 0 || ::listen(listener.fd(), 1) != 0 ||
        ::getsockname(listener.fd(), generic, &length) != 0)
        return systemError("cannot listen");
    const Socket dialler(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    const timeval patience{2, 0};
    ::setsockopt(dialler.fd(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    if (dialler.fd() < 0 || ::connect(dialler.fd(), generic, length) != 0) return systemError("cannot connect");
    const Socket accepted(::accept4(listener.fd(), nullptr, nullptr, SOCK_CLOEXEC));
    ::setsockopt(accepted.fd(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    if (accepted.fd() < 0) return systemError("cannot accept");
    if (!exchangeByte(dialler.fd(), accepted.fd()) || !exchangeByte(accepted.fd(), dialler.fd()))
        return systemError("cannot exchange bytes");
    return fmt::format("127.0.0.1, ephemeral port {} answered", ntohs(address.sin_port));
}

}  // namespace umbriel::net
