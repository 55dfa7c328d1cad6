#include <fmt/format.h>

#include <algorithm>

#include "common/wire/change_codec.h"
#include "common/wire/change_format.h"

namespace umbriel::wire {

namespace {

std::uint64_t multiBytesOf(const Container& container) {
    std::uint64_t bytes = 0;
    for (const FieldDescriptor& field : container.type().fields)
        if (field.isMulti) bytes += field.multi(container).byteSize();
    return bytes;
}

std::vector<BlobRef> readBlobTable(Reader& reader, const DecodeLimits& limits) {
    std::vector<BlobRef> table(reader.count(18));
    for (BlobRef& ref : table) {
        ref.hash.low = reader.u64();
        ref.hash.high = reader.u64();
        ref.elementSize = static_cast<std::uint32_t>(
            reader.bounded(MultiStorage::kChunkBytes, "a blob's element size is impossible"));
        ref.bytes = reader.bounded(limits.maxFieldBytes, "a blob is larger than a field may be");
        if (reader.ok() && (ref.elementSize == 0 || ref.bytes % ref.elementSize != 0))
            reader.fail("a blob's size is no multiple of its element size");
        if (!reader.ok()) return {};
    }
    return table;
}

// Decodes one part. Failures are kept by the reader; functions return whether it is still ok.
class PartDecoder {
 public:
    PartDecoder(std::span<const std::byte> part, Aspect& aspect, const BlobSource& blobs, const DecodeLimits& limits,
                std::uint64_t& multiBytes)
        : _reader(part), _aspect(aspect), _edit(aspect), _blobs(blobs), _limits(limits), _multiBytes(multiBytes) {}

    Result<void> run() {
        _table = readBlobTable(_reader, _limits);
        if (!_reader.ok()) return badInput(fmt::format("change list, blob table: {}", _reader.reason()));
        while (!_reader.atEnd()) {
            ++_entry;
            _id = 0;
            _type = nullptr;
            _field = nullptr;
            if (!decodeEntry()) return error();
        }
        return {};
    }

 private:
    Result<void> error() const {
        std::string where = fmt::format("change list, entry {}", _entry);
        if (_id != 0) where += fmt::format(", container #{}", _id);
        if (_type) where += fmt::format(" ({})", _type->name);
        if (_field) where += fmt::format(", field \"{}\"", _field->name);
        return badInput(fmt::format("{}: {}", where, _reader.reason()));
    }

    bool fail(const char* reason) {
        _reader.fail(reason);
        return false;
    }

    bool decodeEntry() {
        const std::uint64_t head = _reader.varint();
        if (!_reader.ok()) return false;
        const std::int64_t id = static_cast<std::int64_t>(_previousId) + unzigzag(head >> 2);
        if (id < 1 || id > static_cast<std::int64_t>(kMaxContainerId)) return fail("its container id is impossible");
        _id = static_cast<std::uint64_t>(id);
        _previousId = _id;
        switch (head & 3) {
            case static_cast<std::uint64_t>(Op::Create):
                return decodeCreate();
            case static_cast<std::uint64_t>(Op::Change):
                return decodeChange();
            case static_cast<std::uint64_t>(Op::Destroy):
                return decodeDestroy();
            default:
                return fail("it neither creates, changes nor destroys");
        }
    }

    bool decodeType() {
        const std::uint64_t index = _reader.bounded(_aspect.types().size(), "its type is unknown here");
        if (!_reader.ok()) return false;
        _type = _aspect.types().at(static_cast<std::uint32_t>(index));
        if (!_type) return fail("its type is unknown here");
        return accepts(*_type) || fail("its type must not travel");
    }

    bool accepts(const TypeDescriptor& type) const { return type.shipped || _limits.acceptUnshipped; }

    bool decodeCreate() {
        if (!decodeType()) return false;
        if (_aspect.containerCount() >= _limits.maxContainers) return fail("there are more containers than the limit");
        return _edit.create({_id}, *_type) || fail("what it creates exists, or has been destroyed just now");
    }

    bool decodeDestroy() {
        const Container* container = _aspect.find({_id});
        if (!container) return fail("what it destroys does not exist");
        _type = &container->type();
        if (!accepts(*_type)) return fail("its type must not travel");
        _multiBytes -= multiBytesOf(*container);
        _edit.destroy({_id});
        return true;
    }

    bool decodeChange() {
        if (!decodeType()) return false;
        _container = _aspect.find({_id});
        if (!_container) return fail("what it changes does not exist");
        if (&_container->type() != _type) return fail("the container is of another type");
        const FieldMask mask = _reader.varint();
        if (!_reader.ok()) return false;
        if (mask == 0) return fail("it changes no field");
        const std::size_t count = _type->fields.size();
        if (count < kMaxFields && mask >> count != 0) return fail("it changes a field that the type does not have");
        for (std::uint32_t i = 0; i < count; ++i) {
            if (((mask >> i) & 1) == 0) continue;
            _field = &_type->fields[i];
            if (!(_field->isMulti ? decodeMulti(i) : decodeSingle(i))) return false;
        }
        return true;
    }

    bool decodeSingle(std::uint32_t index) {
        if (_field->kind == ElementKind::String) {
            const std::string text = _reader.text(kMaxTextBytes);
            if (!_reader.ok()) return false;
            _edit.setText({_id}, index, text);
            return true;
        }
        const auto bytes = _reader.raw(infoOf(_field->kind).size);
        if (!_reader.ok() || !valid(bytes)) return false;
        _edit.setSingle({_id}, index, bytes);
        return true;
    }

