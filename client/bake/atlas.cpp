#include "client/bake/atlas.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "common/visibility/half.h"
#include "common/visibility/map_maker.h"

namespace umbriel {
namespace {

using visibility::Bytes;
using visibility::MapContent;
using visibility::MapFile;
using visibility::MapHeader;
using visibility::Mapping;
using visibility::MappingKind;

constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 28;

constexpr const char* kShowsMasks = "masks";
constexpr const char* kShowsDistances = "distances";

struct Kind {
    MapContent content;
    const char* layer;
};
constexpr std::array kLayers{Kind{MapContent::Distance, "distance"}, Kind{MapContent::HitDistance, "hit"},
                             Kind{MapContent::Index, "index"}};

bool holds(const MapHeader& header, MapContent content) {
    return (header.contents & static_cast<std::uint32_t>(content)) != 0;
}

std::uint16_t u16(const Bytes& bytes, std::size_t at) {
    return static_cast<std::uint16_t>(std::to_integer<unsigned>(bytes[at]) | std::to_integer<unsigned>(bytes[at + 1])
                                                                                 << 8);
}

// Tiles of a picture.
struct Layout {
    std::uint32_t columns = 1;
    TilePlace tile;
    std::vector<TilePlace> places;  // of each pixel in a tile

    Layout(const Mapping& mapping, std::uint32_t columnCount) : columns(columnCount), tile(tileSize(mapping)) {
        for (std::uint32_t p = 0; p < visibility::pixelCount(mapping); ++p) places.push_back(tilePlace(mapping, p));
    }
    int x(std::uint64_t index, std::uint32_t pixel) const {
        return static_cast<int>(index % columns) * tile.x + places[pixel].x;
    }
    // From the top, as pictures are.
    int y(std::uint64_t index, std::uint32_t pixel) const {
        return static_cast<int>(index / columns + 1) * tile.y - 1 - places[pixel].y;
    }
};

void describe(const MapHeader& h, std::uint32_t columns, const char* shows, LayeredImage& picture) {
    auto& t = picture.texts;
    t["umvisMapping"] = std::string(name(h.mapping.kind));
    t["umvisSize"] = std::to_string(h.mapping.size);
    t["umvisFovy"] = fmt::format("{:.17g}", h.mapping.fovy);
    t["umvisMaker"] = std::to_string(static_cast<int>(h.maker));
    t["umvisGuard"] = std::to_string(static_cast<int>(h.guard));
    t["umvisContents"] = std::to_string(h.contents);
    t["umvisFar"] = fmt::format("{:.17g}", h.farShare);
    t["umvisEnvironment"] = fmt::format("{}x{}", h.environment.width, h.environment.height);
    t["umvisMesh"] = toHex(h.meshHash);
    t["umvisDirections"] = toHex(h.directionHash);
    t["umvisClass"] = h.bakeClass;
    t["umvisColumns"] = std::to_string(columns);
    t["umvisShows"] = shows;
}

Error notAValue(const char* channel, int x, int y) {
    return badInput(
        fmt::format("the atlas was changed: {} of its pixel {}, {} is no value that was baked", channel, x, y));
}

// Reads attributes back; the first that is missing or malformed sticks.
class Texts {
 public:
    explicit Texts(const LayeredImage& picture) : _picture(picture) {}
    std::string text(const char* key) {
        const auto found = _picture.texts.find(key);
        if (found == _picture.texts.end()) {
            fail(key);
            return {};
        }
        return found->second;
    }
    template <class T>
    T number(const char* key) {
        const std::string value = text(key);
        T result{};
        const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), result);
        if (error != std::errc() || end != value.data() + value.size()) fail(key);
        return result;
    }
    void fail(const char* key) {
        if (_missing.empty()) _missing = key;
    }
    const std::string& missing() const { return _missing; }

 private:
    const LayeredImage& _picture;
    std::string _missing;
};

}  // namespace

