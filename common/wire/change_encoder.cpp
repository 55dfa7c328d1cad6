#include <algorithm>
#include <set>

#include "common/scene/field_values.h"
#include "common/wire/change_codec.h"
#include "common/wire/change_format.h"

namespace umbriel::wire {

namespace {

constexpr std::size_t kMinPartBytes = 512;
constexpr std::size_t kEntryFraming = 25;  // head, type and mask at their longest
constexpr std::size_t kBlobFraming = 31;   // an entry of the blob table at its longest
constexpr std::size_t kMultiFraming = 20;  // size and form of a multi field at their longest
constexpr std::size_t kRangeFraming = 20;  // gap and count of a range at their longest

class Encoder {
 public:
    Encoder(const Aspect& aspect, const EncodeOptions& options) : _aspect(aspect), _options(options) {
        UMBRIEL_ASSERT(options.maxPartBytes >= kMinPartBytes, "parts must be long enough for one element");
    }

    EncodedChanges encode(const ChangeList& changes) {
        for (const ContainerCreation& creation : changes.created) {
            if (!ships(*_aspect.types().at(creation.type))) continue;
            makeRoom(kEntryFraming);
            head(creation.id, Op::Create);
            Writer(_entries).varint(creation.type);
            ++_result.entries;
        }
        for (const ContainerChange& change : changes.changed) {
            const Container* container = _aspect.find(change.id);
            UMBRIEL_ASSERT(container != nullptr, "a change list is used before its aspect is edited again");
            if (!ships(container->type())) continue;
            encodeChange(change, *container);
            ++_result.entries;
        }
        for (std::size_t i = 0; i < changes.destroyed.size(); ++i) {
            if (!ships(*_aspect.types().at(changes.destroyedTypes[i]))) continue;
            makeRoom(kEntryFraming);
            head(changes.destroyed[i], Op::Destroy);
            ++_result.entries;
        }
        closePart();
        return std::move(_result);
    }

 private:
    bool ships(const TypeDescriptor& type) const { return type.shipped || _options.includeUnshipped; }

    void head(ContainerId id, Op op) {
        UMBRIEL_ASSERT(id.value <= kMaxContainerId, "a container id is too large to travel");
        const std::uint64_t delta =
            zigzag(static_cast<std::int64_t>(id.value) - static_cast<std::int64_t>(_previousId));
        Writer(_entries).varint(delta << 2 | static_cast<std::uint64_t>(op));
        _previousId = id.value;
    }

    void encodeChange(const ContainerChange& change, const Container& container) {
        _container = &container;
        const auto& fields = container.type().fields;
        auto multi = change.multis.begin();
        for (std::uint32_t i = 0; i < fields.size(); ++i) {
            if (((change.fields >> i) & 1) == 0) continue;
            if (fields[i].isMulti) {
                UMBRIEL_ASSERT(multi != change.multis.end() && multi->field == i, "a multi change without its ranges");
                encodeMulti(i, fields[i].multi(container), multi->touched);
                ++multi;
                continue;
            }
            const auto bytes = bytesOfSingle(fields[i], container);
            makeRoom(bytes.size() + kMultiFraming);
            _mask |= FieldMask{1} << i;
            if (fields[i].kind == ElementKind::String) Writer(_fields).varint(bytes.size());
            Writer(_fields).raw(bytes);
        }
        closeEntry();
    }

