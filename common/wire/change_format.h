#pragma once

#include <cstdint>

namespace umbriel::wire {

// What encoder and decoder of change lists share; the format is described in change_codec.h.
enum class Op : std::uint8_t { Create, Change, Destroy };
enum class Form : std::uint8_t { Ranges, Blob, More };

// Small numbers of either sign become small numbers: 0, -1, 1, -2 ... -> 0, 1, 2, 3 ...
constexpr std::uint64_t zigzag(std::int64_t value) {
    return static_cast<std::uint64_t>(value) << 1 ^ static_cast<std::uint64_t>(value >> 63);
}
constexpr std::int64_t unzigzag(std::uint64_t value) {
    return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
}

}  // namespace umbriel::wire
