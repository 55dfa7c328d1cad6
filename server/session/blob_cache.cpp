#include "server/session/blob_cache.h"

#include <utility>

namespace umbriel {

const MultiStorage* BlobCache::find(const Hash128& hash) const {
    const auto found = _entries.find(hash);
    return found == _entries.end() ? nullptr : &found->second.content;
}

void BlobCache::touch(const Hash128& hash) {
    if (const auto found = _entries.find(hash); found != _entries.end())
        _order.splice(_order.end(), _order, found->second.place);
}

void BlobCache::put(wire::Blob blob) {
    const auto [place, added] = _entries.try_emplace(blob.ref.hash, Entry{std::move(blob.data), {}});
    if (!added) return;
    _bytes += blob.ref.bytes;
    place->second.place = _order.insert(_order.end(), blob.ref.hash);
}

void BlobCache::trim() {
    while (_bytes > _budget && !_order.empty()) {
        const auto found = _entries.find(_order.front());
        _bytes -= found->second.content.byteSize();
        _entries.erase(found);
        _order.pop_front();
    }
}

}  // namespace umbriel
