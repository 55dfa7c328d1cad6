// Any bytes as what a client and a server say to each other about a bake: refused with a reason, or a job or a
// readiness with this one encoding. The first byte says which.

#include <algorithm>

#include "common/base/assert.h"
#include "common/visibility/bake_job.h"

namespace umbriel {
namespace {

template <class Decoded, class Encode>
void check(std::span<const std::byte> bytes, const Decoded& decoded, Encode encode) {
    if (!decoded) {
        UMBRIEL_ASSERT(!decoded.error().message.empty(), "a refusal without a reason");
        return;
    }
    const visibility::Bytes again = encode(*decoded);
    UMBRIEL_ASSERT(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()),
                   "something is read from bytes that are not its encoding");
}

}  // namespace
}  // namespace umbriel

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace umbriel;
    if (size == 0) return 0;
    const auto bytes = std::as_bytes(std::span(data, size)).subspan(1);
    if (data[0] & 1)
        check(bytes, visibility::decodeBakeJob(bytes), visibility::encodeBakeJob);
    else
        check(bytes, visibility::decodeReadiness(bytes), visibility::encodeReadiness);
    return 0;
}
