#include "tests/bench/plain_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>

namespace umbriel::bench {
namespace {

[[noreturn]] void give_up(const char* what) {
    std::perror(what);
    std::exit(1);
}

sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    return address;
}

}  // namespace

PlainSocket::PlainSocket(int socket) : _socket(socket) {
    const int on = 1;
    ::setsockopt(_socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
}

PlainSocket::~PlainSocket() {
    if (_socket >= 0) ::close(_socket);
}

PlainSocket PlainSocket::dial(std::uint16_t port, bool unpaced) {
    PlainSocket result(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (unpaced) ::setsockopt(result._socket, IPPROTO_TCP, TCP_CONGESTION, "reno", 4);
    const sockaddr_in address = loopback(port);
    if (::connect(result._socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
        give_up("connect");
    return result;
}

std::pair<int, std::uint16_t> PlainSocket::listen() {
    const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof(address);
    if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), size) != 0 || ::listen(listener, 1) != 0 ||
        ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) != 0)
        give_up("listen");
    return {listener, ntohs(address.sin_port)};
}

PlainSocket PlainSocket::acceptFrom(int listener) {
    PlainSocket result(::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC));
    if (result._socket < 0) give_up("accept");
    ::close(listener);
    return result;
}

void PlainSocket::write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t count = ::send(_socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (count < 0 && errno != EINTR) give_up("send");
        if (count > 0) bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
}

bool PlainSocket::read(std::span<std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t count = ::recv(_socket, bytes.data(), bytes.size(), 0);
        if (count == 0) return false;
        if (count < 0 && errno != EINTR) return false;
        if (count > 0) bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return true;
}

}  // namespace umbriel::bench
