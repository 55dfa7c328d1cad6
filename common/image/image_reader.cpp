#include "common/image/image_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <new>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "common/image/display.h"
#include "common/image/exif.h"
#include "common/image/exr_io.h"
#include "common/image/png_io.h"
#include "common/image/printable.h"

// Private to this file, so that it meets no other copy of the library at link time.
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_HDR
#define STBI_ONLY_JPEG
#define STBI_MAX_DIMENSIONS (1 << 17)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wsign-compare"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace umbriel {
namespace {

// stb_image takes zeros for what lies behind the end of a file. It fills a buffer of its own (where the file may end)
// or asks for the few bytes it needs now: coming up short on those, or with nothing, means the file is cut off.
struct StbStream {
    static constexpr int kStbBuffer = 128;

    std::FILE* file = nullptr;
    // What it reads in place of the file's bytes, by their places, ascending.
    std::span<const std::pair<long, char>> replaced;
    bool cutOff = false;

    static int read(void* user, char* to, int count) {
        auto* stream = static_cast<StbStream*>(user);
        const long at = stream->replaced.empty() ? 0 : std::ftell(stream->file);
        const int got = static_cast<int>(std::fread(to, 1, static_cast<std::size_t>(count), stream->file));
        for (const auto& [place, byte] : stream->replaced)
            if (place >= at && place < at + got) to[place - at] = byte;
        stream->cutOff = stream->cutOff || got == 0 || (got < count && count < kStbBuffer);
        return got;
    }
    static void skip(void* user, int count) { std::fseek(static_cast<StbStream*>(user)->file, count, SEEK_CUR); }
    static int atEnd(void* user) { return std::feof(static_cast<StbStream*>(user)->file); }
};

using ReplacedBytes = std::vector<std::pair<long, char>>;

// Decodes three channels with stb_image, within the limits. header: what a file that is none lacks, for the message.
// bytesPerPixel: what decoding costs, our four floats included. decode: one of stb_image's loaders from callbacks.
// linear: a decoded sample as a float.
template <class Sample, class Linear>
Result<LayeredImage> decodeWithStb(const std::filesystem::path& path, const ImageLimits& limits, const char* header,
                                   std::uint64_t bytesPerPixel,
                                   Sample* (*decode)(const stbi_io_callbacks*, void*, int*, int*, int*, int),
                                   Linear linear, const ReplacedBytes& replaced = {}) {
    const std::string name = path.string();
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(name.c_str(), "rbe"), &std::fclose);
    int width = 0;
    int height = 0;
    int channels = 0;
    StbStream stream{file.get(), replaced};
    const stbi_io_callbacks callbacks{&StbStream::read, &StbStream::skip, &StbStream::atEnd};
    if (!file || stbi_info_from_callbacks(&callbacks, &stream, &width, &height, &channels) == 0 || width <= 0 ||
        height <= 0) {
        return badInput(fmt::format("cannot read '{}': no sound {} header", name, header));
    }
    const std::uint64_t pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    if (pixels > limits.pixels || pixels * bytesPerPixel > limits.bytes) {
        return badInput(fmt::format("cannot read '{}': {} x {} pixels are more than the limit of {} pixels or {} MiB",
                                    name, width, height, limits.pixels, limits.bytes >> 20));
    }
    std::rewind(file.get());
    stream.cutOff = false;
    const std::unique_ptr<Sample, void (*)(void*)> decoded(decode(&callbacks, &stream, &width, &height, &channels, 3),
                                                           &stbi_image_free);
    if (!decoded || stream.cutOff) {
        return badInput(
            fmt::format("cannot read '{}': {}", name, decoded ? "the file is incomplete" : stbi_failure_reason()));
    }
    LayeredImage image;
    image.rgba = makeRgbaImage(width, height);
    const Sample* from = decoded.get();
    float* to = image.rgba.samples().data();
    for (std::size_t i = 0; i < image.rgba.pixelCount(); ++i, from += 3, to += 4) {
        std::transform(from, from + 3, to, linear);
        to[3] = 1.0F;
    }
    return image;
}