TilePlace tileSize(const Mapping& m) {
    const int s = static_cast<int>(m.size);
    switch (m.kind) {
        case MappingKind::HemiCube:
            return {2 * s, 2 * s};
        case MappingKind::HemiSphere:
            return {2 * s, s / 2};
        case MappingKind::Cube:
            return {4 * s, 3 * s};
        case MappingKind::Fibonacci: {
            // No picture of directions, only a place for each.
            const int width = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(s))));
            return {width, (s + width - 1) / width};
        }
        default:
            return {s, s};
    }
}

TilePlace tilePlace(const Mapping& m, std::uint32_t pixel) {
    const int s = static_cast<int>(m.size), p = static_cast<int>(pixel);
    switch (m.kind) {
        case MappingKind::HemiCube: {
            if (p < s * s) return {s / 2 + p % s, s / 2 + p / s};
            const int rest = p - s * s, perSide = s * s / 2;
            const int column = rest % perSide % s, row = rest % perSide / s;  // row 0 is the horizon: outermost
            switch (rest / perSide) {
                case 0:
                    return {2 * s - 1 - row, s / 2 + column};
                case 1:
                    return {3 * s / 2 - 1 - column, 2 * s - 1 - row};
                case 2:
                    return {row, 3 * s / 2 - 1 - column};
                default:
                    return {s / 2 + column, row};
            }
        }
        case MappingKind::Cube: {
            const int image = p / (s * s), column = p % s, row = p % (s * s) / s;
            if (image < 4) return {image * s + column, s + row};
            return {column, (image == 4 ? 2 * s : 0) + row};
        }
        default: {
            const int width = tileSize(m).x;
            return {p % width, p / width};
        }
    }
}

Result<LayeredImage> exportAtlas(const MapFile& file, const AtlasOptions& options) {
    const MapHeader& h = file.header();
    std::vector<std::uint64_t> rows = options.rows;
    if (rows.empty()) {
        for (std::uint64_t row = 0; row < h.rowCount; ++row) rows.push_back(h.firstRow + row);
    }
    for (const std::uint64_t row : rows) {
        if (row < h.firstRow || row - h.firstRow >= h.rowCount) {
            return badInput(fmt::format("row {} is not in the file, which holds {} to {}", row, h.firstRow,
                                        h.firstRow + h.rowCount - 1));
        }
    }
    if (options.showDistance && !holds(h, MapContent::Distance)) {
        return badInput("the file holds no distance maps; bake them with --distance");
    }
    const TilePlace tile = tileSize(h.mapping);
    const auto square = std::ceil(std::sqrt(static_cast<double>(rows.size()) * tile.y / tile.x));
    const std::uint64_t columns = std::clamp<std::uint64_t>(
        options.columns > 0 ? options.columns : static_cast<std::uint64_t>(square), 1, rows.size());
    const std::uint64_t width = columns * static_cast<std::uint64_t>(tile.x);
    const std::uint64_t height = (rows.size() + columns - 1) / columns * static_cast<std::uint64_t>(tile.y);
    if (width > kMostPixels || height > kMostPixels || width * height > kMostPixels) {
        return badInput(fmt::format("an atlas of {} x {} pixels is too large; name fewer rows", width, height));
    }
    const Layout layout(h.mapping, static_cast<std::uint32_t>(columns));
    LayeredImage picture;
    picture.rgba = makeRgbaImage(static_cast<int>(width), static_cast<int>(height));
    for (const Kind& kind : kLayers) {
        if (!holds(h, kind.content)) continue;
        if (kind.content == MapContent::Index) {
            picture.layers.push_back({kind.layer, UintImage(static_cast<int>(width), static_cast<int>(height), {"V"})});
        } else {
            picture.layers.push_back(
                {kind.layer, FloatImage(static_cast<int>(width), static_cast<int>(height), {"V"})});
        }
    }
    describe(h, layout.columns, options.showDistance ? kShowsDistances : kShowsMasks, picture);

    // Blocks are unpacked once as long as rows come in order.
    std::uint64_t block = ~std::uint64_t{0};
    Bytes mask, distance;
    std::vector<Bytes> data(picture.layers.size());
    for (std::uint64_t index = 0; index < rows.size(); ++index) {
        const std::uint64_t local = rows[index] - h.firstRow;
        const std::uint64_t inBlock = local % visibility::kRowsPerBlock;
        if (local / visibility::kRowsPerBlock != block) {
            block = local / visibility::kRowsPerBlock;
            const auto fetch = [&](MapContent content, Bytes& into) -> Result<void> {
                auto raw = file.read(block, content);
                if (!raw) return raw.error();
                into = std::move(*raw);
                return {};
            };
            if (holds(h, MapContent::Mask)) {
                if (const auto done = fetch(MapContent::Mask, mask); !done) return done.error();
            }
            for (std::size_t layer = 0, k = 0; k < kLayers.size(); ++k) {
                if (!holds(h, kLayers[k].content)) continue;
                if (const auto done = fetch(kLayers[k].content, data[layer++]); !done) return done.error();
            }
        }
        const std::size_t maskSize = visibility::maskBytes(visibility::pixelCount(h.mapping));
        const std::size_t wide = 2 * layout.places.size();
        for (std::uint32_t pixel = 0; pixel < layout.places.size(); ++pixel) {
            const int x = layout.x(index, pixel), y = layout.y(index, pixel);
            float shown = 0.0f;
            if (holds(h, MapContent::Mask)) {
                const auto byte = std::to_integer<unsigned>(mask[inBlock * maskSize + pixel / 8]);
                shown = static_cast<float>(byte >> (pixel % 8) & 1);
            }
            for (std::size_t layer = 0; layer < data.size(); ++layer) {
                const std::uint16_t bits = u16(data[layer], inBlock * wide + 2 * pixel);
                auto& image = picture.layers[layer].image;
                if (auto* ids = std::get_if<UintImage>(&image)) {
                    ids->at(x, y, 0) = bits;
                } else {
                    const float value = visibility::fromHalf(bits);
                    std::get<FloatImage>(image).at(x, y, 0) = value;
                    if (options.showDistance && picture.layers[layer].name == "distance") {
                        shown = std::abs(value) * (2.0f / std::numbers::pi_v<float>);
                    }
                }
            }
            float* rgba = picture.rgba.pixel(x, y);
            rgba[0] = rgba[1] = rgba[2] = shown;
            rgba[3] = 1.0f;
        }
    }
    return picture;
}

