#include "client/import/obj_text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <vector>

namespace umbriel {
namespace {

constexpr double kLargest = 1e30;

bool isBlank(char c) {
    return c == ' ' || c == '\t' || c == '\r';
}

std::string_view nextWord(std::string_view& rest) {
    while (!rest.empty() && isBlank(rest.front())) rest.remove_prefix(1);
    std::size_t size = 0;
    while (size < rest.size() && !isBlank(rest[size])) ++size;
    const std::string_view word = rest.substr(0, size);
    rest.remove_prefix(size);
    return word;
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && isBlank(text.front())) text.remove_prefix(1);
    while (!text.empty() && isBlank(text.back())) text.remove_suffix(1);
    return text;
}

std::string quoted(std::string_view word) {
    return "'" + std::string(word.substr(0, 40)) + "'";
}

std::string lineText(std::size_t number) {
    return "line " + std::to_string(number);
}

enum class NumberKind { Finite, Huge, None };

NumberKind kindOf(std::string_view word) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    double value = 0.0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::invalid_argument || stop != word.data() + word.size()) return NumberKind::None;
    // Of a number that is too large or too small from_chars tells only that; strtod gives infinity or 0.
    if (error == std::errc::result_out_of_range) value = std::strtod(std::string(word).c_str(), nullptr);
    return std::isfinite(value) && std::abs(value) <= kLargest ? NumberKind::Finite : NumberKind::Huge;
}

// Without the mark that Windows programs begin a file with, and with lines that go on behind a backslash put together;
// the lines behind keep their numbers. Throws ImportRefused when it is no text.
std::string plainText(std::string_view bytes, const std::string& place) {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    if (bytes.starts_with(kByteOrderMark)) bytes.remove_prefix(kByteOrderMark.size());
    if (bytes.find('\0') != std::string_view::npos || bytes.find(kJoint) != std::string_view::npos)
        throw ImportRefused(place + "is no text file: it has control characters");
    if (bytes.find('\\') == std::string_view::npos) return std::string(bytes);
    std::string text;
    text.reserve(bytes.size());
    std::size_t joined = 0;
    for (std::size_t begin = 0; begin < bytes.size();) {
        const std::size_t end = std::min(bytes.find('\n', begin), bytes.size());
        std::string_view line = bytes.substr(begin, end - begin);
        begin = end + 1;
        if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        // A comment ends with its line: Windows paths stand there.
        if (line.ends_with('\\') && !trimmed(line).starts_with('#')) {
            text.append(line.substr(0, line.size() - 1)) += ' ';
            ++joined;
            continue;
        }
        text.append(line).append(joined + 1, '\n');
        joined = 0;
    }
    return text;
}

// change: the line that takes the place of one, and its number from 1.
std::string withLines(const std::string& text,
                      const std::function<void(std::string_view, std::size_t, std::string&)>& change) {
    std::string changed;
    changed.reserve(text.size() + 1);
    std::size_t number = 0;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        change(std::string_view(text).substr(begin, end - begin), ++number, changed);
        changed += '\n';
        begin = end + 1;
    }
    return changed;
}

// What the corners of faces may name.
enum Element : std::size_t { kVertex, kTexCoord, kNormal };
constexpr std::array<const char*, 3> kElementNames = {"vertex", "texture coordinate", "normal"};
using Counts = std::array<std::uint64_t, 3>;

void count(std::string_view keyword, Counts& counts) {
    if (keyword == "v") ++counts[kVertex];
    if (keyword == "vt") ++counts[kTexCoord];
    if (keyword == "vn") ++counts[kNormal];
}

class ObjLines {
 public:
    ObjLines(const std::string& text, std::size_t mostCorners, ImportWarnings& warnings)
        : _mostCorners(mostCorners), _warnings(warnings) {
        for (std::size_t begin = 0; begin < text.size();) {
            const std::size_t end = std::min(text.find('\n', begin), text.size());
            std::string_view rest = std::string_view(text).substr(begin, end - begin);
            count(nextWord(rest), _total);
            begin = end + 1;
        }
    }

    void line(std::string_view line, std::size_t number, std::string& out) {
        std::string_view rest = line;
        const std::string_view keyword = nextWord(rest);
        if (keyword == "f") return face(rest, number, out);
        const std::size_t needed = keyword == "v" || keyword == "vn" ? 3 : keyword == "vt" ? 1 : 0;
        if (needed > 0) checkNumbers(rest, needed, number);
        count(keyword, _soFar);
        if (keyword != "usemtl" && keyword != "mtllib") {
            out += line;
            return;
        }
        std::string name = joinedName(rest);
        if (keyword == "mtllib") std::replace(name.begin(), name.end(), '\\', '/');  // of Windows
        out.append(keyword).append(1, ' ').append(name);
    }

