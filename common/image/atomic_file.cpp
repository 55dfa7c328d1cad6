#include "common/image/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "common/base/assert.h"

namespace umbriel {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr int kTemporaryNames = 100;

std::filesystem::path directoryOf(const std::filesystem::path& path) {
    return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

}  // namespace

Result<std::unique_ptr<AtomicFile>> AtomicFile::create(const std::filesystem::path& wanted) {
    std::error_code code;
    std::filesystem::path path = wanted;
    if (path.filename().empty()) {
        return badInput(fmt::format("cannot write '{}': it names no file", path.string()));
    }
    if (std::filesystem::is_symlink(std::filesystem::symlink_status(path, code))) {
        path = std::filesystem::weakly_canonical(path, code);
        if (code) {
            return failure(fmt::format("cannot write '{}': {}", wanted.string(), code.message()));
        }
    }
    const std::filesystem::file_status status = std::filesystem::status(path, code);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
        return badInput(fmt::format("cannot write '{}': it exists and is not a regular file", path.string()));
    }
    // The short name of its own keeps within NAME_MAX whatever the file is called; the number steps over what a
    // killed process with our id left.
    for (int i = 0; i < kTemporaryNames; ++i) {
        const std::filesystem::path temporary =
            directoryOf(path) / fmt::format(".umbriel-{}-{}.tmp", static_cast<long>(::getpid()), i);
        const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0) {
            return std::unique_ptr<AtomicFile>(new AtomicFile(path, temporary, descriptor));
        }
        if (errno != EEXIST) {
            return failure(fmt::format("cannot write '{}': {}", path.string(), std::strerror(errno)));
        }
    }
    return failure(fmt::format("cannot write '{}': no free temporary name beside it; remove the .umbriel-*.tmp files",
                               path.string()));
}

AtomicFile::AtomicFile(std::filesystem::path path, std::filesystem::path temporary, int descriptor)
    : _path(std::move(path)), _temporary(std::move(temporary)), _descriptor(descriptor) {
    _buffer.reserve(kBufferBytes);
}

AtomicFile::~AtomicFile() {
    if (_descriptor >= 0) {
        ::close(_descriptor);
    }
    if (!_temporary.empty()) {
        ::unlink(_temporary.c_str());
    }
}

bool AtomicFile::write(std::span<const std::byte> bytes) {
    _position += bytes.size();
    if (!_problem.empty()) {
        return false;
    }
    _buffer.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return _buffer.size() < kBufferBytes || flush();
}

bool AtomicFile::seek(std::uint64_t position) {
    if (!flush()) {
        return false;
    }
    if (::lseek(_descriptor, static_cast<off_t>(position), SEEK_SET) < 0) {
        note("seek");
        return false;
    }
    _position = position;
    return true;
}

bool AtomicFile::flush() {
    std::size_t done = 0;
    while (_problem.empty() && done < _buffer.size()) {
        const ssize_t wrote = ::write(_descriptor, _buffer.data() + done, _buffer.size() - done);
        if (wrote >= 0) {
            done += static_cast<std::size_t>(wrote);
        } else if (errno != EINTR) {
            note("write");
        }
    }
    _buffer.clear();
    return _problem.empty();
}

Result<void> AtomicFile::commit() {
    UMBRIEL_ASSERT(!_temporary.empty() && _descriptor >= 0, "a file was committed twice");
    flush();
    if (_problem.empty() && ::fsync(_descriptor) != 0) {
        note("fsync");
    }
    const int closed = ::close(_descriptor);
    _descriptor = -1;
    if (closed != 0 && _problem.empty()) {
        note("close");
    }
    if (_problem.empty() && ::rename(_temporary.c_str(), _path.c_str()) != 0) {
        note("rename");
    }
    if (!_problem.empty()) {
        return error();
    }
    _temporary.clear();
    // The file is in place; that a directory cannot be fsynced (some network file systems) is no failure of it.
    const int directory = ::open(directoryOf(_path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory >= 0) {
        ::fsync(directory);
        ::close(directory);
    }
    return {};
}

void AtomicFile::note(const char* doing) {
    _problem = fmt::format("{}: {}", doing, std::strerror(errno));
}

Error AtomicFile::error() const {
    return failure(
        fmt::format("cannot write '{}': {}; nothing was left there by this attempt", _path.string(), _problem));
}

}  // namespace umbriel