Result<Bytes> importAtlas(const LayeredImage& picture, const visibility::BakeMesh& mesh) {
    Texts texts(picture);
    MapHeader h;
    h.totalRows = h.rowCount = mesh.rows.size();
    h.vertexCount = mesh.vertexRow.size();
    if (const auto kind = visibility::mappingKindNamed(texts.text("umvisMapping"))) {
        h.mapping.kind = *kind;
    } else {
        texts.fail("umvisMapping");
    }
    h.mapping.size = texts.number<std::uint32_t>("umvisSize");
    h.mapping.fovy = texts.number<double>("umvisFovy");
    h.maker = static_cast<visibility::MapMaker>(texts.number<std::uint8_t>("umvisMaker"));
    h.guard = static_cast<trace::Guard>(texts.number<std::uint8_t>("umvisGuard"));
    h.contents = texts.number<std::uint32_t>("umvisContents");
    h.farShare = texts.number<double>("umvisFar");
    const std::string environment = texts.text("umvisEnvironment");
    if (std::sscanf(environment.c_str(), "%ux%u", &h.environment.width, &h.environment.height) != 2) {
        texts.fail("umvisEnvironment");
    }
    h.bakeClass = texts.text("umvisClass");
    const auto columns = texts.number<std::uint32_t>("umvisColumns");
    const std::string meshHash = texts.text("umvisMesh"), directions = texts.text("umvisDirections");
    const std::string shows = texts.text("umvisShows");
    if (!texts.missing().empty()) {
        return badInput(fmt::format("the picture is no atlas of visibility maps: its attribute {} is missing or wrong",
                                    texts.missing()));
    }
    if (const auto valid = check(h.mapping); !valid) return valid.error();
    h.meshHash = mesh.hash;
    h.directionHash = visibility::directionHash(h.mapping);
    if (meshHash != toHex(h.meshHash)) return badInput("the atlas was made for another mesh");
    if (directions != toHex(h.directionHash)) return badInput("the rays of the atlas had other directions");
    if (shows != kShowsMasks && holds(h, MapContent::Mask)) {
        return badInput("the atlas shows distances in place of the masks; export it without that");
    }
    const TilePlace tile = tileSize(h.mapping);
    if (h.contents == 0 || (h.contents & ~visibility::kAllContents) != 0 || columns == 0 || columns > h.totalRows ||
        static_cast<std::uint64_t>(picture.width()) != std::uint64_t{columns} * tile.x ||
        static_cast<std::uint64_t>(picture.height()) != (h.totalRows + columns - 1) / columns * tile.y) {
        return badInput(fmt::format("the atlas does not hold the {} rows of the mesh", h.totalRows));
    }
    for (const Kind& kind : kLayers) {
        const bool there = kind.content == MapContent::Index ? picture.uintLayer(kind.layer) != nullptr
                                                             : picture.floatLayer(kind.layer) != nullptr;
        if (holds(h, kind.content) && !there) return badInput(fmt::format("the atlas lacks its layer {}", kind.layer));
    }

    const Layout layout(h.mapping, columns);
    const auto pixels = static_cast<std::uint32_t>(layout.places.size());
    std::vector<visibility::EncodedBlock> blocks;
    for (std::uint64_t first = 0; first < h.totalRows; first += visibility::kRowsPerBlock) {
        const auto rows =
            static_cast<std::uint32_t>(std::min<std::uint64_t>(visibility::kRowsPerBlock, h.totalRows - first));
        if (holds(h, MapContent::Mask)) {
            const std::size_t size = visibility::maskBytes(pixels);
            Bytes raw(rows * size);
            for (std::uint32_t row = 0; row < rows; ++row) {
                for (std::uint32_t p = 0; p < pixels; ++p) {
                    const int x = layout.x(first + row, p), y = layout.y(first + row, p);
                    const float open = picture.rgba.pixel(x, y)[0];
                    if (open != 0.0f && open != 1.0f) return notAValue("R", x, y);
                    if (open == 1.0f) raw[row * size + p / 8] |= static_cast<std::byte>(1u << (p % 8));
                }
            }
            blocks.push_back(encodeBlock(MapContent::Mask, rows, raw));
        }
        for (const Kind& kind : kLayers) {
            if (!holds(h, kind.content)) continue;
            const FloatImage* values = picture.floatLayer(kind.layer);
            const UintImage* ids = picture.uintLayer(kind.layer);
            Bytes raw;
            raw.reserve(std::size_t{2} * rows * pixels);
            for (std::uint32_t row = 0; row < rows; ++row) {
                for (std::uint32_t p = 0; p < pixels; ++p) {
                    const int x = layout.x(first + row, p), y = layout.y(first + row, p);
                    std::uint16_t bits = 0;
                    if (kind.content == MapContent::Index) {
                        const std::uint32_t texel = ids->at(x, y, 0);
                        if (texel != visibility::kBlockedIndex &&
                            texel >= std::uint64_t{h.environment.width} * h.environment.height)
                            return notAValue(kind.layer, x, y);
                        bits = static_cast<std::uint16_t>(texel);
                    } else {
                        bits = visibility::toHalf(values->at(x, y, 0));
                        // Any half float comes back as it was; anything else was changed by another program.
                        if (visibility::fromHalf(bits) != values->at(x, y, 0)) return notAValue(kind.layer, x, y);
                    }
                    raw.push_back(static_cast<std::byte>(bits & 0xff));
                    raw.push_back(static_cast<std::byte>(bits >> 8));
                }
            }
            blocks.push_back(encodeBlock(kind.content, rows, raw));
        }
    }
    return assembleShard(std::move(h), mesh.vertexRow, blocks);
}

}  // namespace umbriel
