#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "common/base/result.h"

namespace umbriel {

// A file mapped for reading. Files of maps appear by rename, so nobody shortens one that is mapped.
class MappedFile {
 public:
    // Bad input when it cannot be opened, is no regular file, or is empty.
    static Result<MappedFile> open(const std::filesystem::path& path);
    ~MappedFile();
    MappedFile(MappedFile&& other) noexcept;
    MappedFile& operator=(MappedFile&&) = delete;

    std::span<const std::byte> bytes() const { return _bytes; }

 private:
    explicit MappedFile(std::span<const std::byte> bytes) : _bytes(bytes) {}
    std::span<const std::byte> _bytes;
};

}  // namespace umbriel
