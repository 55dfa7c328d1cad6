#include "common/scene/change_list.h"

#include <algorithm>
#include <limits>

#include "common/base/assert.h"

namespace umbriel {

namespace {

std::size_t endOf(const IndexRange& range) {
    return range.first + range.count;
}

}  // namespace

void IndexRanges::add(std::size_t first, std::size_t count) {
    if (count == 0) return;
    UMBRIEL_ASSERT(count <= std::numeric_limits<std::size_t>::max() - first, "a range must end");
    const std::size_t end = first + count;
    // Everything that overlaps or adjoins [first, end) becomes one range with it.
    const auto begin =
        std::lower_bound(_ranges.begin(), _ranges.end(), first,
                         [](const IndexRange& range, std::size_t value) { return endOf(range) < value; });
    auto stop = begin;
    IndexRange joined{first, count};
    while (stop != _ranges.end() && stop->first <= end) {
        const std::size_t joinedEnd = std::max(endOf(joined), endOf(*stop));
        joined.first = std::min(joined.first, stop->first);
        joined.count = joinedEnd - joined.first;
        ++stop;
    }
    if (begin == stop)
        _ranges.insert(begin, joined);
    else {
        *begin = joined;
        _ranges.erase(begin + 1, stop);
    }
    if (_ranges.size() <= kMaxRanges) return;
    std::size_t best = 0;
    std::size_t bestGap = std::numeric_limits<std::size_t>::max();
    for (std::size_t i = 0; i + 1 < _ranges.size(); ++i) {
        const std::size_t gap = _ranges[i + 1].first - endOf(_ranges[i]);
        if (gap < bestGap) best = i, bestGap = gap;
    }
    _ranges[best].count = endOf(_ranges[best + 1]) - _ranges[best].first;
    _ranges.erase(_ranges.begin() + static_cast<std::ptrdiff_t>(best) + 1);
}

void IndexRanges::add(const IndexRanges& other) {
    for (const IndexRange& range : other._ranges) add(range.first, range.count);
}

void IndexRanges::clampTo(std::size_t size) {
    while (!_ranges.empty() && _ranges.back().first >= size) _ranges.pop_back();
    if (!_ranges.empty()) _ranges.back().count = std::min(_ranges.back().count, size - _ranges.back().first);
}

std::size_t IndexRanges::elementCount() const {
    std::size_t count = 0;
    for (const IndexRange& range : _ranges) count += range.count;
    return count;
}

}  // namespace umbriel
