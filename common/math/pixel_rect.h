#pragma once

#include <algorithm>
#include <cstdint>

namespace umbriel {

struct PixelSize {
    std::int32_t width = 0;
    std::int32_t height = 0;
    friend bool operator==(const PixelSize&, const PixelSize&) = default;
};

// Half-open, in wall pixels, origin at the lower left corner.
struct PixelRect {
    std::int32_t x = 0;
    std::int32_t y = 0;
    std::int32_t width = 0;
    std::int32_t height = 0;

    bool empty() const { return width <= 0 || height <= 0; }
    std::int64_t area() const { return empty() ? 0 : std::int64_t{width} * height; }
    friend bool operator==(const PixelRect&, const PixelRect&) = default;
};

inline PixelRect intersect(const PixelRect& a, const PixelRect& b) {
    const std::int32_t left = std::max(a.x, b.x);
    const std::int32_t bottom = std::max(a.y, b.y);
    const std::int32_t right = std::min(a.x + a.width, b.x + b.width);
    const std::int32_t top = std::min(a.y + a.height, b.y + b.height);
    return {left, bottom, std::max(0, right - left), std::max(0, top - bottom)};
}

}  // namespace umbriel