// Where a Radiance file's scan lines lie: the axis and direction from one to the next, and within one.
struct HdrLayout {
    bool isTurned = false;      // scan lines are columns
    bool linesAscend = false;   // from one to the next along +X or +Y
    bool pixelsAscend = false;  // within one
    // For stb_image, which knows -Y N +X M alone; empty: the file is like that.
    ReplacedBytes replaced;
};

// "-Y 480 +X 640": X grows to the right, Y upwards (Ward, "File Formats" of the Radiance manual). line: what follows
// the header's empty line, `place` bytes into the file. A line of another form is left to the decoder, which refuses
// it.
HdrLayout hdrLayout(std::string_view line, std::size_t place) {
    HdrLayout layout;
    const auto isAxis = [&](std::size_t at) {
        return at + 2 < line.size() && (line[at] == '+' || line[at] == '-') &&
               (line[at + 1] == 'X' || line[at + 1] == 'Y') && line[at + 2] == ' ';
    };
    if (!isAxis(0)) return layout;
    const std::size_t second = line.find_first_of("+-", 3);
    if (second == std::string_view::npos || !isAxis(second) || line[second + 1] == line[1]) return layout;
    layout.isTurned = line[1] == 'X';
    layout.linesAscend = line[0] == '+';
    layout.pixelsAscend = line[second] == '+';
    const auto is = static_cast<long>(place);
    if (line.substr(0, 2) != "-Y" || line.substr(second, 2) != "+X")
        layout.replaced = {
            {is, '-'}, {is + 1, 'Y'}, {is + static_cast<long>(second), '+'}, {is + static_cast<long>(second) + 1, 'X'}};
    return layout;
}

// The picture upright, whose scan lines were taken for rows from the top, and their pixels for columns from the left.
FloatImage upright(const FloatImage& lines, const HdrLayout& layout) {
    const int count = lines.height(), length = lines.width();
    FloatImage image = layout.isTurned ? makeRgbaImage(count, length) : makeRgbaImage(length, count);
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < length; ++k) {
            // Rows are counted from the top, so Y ascends against them.
            const bool fromLast = layout.isTurned ? !layout.linesAscend : layout.linesAscend;
            const bool fromEnd = layout.isTurned ? layout.pixelsAscend : !layout.pixelsAscend;
            const int line = fromLast ? count - 1 - i : i, pixel = fromEnd ? length - 1 - k : k;
            float* to = layout.isTurned ? image.pixel(line, pixel) : image.pixel(pixel, line);
            std::copy_n(lines.pixel(k, i), 4, to);
        }
    return image;
}

struct HdrHeader {
    // What all pixels were multiplied with after they were radiance: the product of the EXPOSURE lines (Ward,
    // likewise), which stb_image leaves alone.
    double exposure = 1.0;
    HdrLayout layout;
};

