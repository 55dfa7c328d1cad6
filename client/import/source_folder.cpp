#include "client/import/source_folder.h"

#include <fcntl.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>

namespace umbriel {
namespace {

class Descriptor {
 public:
    explicit Descriptor(int value) : _value(value) {}
    ~Descriptor() {
        if (_value >= 0) close(_value);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return _value; }

 private:
    int _value;
};

int hexValue(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

std::string percentDecoded(std::string_view text, std::string_view place) {
    std::string decoded;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            decoded += text[i];
            continue;
        }
        const int high = i + 2 < text.size() ? hexValue(text[i + 1]) : -1;
        const int low = i + 2 < text.size() ? hexValue(text[i + 2]) : -1;
        if (high < 0 || low < 0) throw ImportRefused(place, "the URI has a broken percent escape");
        decoded += static_cast<char>(high * 16 + low);
        i += 2;
    }
    return decoded;
}

void requireConfined(const std::string& name, std::string_view place) {
    const auto refuse = [&](const char* reason) {
        throw ImportRefused(place, "'" + name + "' " + reason + "; only files below the folder of the scene are read");
    };
    if (name.empty()) throw ImportRefused(place, "the file name is empty");
    for (const char c : name)
        if (static_cast<unsigned char>(c) < 32) throw ImportRefused(place, "the file name has control characters");
    if (name.front() == '/' || name.front() == '\\') refuse("is an absolute path");
    const std::size_t colon = name.find(':');
    if (colon != std::string::npos && name.find('/') > colon) refuse("is not a relative file name");
    for (std::size_t begin = 0; begin <= name.size();) {
        const std::size_t end = std::min(name.find_first_of("/\\", begin), name.size());
        if (name.compare(begin, end - begin, "..") == 0) refuse("leads out of the folder");
        begin = end + 1;
    }
}

// openat2 lets the kernel keep symbolic links below the folder; where it is missing (before Linux 5.6, some sandboxes)
// the resolved path is compared instead.
int openBeneath(int folder, const std::string& name) {
    open_how how{};
    how.flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY;
    how.resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS;
    const int opened = static_cast<int>(syscall(SYS_openat2, folder, name.c_str(), &how, sizeof(how)));
    if (opened >= 0 || (errno != ENOSYS && errno != EPERM)) return opened;
    const int plain = openat(folder, name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (plain < 0) return plain;
    const auto pathOf = [](int descriptor) {
        char path[PATH_MAX + 1];
        const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
        const ssize_t length = readlink(link.c_str(), path, PATH_MAX);
        return std::string(path, length > 0 ? static_cast<std::size_t>(length) : 0);
    };
    const std::string root = pathOf(folder);
    const std::string found = pathOf(plain);
    if (!root.empty() && (root == "/" || found.compare(0, root.size() + 1, root + "/") == 0)) return plain;
    close(plain);
    errno = EXDEV;
    return -1;
}

}  // namespace

SourceFolder::SourceFolder(const std::string& file, ByteBudget& fileBytes) : _file(file), _fileBytes(fileBytes) {
    const std::size_t slash = file.rfind('/');
    const std::string folder = slash == std::string::npos ? "." : slash == 0 ? "/" : file.substr(0, slash);
    _fileName = slash == std::string::npos ? file : file.substr(slash + 1);
    _folder = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (_folder < 0) throw ImportRefused(folder, "cannot open the folder: " + std::string(std::strerror(errno)));
}

SourceFolder::~SourceFolder() {
    if (_folder >= 0) close(_folder);
}

std::vector<std::byte> SourceFolder::readMain() {
    const Descriptor file(open(_file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
    if (file.get() < 0) throw ImportRefused("cannot be read: " + std::string(std::strerror(errno)));
    return readAll(file.get(), _fileName, "the file");
}

std::vector<std::byte> SourceFolder::read(std::string_view name, std::string_view place, bool uri) {
    const std::string decoded = uri ? percentDecoded(name, place) : std::string(name);
    requireConfined(decoded, place);
    const Descriptor file(openBeneath(_folder, decoded));
    if (file.get() < 0) {
        const std::string reason = errno == EXDEV ? "it lies outside the folder of the scene" : std::strerror(errno);
        throw ImportRefused(place, "cannot read '" + decoded + "': " + reason);
    }
    return readAll(file.get(), decoded, place);
}

std::vector<std::byte> SourceFolder::readAll(int descriptor, const std::string& name, std::string_view place) {
    struct stat status {};
    if (fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode))
        throw ImportRefused(place, "'" + name + "' is not a regular file");
    _fileBytes.take(static_cast<std::uint64_t>(status.st_size), place);
    std::vector<std::byte> bytes(static_cast<std::size_t>(status.st_size));
    std::size_t filled = 0;
    while (filled < bytes.size()) {
        const ssize_t got = ::read(descriptor, bytes.data() + filled, bytes.size() - filled);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) throw ImportRefused(place, "cannot read '" + name + "': " + std::strerror(errno));
        if (got == 0) break;  // it was shortened while we read
        filled += static_cast<std::size_t>(got);
    }
    bytes.resize(filled);
    return bytes;
}

}  // namespace umbriel
