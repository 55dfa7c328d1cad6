#include "common/visibility/bake.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <thread>
#include <utility>

#include "common/base/assert.h"
#include "common/trace/grid_scene.h"
#include "common/visibility/distance_map.h"
#include "common/visibility/half.h"
#include "common/visibility/index_map.h"
#include "common/visibility/map_maker.h"

namespace umbriel::visibility {
namespace {

// Of 921,600 texels of a SinglePlane 32 among 300 triangles 32 differ from rays at 0.1 degrees and 325 at 179, all of
// them at silhouettes; 2969 at 0.001 and 1410 at 179.9, where texels are as narrow as the rounding of a matrix.
constexpr double kGlNarrowest = 0.1 * std::numbers::pi / 180.0;
constexpr double kGlWidest = 179.0 * std::numbers::pi / 180.0;

bool has(std::uint32_t contents, MapContent content) {
    return (contents & static_cast<std::uint32_t>(content)) != 0;
}

std::string processorVendor() {
#if defined(__x86_64__) && defined(__GNUC__)
    return __builtin_cpu_is("intel") ? "Intel" : __builtin_cpu_is("amd") ? "AMD" : "x86";
#else
    return "other";
#endif
}

// The header has room for 63 printable characters.
std::string fitting(std::string text, std::size_t room) {
    std::ranges::replace_if(
        text, [](char c) { return c < ' ' || c > '~'; }, '?');
    return text.substr(0, room);
}

// What else than mesh, settings and range the bytes may depend on: version and instruction set of the ray caster, maker
// of the processor, compressor. Exact masks belong to it as well: of the rays nearly parallel to a triangle a share
// below 1e-9 is still decided by Embree alone (ray_scene.h), and a class promises every bit.
std::string bakeClass(const std::string& maker) {
    return fmt::format("{} {}, zstd {}", maker, processorVendor(), ZSTD_versionString());
}

// Appends a row of 16-bit values to a block.
template <class Values, class Convert>
void append(Bytes& out, const Values& values, Convert convert) {
    for (const auto value : values) {
        const std::uint16_t bits = convert(value);
        out.push_back(static_cast<std::byte>(bits & 0xff));
        out.push_back(static_cast<std::byte>(bits >> 8));
    }
}

}  // namespace

BakeSettings::BakeSettings() : farShare(std::numeric_limits<double>::infinity()) {}

Result<void> check(const BakeSettings& s) {
    if (const auto valid = check(s.mapping); !valid) return valid.error();
    if (!(s.farShare > 0.0)) return badInput(fmt::format("the far limit {} is not above zero", s.farShare));
    if (s.contents == 0 || (s.contents & ~kAllContents) != 0)
        return badInput("no, or unknown, contents of visibility maps");
    if (has(s.contents, MapContent::Distance) && s.mapping.kind == MappingKind::Fibonacci) {
        return badInput("the fibonacci mapping has no distance maps: its pixels have no neighbours");
    }
    if (has(s.contents, MapContent::Index)) {
        if (!indexable(s.environment)) {
            return badInput(fmt::format("index maps of an environment of {} x {} texels do not fit 16 bits",
                                        s.environment.width, s.environment.height));
        }
        if (directionFrame(s.mapping) == DirectionFrame::Object) {
            return badInput("the octahedral mapping needs no index maps: all vertices share its directions");
        }
    }
    if (s.maker == MapMaker::Gl && s.mapping.kind == MappingKind::SinglePlane &&
        !(s.mapping.fovy >= kGlNarrowest && s.mapping.fovy <= kGlWidest)) {
        return badInput(
            fmt::format("the gl maker draws in single precision, which holds openings of {:g} to {:g} "
                        "degrees; --maker rays takes any",
                        kGlNarrowest * 180.0 / std::numbers::pi, kGlWidest * 180.0 / std::numbers::pi));
    }
    if (s.maker != MapMaker::Rays && (s.guard != trace::Guard::Exact || has(s.contents, MapContent::HitDistance))) {
        return badInput(fmt::format("the {} maker has the exact guard only, and no hit distances",
                                    s.maker == MapMaker::Grid ? "grid" : "gl"));
    }
    return {};
}

MapHeader wholeHeader(const BakeMesh& mesh, const BakeSettings& settings, std::string bakeClass) {
    MapHeader h;
    h.totalRows = h.rowCount = mesh.rows.size();
    h.vertexCount = mesh.vertexRow.size();
    h.mapping = settings.mapping;
    h.maker = settings.maker;
    h.guard = settings.guard;
    h.contents = settings.contents;
    h.farShare = settings.farShare;
    if (has(settings.contents, MapContent::Index)) h.environment = settings.environment;
    h.meshHash = mesh.hash;
    h.directionHash = directionHash(settings.mapping);
    h.bakeClass = std::move(bakeClass);
    return h;
}

struct Baker::State {
    const BakeMesh& mesh;
    BakeSettings settings;
    trace::DirectionPackets directions;
    MaskPacker packer;
    std::unique_ptr<trace::RayScene> rays;
    std::unique_ptr<trace::GridScene> grid;
    std::optional<DistanceMaps> distances;
    MapHeader header;
    double farDistance;

