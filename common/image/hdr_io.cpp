#include "common/image/hdr_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/image/atomic_file.h"

namespace umbriel {
namespace {

constexpr int kExponentBias = 128;
// Scan lines of other widths cannot be marked as run-length encoded: the format stores them flat.
constexpr int kShortestRleLine = 8;
constexpr int kLongestRleLine = 32767;
constexpr std::size_t kLongestRun = 127;
constexpr std::size_t kLongestLiteral = 128;
constexpr std::size_t kShortestRun = 4;  // shorter ones cost as much as they save

using Rgbe = std::array<std::uint8_t, 4>;

float repaired(float value, HdrRepairs& repairs) {
    if (std::isnan(value)) {
        ++repairs.nan;
        return 0.0F;
    }
    if (value < 0.0F) {
        ++repairs.negative;
        return 0.0F;
    }
    if (value > kHdrMax) {
        ++repairs.tooLarge;
        return kHdrMax;
    }
    return value;
}

Rgbe encoded(const float* rgb, HdrRepairs& repairs) {
    std::array<float, 3> value{};
    for (std::size_t c = 0; c < value.size(); ++c) {
        value[c] = repaired(rgb[c], repairs);
    }
    const float largest = *std::max_element(value.begin(), value.end());
    if (largest < 0x1p-128F) {
        return {};
    }
    int exponent = 0;
    std::frexp(largest, &exponent);  // largest in [0.5, 1) * 2^exponent
    const auto mantissa = [&exponent](float v) {
        return static_cast<int>(std::floor(std::ldexp(v, 8 - exponent) + 0.5));
    };
    if (mantissa(largest) == 256) {  // rounded up into the next binade
        ++exponent;
    }
    return {static_cast<std::uint8_t>(mantissa(value[0])), static_cast<std::uint8_t>(mantissa(value[1])),
            static_cast<std::uint8_t>(mantissa(value[2])), static_cast<std::uint8_t>(exponent + kExponentBias)};
}

std::size_t runAt(std::span<const std::uint8_t> line, std::size_t start) {
    std::size_t length = 1;
    while (length < kLongestRun && start + length < line.size() && line[start + length] == line[start]) {
        ++length;
    }
    return length;
}

// A run is 128 + its length and the byte; everything else its length and the bytes.
void appendRunLengths(std::span<const std::uint8_t> line, std::vector<std::uint8_t>& bytes) {
    std::size_t at = 0;
    while (at < line.size()) {
        const std::size_t run = runAt(line, at);
        if (run >= kShortestRun) {
            bytes.push_back(static_cast<std::uint8_t>(128 + run));
            bytes.push_back(line[at]);
            at += run;
            continue;
        }
        std::size_t end = at + run;
        while (end < line.size() && end - at < kLongestLiteral && runAt(line, end) < kShortestRun) {
            ++end;
        }
        end = std::min(end, at + kLongestLiteral);
        bytes.push_back(static_cast<std::uint8_t>(end - at));
        bytes.insert(bytes.end(), line.begin() + static_cast<std::ptrdiff_t>(at),
                     line.begin() + static_cast<std::ptrdiff_t>(end));
        at = end;
    }
}

void appendLine(const std::vector<Rgbe>& pixels, std::vector<std::uint8_t>& bytes) {
    const auto width = static_cast<int>(pixels.size());
    if (width < kShortestRleLine || width > kLongestRleLine) {
        for (const Rgbe& pixel : pixels) {
            bytes.insert(bytes.end(), pixel.begin(), pixel.end());
        }
        return;
    }
    for (const int word : {2, 2, width >> 8, width & 255}) {
        bytes.push_back(static_cast<std::uint8_t>(word));
    }
    std::vector<std::uint8_t> plane(pixels.size());
    for (std::size_t c = 0; c < 4; ++c) {
        std::transform(pixels.begin(), pixels.end(), plane.begin(), [c](const Rgbe& pixel) { return pixel[c]; });
        appendRunLengths(plane, bytes);
    }
}

}  // namespace

Result<HdrRepairs> writeHdr(const std::filesystem::path& path, const FloatImage& rgba) {
    UMBRIEL_ASSERT(rgba.channelCount() == 4, "a picture's colour is not R, G, B, A");
    if (rgba.width() <= 0 || rgba.height() <= 0) {
        return badInput(fmt::format("cannot write '{}': the picture is empty", path.string()));
    }
    Result<std::unique_ptr<AtomicFile>> file = AtomicFile::create(path);
    if (!file) {
        return file.error();
    }
    const std::string header =
        fmt::format("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", rgba.height(), rgba.width());
    (*file)->write(std::as_bytes(std::span(header)));
    HdrRepairs repairs;
    std::vector<Rgbe> pixels(static_cast<std::size_t>(rgba.width()));
    std::vector<std::uint8_t> bytes;
    for (int y = 0; y < rgba.height(); ++y) {
        for (int x = 0; x < rgba.width(); ++x) {
            pixels[static_cast<std::size_t>(x)] = encoded(rgba.pixel(x, y), repairs);
        }
        bytes.clear();
        appendLine(pixels, bytes);
        (*file)->write(std::as_bytes(std::span(bytes)));
    }
    if (const Result<void> committed = (*file)->commit(); !committed) {
        return committed.error();
    }
    return repairs;
}

}  // namespace umbriel
