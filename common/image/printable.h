#pragma once

#include <string>
#include <string_view>

namespace umbriel {

// Words of a file in a message to people: control characters and bytes beyond ASCII become '?', so that no file can
// speak to the terminal; cut after 200 bytes.
inline std::string printable(std::string_view text) {
    constexpr std::size_t kLongest = 200;
    std::string result(text.substr(0, kLongest));
    for (char& c : result) {
        if (c < ' ' || c > '~') {
            c = '?';
        }
    }
    return text.size() > kLongest ? result + "..." : result;
}

}  // namespace umbriel