 private:
    static void checkNumbers(std::string_view rest, std::size_t needed, std::size_t number) {
        std::size_t count = 0;
        for (std::string_view word = nextWord(rest); !word.empty() && word.front() != '#';
             word = nextWord(rest), ++count) {
            const NumberKind kind = kindOf(word);
            if (kind == NumberKind::None) throw ImportRefused(lineText(number), quoted(word) + " is not a number");
            if (kind == NumberKind::Huge)
                throw ImportRefused(lineText(number), quoted(word) + " is not a finite coordinate");
        }
        if (count < needed)
            throw ImportRefused(lineText(number), "has " + std::to_string(count) + " numbers where " +
                                                      std::to_string(needed) + " are needed");
    }

    void face(std::string_view rest, std::size_t number, std::string& out) {
        const std::size_t begin = out.size();
        out += 'f';
        std::size_t corners = 0;
        for (std::string_view word = nextWord(rest); !word.empty() && word.front() != '#'; word = nextWord(rest)) {
            // "f 1/2/ 3//" leaves the normal out with its slash; other programs read that, tinyobjloader does not.
            while (!word.empty() && word.back() == '/') word.remove_suffix(1);
            checkCorner(word, number);
            out.append(1, ' ').append(word);
            ++corners;
        }
        if (corners > _mostCorners)
            throw ImportRefused(lineText(number), "is a face of " + std::to_string(corners) + " corners, and at most " +
                                                      std::to_string(_mostCorners) +
                                                      " are cut into triangles: divide it in the program it is from");
        if (corners < 3) {
            out.resize(begin);
            _warnings.add(lineText(number) + ": a face of " + std::to_string(corners) + " corners is not drawn");
        }
        if (corners > 3) _warnings.addPolygons(1);
    }

    // V, V/T, V//N or V/T/N.
    void checkCorner(std::string_view word, std::size_t number) const {
        std::string_view rest = word;
        for (const Element element : {kVertex, kTexCoord, kNormal}) {
            const std::size_t slash = std::min(rest.find('/'), rest.size());
            const std::string_view index = rest.substr(0, slash);
            if (!index.empty() || element == kVertex) checkIndex(index, element, word, number);
            if (slash == rest.size()) return;
            rest.remove_prefix(slash + 1);
        }
        throw ImportRefused(lineText(number), quoted(word) + " is not a corner of a face");
    }

    void checkIndex(std::string_view text, Element element, std::string_view word, std::size_t number) const {
        std::int64_t index = 0;
        const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), index);
        if (error == std::errc::invalid_argument || stop != text.data() + text.size() ||
            (error == std::errc() && index == 0))
            throw ImportRefused(lineText(number), quoted(word) + " is not a corner of a face");
        // From the front they may name what comes later in the file, from the back only what was there before.
        const std::uint64_t most = index > 0 ? _total[element] : _soFar[element];
        if (error != std::errc() || static_cast<std::uint64_t>(std::abs(index)) > most)
            throw ImportRefused(lineText(number), "names " + std::string(kElementNames[element]) + " " +
                                                      std::string(text.substr(0, 40)) + ", there are " +
                                                      std::to_string(most));
    }

    std::size_t _mostCorners;
    ImportWarnings& _warnings;
    Counts _total{};
    Counts _soFar{};
};

}  // namespace

std::string joinedName(std::string_view name) {
    std::string joined(trimmed(name));
    std::replace_if(joined.begin(), joined.end(), isBlank, kJoint);
    return joined;
}

std::string spacedName(std::string name) {
    std::replace(name.begin(), name.end(), kJoint, ' ');
    return name;
}

std::string readableObj(std::string_view bytes, std::size_t mostCorners, ImportWarnings& warnings) {
    const std::string text = plainText(bytes, "");
    ObjLines lines(text, mostCorners, warnings);
    return withLines(
        text, [&](std::string_view line, std::size_t number, std::string& out) { lines.line(line, number, out); });
}

std::string readableMtl(std::string_view bytes, const std::string& name, ImportWarnings& warnings) {
    constexpr std::array<std::string_view, 7> kNumbers = {"Ka", "Kd", "Ks", "Ke", "Ns", "d", "Tr"};
    return withLines(
        plainText(bytes, "mtllib '" + name + "': "), [&](std::string_view line, std::size_t number, std::string& out) {
            std::string_view rest = line;
            const std::string_view keyword = nextWord(rest);
            if (keyword == "newmtl") {
                out.append(keyword).append(1, ' ').append(joinedName(rest));
                return;
            }
            if (std::find(kNumbers.begin(), kNumbers.end(), keyword) == kNumbers.end()) {
                out += line;
                return;
            }
            out += keyword;
            for (std::string_view word = nextWord(rest); !word.empty() && word.front() != '#'; word = nextWord(rest)) {
                // "d -halo 0.5" is the one option among them.
                const bool isSound =
                    word.front() == '-' && word.size() > 1 && std::isalpha(static_cast<unsigned char>(word[1]))
                        ? word == "-halo"
                        : kindOf(word) == NumberKind::Finite;
                if (!isSound)
                    warnings.add("mtllib '" + name + "', " + lineText(number) + ": " + std::string(keyword) + " " +
                                 quoted(word) + " is not a finite number and taken as 0");
                out.append(1, ' ').append(isSound ? word : "0");
            }
        });
}

}  // namespace umbriel
