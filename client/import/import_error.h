#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

namespace umbriel {

// Ends an import from any depth of a parser. Never leaves this folder: the importers' entry points turn it into an
// Error.
class ImportRefused : public std::exception {
 public:
    explicit ImportRefused(std::string message) : _message(std::move(message)) {}
    // "PLACE: REASON", the place in the notation of the file's format.
    ImportRefused(std::string_view place, std::string_view reason);
    const char* what() const noexcept override { return _message.c_str(); }

 private:
    std::string _message;
};

// What the user should know of a file that loads nevertheless. Each text once, and no more than a person reads.
class ImportWarnings {
 public:
    static constexpr std::size_t kMax = 50;

    void add(std::string text);
    const std::vector<std::string>& texts() const { return _texts; }
    // Faces of more than three corners, which were split into triangles. Nothing to warn of: only counted.
    void addPolygons(std::uint64_t count) { _polygons += count; }
    std::uint64_t polygons() const { return _polygons; }

 private:
    std::vector<std::string> _texts;
    std::uint64_t _polygons = 0;
    bool _full = false;
};

// Counts bytes before they are allocated: a small file may describe a large scene (an accessor without data, one used
// by ten thousand primitives, a compressed picture).
class ByteBudget {
 public:
    ByteBudget(std::uint64_t bytes, std::string_view what) : _total(bytes), _left(bytes), _what(what) {}

    // Throws ImportRefused when less is left.
    void take(std::uint64_t bytes, std::string_view place);
    std::uint64_t left() const { return _left; }

 private:
    std::uint64_t _total;
    std::uint64_t _left;
    std::string _what;
};

}  // namespace umbriel
