#include "client/app/output_files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <optional>
#include <set>
#include <type_traits>

#include "common/base/log.h"
#include "common/image/assemble.h"
#include "common/image/exr_io.h"
#include "common/image/hdr_io.h"
#include "common/image/png_io.h"

namespace umbriel {
namespace {

namespace fs = std::filesystem;

struct FrameNumberPlace {
    std::size_t begin = 0;
    std::size_t length = 0;
    int digits = 0;
};

// The %d or %0Nd of a pattern; none: no place; a malformed or second one is an error.
Result<std::optional<FrameNumberPlace>> findPlace(const std::string& pattern) {
    const std::size_t begin = pattern.find('%');
    if (begin == std::string::npos) return std::optional<FrameNumberPlace>{};
    std::size_t end = begin + 1;
    int digits = 0;
    while (end < pattern.size() && std::isdigit(static_cast<unsigned char>(pattern[end])) && digits < 100)
        digits = digits * 10 + (pattern[end++] - '0');
    const bool good = end < pattern.size() && pattern[end] == 'd' && digits <= 12 &&
                      pattern.find('%', end) == std::string::npos;
    if (!good) return badInput(fmt::format("--out '{}': a pattern has exactly one %d or %0Nd, as in x.%04d.exr", pattern));
    return std::optional<FrameNumberPlace>({begin, end + 1 - begin, digits});
}

// Characters that mean something in a channel's name become '_'.
std::string asLayerName(std::string_view name) {
    std::string clean(name.substr(0, 100));
    std::replace_if(clean.begin(), clean.end(),
                    [](unsigned char c) { return !std::isalnum(c) && c != '.' && c != '-' && c != '_'; }, '_');
    return clean;
}

std::vector<std::string> channelNames(Layer layer, std::uint32_t channels) {
    switch (layer) {
        case Layer::Colour: return {"R", "G", "B", "A"};
        case Layer::Depth: return {"Z"};
        case Layer::Position:
        case Layer::Normal: return {"X", "Y", "Z"};
        case Layer::Ids: return {"node", "primitive"};
        case Layer::LightFactors: break;
    }
    std::vector<std::string> names;
    for (std::uint32_t i = 0; i < channels; ++i) names.push_back(i == 0 ? "factor" : fmt::format("factor{}", i));
    return names;
}

template <class T>
void place(const TileLayer& layer, const TileAssignment& tile, BasicImage<T>& wall) {
    const PixelRect& rect = tile.pixels;
    std::vector<T> samples(static_cast<std::size_t>(rect.width) * layer.channels);
    const std::size_t rowBytes = samples.size() * bytesOf(layer.components);
    for (std::int32_t y = 0; y < rect.height; ++y) {
        const auto row = std::span(layer.pixels).subspan(static_cast<std::size_t>(y) * rowBytes, rowBytes);
        if constexpr (std::is_same_v<T, float>)
            convertToFloats(layer.components, row, samples);
        else
            std::memcpy(samples.data(), row.data(), row.size());
        copyTile(std::span<const T>(samples), static_cast<int>(layer.channels), {rect.x, rect.y + y, rect.width, 1},
                 wall);
    }
}

Result<void> writeRadiance(const fs::path& path, const FloatImage& rgba) {
    const auto repairs = writeHdr(path, rgba);
    if (!repairs) return repairs.error();
    if (const std::uint64_t count = repairs->negative + repairs->nan + repairs->tooLarge; count > 0)
        log::warning(fmt::format("{}: {} values below 0, {} that are no number and {} beyond {:.3g} do not fit the format "
                                 "and were replaced; .exr keeps them",
                                 path.string(), repairs->negative, repairs->nan, repairs->tooLarge, kHdrMax));
    return {};
}

}  // namespace

Result<OutputFiles> OutputFiles::plan(const std::vector<std::string>& outs, std::uint64_t frames) {
    OutputFiles files;
    for (const std::string& out : outs) {
        std::string pattern = out;
        std::error_code error;
        if (pattern.empty()) return badInput("--out: expected a file or folder");
        if (fs::is_directory(pattern, error)) pattern = (fs::path(pattern) / "frame.%04d.exr").string();
        const auto place = findPlace(pattern);
        if (!place) return place.error();
        if (frames > 1 && !*place)
            return badInput(fmt::format("--out '{}': {} frames need a pattern such as x.%04d.exr, or an existing folder",
                                        out, frames));
        const fs::path path(pattern);
        const std::string suffix = path.extension().string();
        if (suffix != ".exr" && suffix != ".hdr" && suffix != ".png")
            return badInput(
                fmt::format("--out '{}': expected a name ending in .exr, .hdr or .png, or an existing folder", out));
        const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
        if (!fs::is_directory(folder, error))
            return badInput(fmt::format("--out '{}': there is no folder {}; create it first", out, folder.string()));
        if (::access(folder.c_str(), W_OK) != 0)
            return badInput(fmt::format("--out '{}': the folder {} cannot be written: {}", out, folder.string(),
                                        std::strerror(errno)));
        files._patterns.push_back(pattern);
    }
    return files;
}

bool OutputFiles::allShowBytes() const {
    return std::all_of(_patterns.begin(), _patterns.end(),
                       [](const std::string& pattern) { return fs::path(pattern).extension() == ".png"; });
}

std::vector<fs::path> OutputFiles::pathsFor(std::uint64_t frame, std::string_view suffix) const {
    std::vector<fs::path> paths;
    for (const std::string& pattern : _patterns) {
        std::string name = pattern;
        if (const auto place = findPlace(pattern); place && *place)
            name.replace((*place)->begin, (*place)->length, fmt::format("{:0{}}", frame, std::max(1, (*place)->digits)));
        fs::path path(name);
        if (!suffix.empty()) path.replace_extension("." + std::string(suffix) + path.extension().string());
        paths.push_back(std::move(path));
    }
    return paths;
}

Result<std::vector<fs::path>> OutputFiles::write(std::uint64_t frame, std::string_view suffix, const LayeredImage& image,
                                                   double exposure, ToneMapping toneMapping) const {
    const std::vector<fs::path> paths = pathsFor(frame, suffix);
    for (const fs::path& path : paths) {
        Result<void> written;
        if (path.extension() == ".png")
            written = writePng(path, image.rgba, {.exposure = exposure, .toneMapping = toneMapping});
        else if (path.extension() == ".hdr")
            written = writeRadiance(path, image.rgba);
        else
            written = writeExr(path, image);
        if (!written) return written.error();
    }
    return paths;
}

LayeredImage assembleWall(PixelSize wall, const std::vector<TilePixels>& tiles, Eye eye) {
    LayeredImage image;
    image.rgba = makeRgbaImage(wall.width, wall.height);
    for (const TilePixels& tile : tiles) {
        if (tile.tile.eye != eye) continue;
        // Two lights may have the same name. Every tile has its layers in the same order, so numbers agree.
        std::set<std::string> taken;
        for (const TileLayer& layer : tile.layers) {
            if (layer.layer == Layer::Colour) {
                place(layer, tile.tile, image.rgba);
                continue;
            }
            const std::string plain = asLayerName(layer.name);
            std::string name = plain;
            for (int number = 2; !taken.insert(name).second; ++number) name = fmt::format("{}_{}", plain, number);
            const auto channels = channelNames(layer.layer, layer.channels);
            auto found = std::find_if(image.layers.begin(), image.layers.end(),
                                      [&](const ImageLayer& known) { return known.name == name; });
            if (found == image.layers.end()) {
                if (layer.components == ComponentType::Uint)
                    image.layers.push_back({name, UintImage(wall.width, wall.height, channels, 0xffffffffu)});
                else
                    image.layers.push_back({name, FloatImage(wall.width, wall.height, channels)});
                found = image.layers.end() - 1;
            }
            if (layer.components == ComponentType::Uint)
                place(layer, tile.tile, std::get<UintImage>(found->image));
            else place(layer, tile.tile, std::get<FloatImage>(found->image));
        }
    }
    return image;
}

}  // namespace umbriel
