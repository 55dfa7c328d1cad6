#include "client/import/import_error.h"

#include <algorithm>

namespace umbriel {
namespace {

// A message ends up in a terminal and a log: one line of printable text, whatever names a file contains.
std::string printable(std::string_view text) {
    constexpr std::size_t kLongest = 600;
    std::string line;
    for (const char c : text.substr(0, kLongest)) line += static_cast<unsigned char>(c) < 32 || c == 127 ? ' ' : c;
    if (text.size() > kLongest) line += "...";
    return line;
}

}  // namespace

ImportRefused::ImportRefused(std::string_view place, std::string_view reason)
    : _message(printable(std::string(place) + ": " + std::string(reason))) {}

void ImportWarnings::add(std::string text) {
    text = printable(text);
    if (_full || std::find(_texts.begin(), _texts.end(), text) != _texts.end()) return;
    _full = _texts.size() + 1 == kMax;
    _texts.push_back(_full ? "more warnings are not shown" : std::move(text));
}

void ByteBudget::take(std::uint64_t bytes, std::string_view place) {
    if (bytes > _left)
        throw ImportRefused(place, "the " + _what + " would take more than " + std::to_string(_total >> 20) + " MiB");
    _left -= bytes;
}

}  // namespace umbriel
