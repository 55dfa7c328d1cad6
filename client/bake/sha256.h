#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace umbriel {

// SHA-256 of bytes that come in pieces (OpenSSL), for people who compare files with sha256sum.
class Sha256 {
 public:
    Sha256();
    ~Sha256();
    Sha256(const Sha256&) = delete;
    Sha256& operator=(const Sha256&) = delete;
    void add(std::span<const std::byte> bytes);
    // 64 hexadecimal digits. Call once, last.
    std::string finish();

 private:
    struct State;
    std::unique_ptr<State> _state;
};

}  // namespace umbriel
