#pragma once

#include <vector>

namespace umbriel {

// How a measured quantity is spread over pixels. All 0 when there are none.
struct Spread {
    double mean = 0.0;
    double median = 0.0;
    double percentile95 = 0.0;
    double max = 0.0;
};

// Percentile p is the smallest value that at least p % of the values do not exceed (nearest rank): always one of them.
// The mean is summed in the order given. Values are finite.
Spread spreadOf(std::vector<float> values);

}  // namespace umbriel
