#include "common/visibility/bake_job.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace umbriel::visibility {
namespace {

constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kMostClassBytes = 63;
constexpr std::uint32_t kMostSlots = 4096;

class Out {
 public:
    void u32(std::uint32_t value) { little(value, 4); }
    void u64(std::uint64_t value) { little(value, 8); }
    void f64(double value) { u64(std::bit_cast<std::uint64_t>(value)); }
    void hash(const Hash128& value) {
        u64(value.low);
        u64(value.high);
    }
    Bytes bytes;

 private:
    void little(std::uint64_t value, int count) {
        for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::byte>(value >> (8 * i)));
    }
};

// Zeros after the end; the size is checked at last.
class In {
 public:
    explicit In(std::span<const std::byte> bytes) : _bytes(bytes) {}
    std::uint32_t u32() { return static_cast<std::uint32_t>(little(4)); }
    std::uint64_t u64() { return little(8); }
    double f64() { return std::bit_cast<double>(u64()); }
    Hash128 hash() {
        const std::uint64_t low = u64();
        return {low, u64()};
    }
    std::span<const std::byte> rest() { return _bytes.subspan(std::min(_at, _bytes.size())); }
    bool isEnd() const { return _at == _bytes.size(); }

 private:
    std::uint64_t little(int count) {
        std::uint64_t value = 0;
        for (int i = 0; i < count; ++i, ++_at)
            if (_at < _bytes.size()) value |= std::to_integer<std::uint64_t>(_bytes[_at]) << (8 * i);
        return value;
    }
    std::span<const std::byte> _bytes;
    std::size_t _at = 0;
};

}  // namespace

Bytes encodeBakeJob(const BakeJob& job) {
    Out out;
    const BakeSettings& s = job.settings;
    out.u32(kVersion);
    out.u32(static_cast<std::uint32_t>(s.mapping.kind));
    out.u32(s.mapping.size);
    out.f64(s.mapping.fovy);
    out.u32(static_cast<std::uint32_t>(s.maker));
    out.u32(static_cast<std::uint32_t>(s.guard));
    out.f64(s.farShare);
    out.u32(s.contents);
    out.u32(s.environment.width);
    out.u32(s.environment.height);
    out.hash(job.meshHash);
    out.hash(job.directionHash);
    out.u64(job.firstRow);
    out.u64(job.rowCount);
    return std::move(out.bytes);
}

Result<BakeJob> decodeBakeJob(std::span<const std::byte> bytes) {
    In in(bytes);
    BakeJob job;
    BakeSettings& s = job.settings;
    const std::uint32_t version = in.u32(), kind = in.u32();
    s.mapping.size = in.u32();
    s.mapping.fovy = in.f64();
    const std::uint32_t maker = in.u32(), guard = in.u32();
    s.farShare = in.f64();
    s.contents = in.u32();
    s.environment.width = in.u32();
    s.environment.height = in.u32();
    job.meshHash = in.hash();
    job.directionHash = in.hash();
    job.firstRow = in.u64();
    job.rowCount = in.u64();
    if (!in.isEnd() || version != kVersion) return badInput("a bake job of another version, or of wrong length");
    if (kind > static_cast<std::uint32_t>(MappingKind::Fibonacci) || maker > static_cast<std::uint32_t>(MapMaker::Gl) ||
        guard > static_cast<std::uint32_t>(trace::Guard::FastFan))
        return badInput("a bake job of an unknown mapping, maker or guard");
    s.mapping.kind = static_cast<MappingKind>(kind);
    s.maker = static_cast<MapMaker>(maker);
    s.guard = static_cast<trace::Guard>(guard);
    if (const auto valid = check(s); !valid) return valid.error();
    return job;
}

Bytes encodeReadiness(const BakeReadiness& readiness) {
    Out out;
    out.u32(kVersion);
    out.u32(readiness.slots);
    out.hash(readiness.meshHash);
    out.hash(readiness.directionHash);
    const auto text = std::as_bytes(std::span(readiness.bakeClass));
    out.bytes.insert(out.bytes.end(), text.begin(), text.end());
    return std::move(out.bytes);
}

Result<BakeReadiness> decodeReadiness(std::span<const std::byte> bytes) {
    In in(bytes);
    BakeReadiness readiness;
    const std::uint32_t version = in.u32();
    readiness.slots = in.u32();
    readiness.meshHash = in.hash();
    readiness.directionHash = in.hash();
    const auto text = in.rest();
    const bool printable = std::ranges::all_of(text, [](std::byte b) {
        return std::to_integer<int>(b) >= 0x20 && std::to_integer<int>(b) < 0x7f;
    });
    if (version != kVersion || readiness.slots == 0 || readiness.slots > kMostSlots || text.empty() ||
        text.size() > kMostClassBytes || !printable)
        return badInput("what the server says of its readiness to bake makes no sense");
    readiness.bakeClass.assign(reinterpret_cast<const char*>(text.data()), text.size());
    return readiness;
}

}  // namespace umbriel::visibility
