#include "common/scene/container.h"

namespace umbriel {

void cutText(std::string& text) {
    if (text.size() <= kMaxTextBytes) return;
    std::size_t size = kMaxTextBytes;
    // Bytes 10xxxxxx continue a character, of which there are at most three.
    for (int i = 0; i < 3 && (static_cast<unsigned char>(text[size]) & 0xc0) == 0x80; ++i) --size;
    text.resize(size);
}

}  // namespace umbriel