Result<HdrHeader> readHdrHeader(const std::filesystem::path& path) {
    constexpr std::string_view kKey = "EXPOSURE=";
    constexpr std::size_t kLongestHeader = 1 << 16;
    std::string header(kLongestHeader, '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(header.data(), static_cast<std::streamsize>(header.size()));
    header.resize(static_cast<std::size_t>(file.gcount()));
    double product = 1.0;
    std::string_view rest = header;
    std::size_t size = rest.find('\n');
    for (; size != std::string_view::npos && size > 0; size = rest.find('\n')) {
        const std::string_view line = rest.substr(0, size);
        rest.remove_prefix(size + 1);
        if (!line.starts_with(kKey)) continue;
        const char* const end = line.data() + line.size();
        const char* begin = line.data() + kKey.size();
        while (begin != end && (*begin == ' ' || *begin == '+')) ++begin;
        double value = 0.0;
        const auto [stop, error] = std::from_chars(begin, end, value);
        product *= value;
        const bool isNumber = error == std::errc() && (stop == end || *stop == ' ' || *stop == '\t' || *stop == '\r');
        if (!isNumber || !(product >= 1e-30 && product <= 1e30))
            return badInput(fmt::format("cannot read '{}': its exposure is no positive number: {}", path.string(),
                                        printable(line)));
    }
    HdrHeader result{product, {}};
    if (size == 0) {
        rest.remove_prefix(1);
        result.layout = hdrLayout(rest.substr(0, rest.find('\n')), header.size() - rest.size());
    }
    return result;
}

Result<LayeredImage> readHdr(const std::filesystem::path& path, const ImageLimits& limits) {
    const auto header = readHdrHeader(path);
    if (!header) return header.error();
    const bool isUpright = header->layout.replaced.empty();
    // Three decoded floats and four of ours, or, afterwards, four of ours twice.
    const std::uint64_t bytesPerPixel = (isUpright ? 7 : 8) * sizeof(float);
    auto image = decodeWithStb(
        path, limits, "Radiance", bytesPerPixel, &stbi_loadf_from_callbacks,
        [scale = 1.0 / header->exposure](float sample) { return static_cast<float>(sample * scale); },
        header->layout.replaced);
    if (image && !isUpright) image->rgba = upright(image->rgba, header->layout);
    return image;
}

// What decoding costs for a pixel: our four floats, the decoder's planes, codes, and coefficients of a progressive
// file.
constexpr std::uint64_t kJpegBytesPerPixel = 32;

Result<LayeredImage> readJpeg(const std::filesystem::path& path, const ImageLimits& limits) {
    auto decoded = decodeWithStb(path, limits, "JPEG", kJpegBytesPerPixel, &stbi_load_from_callbacks, linearFromSrgbByte);
    if (!decoded) return decoded;
    LayeredImage image = std::move(*decoded);
    const ExposureTags tags = readExposureTags(path);
    if (tags.seconds) {
        image.numbers["expTime"] = *tags.seconds;
    }
    if (tags.aperture) {
        image.numbers["aperture"] = *tags.aperture;
    }
    if (tags.isoSpeed) {
        image.numbers["isoSpeed"] = *tags.isoSpeed;
    }
    return image;
}

}  // namespace

Result<LayeredImage> readImage(const std::filesystem::path& path, const ImageLimits& limits) {
    const std::string name = path.string();
    std::error_code code;
    const std::filesystem::file_status status = std::filesystem::status(path, code);
    if (!std::filesystem::exists(status)) {
        return badInput(fmt::format("cannot read '{}': {}", name, code ? code.message() : "no such file"));
    }
    // A pipe or a terminal could keep us waiting for ever.
    if (!std::filesystem::is_regular_file(status)) {
        return badInput(fmt::format("cannot read '{}': it is not a regular file", name));
    }
    const std::uintmax_t size = std::filesystem::file_size(path, code);
    if (code || size > limits.fileBytes) {
        return badInput(fmt::format("cannot read '{}': {}", name,
                                    code ? code.message() : fmt::format("larger than {} bytes", limits.fileBytes)));
    }
    std::array<char, 8> magic{};
    std::ifstream stream(path, std::ios::binary);
    if (!stream) {
        return badInput(fmt::format("cannot read '{}': {}", name, std::strerror(errno)));
    }
    stream.read(magic.data(), magic.size());
    stream.close();
    const std::string_view start(magic.data(), magic.size());
    try {
        if (start.starts_with("\x76\x2f\x31\x01")) {
            return readExr(path, limits);
        }
        if (start.starts_with("\x89PNG\r\n\x1a\n")) {
            return readPng(path, limits);
        }
        if (start.starts_with("#?")) {
            return readHdr(path, limits);
        }
        if (start.starts_with("\xff\xd8\xff")) {
            return readJpeg(path, limits);
        }
    } catch (const std::bad_alloc&) {
        return failure(fmt::format("cannot read '{}': not enough memory", name));
    }
    return badInput(fmt::format("cannot read '{}': it is no OpenEXR, PNG, JPEG or Radiance file", name));
}

}  // namespace umbriel
