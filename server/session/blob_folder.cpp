#include "server/session/blob_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "common/base/log.h"

namespace umbriel {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSuffix = ".blob";
constexpr std::string_view kHalfWritten = ".part";
// Nobody writes one blob for so long: whoever did was killed.
constexpr auto kAbandoned = std::chrono::minutes(10);
constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

class Descriptor {
 public:
    explicit Descriptor(int descriptor) : _descriptor(descriptor) {}
    ~Descriptor() { close(); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return _descriptor; }
    bool close() { return _descriptor < 0 || ::close(std::exchange(_descriptor, -1)) == 0; }

 private:
    int _descriptor;
};

Error systemError(const std::string& what) {
    return failure(fmt::format("{}: {}", what, std::strerror(errno)));
}

}  // namespace

Result<BlobFolder> BlobFolder::open(fs::path folder, std::uint64_t limitBytes) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) return badInput(fmt::format("--blob-cache {}: {}", folder.string(), error.message()));
    if (::access(folder.c_str(), R_OK | W_OK | X_OK) != 0)
        return badInput(fmt::format("--blob-cache {}: {}", folder.string(), std::strerror(errno)));
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
        std::error_code ignored;
        if (entry->path().extension() == kHalfWritten &&
            fs::last_write_time(entry->path(), ignored) < fs::file_time_type::clock::now() - kAbandoned)
            fs::remove(entry->path(), ignored);
    }
    return BlobFolder(std::move(folder), limitBytes);
}

// The element size and the size are in the hash as well; in the name they tell a person what it is.
fs::path BlobFolder::pathOf(const wire::BlobRef& ref) const {
    return _folder / fmt::format("{}-{}-{}{}", toHex(ref.hash), ref.elementSize, ref.bytes, kSuffix);
}

bool BlobFolder::has(const wire::BlobRef& ref) const {
    return ::access(pathOf(ref).c_str(), R_OK) == 0;
}

std::optional<wire::Blob> BlobFolder::load(const wire::BlobRef& ref) {
    const fs::path path = pathOf(ref);
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
    if (file.get() < 0) return std::nullopt;
    const auto read = [&]() -> Result<wire::Blob> {
        struct stat status;
        if (::fstat(file.get(), &status) != 0) return systemError("fstat");
        if (static_cast<std::uint64_t>(status.st_size) != ref.bytes) return failure("its size is wrong");
        wire::BlobAssembler assembler(ref, ref.bytes);
        std::vector<std::byte> piece(kPieceBytes);
        while (!assembler.complete()) {
            const ssize_t count = ::read(file.get(), piece.data(), piece.size());
            if (count < 0 && errno == EINTR) continue;
            if (count < 0) return systemError("read");
            if (count == 0) return failure("it is too short");
            const auto added = assembler.add(std::span(piece).first(static_cast<std::size_t>(count)));
            if (!added) return added.error();
        }
        return assembler.finish();
    };
    auto blob = read();
    if (!blob) {
        log::warning(
            fmt::format("the blob cache's {} is damaged and deleted: {}", path.string(), blob.error().message));
        ::unlink(path.c_str());
        return std::nullopt;
    }
    ::futimens(file.get(), nullptr);  // used now
    return std::move(*blob);
}

void BlobFolder::store(const wire::Blob& blob) {
    if (_broken || blob.ref.bytes > _limit) return;
    const fs::path path = pathOf(blob.ref);
    if (::access(path.c_str(), F_OK) == 0) {
        ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0);
        return;
    }
    makeRoom(blob.ref.bytes);
    if (const auto written = write(blob, path); !written) {
        _broken = true;
        log::warning(fmt::format("the blob cache keeps nothing more: {}", written.error().message));
        return;
    }
    _unaccounted += blob.ref.bytes;
}

Result<void> BlobFolder::write(const wire::Blob& blob, const fs::path& path) {
    // The system finds a free name: process numbers repeat in containers, and several folders may be open in one.
    std::string part = (_folder / fmt::format("{}-XXXXXX{}", toHex(blob.ref.hash), kHalfWritten)).string();
    Descriptor file(::mkostemps(part.data(), static_cast<int>(kHalfWritten.size()), O_CLOEXEC));
    if (file.get() < 0) return systemError(part);
    const auto failed = [&] {
        const Error error = systemError(part);
        ::unlink(part.c_str());
        return error;
    };
    for (std::size_t i = 0; i < blob.data.chunkCount(); ++i)
        for (auto rest = blob.data.chunk(i); !rest.empty();) {
            const ssize_t count = ::write(file.get(), rest.data(), rest.size());
            if (count < 0 && errno == EINTR) continue;
            if (count <= 0) return failed();
            rest = rest.subspan(static_cast<std::size_t>(count));
        }
    // Not synchronised: what a power cut leaves under the name is found out by its hash.
    if (!file.close() || ::rename(part.c_str(), path.c_str()) != 0) return failed();
    return {};
}

void BlobFolder::makeRoom(std::uint64_t bytes) {
    // Others may store, too: now and then it is looked at afresh, always before it would become too large.
    const bool isKnown = _unaccounted <= _limit / 8;
    if (isKnown && _found + _unaccounted + bytes <= _limit) return;
    struct File {
        fs::file_time_type used;
        std::uint64_t bytes;
        fs::path path;
    };
    std::vector<File> files;
    std::error_code error;
    _found = 0;
    for (fs::directory_iterator entry(_folder, error), end; !error && entry != end; entry.increment(error)) {
        if (entry->path().extension() != kSuffix) continue;
        std::error_code gone;  // another server deleted it meanwhile
        const std::uint64_t size = entry->file_size(gone);
        const auto used = gone ? fs::file_time_type() : entry->last_write_time(gone);
        if (gone) continue;
        files.push_back({used, size, entry->path()});
        _found += size;
    }
    _unaccounted = 0;
    std::sort(files.begin(), files.end(),
              [](const File& a, const File& b) { return a.used != b.used ? a.used < b.used : a.path < b.path; });
    for (const File& file : files) {
        if (_found + bytes <= _limit) break;
        std::error_code ignored;
        fs::remove(file.path, ignored);
        _found -= file.bytes;
    }
}

}  // namespace umbriel
