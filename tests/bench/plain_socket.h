#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace umbriel::bench {

// A blocking TCP connection on loopback, the floor that everything is compared with. What fails ends the program.
class PlainSocket {
 public:
    // unpaced: with the congestion control that our own connections on loopback have, instead of the system's.
    static PlainSocket dial(std::uint16_t port, bool unpaced = false);
    // Waits for one peer. listening: called with the port once it can be reached.
    template <class Function>
    static PlainSocket accept(Function&& listening) {
        const auto [listener, port] = listen();
        listening(port);
        return acceptFrom(listener);
    }
    PlainSocket(PlainSocket&& other) noexcept : _socket(std::exchange(other._socket, -1)) {}
    PlainSocket& operator=(PlainSocket&&) = delete;
    ~PlainSocket();

    void write(std::span<const std::byte> bytes);
    // Fills all of it; false when the peer has left.
    bool read(std::span<std::byte> bytes);

 private:
    explicit PlainSocket(int socket);
    static std::pair<int, std::uint16_t> listen();
    static PlainSocket acceptFrom(int listener);
    int _socket;
};

}  // namespace umbriel::bench
