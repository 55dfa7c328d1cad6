// A message type and any bytes as its payload: refused with a reason, or read as a message that has this one encoding.

#include "tests/fuzz/decode_any.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::uint8_t type = data[0];
    const auto payload = std::as_bytes(std::span(data, size).subspan(1));
    const umbriel::wire::MessageRule* rule = umbriel::wire::ruleOf(type);
    if (rule && payload.size() <= rule->limit) umbriel::fuzz::decodesAs(type, payload);
    return 0;
}
