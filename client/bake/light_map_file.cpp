#include "client/bake/light_map_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "client/bake/mapped_file.h"
#include "common/base/hash.h"
#include "common/image/atomic_file.h"
#include "common/scene/light_map.h"
#include "common/wire/bytes.h"

namespace umbriel {
namespace {

constexpr std::string_view kMagic = "UMLIGHT1";
constexpr std::size_t kHashBytes = 16;
constexpr std::uint32_t kMostLights = 256;
constexpr std::uint32_t kMostName = 256;
constexpr std::size_t kChartFloats = 12;

}  // namespace

Result<void> writeLightMap(const std::filesystem::path& path, const LightMapFile& file) {
    wire::Bytes bytes;
    wire::Writer writer(bytes);
    writer.raw(std::as_bytes(std::span(kMagic)));
    const BakedLightMap& baked = file.baked;
    writer.u32(baked.size);
    writer.u32(static_cast<std::uint32_t>(file.lightStates.size()));
    writer.u32(static_cast<std::uint32_t>(file.states.size()));
    writer.u32(static_cast<std::uint32_t>(baked.places.size()));
    writer.u32(static_cast<std::uint32_t>(baked.charts.size() / 3));
    for (std::size_t i = 0; i < file.lightStates.size(); ++i) {
        writer.u64(file.lightStates[i]);
        const std::string name = file.lightNames[i].substr(0, kMostName);
        writer.u32(static_cast<std::uint32_t>(name.size()));
        writer.raw(std::as_bytes(std::span(name)));
    }
    for (std::size_t i = 0; i < file.states.size(); ++i) {
        writer.u64(file.states[i]);
        writer.u32(baked.triangles[i]);
    }
    for (const std::uint32_t place : baked.places) writer.u32(place);
    for (const glm::vec4& row : baked.charts)
        for (int k = 0; k < 4; ++k) writer.f32(row[k]);
    auto out = AtomicFile::create(path);
    if (!out) return out.error();
    // Texels, which may be a gigabyte, are not copied.
    const std::span<const std::byte> texels = std::as_bytes(std::span(baked.texels));
    Hasher128 hasher;
    hasher.add(bytes);
    hasher.add(texels);
    const Hash128 hash = hasher.finish();
    (*out)->write(bytes);
    constexpr std::size_t kPart = std::size_t{1} << 20;
    for (std::size_t at = 0; at < texels.size(); at += kPart)
        (*out)->write(texels.subspan(at, std::min(kPart, texels.size() - at)));
    bytes.clear();
    writer.u64(hash.low);
    writer.u64(hash.high);
    (*out)->write(bytes);
    return (*out)->commit();
}

Result<LightMapFile> readLightMap(const std::filesystem::path& path) {
    const auto mapped = MappedFile::open(path);
    if (!mapped) return mapped.error();
    const std::span<const std::byte> bytes = mapped->bytes();
    const auto bad = [&](std::string_view what) {
        return badInput(fmt::format("{}: {}; make it with umbriel bake SCENE --light-map N", path.string(), what));
    };
    if (bytes.size() < kMagic.size() || std::memcmp(bytes.data(), kMagic.data(), kMagic.size() - 1) != 0)
        return bad("no light map");
    if (static_cast<char>(bytes[kMagic.size() - 1]) != kMagic.back())
        return bad("a light map of another version of umbriel");
    if (bytes.size() < kMagic.size() + 20 + kHashBytes) return bad("the light map is cut short");
    const std::span<const std::byte> content = bytes.first(bytes.size() - kHashBytes);
    wire::Reader end(bytes.subspan(content.size()));
    const std::uint64_t low = end.u64(), high = end.u64();
    if (hash128(content) != Hash128{low, high}) return bad("the light map is cut short or damaged");

    wire::Reader reader(content.subspan(kMagic.size()));
    LightMapFile file;
    BakedLightMap& baked = file.baked;
    baked.size = reader.u32();
    const std::uint32_t lights = reader.u32(), surfaces = reader.u32(), triangles = reader.u32(), charts = reader.u32();
    // Everything that is counted takes room, so that nothing is reserved that is not there.
    const std::uint64_t least = std::uint64_t{baked.size} * baked.size * lights + std::uint64_t{12} * lights +
                                std::uint64_t{12} * surfaces + std::uint64_t{4} * triangles +
                                std::uint64_t{4 * kChartFloats} * charts;
    if (baked.size == 0 || baked.size > LightMap::kMaxSize || lights == 0 || lights > kMostLights ||
        least > reader.remaining())
        return bad("the light map's sizes do not fit together");
    for (std::uint32_t i = 0; i < lights && reader.ok(); ++i) {
        file.lightStates.push_back(reader.u64());
        const std::uint32_t length = reader.u32();
        if (length > kMostName) return bad("the light map holds a name that is too long");
        const std::span<const std::byte> name = reader.raw(length);
        file.lightNames.emplace_back(reinterpret_cast<const char*>(name.data()), name.size());
    }
    std::uint64_t sum = 0;
    for (std::uint32_t i = 0; i < surfaces && reader.ok(); ++i) {
        file.states.push_back(reader.u64());
        baked.triangles.push_back(reader.u32());
        sum += baked.triangles.back();
    }
    if (sum != triangles) return bad("the light map's triangles do not fit together");
    for (std::uint32_t i = 0; i < triangles && reader.ok(); ++i) {
        baked.places.push_back(reader.u32());
        if (baked.places.back() != LightMap::kNoChart && baked.places.back() >= charts)
            return bad("the light map names a chart that it does not have");
    }
    for (std::uint64_t i = 0; i < std::uint64_t{charts} * 3 && reader.ok(); ++i) {
        glm::vec4 row;
        for (int k = 0; k < 4; ++k) row[k] = reader.finiteF32();
        baked.charts.push_back(row);
    }
    const std::span<const std::byte> texels = reader.raw(std::size_t{baked.size} * baked.size * lights);
    if (!reader.ok() || !reader.atEnd()) return bad("the light map's parts do not fit together");
    baked.texels.resize(texels.size());
    std::memcpy(baked.texels.data(), texels.data(), texels.size());
    return file;
}

LayeredImage atlasPicture(const LightMapFile& file) {
    const auto side = static_cast<int>(file.baked.size);
    const std::size_t texels = std::size_t{file.baked.size} * file.baked.size;
    LayeredImage picture;
    picture.rgba = makeRgbaImage(side, side);
    for (std::size_t light = 0; light < file.lightStates.size(); ++light) {
        FloatImage factors(side, side, {"V"});
        for (std::size_t i = 0; i < texels; ++i)
            factors.samples()[i] = static_cast<float>(file.baked.texels[light * texels + i]) / 255.0f;
        if (light == 0)
            for (std::size_t i = 0; i < texels; ++i) {
                for (std::size_t k = 0; k < 3; ++k) picture.rgba.samples()[4 * i + k] = factors.samples()[i];
                picture.rgba.samples()[4 * i + 3] = 1.0f;
            }
        // By number: two lights may have the same name, and names may hold what no channel's may.
        picture.layers.push_back({fmt::format("light{}", light), std::move(factors)});
        picture.texts[fmt::format("umbriel.light{}", light)] = file.lightNames[light];
    }
    return picture;
}

std::filesystem::path lightMapFileOf(const std::string& scene) {
    if (!scene.starts_with("demo:")) return scene + ".umlight";
    std::string name = scene;
    std::replace_if(
        name.begin(), name.end(),
        [](unsigned char c) { return !((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9')); },
        '-');
    return name + ".umlight";
}

}  // namespace umbriel
