// Any bytes as views and shadow fits: refused with a reason, or views that have this one encoding.

#include <algorithm>

#include "common/base/assert.h"
#include "common/wire/view_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto bytes = std::as_bytes(std::span(data, size));
    const auto views = umbriel::wire::decodeViews(bytes);
    if (!views) {
        UMBRIEL_ASSERT(!views.error().message.empty(), "a refusal without a reason");
        return 0;
    }
    const umbriel::wire::Bytes again = umbriel::wire::encodeViews(*views);
    UMBRIEL_ASSERT(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()),
                   "views are read from bytes that are not their encoding");
    return 0;
}