    State(const BakeMesh& bakeMesh, const BakeSettings& bakeSettings)
        : mesh(bakeMesh),
          settings(bakeSettings),
          directions(directionPackets(bakeSettings.mapping)),
          packer(directions),
          farDistance(bakeSettings.farShare * bakeMesh.diagonal) {}
};

Baker::Baker(std::unique_ptr<State> state) : _state(std::move(state)) {}
Baker::~Baker() = default;
const MapHeader& Baker::header() const {
    return _state->header;
}
std::uint32_t Baker::rowBlocks() const {
    return static_cast<std::uint32_t>((_state->mesh.rows.size() + kRowsPerBlock - 1) / kRowsPerBlock);
}

std::uint32_t Baker::rowsInBlock(std::uint32_t rowBlock) const {
    const std::uint32_t first = rowBlock * kRowsPerBlock;
    return std::min<std::uint32_t>(kRowsPerBlock, static_cast<std::uint32_t>(_state->mesh.rows.size()) - first);
}

Result<std::unique_ptr<Baker>> Baker::create(const BakeMesh& mesh, const BakeSettings& settings, int threads) {
    if (settings.maker == MapMaker::Gl) return badInput("maps are drawn by render servers, not by this process");
    return make(mesh, settings, threads, {});
}

Result<std::unique_ptr<Baker>> Baker::createForMasks(const BakeMesh& mesh, const BakeSettings& settings,
                                                     const std::string& description) {
    UMBRIEL_ASSERT(settings.maker == MapMaker::Gl, "rays and grids make their own masks");
    return make(mesh, settings, 1, description);
}

Result<std::unique_ptr<Baker>> Baker::make(const BakeMesh& mesh, const BakeSettings& settings, int threads,
                                           const std::string& drawnBy) {
    if (const auto valid = check(settings); !valid) return valid.error();
    auto state = std::make_unique<State>(mesh, settings);
    std::string maker = "grid";
    if (settings.maker == MapMaker::Rays) {
        auto scene = trace::RayScene::create(mesh.view(), settings.guard, threads);
        if (!scene) return scene.error();
        state->rays = std::move(*scene);
        maker = state->rays->description();
    } else if (settings.maker == MapMaker::Grid) {
        state->grid = std::make_unique<trace::GridScene>(mesh.view());
    } else {
        maker = fitting("gl " + drawnBy, 40);
    }
    if (has(settings.contents, MapContent::Distance)) state->distances.emplace(settings.mapping);
    state->header = wholeHeader(mesh, settings, bakeClass(maker));
    return std::unique_ptr<Baker>(new Baker(std::move(state)));
}

std::vector<EncodedBlock> Baker::block(std::uint32_t rowBlock, const std::function<bool()>& goOn) const {
    const State& s = *_state;
    UMBRIEL_ASSERT(s.rays || s.grid, "masks of a rasteriser come from outside");
    const std::uint32_t first = rowBlock * kRowsPerBlock, rows = rowsInBlock(rowBlock);
    const DirectionFrame frame = directionFrame(s.settings.mapping);
    std::optional<trace::RayScene::Tracer> rays;
    std::optional<trace::GridScene::Tracer> grid;
    if (s.rays) {
        rays.emplace(*s.rays);
    } else {
        grid.emplace(*s.grid);
    }
    const std::size_t bytes = maskBytes(pixelCount(s.settings.mapping));
    std::vector<std::uint8_t> blocked(s.directions.packets()), masks(rows * bytes);
    const std::uint32_t rowsPerSlice = std::max(1u, kRaysPerSlice / pixelCount(s.settings.mapping));
    for (std::uint32_t row = 0; row < rows; ++row) {
        if (goOn && row % rowsPerSlice == 0 && !goOn()) return {};
        const trace::Origin o = origin(s.mesh, first + row, frame);
        const auto own = s.mesh.ownTriangles(o.position);
        if (rays) {
            rays->blocked(o, own, s.directions, s.farDistance, blocked);
        } else {
            grid->blocked(o, own, s.directions, s.farDistance, blocked);
        }
        s.packer.pack(blocked, std::span(masks).subspan(row * bytes, bytes));
    }
    return blockOfMasks(rowBlock, masks, goOn);
}

std::vector<EncodedBlock> Baker::blockOfMasks(std::uint32_t rowBlock, std::span<const std::uint8_t> masks,
                                              const std::function<bool()>& goOn) const {
    const State& s = *_state;
    const std::uint32_t contents = s.settings.contents, pixels = pixelCount(s.settings.mapping);
    const std::uint32_t first = rowBlock * kRowsPerBlock, rows = rowsInBlock(rowBlock);
    UMBRIEL_ASSERT(masks.size() == rows * maskBytes(pixels), "a mask for each row");
    const auto mask = [&](std::uint32_t row) { return masks.subspan(row * maskBytes(pixels), maskBytes(pixels)); };
    const auto originOf = [&](std::uint32_t row) {
        return origin(s.mesh, first + row, directionFrame(s.settings.mapping));
    };
    const std::uint32_t rowsPerSlice = std::max(1u, kRaysPerSlice / pixels);
    const auto stops = [&](std::uint32_t row) { return goOn && row % rowsPerSlice == 0 && !goOn(); };
    std::vector<EncodedBlock> result;
    const auto add = [&](MapContent content, std::span<const std::byte> data) {
        result.push_back(encodeBlock(content, rows, data));
    };
    if (has(contents, MapContent::Mask)) add(MapContent::Mask, std::as_bytes(masks));
    std::vector<float> values(pixels);
    if (has(contents, MapContent::Distance)) {
        Bytes data;
        DistanceMaps::Silhouette silhouette;
        for (std::uint32_t row = 0; row < rows; ++row) {
            if (stops(row)) return {};
            s.distances->compute(mask(row), silhouette, values);
            append(data, values, toHalf);
        }
        add(MapContent::Distance, data);
    }
    if (has(contents, MapContent::HitDistance)) {
        Bytes data;
        trace::RayScene::Tracer rays(*s.rays);
        std::vector<float> laneDistances(s.directions.lanes());
        const auto unit = static_cast<float>(1.0 / s.mesh.diagonal);
        for (std::uint32_t row = 0; row < rows; ++row) {
            if (stops(row)) return {};
            const trace::Origin o = originOf(row);
            rays.distances(o, s.mesh.ownTriangles(o.position), s.directions, s.farDistance, laneDistances);
            for (std::size_t lane = 0; lane < laneDistances.size(); ++lane) {
                if (s.directions.pixel[lane] != trace::kNoPixel)
                    values[s.directions.pixel[lane]] = laneDistances[lane] * unit;
            }
            append(data, values, toHalf);
        }
        add(MapContent::HitDistance, data);
    }
    if (has(contents, MapContent::Index)) {
        Bytes data;
        std::vector<std::uint16_t> indices(pixels);
        for (std::uint32_t row = 0; row < rows; ++row) {
            if (stops(row)) return {};
            indexMap(s.directions, originOf(row), mask(row), s.settings.environment, indices);
            append(data, indices, [](std::uint16_t index) { return index; });
        }
        add(MapContent::Index, data);
    }
    return result;
}

Result<Bytes> Baker::shard(std::uint64_t firstRow, std::uint64_t rowCount, int threads) const {
    const std::uint64_t total = _state->mesh.rows.size();
    if (firstRow % kRowsPerBlock != 0 || firstRow >= total || rowCount == 0 || rowCount > total - firstRow ||
        (rowCount % kRowsPerBlock != 0 && firstRow + rowCount != total)) {
        return badInput(fmt::format("rows {} to {} of {} are no shard: it holds whole blocks of {}", firstRow,
                                    firstRow + rowCount, total, kRowsPerBlock));
    }
    const auto firstBlock = static_cast<std::uint32_t>(firstRow / kRowsPerBlock);
    const auto blockCount = static_cast<std::uint32_t>((rowCount + kRowsPerBlock - 1) / kRowsPerBlock);
    std::vector<std::vector<EncodedBlock>> baked(blockCount);
    std::atomic<std::uint32_t> next{0};
    const auto work = [&] {
        for (std::uint32_t i = next++; i < blockCount; i = next++) baked[i] = block(firstBlock + i);
    };
    const unsigned wanted =
        threads > 0 ? static_cast<unsigned>(threads) : std::max(1u, std::thread::hardware_concurrency());
    {
        std::vector<std::jthread> helpers;
        for (unsigned i = 1; i < std::min(wanted, blockCount); ++i) helpers.emplace_back(work);
        work();
    }
    std::vector<EncodedBlock> blocks;
    for (auto& part : baked) std::ranges::move(part, std::back_inserter(blocks));
    MapHeader header = _state->header;
    header.firstRow = firstRow;
    header.rowCount = rowCount;
    return assembleShard(std::move(header), _state->mesh.vertexRow, blocks);
}

Result<Bytes> bakeShard(const BakeMesh& mesh, const BakeSettings& settings, std::uint64_t firstRow,
                        std::uint64_t rowCount, int threads) {
    const auto baker = Baker::create(mesh, settings, threads);
    if (!baker) return baker.error();
    return (*baker)->shard(firstRow, rowCount, threads);
}

}  // namespace umbriel::visibility
