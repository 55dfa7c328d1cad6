#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace umbriel {

// A fixed-width font of 5x7 pixels in cells of 6x8, printable ASCII; anything else shows as a question mark.
inline constexpr int kTextCellWidth = 6;
inline constexpr int kTextCellHeight = 8;
inline constexpr std::size_t kMaxTextCharacters = 1024;

struct TextBitmap {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> coverage;  // 0 or 255; first row on top
};

// One line; characters beyond kMaxTextCharacters are left out.
TextBitmap drawText(std::string_view text);

}  // namespace umbriel
