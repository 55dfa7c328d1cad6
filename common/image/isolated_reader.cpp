#include "common/image/isolated_reader.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>
#include <optional>
#include <system_error>

#include "common/base/clock.h"
#include "common/image/image_reader.h"

// Sanitizers reserve terabytes of address space, and their reports on stderr are wanted.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define UMBRIEL_SANITIZED 1
#endif
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define UMBRIEL_SANITIZED 1
#endif

namespace umbriel {
namespace {

#ifdef UMBRIEL_SANITIZED
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

constexpr int kChildPipe = 3;
constexpr std::uint32_t kMaxTextBytes = 1U << 17;
constexpr std::uint32_t kMaxAttributes = 4096;
constexpr std::uint64_t kFileBytesPerSecond = std::uint64_t{8} << 20;

enum class Answer : std::uint32_t { Picture = 0x55504943, BadInput = 0x55424144, Failure = 0x55464149 };

// ---- child: the picture as a stream of machine-order words ----

class PipeWriter {
 public:
    explicit PipeWriter(int descriptor) : _descriptor(descriptor) {}

    void bytes(const void* data, std::size_t count) {
        const char* from = static_cast<const char*>(data);
        while (count > 0) {
            const ssize_t wrote = ::write(_descriptor, from, count);
            if (wrote < 0 && errno == EINTR) {
                continue;
            }
            if (wrote <= 0) {
                ::_exit(1);  // nobody listens any more
            }
            from += wrote;
            count -= static_cast<std::size_t>(wrote);
        }
    }
    void word(std::uint32_t value) { bytes(&value, sizeof value); }
    void text(const std::string& value) {
        const auto size = static_cast<std::uint32_t>(std::min<std::size_t>(value.size(), kMaxTextBytes));
        word(size);
        bytes(value.data(), size);
    }
    template <class T>
    void samples(const BasicImage<T>& image) {
        bytes(image.samples().data(), image.samples().size() * sizeof(T));
    }

 private:
    int _descriptor;
};

void sendPicture(const LayeredImage& image, PipeWriter& writer) {
    writer.word(static_cast<std::uint32_t>(Answer::Picture));
    writer.word(static_cast<std::uint32_t>(image.width()));
    writer.word(static_cast<std::uint32_t>(image.height()));
    writer.samples(image.rgba);
    writer.word(static_cast<std::uint32_t>(image.layers.size()));
    for (const ImageLayer& layer : image.layers) {
        writer.text(layer.name);
        writer.word(layer.isUint() ? 1 : 0);
        writer.word(static_cast<std::uint32_t>(layer.channels().size()));
        for (const std::string& channel : layer.channels()) {
            writer.text(channel);
        }
        std::visit([&writer](const auto& i) { writer.samples(i); }, layer.image);
    }
    writer.word(static_cast<std::uint32_t>(std::min<std::size_t>(image.texts.size(), kMaxAttributes)));
    std::uint32_t sent = 0;
    for (const auto& [name, text] : image.texts) {
        if (sent++ == kMaxAttributes) {
            break;
        }
        writer.text(name);
        writer.text(text);
    }
    writer.word(static_cast<std::uint32_t>(std::min<std::size_t>(image.numbers.size(), kMaxAttributes)));
    sent = 0;
    for (const auto& [name, number] : image.numbers) {
        if (sent++ == kMaxAttributes) {
            break;
        }
        writer.text(name);
        writer.bytes(&number, sizeof number);
    }
}

struct ChildLimits {
    rlim_t addressSpace = 0;
    rlim_t processorSeconds = 0;
};

void limit(int resource, rlim_t value) {
    const rlimit wanted{value, value};
    ::setrlimit(static_cast<__rlimit_resource>(resource), &wanted);
}

void closeFrom(int first) {
    rlimit files{};
    if (::close_range(static_cast<unsigned>(first), ~0U, 0) != 0 && ::getrlimit(RLIMIT_NOFILE, &files) == 0) {
        for (int i = first; i < static_cast<int>(std::min<rlim_t>(files.rlim_cur, 65536)); ++i) {
            ::close(i);
        }
    }
}

[[noreturn]] void runChild(int pipe, const std::filesystem::path& path, const ImageLimits& imageLimits,
                           const ChildLimits& limits) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU}) {
        if (!kSanitized || number != SIGSEGV) {
            std::signal(number, SIG_DFL);
        }
    }
    if (pipe != kChildPipe) {
        ::dup2(pipe, kChildPipe);
    }
    closeFrom(kChildPipe + 1);
    const int null = ::open("/dev/null", O_RDWR);
    if (null >= 0) {
        ::dup2(null, 0);
        ::dup2(null, 1);
        if (!kSanitized) {
            ::dup2(null, 2);  // the allocator's last words about a corrupted heap are no message for users
        }
        ::close(null);
    }
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_FSIZE, 0);
    limit(RLIMIT_CPU, limits.processorSeconds);
    if (!kSanitized) {
        limit(RLIMIT_AS, limits.addressSpace);
    }
    PipeWriter writer(kChildPipe);
    const Result<LayeredImage> image = readImage(path, imageLimits);
    if (image) {
        sendPicture(*image, writer);
    } else {
        const bool bad = image.error().kind == Error::Kind::BadInput;
        writer.word(static_cast<std::uint32_t>(bad ? Answer::BadInput : Answer::Failure));
        writer.text(image.error().message);
    }
    ::_exit(0);  // no destructors of the parent's objects
}

