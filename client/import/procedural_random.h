#pragma once

#include <cstdint>

namespace umbriel {

// PCG32 (O'Neill 2014), so that procedural scenes have the same bits with every standard library.
class ProceduralRandom {
 public:
    explicit ProceduralRandom(std::uint64_t seed, std::uint64_t stream = 1) : _increment(2 * stream + 1) {
        next();
        _state += seed;
        next();
    }

    std::uint32_t next() {
        const std::uint64_t old = _state;
        _state = old * 6364136223846793005ULL + _increment;
        const auto shifted = static_cast<std::uint32_t>(((old >> 18) ^ old) >> 27);
        const auto turn = static_cast<std::uint32_t>(old >> 59);
        return (shifted >> turn) | (shifted << ((32 - turn) & 31));
    }
    // In [0, 1), all 24 bits used.
    float unit() { return static_cast<float>(next() >> 8) * 0x1p-24f; }
    float between(float low, float high) { return low + (high - low) * unit(); }
    // In [0, count).
    std::uint32_t below(std::uint32_t count) {
        return static_cast<std::uint32_t>((static_cast<std::uint64_t>(next()) * count) >> 32);
    }

 private:
    std::uint64_t _state = 0;
    std::uint64_t _increment;
};

}  // namespace umbriel
