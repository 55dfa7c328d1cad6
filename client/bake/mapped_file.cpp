#include "client/bake/mapped_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace umbriel {

Result<MappedFile> MappedFile::open(const std::filesystem::path& path) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0) return badInput(fmt::format("{}: {}", path.string(), std::strerror(errno)));
    struct stat status {};
    void* memory = MAP_FAILED;
    std::string problem;
    if (::fstat(descriptor, &status) != 0) {
        problem = std::strerror(errno);
    } else if (!S_ISREG(status.st_mode)) {
        problem = "it is no regular file";
    } else if (status.st_size == 0) {
        problem = "the file is empty";
    } else {
        memory = ::mmap(nullptr, static_cast<std::size_t>(status.st_size), PROT_READ, MAP_SHARED, descriptor, 0);
        if (memory == MAP_FAILED) problem = std::strerror(errno);
    }
    ::close(descriptor);
    if (!problem.empty()) return badInput(fmt::format("{}: {}", path.string(), problem));
    return MappedFile({static_cast<const std::byte*>(memory), static_cast<std::size_t>(status.st_size)});
}

MappedFile::MappedFile(MappedFile&& other) noexcept : _bytes(std::exchange(other._bytes, {})) {}

MappedFile::~MappedFile() {
    if (!_bytes.empty()) ::munmap(const_cast<std::byte*>(_bytes.data()), _bytes.size());
}

}  // namespace umbriel
