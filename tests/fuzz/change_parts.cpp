#include "tests/fuzz/change_parts.h"

#include <algorithm>

namespace umbriel::fuzz {

using wire::Form;
using wire::Op;

namespace {

constexpr std::size_t kMaxPieces = 4096;

bool isRanges(std::uint64_t form) {
    return (form & 3) != static_cast<std::uint64_t>(Form::Blob);
}

wire::Bytes copied(std::span<const std::byte> bytes) {
    return {bytes.begin(), bytes.end()};
}

ChangePart::Field readField(wire::Reader& reader, const FieldDescriptor& descriptor, std::uint32_t index) {
    ChangePart::Field field;
    field.index = index;
    const std::size_t elementSize = infoOf(descriptor.kind).size;
    if (!descriptor.isMulti) {
        const bool isText = descriptor.kind == ElementKind::String;
        field.value = copied(reader.raw(isText ? reader.count(1) : elementSize));
        return field;
    }
    field.size = reader.varint();
    field.form = reader.varint();
    if (!isRanges(field.form)) return field;
    const std::uint64_t count = field.form >> 2;
    for (std::uint64_t i = 0; i < std::min<std::uint64_t>(count, kMaxPieces) && reader.ok(); ++i) {
        ChangePart::Range range;
        range.gap = reader.varint();
        range.count = reader.count(elementSize);
        range.elements = copied(reader.raw(range.count * elementSize));
        field.ranges.push_back(std::move(range));
    }
    return field;
}

void writeField(wire::Writer& writer, const ChangePart::Field& field, const FieldDescriptor& descriptor) {
    if (!descriptor.isMulti) {
        if (descriptor.kind == ElementKind::String) writer.varint(field.value.size());
        return writer.raw(field.value);
    }
    writer.varint(field.size);
    writer.varint(field.form);
    for (const ChangePart::Range& range : field.ranges) {
        writer.varint(range.gap);
        writer.varint(range.count);
        writer.raw(range.elements);
    }
}

}  // namespace

std::optional<ChangePart> takeApart(std::span<const std::byte> bytes, const TypeRegistry& types) {
    wire::Reader reader(bytes);
    ChangePart part;
    part.blobs.resize(reader.count(18));
    for (wire::BlobRef& blob : part.blobs) {
        blob.hash.low = reader.u64();
        blob.hash.high = reader.u64();
        blob.elementSize = static_cast<std::uint32_t>(reader.varint());
        blob.bytes = reader.varint();
    }
    std::uint64_t previous = 0;
    while (reader.ok() && !reader.atEnd()) {
        ChangePart::Entry entry;
        const std::uint64_t head = reader.varint();
        entry.op = static_cast<std::uint8_t>(head & 3);
        entry.id = previous = previous + static_cast<std::uint64_t>(wire::unzigzag(head >> 2));
        if (entry.op == static_cast<std::uint8_t>(Op::Create) || entry.op == static_cast<std::uint8_t>(Op::Change))
            entry.type = reader.varint();
        if (entry.op == static_cast<std::uint8_t>(Op::Change)) {
            const TypeDescriptor* type =
                entry.type < types.size() ? types.at(static_cast<std::uint32_t>(entry.type)) : nullptr;
            const FieldMask mask = reader.varint();
            if (!type) return std::nullopt;
            for (std::uint32_t i = 0; i < type->fields.size() && reader.ok(); ++i)
                if ((mask >> i) & 1) entry.fields.push_back(readField(reader, type->fields[i], i));
        }
        part.entries.push_back(std::move(entry));
    }
    if (!reader.ok()) return std::nullopt;
    return part;
}

wire::Bytes putTogether(const ChangePart& part, const TypeRegistry& types) {
    wire::Bytes bytes;
    wire::Writer writer(bytes);
    writer.varint(part.blobs.size());
    for (const wire::BlobRef& blob : part.blobs) {
        writer.u64(blob.hash.low);
        writer.u64(blob.hash.high);
        writer.varint(blob.elementSize);
        writer.varint(blob.bytes);
    }
    std::uint64_t previous = 0;
    for (const ChangePart::Entry& entry : part.entries) {
        writer.varint(wire::zigzag(static_cast<std::int64_t>(entry.id - previous)) << 2 | (entry.op & 3));
        previous = entry.id;
        if (entry.op == static_cast<std::uint8_t>(Op::Create) || entry.op == static_cast<std::uint8_t>(Op::Change))
            writer.varint(entry.type);
        if (entry.op != static_cast<std::uint8_t>(Op::Change)) continue;
        const TypeDescriptor* type =
            entry.type < types.size() ? types.at(static_cast<std::uint32_t>(entry.type)) : nullptr;
        FieldMask mask = 0;
        for (const ChangePart::Field& field : entry.fields) mask |= FieldMask{1} << field.index;
        writer.varint(mask);
        for (const ChangePart::Field& field : entry.fields)
            if (type && field.index < type->fields.size()) writeField(writer, field, type->fields[field.index]);
    }
    return bytes;
}

ChangePart::Field plainField(const TypeDescriptor& type, std::uint32_t index) {
    ChangePart::Field field;
    field.index = index;
    const FieldDescriptor& descriptor = type.fields[index];
    if (!descriptor.isMulti) {
        if (descriptor.kind != ElementKind::String) field.value.resize(infoOf(descriptor.kind).size);
        return field;
    }
    field.size = 2;
    field.form = 1 << 2;
    field.ranges.push_back({0, 2, wire::Bytes(2 * infoOf(descriptor.kind).size)});
    return field;
}

}  // namespace umbriel::fuzz
