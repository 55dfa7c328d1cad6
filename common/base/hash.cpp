#include "common/base/hash.h"

#include <fmt/format.h>
#if defined(__x86_64__)
// The vector instructions of the processor it runs on: the results are the same, the baseline takes four times as long.
#include <xxh_x86dispatch.h>
#else
#include <xxhash.h>
#endif

#include "common/base/assert.h"

namespace umbriel {

std::uint64_t hash64(std::span<const std::byte> bytes, std::uint64_t seed) {
    return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

Hash128 hash128(std::span<const std::byte> bytes) {
    const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
    return {hash.low64, hash.high64};
}

Hasher128::Hasher128() : _state(XXH3_createState()) {
    UMBRIEL_ASSERT(_state != nullptr, "out of memory for a hash state");
    XXH3_128bits_reset(static_cast<XXH3_state_t*>(_state));
}

Hasher128::~Hasher128() { XXH3_freeState(static_cast<XXH3_state_t*>(_state)); }

void Hasher128::add(std::span<const std::byte> bytes) {
    XXH3_128bits_update(static_cast<XXH3_state_t*>(_state), bytes.data(), bytes.size());
}

Hash128 Hasher128::finish() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(static_cast<const XXH3_state_t*>(_state));
    return {hash.low64, hash.high64};
}

std::string toHex(const Hash128& hash) { return fmt::format("{:016x}{:016x}", hash.high, hash.low); }

std::string toHex(std::uint64_t value) { return fmt::format("{:016x}", value); }

}  // namespace umbriel
