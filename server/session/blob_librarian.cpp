#include "server/session/blob_librarian.h"

#include <utility>

namespace umbriel {

BlobLibrarian::BlobLibrarian(BlobFolder folder, std::function<void(Loaded)> answer)
    : _folder(std::move(folder)), _answer(std::move(answer)), _thread([this] { run(); }) {}

BlobLibrarian::~BlobLibrarian() {
    {
        const std::lock_guard lock(_mutex);
        _ending = true;
        _loads.clear();
    }
    _filled.notify_one();
    _thread.join();
}

void BlobLibrarian::load(std::uint64_t request, std::vector<wire::BlobRef> refs) {
    {
        const std::lock_guard lock(_mutex);
        _loads.push_back({request, std::move(refs)});
    }
    _filled.notify_one();
}

void BlobLibrarian::store(wire::Blob blob) {
    {
        const std::lock_guard lock(_mutex);
        if (_waiting + blob.ref.bytes > kMostWaiting) return;
        _waiting += blob.ref.bytes;
        _stores.push_back(std::move(blob));
    }
    _filled.notify_one();
}

void BlobLibrarian::run() {
    std::unique_lock lock(_mutex);
    for (;;) {
        _filled.wait(lock, [&] { return _ending || !_loads.empty() || !_stores.empty(); });
        if (!_loads.empty()) {
            const Load next = std::move(_loads.front());
            _loads.pop_front();
            lock.unlock();
            answer(next);
            lock.lock();
            continue;
        }
        const std::size_t waiting = _stores.size();
        if (waiting > 0 && !_ending && _filled.wait_for(lock, kStoreAfter, [&] {
                return _ending || !_loads.empty() || _stores.size() != waiting;
            }))
            continue;
        while (!_stores.empty() && _loads.empty()) {
            const wire::Blob next = std::move(_stores.front());
            _stores.pop_front();
            lock.unlock();
            _folder.store(next);
            lock.lock();
            _waiting -= next.ref.bytes;
        }
        if (_ending && _loads.empty()) return;
    }
}

void BlobLibrarian::answer(const Load& load) {
    std::vector<wire::BlobRef> there;
    Loaded missing{load.request, {}, {}};
    for (const wire::BlobRef& ref : load.refs) (_folder.has(ref) ? there : missing.others).push_back(ref);
    if (!missing.others.empty()) _answer(std::move(missing));
    for (const wire::BlobRef& ref : there) {
        Loaded one{load.request, {}, {}};
        if (auto blob = _folder.load(ref))
            one.blobs.push_back(std::move(*blob));
        else
            one.others.push_back(ref);
        _answer(std::move(one));
    }
}

}  // namespace umbriel
