#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace umbriel {

// XXH3, 64 bits: digests of state, where a collision costs a missed diagnostic.
std::uint64_t hash64(std::span<const std::byte> bytes, std::uint64_t seed = 0);

// XXH3, 128 bits: content addresses of blobs. Not cryptographic: peers that may send blobs are trusted to be who they
// are by the transport, and a blob's content is checked against its address on arrival.
struct Hash128 {
    std::uint64_t low = 0;
    std::uint64_t high = 0;
    friend auto operator<=>(const Hash128&, const Hash128&) = default;
};
Hash128 hash128(std::span<const std::byte> bytes);

// The same as hash128 over bytes that come in pieces.
class Hasher128 {
   public:
    Hasher128();
    ~Hasher128();
    Hasher128(const Hasher128&) = delete;
    Hasher128& operator=(const Hasher128&) = delete;
    void add(std::span<const std::byte> bytes);
    Hash128 finish() const;

   private:
    void* _state;
};

// 32 hexadecimal digits.
std::string toHex(const Hash128& hash);
// 16 hexadecimal digits.
std::string toHex(std::uint64_t value);

}  // namespace umbriel
