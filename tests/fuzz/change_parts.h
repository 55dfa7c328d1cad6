#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/scene/type_descriptor.h"
#include "common/wire/change_codec.h"
#include "common/wire/change_format.h"

namespace umbriel::fuzz {

// A part of a change list taken apart, so that a mutation of one number keeps everything around it readable. Nothing in
// it needs to be valid: what the decoder refuses can be written just as well.
struct ChangePart {
    struct Range {
        std::uint64_t gap = 0;
        std::uint64_t count = 0;
        wire::Bytes elements;
    };
    struct Field {
        std::uint32_t index = 0;
        wire::Bytes value;       // of a single field, or a text
        std::uint64_t size = 0;  // of a multi field
        std::uint64_t form = 0;  // n << 2 | form
        std::vector<Range> ranges;
    };
    struct Entry {
        std::uint8_t op = 0;
        std::uint64_t id = 0;
        std::uint64_t type = 0;
        std::vector<Field> fields;
    };
    std::vector<wire::BlobRef> blobs;
    std::vector<Entry> entries;
};

// Nothing when the bytes are no part.
std::optional<ChangePart> takeApart(std::span<const std::byte> bytes, const TypeRegistry& types);
wire::Bytes putTogether(const ChangePart& part, const TypeRegistry& types);

// A field with a value of the right length.
ChangePart::Field plainField(const TypeDescriptor& type, std::uint32_t index);

}  // namespace umbriel::fuzz
