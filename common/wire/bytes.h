#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace umbriel::wire {

static_assert(std::endian::native == std::endian::little, "bulk field data is copied as it lies in memory");

using Bytes = std::vector<std::byte>;

// Appends to a byte vector: integers little-endian byte by byte, varints as LEB128.
class Writer {
   public:
    explicit Writer(Bytes& out) : _out(out) {}

    void u8(std::uint8_t value) { _out.push_back(std::byte{value}); }
    void u16(std::uint16_t value) { little(value, 2); }
    void u32(std::uint32_t value) { little(value, 4); }
    void u64(std::uint64_t value) { little(value, 8); }
    void f32(float value) { u32(std::bit_cast<std::uint32_t>(value)); }
    void f64(double value) { u64(std::bit_cast<std::uint64_t>(value)); }
    // 1 to 10 bytes, 7 bits each, lowest first.
    void varint(std::uint64_t value) {
        while (value >= 0x80) {
            u8(static_cast<std::uint8_t>(value) | 0x80);
            value >>= 7;
        }
        u8(static_cast<std::uint8_t>(value));
    }
    void raw(std::span<const std::byte> bytes) { _out.insert(_out.end(), bytes.begin(), bytes.end()); }
    // Length as varint, then the bytes.
    void text(std::string_view value) {
        varint(value.size());
        raw(std::as_bytes(std::span(value.data(), value.size())));
    }
    std::size_t size() const { return _out.size(); }

   private:
    void little(std::uint64_t value, int count) {
        for (int i = 0; i < count; ++i) u8(static_cast<std::uint8_t>(value >> (8 * i)));
    }
    Bytes& _out;
};

// Reads hostile bytes: never past the end, never trusting a count. The first failure sticks, later reads return zeros, so
// a decoder reads straight through and checks ok() before it acts or allocates.
class Reader {
   public:
    explicit Reader(std::span<const std::byte> bytes) : _bytes(bytes) {}

    bool ok() const { return _reason == nullptr; }
    // What was wrong first; empty while ok.
    std::string_view reason() const { return _reason ? _reason : ""; }
    // Marks the input as bad; reason must outlive the reader (a literal).
    void fail(const char* reason) {
        if (!_reason) _reason = reason;
    }
    std::size_t remaining() const { return ok() ? _bytes.size() - _position : 0; }
    std::size_t position() const { return _position; }
    bool atEnd() const { return ok() && _position == _bytes.size(); }

    std::uint8_t u8() { return static_cast<std::uint8_t>(little(1)); }
    std::uint16_t u16() { return static_cast<std::uint16_t>(little(2)); }
    std::uint32_t u32() { return static_cast<std::uint32_t>(little(4)); }
    std::uint64_t u64() { return little(8); }
    float f32() { return std::bit_cast<float>(u32()); }
    double f64() { return std::bit_cast<double>(u64()); }
    // Must be finite.
    float finiteF32();
    double finiteF64();
    // Must be 0 or 1.
    bool boolean();
    // Shortest form only, so that equal values have equal bytes.
    std::uint64_t varint();
    // A varint of at most limit.
    std::uint64_t bounded(std::uint64_t limit, const char* reason);
    // A count of elements that take at least minElementBytes each: refused when they cannot fit in what remains, so
    // reserving for it is safe.
    std::size_t count(std::size_t minElementBytes, std::uint64_t limit = ~std::uint64_t{0});
    // A view into the input; empty on failure.
    std::span<const std::byte> raw(std::size_t size);
    std::string text(std::size_t limit);

   private:
    std::uint64_t little(int count);
    std::span<const std::byte> _bytes;
    std::size_t _position = 0;
    const char* _reason = nullptr;
};

}  // namespace umbriel::wire
