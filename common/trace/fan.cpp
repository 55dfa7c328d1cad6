#include "common/trace/fan.h"

#include <algorithm>
#include <cmath>

namespace umbriel::trace {
namespace {

// On unit vectors: the axes are orthonormal and the tables rounded to a few 2^-24; 4e-6 is 60 of them.
constexpr float kUnsure = 4e-6f;

#if defined(__x86_64__) && defined(__GNUC__)
#define UMBRIEL_HAS_AVX2_CLONE 1
#endif

// Eight lanes against one wedge: bits of the lanes surely blocked, and of those that may be. Plain loops, so that every
// instruction set computes the same bits (no contraction to fused multiply-add).
struct Verdict {
    int blocked[kPacket];
    int maybe[kPacket];
};

template <class Wedge>
[[gnu::always_inline]] inline void accumulate(const Wedge& w, float sign, const float* x, const float* y,
                                              const float* z, Verdict& verdict) {
    for (std::size_t i = 0; i < kPacket; ++i) {
        const float q = sign * ((w.q[0] * x[i] + w.q[1] * y[i]) + w.q[2] * z[i]);
        const float m0 = (w.m0[0] * x[i] + w.m0[1] * y[i]) + w.m0[2] * z[i];
        const float m1 = (w.m1[0] * x[i] + w.m1[1] * y[i]) + w.m1[2] * z[i];
        // The largest of the three tells: all conditions hold surely below -kUnsure, and perhaps below +kUnsure.
        const float worst = std::max(q, std::max(-m0, m1));
        verdict.blocked[i] |= worst < -kUnsure ? -1 : 0;
        verdict.maybe[i] |= worst < kUnsure ? -1 : 0;
    }
}

template <class Wedge>
[[gnu::always_inline]] inline void packetVerdict(const std::vector<Wedge>& wedges, float sign, const float* x,
                                                 const float* y, const float* z, std::uint8_t& sure,
                                                 std::uint8_t& unsure) {
    Verdict verdict{};
    for (const Wedge& w : wedges) accumulate(w, sign, x, y, z, verdict);
    unsigned blocked = 0, maybe = 0;
    for (std::size_t i = 0; i < kPacket; ++i) {
        blocked |= (verdict.blocked[i] & 1u) << i;
        maybe |= (verdict.maybe[i] & 1u) << i;
    }
    sure = static_cast<std::uint8_t>(blocked);
    unsure = static_cast<std::uint8_t>(maybe & ~blocked);
}

template <class Wedge>
[[gnu::always_inline]] inline void allPackets(const std::vector<Wedge>& wedges, float sign, const DirectionPackets& set,
                                              std::size_t begin, std::size_t end, std::uint8_t* sure,
                                              std::uint8_t* unsure) {
    for (std::size_t packet = begin; packet < end; ++packet) {
        const std::size_t lane = packet * kPacket;
        packetVerdict(wedges, sign, &set.x[lane], &set.y[lane], &set.z[lane], sure[packet], unsure[packet - begin]);
    }
}

template <class Wedge>
void allPacketsPlain(const std::vector<Wedge>& wedges, float sign, const DirectionPackets& set, std::size_t begin,
                     std::size_t end, std::uint8_t* sure, std::uint8_t* unsure) {
    allPackets(wedges, sign, set, begin, end, sure, unsure);
}

#if UMBRIEL_HAS_AVX2_CLONE
template <class Wedge>
[[gnu::target("avx2")]] void allPacketsAvx2(const std::vector<Wedge>& wedges, float sign, const DirectionPackets& set,
                                            std::size_t begin, std::size_t end, std::uint8_t* sure,
                                            std::uint8_t* unsure) {
    allPackets(wedges, sign, set, begin, end, sure, unsure);
}
#endif

glm::dvec3 unit(const glm::dvec3& v) {
    const double length = glm::length(v);
    return length > 0.0 ? v / length : v;
}

}  // namespace

void Fan::reset(const Origin& origin, std::span<const glm::dvec3> edges) {
    _origin = origin;
    _wedges.clear();
    _wedges32.clear();
    const glm::dvec3 n(origin.normal);
    const glm::dmat3 axes(origin.axes);
    for (std::size_t i = 0; i + 1 < edges.size(); i += 2) {
        glm::dvec3 e0 = edges[i], e1 = edges[i + 1];
        glm::dvec3 q = glm::cross(e0, e1);
        const double side = glm::dot(q, n);
        // The normal lies in the wedge's plane: from P + delta n rays start on it and do not cross it.
        if (side == 0.0) continue;
        if (side < 0.0) {
            std::swap(e0, e1);
            q = -q;
        }
        const Wedge wedge{q, glm::cross(n, e0), glm::cross(n, e1)};
        Wedge32 local;
        const glm::dvec3 unitQ = unit(wedge.q), unit0 = unit(wedge.m0), unit1 = unit(wedge.m1);
        for (int k = 0; k < 3; ++k) {
            local.q[k] = static_cast<float>(glm::dot(axes[k], unitQ));
            local.m0[k] = static_cast<float>(glm::dot(axes[k], unit0));
            local.m1[k] = static_cast<float>(glm::dot(axes[k], unit1));
        }
        _wedges.push_back(wedge);
        _wedges32.push_back(local);
    }
}

bool Fan::blocks(const glm::dvec3& d, bool lower) const {
    // From the other side n, and with it q, changes sign; the edges change roles and m0 and m1 sign, which cancels.
    const double sign = lower ? -1.0 : 1.0;
    return std::ranges::any_of(_wedges, [&](const Wedge& w) {
        return sign * glm::dot(d, w.q) < 0.0 && glm::dot(d, w.m0) >= 0.0 && glm::dot(d, w.m1) <= 0.0;
    });
}

void Fan::classify(const DirectionPackets& set, std::size_t begin, std::size_t end, bool lower,
                   std::span<std::uint8_t> blocked) {
    if (begin == end) return;
    _unsure.resize(end - begin);
    const float sign = lower ? -1.0f : 1.0f;
#if UMBRIEL_HAS_AVX2_CLONE
    if (__builtin_cpu_supports("avx2")) {
        allPacketsAvx2(_wedges32, sign, set, begin, end, blocked.data(), _unsure.data());
    } else {
        allPacketsPlain(_wedges32, sign, set, begin, end, blocked.data(), _unsure.data());
    }
#else
    allPacketsPlain(_wedges32, sign, set, begin, end, blocked.data(), _unsure.data());
#endif
    for (std::size_t packet = begin; packet < end; ++packet) {
        if (_unsure[packet - begin] == 0) continue;
        for (std::size_t i = 0; i < kPacket; ++i) {
            if ((_unsure[packet - begin] >> i & 1) == 0) continue;
            const std::size_t lane = packet * kPacket + i;
            const glm::dvec3 d(worldDirection(_origin, set.x[lane], set.y[lane], set.z[lane]));
            if (blocks(d, lower)) blocked[packet] |= static_cast<std::uint8_t>(1u << i);
        }
    }
}

void Fan::blocked(const DirectionPackets& set, std::span<std::uint8_t> blocked) {
    std::ranges::fill(blocked, std::uint8_t{0});
    if (_wedges.empty()) return;
    const std::size_t lowerPacket = set.lowerBegin / kPacket;
    classify(set, 0, lowerPacket, false, blocked);
    classify(set, lowerPacket, set.packets(), true, blocked);
}

}  // namespace umbriel::trace
