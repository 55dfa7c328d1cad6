#include "common/image/spread.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace umbriel {

Spread spreadOf(std::vector<float> values) {
    if (values.empty()) {
        return {};
    }
    double sum = 0.0;
    for (const float value : values) {
        sum += static_cast<double>(value);
    }
    const auto ranked = [&values](std::size_t percent) {
        const std::size_t rank = (values.size() * percent + 99) / 100;  // from 1
        const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank - 1);
        std::nth_element(values.begin(), place, values.end());
        return static_cast<double>(*place);
    };
    return {sum / static_cast<double>(values.size()), ranked(50), ranked(95), ranked(100)};
}

}  // namespace umbriel
