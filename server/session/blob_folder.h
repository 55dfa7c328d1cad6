#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "common/base/result.h"
#include "common/wire/blob.h"

namespace umbriel {

// Blobs in a folder, each in a file that is named after its content: what a server has received once it need not be
// sent again after a restart. A file appears under its name when all of it is written, and is believed only if its
// content bears that name: a damaged one is deleted. Beyond the limit those go that were used longest ago. Several
// servers may share a folder. Whatever the disk refuses costs a warning and the cache, never a frame. On one thread.
class BlobFolder {
 public:
    // Makes the folder if it is not there, and takes away what killed servers left half written. An error when it
    // cannot be used.
    static Result<BlobFolder> open(std::filesystem::path folder, std::uint64_t limitBytes);

    // It seems to be there.
    bool has(const wire::BlobRef& ref) const;
    // Nothing when it is not there, or is damaged.
    std::optional<wire::Blob> load(const wire::BlobRef& ref);
    // A blob larger than the limit is not kept. After an error nothing more is.
    void store(const wire::Blob& blob);

    // False after an error: nothing more is stored.
    bool isWritable() const { return !_broken; }

 private:
    BlobFolder(std::filesystem::path folder, std::uint64_t limitBytes)
        : _folder(std::move(folder)), _limit(limitBytes) {}
    std::filesystem::path pathOf(const wire::BlobRef& ref) const;
    Result<void> write(const wire::Blob& blob, const std::filesystem::path& path);
    // Deletes the oldest until there is room for so many bytes.
    void makeRoom(std::uint64_t bytes);

    std::filesystem::path _folder;
    std::uint64_t _limit;
    std::uint64_t _unaccounted = ~std::uint64_t{0};  // stored since the folder was looked through
    std::uint64_t _found = 0;                        // bytes in it then
    bool _broken = false;
};

}  // namespace umbriel
