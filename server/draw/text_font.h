#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace umbriel {

// A fixed-width font, printable ASCII; anything else shows as a question mark. Capitals are 5x7 pixels at the top of
// cells of 6x8, whose last row is for what hangs below the line.
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
