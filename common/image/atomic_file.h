#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "common/base/result.h"

namespace umbriel {

// A file that appears whole or not at all: bytes go to a temporary file in the same directory, commit() makes them
// durable and renames it over the path. Without commit() the destructor deletes the temporary file and leaves
// whatever had the name before. A path that names something other than a regular file (a device, a directory) is
// refused, because the rename would replace it; a symbolic link is followed. Lives on one thread.
class AtomicFile {
 public:
    static Result<std::unique_ptr<AtomicFile>> create(const std::filesystem::path& path);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    // Buffered. False after the first thing that went wrong (disk full, quota); commit() says what it was.
    bool write(std::span<const std::byte> bytes);
    bool seek(std::uint64_t position);
    std::uint64_t position() const { return _position; }
    bool failed() const { return !_problem.empty(); }

    // Flushes, fsyncs, renames, and fsyncs the directory. Call once, last.
    Result<void> commit();

 private:
    AtomicFile(std::filesystem::path path, std::filesystem::path temporary, int descriptor);
    bool flush();
    void note(const char* doing);
    Error error() const;

    std::filesystem::path _path;
    std::filesystem::path _temporary;  // empty once renamed
    int _descriptor = -1;
    std::string _buffer;
    std::uint64_t _position = 0;
    std::string _problem;
};

}  // namespace umbriel
