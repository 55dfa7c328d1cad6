#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <optional>

#include "common/base/clock.h"
#include "common/protocol/failure_policy.h"

namespace umbriel::protocol {

// How long the wall waits for the slower half of its servers once the faster half is ready.
class FramePacing {
 public:
    static constexpr Duration kStrictLimit = std::chrono::seconds(2);
    static constexpr Duration kDegradeLeast = std::chrono::milliseconds(100);
    static constexpr Duration kDegradeMost = std::chrono::milliseconds(250);

    explicit FramePacing(FailurePolicy policy) : _policy(policy) {}

    // How long a frame took, from its request to its swap.
    void took(Duration frame) {
        _last[_count % _last.size()] = frame;
        ++_count;
    }

    // None: it waits for as long as it takes.
    std::optional<Duration> allowance() const {
        if (_policy == FailurePolicy::Wait) return std::nullopt;
        if (_policy == FailurePolicy::Strict) return kStrictLimit;
        if (_count == 0) return kDegradeMost;
        auto sorted = _last;
        const std::size_t known = std::min(_count, sorted.size());
        const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(known / 2);
        std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(known));
        return std::clamp(3 * *middle, kDegradeLeast, kDegradeMost);
    }

 private:
    FailurePolicy _policy;
    std::array<Duration, 31> _last{};
    std::size_t _count = 0;
};

}  // namespace umbriel::protocol
