#include "client/app/bake_atlas_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

#include "client/app/exit_code.h"
#include "client/app/mesh_input.h"
#include "client/bake/atlas.h"
#include "client/bake/mapped_file.h"
#include "client/bake/sha256.h"
#include "common/image/atomic_file.h"
#include "common/image/exr_io.h"
#include "common/image/isolated_reader.h"
#include "common/image/png_io.h"

namespace umbriel {
namespace {

using Json = nlohmann::ordered_json;

// What EXR needs beside the samples that an atlas has at most.
IsolationLimits atlasLimits() {
    IsolationLimits limits;
    limits.image.bytes = std::uint64_t{8} << 30;
    return limits;
}

Result<std::vector<std::uint64_t>> rowsOf(const BakeExportArguments& a, const visibility::MapFile& file) {
    std::vector<std::uint64_t> rows = a.rows;
    if (a.vertices.empty()) return rows;
    const auto table = file.vertexRows(file.header().vertexCount);
    if (!table) return table.error();
    for (const std::uint32_t vertex : a.vertices) {
        if (vertex >= table->size()) {
            return badInput(fmt::format("--vertices: there is no vertex {}; the mesh has {}", vertex, table->size()));
        }
        if ((*table)[vertex] == visibility::kNoRow) {
            return badInput(fmt::format("--vertices: vertex {} has no triangle, so it has no map", vertex));
        }
        rows.push_back((*table)[vertex]);
    }
    return rows;
}

constexpr std::uint32_t kMostScale = 64;

// Grey, and a dark blue where no map is.
Result<void> drawPng(const BakeExportArguments& a, const LayeredImage& picture) {
    const std::uint64_t width = std::uint64_t{a.scale} * static_cast<std::uint64_t>(picture.width());
    const std::uint64_t height = std::uint64_t{a.scale} * static_cast<std::uint64_t>(picture.height());
    if (width > 32768 || height > 32768) {
        return badInput(
            fmt::format("a PNG of {} x {} pixels is too large; name fewer --rows or --vertices", width, height));
    }
    std::vector<std::uint8_t> bytes;
    bytes.reserve(3 * width * height);
    for (std::uint64_t y = 0; y < height; ++y) {
        for (std::uint64_t x = 0; x < width; ++x) {
            const float* rgba = picture.rgba.pixel(static_cast<int>(x / a.scale), static_cast<int>(y / a.scale));
            const auto grey = static_cast<std::uint8_t>(std::clamp(rgba[0], 0.0f, 1.0f) * 255.0f + 0.5f);
            if (rgba[3] > 0.0f)
                bytes.insert(bytes.end(), {grey, grey, grey});
            else
                bytes.insert(bytes.end(), {40, 40, 80});
        }
    }
    return writePngBytes(a.out, static_cast<int>(width), static_cast<int>(height), 3, bytes);
}

Result<void> exportMaps(const BakeExportArguments& a, std::ostream& out) {
    const bool png = a.out.ends_with(".png");
    if (!png && !a.out.ends_with(".exr")) {
        return badInput(fmt::format("--out '{}': expected a name ending in .exr or .png", a.out));
    }
    if (a.scale < 1 || a.scale > kMostScale || (a.scale > 1 && !png)) {
        return badInput(fmt::format("--scale {}: expected 1 to {}, for .png only", a.scale, kMostScale));
    }
    const auto mapped = MappedFile::open(a.maps);
    if (!mapped) return mapped.error();
    const auto file = visibility::MapFile::open(mapped->bytes(), a.maps.string());
    if (!file) return file.error();
    auto rows = rowsOf(a, *file);
    if (!rows) return rows.error();
    const auto picture = exportAtlas(*file, {std::move(*rows), a.columns, a.showDistance});
    if (!picture) return picture.error();
    if (const auto written = png ? drawPng(a, *picture) : writeExr(a.out, *picture); !written) return written.error();
    const std::uint64_t maps =
        a.rows.empty() && a.vertices.empty() ? file->header().rowCount : a.rows.size() + a.vertices.size();
    if (a.json) {
        Json layers = Json::array();
        for (const auto& layer : picture->layers) layers.push_back(layer.name);
        out << Json({{"vertices", maps},
                     {"directions", visibility::pixelCount(file->header().mapping)},
                     {"width", picture->width()},
                     {"height", picture->height()},
                     {"layers", layers}})
                   .dump(2, ' ', false, Json::error_handler_t::replace)
            << '\n';
    } else {
        out << fmt::format("{} maps in {} x {} pixels\nwrote {}\n", maps, picture->width(), picture->height(), a.out);
    }
    if (!out.flush()) return failure("the result could not be written");
    return {};
}

Result<void> importMaps(const BakeImportArguments& a, std::ostream& out) {
    if (a.mesh.empty()) return badInput("--mesh MESH is missing: what the maps were baked of");
    if (!a.out.ends_with(".umvis")) {
        return badInput(fmt::format("--out '{}': expected a name ending in .umvis", a.out));
    }
    // Before the mesh, whose import has threads.
    const auto picture = readImageIsolated(a.picture, atlasLimits());
    if (!picture) return picture.error();
    const auto input = loadMeshes(a.mesh);
    if (!input) return input.error();
    const auto loaded = concatenated(*input);
    if (!loaded) return loaded.error();
    const auto mesh = visibility::prepare(*loaded);
    if (!mesh) return badInput(fmt::format("{}: {}", a.mesh, mesh.error().message));
    const auto bytes = importAtlas(*picture, *mesh);
    if (!bytes) return badInput(fmt::format("{}: {}", a.picture.string(), bytes.error().message));
    auto file = AtomicFile::create(a.out);
    if (!file) return file.error();
    (*file)->write(*bytes);
    if (const auto written = (*file)->commit(); !written) return written.error();
    Sha256 sha;
    sha.add(*bytes);
    const std::string hash = sha.finish();
    const auto maps = visibility::MapFile::open(*bytes, a.out);
    if (!maps) return maps.error();
    const std::uint32_t directions = visibility::pixelCount(maps->header().mapping);
    if (a.json) {
        out << Json({{"vertices", mesh->rows.size()}, {"directions", directions}, {"sha256", hash}}).dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    } else {
        out << fmt::format("{} vertices x {} directions\nwrote {}, sha256 {}\n", mesh->rows.size(), directions, a.out,
                           hash);
    }
    if (!out.flush()) return failure("the result could not be written");
    return {};
}

}  // namespace

int runBakeExport(const BakeExportArguments& arguments, std::ostream& out, std::ostream& err) {
    return endCommand("umbriel bake export", exportMaps(arguments, out), err);
}

int runBakeImport(const BakeImportArguments& arguments, std::ostream& out, std::ostream& err) {
    return endCommand("umbriel bake import", importMaps(arguments, out), err);
}

}  // namespace umbriel