// ---- parent: nothing the child says is believed ----

class PipeReader {
 public:
    PipeReader(int descriptor, TimePoint deadline) : _descriptor(descriptor), _deadline(deadline) {}

    bool late() const { return _late; }

    bool bytes(void* data, std::size_t count) {
        char* to = static_cast<char*>(data);
        while (count > 0) {
            const double left = toMilliseconds(_deadline - SteadyClock().now());
            if (left <= 0.0) {
                _late = true;
                return false;
            }
            pollfd waiting{_descriptor, POLLIN, 0};
            const int ready = ::poll(&waiting, 1, static_cast<int>(std::min(left + 1.0, 1e6)));
            if (ready < 0 && errno != EINTR) {
                return false;
            }
            if (ready <= 0) {
                continue;
            }
            const ssize_t got = ::read(_descriptor, to, count);
            if (got < 0 && errno == EINTR) {
                continue;
            }
            if (got <= 0) {
                return false;
            }
            to += got;
            count -= static_cast<std::size_t>(got);
        }
        return true;
    }
    bool word(std::uint32_t& value) { return bytes(&value, sizeof value); }
    bool text(std::string& value) {
        std::uint32_t size = 0;
        if (!word(size) || size > kMaxTextBytes) {
            return false;
        }
        value.resize(size);
        return bytes(value.data(), size);
    }

 private:
    int _descriptor;
    TimePoint _deadline;
    bool _late = false;
};

// Counts what has been promised to the samples against the limits.
class Budget {
 public:
    explicit Budget(const ImageLimits& limits) : _limits(limits), _bytesLeft(limits.bytes) {}

    bool take(std::uint64_t width, std::uint64_t height, std::uint64_t channels) {
        if (width == 0 || height == 0 || width > (1U << 20) || height > (1U << 20) || width * height > _limits.pixels ||
            channels > static_cast<std::uint64_t>(_limits.channels) + 4) {
            return false;
        }
        const std::uint64_t bytes = width * height * channels * sizeof(float);
        if (bytes > _bytesLeft) {
            return false;
        }
        _bytesLeft -= bytes;
        return true;
    }

 private:
    ImageLimits _limits;
    std::uint64_t _bytesLeft;
};

template <class T>
bool receiveSamples(PipeReader& reader, BasicImage<T>& image) {
    return reader.bytes(image.samples().data(), image.samples().size() * sizeof(T));
}

bool receiveLayer(PipeReader& reader, Budget& budget, LayeredImage& image, int maxChannels) {
    ImageLayer layer;
    std::uint32_t isUint = 0;
    std::uint32_t channelCount = 0;
    if (!reader.text(layer.name) || !reader.word(isUint) || !reader.word(channelCount) ||
        channelCount > static_cast<std::uint32_t>(maxChannels)) {
        return false;
    }
    std::vector<std::string> channels(channelCount);
    for (std::string& channel : channels) {
        if (!reader.text(channel)) {
            return false;
        }
    }
    if (!budget.take(static_cast<std::uint64_t>(image.width()), static_cast<std::uint64_t>(image.height()),
                     channelCount)) {
        return false;
    }
    if (isUint != 0) {
        layer.image = UintImage(image.width(), image.height(), std::move(channels));
    } else {
        layer.image = FloatImage(image.width(), image.height(), std::move(channels));
    }
    image.layers.push_back(std::move(layer));
    return std::visit([&reader](auto& i) { return receiveSamples(reader, i); }, image.layers.back().image);
}

