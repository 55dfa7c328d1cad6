#include "common/wire/bytes.h"

#include <cmath>

namespace umbriel::wire {

float Reader::finiteF32() {
    const float value = f32();
    if (!std::isfinite(value)) fail("a number is not finite");
    return ok() ? value : 0.0f;
}

double Reader::finiteF64() {
    const double value = f64();
    if (!std::isfinite(value)) fail("a number is not finite");
    return ok() ? value : 0.0;
}

bool Reader::boolean() {
    const std::uint8_t value = u8();
    if (value > 1) fail("a flag is neither 0 nor 1");
    return value == 1;
}

std::uint64_t Reader::varint() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 70; shift += 7) {
        const std::uint8_t byte = u8();
        if (!ok()) return 0;
        if (shift == 63 && byte > 1) break;  // more than 64 bits
        value |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
        if ((byte & 0x80) == 0) {
            if (byte == 0 && shift > 0) break;  // a longer form of a smaller number
            return value;
        }
    }
    fail("a variable-length number is malformed");
    return 0;
}

std::uint64_t Reader::bounded(std::uint64_t limit, const char* reason) {
    const std::uint64_t value = varint();
    if (value > limit) {
        fail(reason);
        return 0;
    }
    return value;
}

std::size_t Reader::count(std::size_t minElementBytes, std::uint64_t limit) {
    const std::uint64_t value = varint();
    if (value > limit || value > remaining() / (minElementBytes == 0 ? 1 : minElementBytes)) {
        fail("a count is larger than its message can hold");
        return 0;
    }
    return static_cast<std::size_t>(value);
}

std::span<const std::byte> Reader::raw(std::size_t size) {
    if (size > remaining()) {
        fail("the message ends too early");
        return {};
    }
    const auto view = _bytes.subspan(_position, size);
    _position += size;
    return view;
}

std::string Reader::text(std::size_t limit) {
    const std::size_t size = static_cast<std::size_t>(bounded(limit, "a text is too long"));
    const auto view = raw(size);
    return std::string(reinterpret_cast<const char*>(view.data()), view.size());
}

std::uint64_t Reader::little(int count) {
    const auto view = raw(static_cast<std::size_t>(count));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < view.size(); ++i) value |= std::to_integer<std::uint64_t>(view[i]) << (8 * i);
    return value;
}

}  // namespace umbriel::wire
