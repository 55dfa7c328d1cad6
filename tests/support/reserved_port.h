#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <stdexcept>

namespace umbriel::test {

// A TCP port of loopback that nobody else gets while this object lives. A socket is bound to it and never listens, so
// whoever dials it is refused; a program that asks for this port by number gets it, now and again after its end,
// because both allow it (SO_REUSEADDR), while the system gives a port that is bound to nobody who asks for any.
class ReservedPort {
 public:
    ReservedPort() : _socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        const int yes = 1;
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof(address);
        if (::setsockopt(_socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes)) != 0 ||
            ::bind(_socket, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
            ::getsockname(_socket, reinterpret_cast<sockaddr*>(&address), &size) != 0)
            throw std::runtime_error("no port on loopback");
        _number = ntohs(address.sin_port);
    }
    ~ReservedPort() { ::close(_socket); }
    ReservedPort(const ReservedPort&) = delete;
    ReservedPort& operator=(const ReservedPort&) = delete;

    std::uint16_t number() const { return _number; }

 private:
    int _socket;
    std::uint16_t _number = 0;
};

}  // namespace umbriel::test