    void encodeMulti(std::uint32_t field, const MultiStorage& data, const IndexRanges& touched) {
        const bool isWhole = touched.ranges().size() == 1 && touched.ranges().front() == IndexRange{0, data.size()};
        if (isWhole && data.byteSize() >= _options.blobThreshold) return encodeBlob(field, data);
        Writer fields(_fields);
        const std::vector<IndexRange>& ranges = touched.ranges();
        std::size_t next = 0;  // the range that is next, of which done elements are written
        std::size_t done = 0;
        std::vector<IndexRange> pieces;
        do {
            makeRoom(kMultiFraming + kRangeFraming + data.elementSize());
            std::size_t room = _options.maxPartBytes - used() - kMultiFraming;
            pieces.clear();
            while (next < ranges.size() && room >= kRangeFraming + data.elementSize()) {
                const std::size_t fit = (room - kRangeFraming) / data.elementSize();
                const std::size_t count = std::min(ranges[next].count - done, fit);
                pieces.push_back({ranges[next].first + done, count});
                room -= kRangeFraming + count * data.elementSize();
                done += count;
                if (done < ranges[next].count) break;
                ++next;
                done = 0;
            }
            const bool more = next < ranges.size();
            _mask |= FieldMask{1} << field;
            fields.varint(data.size());
            fields.varint(std::uint64_t{pieces.size()} << 2 |
                          static_cast<std::uint64_t>(more ? Form::More : Form::Ranges));
            std::size_t end = 0;
            for (const IndexRange& piece : pieces) {
                fields.varint(piece.first - end);
                fields.varint(piece.count);
                end = piece.first + piece.count;
                appendElements(data, piece);
            }
            if (more) {
                closeEntry();
                closePart();
            }
        } while (next < ranges.size());
    }

    void appendElements(const MultiStorage& data, const IndexRange& range) {
        const std::size_t at = _fields.size();
        _fields.resize(at + range.count * data.elementSize());
        data.read(range.first, std::span(_fields).subspan(at));
    }

    void encodeBlob(std::uint32_t field, const MultiStorage& data) {
        makeRoom(kMultiFraming + kBlobFraming);
        const Hash128 hash = hashOfBlob(data);
        const BlobRef ref{hash, data.elementSize(), data.byteSize()};
        if (_known.insert(hash).second) _result.blobs.push_back({ref, data});
        auto place = std::find(_table.begin(), _table.end(), ref);
        if (place == _table.end()) place = _table.insert(place, ref);
        _mask |= FieldMask{1} << field;
        Writer(_fields).varint(data.size());
        Writer(_fields).varint(static_cast<std::uint64_t>(place - _table.begin()) << 2 |
                               static_cast<std::uint64_t>(Form::Blob));
    }

    // Bytes of the part so far, as long as they can become.
    std::size_t used() const {
        return 10 + _table.size() * kBlobFraming + _entries.size() + kEntryFraming + _fields.size();
    }

    void makeRoom(std::size_t bytes) {
        if (used() + bytes <= _options.maxPartBytes) return;
        closeEntry();
        closePart();
    }

    void closeEntry() {
        if (_mask == 0) return;
        head(_container->id(), Op::Change);
        Writer(_entries).varint(_container->type().index);
        Writer(_entries).varint(_mask);
        Writer(_entries).raw(_fields);
        _fields.clear();
        _mask = 0;
    }

    void closePart() {
        if (_entries.empty()) return;
        Bytes& part = _result.parts.emplace_back();
        part.reserve(10 + _table.size() * kBlobFraming + _entries.size());
        Writer writer(part);
        writer.varint(_table.size());
        for (const BlobRef& ref : _table) {
            writer.u64(ref.hash.low);
            writer.u64(ref.hash.high);
            writer.varint(ref.elementSize);
            writer.varint(ref.bytes);
        }
        writer.raw(_entries);
        _table.clear();
        _entries.clear();
        _previousId = 0;
    }

    const Aspect& _aspect;
    const EncodeOptions& _options;
    EncodedChanges _result;
    std::set<Hash128> _known;
    // The part that is being written.
    std::vector<BlobRef> _table;
    Bytes _entries;
    std::uint64_t _previousId = 0;
    // The change entry that is being written.
    const Container* _container = nullptr;
    FieldMask _mask = 0;
    Bytes _fields;
};

}  // namespace

std::uint64_t EncodedChanges::bytes() const {
    std::uint64_t sum = 0;
    for (const Bytes& part : parts) sum += part.size();
    return sum;
}

EncodedChanges encodeChanges(const ChangeList& changes, const Aspect& aspect, const EncodeOptions& options) {
    return Encoder(aspect, options).encode(changes);
}

}  // namespace umbriel::wire