    // Elements whose kind does not allow every bit pattern.
    bool valid(std::span<const std::byte> elements) {
        if (_field->kind == ElementKind::Bool && std::to_integer<std::uint8_t>(elements.front()) > 1)
            return fail("a flag is neither 0 nor 1");
        if (_field->enumCount == 0) return true;
        for (Reader values(elements); !values.atEnd();)
            if (values.u32() >= _field->enumCount) return fail("it has a value that its enumeration does not have");
        return true;
    }

    bool decodeMulti(std::uint32_t index) {
        const std::uint32_t elementSize = infoOf(_field->kind).size;
        const std::uint64_t size =
            _reader.bounded(_limits.maxFieldBytes / elementSize, "it is larger than a field may be");
        const std::uint64_t form = _reader.varint();
        if (!_reader.ok()) return false;
        switch (form & 3) {
            case static_cast<std::uint64_t>(Form::Ranges):
                return decodeRanges(index, size, form >> 2, false);
            case static_cast<std::uint64_t>(Form::More):
                return decodeRanges(index, size, form >> 2, true);
            case static_cast<std::uint64_t>(Form::Blob):
                return assignBlob(index, size, form >> 2);
            default:
                return fail("its form is unknown");
        }
    }

    bool decodeRanges(std::uint32_t index, std::uint64_t size, std::uint64_t count, bool more) {
        const std::uint32_t elementSize = infoOf(_field->kind).size;
        if (count > IndexRanges::kMaxRanges) return fail("it has too many ranges");
        _pieces.clear();
        std::uint64_t end = 0;
        for (std::uint64_t i = 0; i < count; ++i) {
            const std::uint64_t gap = _reader.bounded(size - end, "a range lies outside the field");
            const std::uint64_t length = _reader.bounded(size - end - gap, "a range lies outside the field");
            if (!_reader.ok()) return false;
            if (length == 0 || (gap == 0 && i > 0)) return fail("its ranges are empty or not joined");
            // size is bounded by maxFieldBytes / elementSize: the product cannot overflow.
            const auto bytes = _reader.raw(length * elementSize);
            if (!_reader.ok() || !valid(bytes)) return false;
            _pieces.push_back({end + gap, bytes});
            end += gap + length;
        }
        const std::uint64_t before = _field->multi(*_container).size();
        const std::uint64_t after = more ? std::max(before, end) : size;
        if (after > before && (_pieces.empty() || end != after || _pieces.back().first > before))
            return fail("it grows by elements that do not come with it");
        if (!account(before * elementSize, after * elementSize)) return false;
        _edit.resizeMulti({_id}, index, after);
        for (const Piece& piece : _pieces) _edit.writeMulti({_id}, index, piece.first, piece.bytes);
        return true;
    }

    bool assignBlob(std::uint32_t index, std::uint64_t size, std::uint64_t blob) {
        if (blob >= _table.size()) return fail("it refers to a blob that the part does not name");
        const BlobRef& ref = _table[blob];
        const std::uint32_t elementSize = infoOf(_field->kind).size;
        if (ref.elementSize != elementSize || ref.bytes != size * elementSize)
            return fail("its blob is of another size or for other elements");
        const MultiStorage* data = _blobs.find(ref.hash);
        if (!data) return fail("its blob has not come");
        if (data->elementSize() != elementSize || data->size() != size)
            return fail("its blob is not what its name says");
        if (_field->enumCount != 0)
            for (std::size_t i = 0; i < data->chunkCount(); ++i)
                if (!valid(data->chunk(i))) return false;
        if (!account(_field->multi(*_container).byteSize(), ref.bytes)) return false;
        _edit.assignMulti({_id}, index, *data);
        return true;
    }

    bool account(std::uint64_t before, std::uint64_t after) {
        if (after > before && after - before > _limits.maxMultiBytes - std::min(_multiBytes, _limits.maxMultiBytes))
            return fail("the multi fields of the scene are larger than the limit");
        _multiBytes = _multiBytes - before + after;
        return true;
    }

    struct Piece {
        std::uint64_t first;  // element
        std::span<const std::byte> bytes;
    };

    Reader _reader;
    Aspect& _aspect;
    RawEdit _edit;
    const BlobSource& _blobs;
    const DecodeLimits& _limits;
    std::uint64_t& _multiBytes;
    std::vector<BlobRef> _table;
    std::vector<Piece> _pieces;

    std::uint64_t _previousId = 0;
    // What is being decoded.
    std::size_t _entry = 0;
    std::uint64_t _id = 0;
    const TypeDescriptor* _type = nullptr;
    const FieldDescriptor* _field = nullptr;
    const Container* _container = nullptr;
};

}  // namespace

Result<std::vector<BlobRef>> blobsReferenced(std::span<const std::byte> part, const DecodeLimits& limits) {
    Reader reader(part);
    auto table = readBlobTable(reader, limits);
    if (!reader.ok()) return badInput(fmt::format("change list, blob table: {}", reader.reason()));
    return table;
}

ChangeDecoder::ChangeDecoder(Aspect& into, const DecodeLimits& limits) : _aspect(into), _limits(limits) {
    for (const ContainerId id : into.ids()) _multiBytes += multiBytesOf(*into.find(id));
}

Result<void> ChangeDecoder::apply(std::span<const std::byte> part, const BlobSource& blobs) {
    return PartDecoder(part, _aspect, blobs, _limits, _multiBytes).run();
}

Result<void> applyChanges(std::span<const std::byte> part, Aspect& into, const BlobSource& blobs,
                          const DecodeLimits& limits) {
    return ChangeDecoder(into, limits).apply(part, blobs);
}

}  // namespace umbriel::wire