bool receiveAttributes(PipeReader& reader, LayeredImage& image) {
    std::uint32_t count = 0;
    std::string name;
    if (!reader.word(count) || count > kMaxAttributes) {
        return false;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
        if (!reader.text(name) || !reader.text(image.texts[name])) {
            return false;
        }
    }
    if (!reader.word(count) || count > kMaxAttributes) {
        return false;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
        if (!reader.text(name) || !reader.bytes(&image.numbers[name], sizeof(float))) {
            return false;
        }
    }
    return true;
}

bool receivePicture(PipeReader& reader, const ImageLimits& limits, LayeredImage& image) {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    Budget budget(limits);
    if (!reader.word(width) || !reader.word(height) || !budget.take(width, height, 4)) {
        return false;
    }
    image.rgba = makeRgbaImage(static_cast<int>(width), static_cast<int>(height));
    std::uint32_t layerCount = 0;
    if (!receiveSamples(reader, image.rgba) || !reader.word(layerCount) ||
        layerCount > static_cast<std::uint32_t>(limits.channels)) {
        return false;
    }
    for (std::uint32_t i = 0; i < layerCount; ++i) {
        if (!receiveLayer(reader, budget, image, limits.channels)) {
            return false;
        }
    }
    return receiveAttributes(reader, image);
}

// Empty while the child's answer is not whole.
std::optional<Result<LayeredImage>> receive(PipeReader& reader, const ImageLimits& limits) {
    std::uint32_t kind = 0;
    if (!reader.word(kind)) {
        return std::nullopt;
    }
    if (kind == static_cast<std::uint32_t>(Answer::Picture)) {
        LayeredImage image;
        if (!receivePicture(reader, limits, image)) {
            return std::nullopt;
        }
        return Result<LayeredImage>(std::move(image));
    }
    std::string message;
    if (!reader.text(message)) {
        return std::nullopt;
    }
    if (kind == static_cast<std::uint32_t>(Answer::BadInput)) {
        return Result<LayeredImage>(badInput(message));
    }
    return Result<LayeredImage>(failure(message));
}

std::uint64_t addressSpaceNow() {
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

std::string endOf(int status, bool late, std::chrono::seconds waited) {
    if (late) {
        return fmt::format("decoding did not end within {} s", waited.count());
    }
    if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL)) {
        return "decoding took more processor time or memory than a picture of this size may";
    }
    if (WIFSIGNALED(status)) {
        return fmt::format("the decoder crashed on it ({}): the file is damaged or hostile",
                           ::strsignal(WTERMSIG(status)));
    }
    return "the decoder gave up on it without an answer: the file is damaged or hostile";
}

}  // namespace

Result<LayeredImage> readImageIsolated(const std::filesystem::path& path, const IsolationLimits& limits) {
    std::error_code code;
    const std::uintmax_t fileBytes = std::filesystem::file_size(path, code);
    const std::chrono::seconds processorTime =
        limits.processorTime +
        std::chrono::seconds(code ? 0 : std::min<std::uintmax_t>(fileBytes / kFileBytesPerSecond, 3600));
    ChildLimits childLimits;
    childLimits.addressSpace = addressSpaceNow() + limits.image.bytes + limits.workingBytes;
    childLimits.processorSeconds = static_cast<rlim_t>(processorTime.count());

    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) {
        return failure(fmt::format("cannot read '{}': no pipe: {}", path.string(), std::strerror(errno)));
    }
    const pid_t child = ::fork();
    if (child < 0) {
        const int reason = errno;
        ::close(ends[0]);
        ::close(ends[1]);
        return failure(fmt::format("cannot read '{}': no process: {}", path.string(), std::strerror(reason)));
    }
    if (child == 0) {
        runChild(ends[1], path, limits.image, childLimits);
    }
    ::close(ends[1]);
    ::fcntl(ends[0], F_SETPIPE_SZ, 1 << 20);  // fewer switches between the two; the default works too

    PipeReader reader(ends[0], SteadyClock().now() + 2 * processorTime);
    std::optional<Result<LayeredImage>> answer;
    bool outOfMemory = false;
    try {
        answer = receive(reader, limits.image);
    } catch (const std::bad_alloc&) {
        outOfMemory = true;
    }
    ::close(ends[0]);
    // An answer that is whole stands. The child is not waited for longer: it has nothing more to say.
    int status = 0;
    if (answer || reader.late() || outOfMemory) {
        ::kill(child, SIGKILL);
    }
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (outOfMemory) {
        return failure(fmt::format("cannot read '{}': not enough memory", path.string()));
    }
    if (answer) {
        return *std::move(answer);
    }
    return badInput(
        fmt::format("cannot read '{}': {}", path.string(), endOf(status, reader.late(), 2 * processorTime)));
}

}  // namespace umbriel
