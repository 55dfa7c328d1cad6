// Tables of visibility maps: makers x mappings x resolutions (Ganster 2002, table 4), error and time over the far
// limit, first rays (table 3) and closed forms. Times are CPU seconds of one thread (the rasteriser's include the
// driver's threads) for all rows of the mesh; where fewer were measured, in runs of neighbours spread over the mesh,
// they are scaled up and the line says so. Arguments: --mesh FILE|cloth3k|cloth35k, --table makers|far|forms|sets
// (default: all), --most RAYS (a cell, in millions).
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "common/base/processor_time.h"
#include "common/trace/grid_scene.h"
#include "common/trace/ray_scene.h"
#include "common/visibility/distance_map.h"
#include "common/visibility/index_map.h"
#include "common/visibility/map_maker.h"
#include "common/visibility/single_plane.h"
#include "server/bake/gl_maker.h"
#include "server/gl/context.h"
#include "tests/bench/measure.h"
#include "tests/unit/visibility/closed_forms.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel {
namespace {

using namespace visibility;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kRun = 64;  // neighbouring rows measured together

double cpuSeconds() {
    return toSeconds(processorTime());
}

// First rows of runs, spread evenly; all of the mesh when they fit.
std::vector<std::uint32_t> runsOf(std::uint32_t rows, std::uint64_t most) {
    const std::uint32_t runs = (rows + kRun - 1) / kRun;
    const auto wanted = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(most / kRun, 1, runs));
    std::vector<std::uint32_t> first;
    for (std::uint32_t i = 0; i < wanted; ++i) {
        first.push_back(static_cast<std::uint32_t>(std::uint64_t{i} * runs / wanted) * kRun);
    }
    return first;
}

// Masks by any of the makers.
class Maker {
 public:
    Maker(const BakeMesh& mesh, const Mapping& mapping, trace::Guard guard, double far,
          std::string_view instructionSet = "avx2")
        : _mesh(mesh),
          _mapping(mapping),
          _directions(directionPackets(mapping)),
          _packer(_directions),
          _blocked(_directions.packets()),
          _far(far) {
        _rays = bench::need(trace::RayScene::create(mesh.view(), guard, 1, instructionSet));
        _tracer.emplace(*_rays);
    }
    Maker(const BakeMesh& mesh, const Mapping& mapping, const trace::GridScene& grid, double far)
        : _mesh(mesh),
          _mapping(mapping),
          _directions(directionPackets(mapping)),
          _packer(_directions),
          _blocked(_directions.packets()),
          _far(far),
          _grid(trace::GridScene::Tracer(grid)) {}
    Maker(const BakeMesh& mesh, const Mapping& mapping, double far)
        : _mesh(mesh),
          _mapping(mapping),
          _directions(directionPackets(mapping)),
          _packer(_directions),
          _far(far),
          _gl(bench::need(GlMaker::create(mesh, mapping, far))) {}

    std::size_t bytes() const { return maskBytes(pixelCount(_mapping)); }
    void masks(std::uint32_t first, std::uint32_t count, std::span<std::uint8_t> out) {
        if (_gl) {
            if (const auto done = _gl->masks(first, count, out); !done) {
                std::fprintf(stderr, "bench_maps: %s\n", done.error().message.c_str());
                std::exit(1);
            }
            return;
        }
        for (std::uint32_t i = 0; i < count; ++i) {
            const trace::Origin o = origin(_mesh, first + i, directionFrame(_mapping));
            const auto own = _mesh.ownTriangles(o.position);
            if (_tracer)
                _tracer->blocked(o, own, _directions, _far, _blocked);
            else
                _grid->blocked(o, own, _directions, _far, _blocked);
            _packer.pack(_blocked, out.subspan(i * bytes(), bytes()));
        }
    }

    // CPU seconds for all rows of the mesh, and the masks of those that were measured.
    struct Made {
        double seconds = 0.0, scale = 1.0;
        std::vector<std::uint32_t> rows;
        std::vector<std::uint8_t> masks;
    };
    Made make(std::uint64_t mostRows) {
        const auto all = static_cast<std::uint32_t>(_mesh.rows.size());
        Made made;
        // The rasteriser draws more rows at once.
        const std::vector<std::uint32_t> runs = runsOf(all, mostRows);
        for (const std::uint32_t first : runs) {
            for (std::uint32_t i = 0; i < std::min(kRun, all - first); ++i) made.rows.push_back(first + i);
        }
        made.masks.resize(made.rows.size() * bytes());
        {
            std::vector<std::uint8_t> warm(bytes());
            masks(0, 1, warm);  // drivers compile when they first draw
        }
        const double start = cpuSeconds();
        for (std::size_t at = 0; at < made.rows.size();) {
            std::size_t end = at + 1;
            while (end < made.rows.size() && made.rows[end] == made.rows[end - 1] + 1) ++end;
            masks(made.rows[at], static_cast<std::uint32_t>(end - at),
                  std::span(made.masks).subspan(at * bytes(), (end - at) * bytes()));
            at = end;
        }
        made.scale = static_cast<double>(all) / static_cast<double>(made.rows.size());
        made.seconds = (cpuSeconds() - start) * made.scale;
        return made;
    }

    const trace::DirectionPackets& directions() const { return _directions; }
    // Of rays: what traces them, the instruction set last.
    std::string description() const { return _rays->description(); }

 private:
    const BakeMesh& _mesh;
    Mapping _mapping;
    trace::DirectionPackets _directions;
    MaskPacker _packer;
    std::vector<std::uint8_t> _blocked;
    double _far;
    std::unique_ptr<trace::RayScene> _rays;
    std::optional<trace::RayScene::Tracer> _tracer;
    std::optional<trace::GridScene::Tracer> _grid;
    std::unique_ptr<GlMaker> _gl;
};

double indexSeconds(const BakeMesh& mesh, const Mapping& mapping, const Maker& maker, const Maker::Made& made) {
    std::vector<std::uint16_t> indices(pixelCount(mapping));
    const double start = cpuSeconds();
    for (std::size_t i = 0; i < made.rows.size(); ++i) {
        indexMap(maker.directions(), origin(mesh, made.rows[i], directionFrame(mapping)),
                 std::span(made.masks).subspan(i * maker.bytes(), maker.bytes()), {256, 128}, indices);
    }
    return (cpuSeconds() - start) * made.scale;
}

double distanceSeconds(const Mapping& mapping, const Maker& maker, const Maker::Made& made) {
    const DistanceMaps maps(mapping);
    DistanceMaps::Silhouette silhouette;
    std::vector<float> distances(pixelCount(mapping));
    // Large maps need the square of what small ones do; some of the rows are enough to know.
    const std::size_t step = pixelCount(mapping) > 2048 ? 8 : 1;
    std::size_t count = 0;
    const double start = cpuSeconds();
    for (std::size_t i = 0; i < made.rows.size(); i += step, ++count) {
        maps.compute(std::span(made.masks).subspan(i * maker.bytes(), maker.bytes()), silhouette, distances);
    }
    return (cpuSeconds() - start) * made.scale * static_cast<double>(made.rows.size()) / static_cast<double>(count);
}

// Every bit of the mesh by each instruction set that Embree has code for, against avx2's.
void instructionSetTable(const std::string& file, const BakeMesh& mesh) {
    const Mapping mapping{MappingKind::HemiSphere, 32};
    const std::pair<trace::Guard, const char*> guards[] = {
        {trace::Guard::Exact, "exact"}, {trace::Guard::Fast, "fast"}, {trace::Guard::FastFan, "fast-fan"}};
    for (const auto& [guard, name] : guards) {
        std::vector<std::uint8_t> widest;
        for (const std::string_view set : {"avx2", "avx", "sse4.2", "sse2"}) {
            Maker maker(mesh, mapping, guard, kEndless, set);
            if (!maker.description().ends_with(std::string(" ") + std::string(set))) {
                fmt::print("| {} | {} | {} | not on this processor | | |\n", file, name, set);
                continue;
            }
            const Maker::Made made = maker.make(mesh.rows.size());
            if (widest.empty()) widest = made.masks;
            std::uint64_t differing = 0;
            for (std::size_t i = 0; i < widest.size(); ++i)
                differing += static_cast<std::uint64_t>(std::popcount<std::uint8_t>(widest[i] ^ made.masks[i]));
            const std::uint64_t bits = std::uint64_t{mesh.rows.size()} * pixelCount(mapping);
            fmt::print("| {} | {} | {} | {} of {} | {:.1e} | {:.2f} |\n", file, name, set, differing, bits,
                       static_cast<double>(differing) / static_cast<double>(bits), made.seconds);
            std::fflush(stdout);
        }
    }
}

struct Cell {
    Mapping mapping;
    const char* image;
    double then[3];  // of the thesis, seconds: maps, + index, + distance; 0: not there
};

const std::vector<Cell>& rasteriserCells() {
    static const double fovy = 150.0 * kDegree;
    static const std::vector<Cell> cells{{{MappingKind::HemiCube, 8}, "HemiCube 8", {4.7, 5.0}},
                                         {{MappingKind::HemiCube, 16}, "HemiCube 16", {4.8, 5.7}},
                                         {{MappingKind::HemiCube, 32}, "HemiCube 32", {5.4}},
                                         {{MappingKind::HemiCube, 64}, "HemiCube 64", {7.5}},
                                         {{MappingKind::SinglePlane, 8, fovy}, "SinglePlane 8", {1.0, 1.1}},
                                         {{MappingKind::SinglePlane, 16, fovy}, "SinglePlane 16", {1.0, 1.3}},
                                         {{MappingKind::SinglePlane, 32, fovy}, "SinglePlane 32", {1.1, 1.8}},
                                         {{MappingKind::SinglePlane, 64, fovy}, "SinglePlane 64", {1.7}},
                                         {{MappingKind::SinglePlane, 128, fovy}, "SinglePlane 128", {4.1}}};
    return cells;
}

const std::vector<Cell>& rayCells() {
    static const std::vector<Cell> cells{{{MappingKind::HemiSphere, 8}, "HemiSphere 16x4", {4.0, 4.2, 5.9}},
                                         {{MappingKind::HemiSphere, 16}, "HemiSphere 32x8", {15.2, 15.6, 23.2}},
                                         {{MappingKind::HemiSphere, 32}, "HemiSphere 64x16", {59.3, 61.1, 91.4}},
                                         {{MappingKind::HemiSphere, 64}, "HemiSphere 128x32", {234.7, 236.1, 374.7}}};
    return cells;
}

void makersTable(const BakeMesh& mesh, bool gl, double mostRays) {
    const auto rows = static_cast<double>(mesh.rows.size());
    fmt::print("makers: CPU seconds, and microseconds a vertex; the last three columns are the thesis'\n");
    fmt::print(
        "| maker | map | rows | maps s | + index s | + distance s | maps us | + index us | + distance us | 2002 s | "
        "+ index | + distance |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    const trace::GridScene grid(mesh.view());
    const auto line = [&](const char* name, Maker maker, const Cell& cell, bool thesis, double costOfRay) {
        const auto most = static_cast<std::uint64_t>(mostRays / costOfRay / pixelCount(cell.mapping));
        const Maker::Made made = maker.make(std::max<std::uint64_t>(most, 2 * kRun));
        const double index = made.seconds + indexSeconds(mesh, cell.mapping, maker, made);
        const double distance = made.seconds + distanceSeconds(cell.mapping, maker, made);
        fmt::print("| {} | {} | {} | {:.3f} | {:.3f} | {:.3f} | {:.1f} | {:.1f} | {:.1f} |", name, cell.image,
                   made.rows.size(), made.seconds, index, distance, 1e6 * made.seconds / rows, 1e6 * index / rows,
                   1e6 * distance / rows);
        for (const double then : cell.then)
            fmt::print(" {} |", thesis && then > 0.0 ? fmt::format("{:.1f}", then) : "");
        fmt::print("\n");
        std::fflush(stdout);
    };
    if (gl) {
        // A picture costs about as much as so many rays, whatever its size.
        const auto cost = [](const Cell& c) { return 6000.0 / pixelCount(c.mapping) + 0.5; };
        for (const Cell& c : rasteriserCells()) line("gl", Maker(mesh, c.mapping, kEndless), c, true, cost(c));
        for (const Cell& c : rayCells()) line("gl", Maker(mesh, c.mapping, kEndless), c, false, cost(c));
    }
    for (const auto& [name, guard] :
         {std::pair{"rays, exact", trace::Guard::Exact}, std::pair{"rays, fast", trace::Guard::Fast}}) {
        for (const Cell& c : rasteriserCells()) line(name, Maker(mesh, c.mapping, guard, kEndless), c, false, 1.0);
        for (const Cell& c : rayCells()) line(name, Maker(mesh, c.mapping, guard, kEndless), c, true, 1.0);
    }
    for (const Cell& c : rayCells()) line("grid", Maker(mesh, c.mapping, grid, kEndless), c, true, 40.0);
}

void farTable(const BakeMesh& mesh, bool gl, double mostRays) {
    const Mapping mapping{MappingKind::HemiSphere, 32};
    const std::uint32_t pixels = pixelCount(mapping);
    std::vector<double> weight(pixels);
    for (std::uint32_t p = 0; p < pixels; ++p) weight[p] = cosineWeight(mapping, p) / totalCosineWeight(mapping);
    const auto most = [&](double cost) {
        return std::max<std::uint64_t>(static_cast<std::uint64_t>(mostRays / cost / pixels), 2 * kRun);
    };
    const trace::GridScene grid(mesh.view());
    fmt::print(
        "far limit, HemiSphere 64x16: bits that differ from no limit, error of ambient occlusion, CPU seconds for "
        "all rows\n| far % | bits % | AO rms | AO max | rays s | grid s | gl s |\n|---|---|---|---|---|---|---|\n");
    std::vector<std::uint8_t> whole;
    for (const double percent : {0.0, 100.0, 75.0, 50.0, 33.3, 25.0, 16.7, 10.0}) {
        const double far = percent > 0.0 ? 0.01 * percent * mesh.diagonal : kEndless;
        const Maker::Made rays = Maker(mesh, mapping, trace::Guard::Exact, far).make(most(1.0));
        if (percent == 0.0) whole = rays.masks;
        std::uint64_t differing = 0;
        double squares = 0.0, worst = 0.0;
        for (std::size_t row = 0; row < rays.rows.size(); ++row) {
            double error = 0.0;
            for (std::uint32_t p = 0; p < pixels; ++p) {
                const std::size_t at = row * maskBytes(pixels);
                const bool open = isOpen(std::span(rays.masks).subspan(at), p);
                if (open == isOpen(std::span(whole).subspan(at), p)) continue;
                ++differing;
                error += weight[p];
            }
            squares += error * error;
            worst = std::max(worst, error);
        }
        const double gridSeconds = Maker(mesh, mapping, grid, far).make(most(160.0)).seconds;
        const std::string glText = gl ? fmt::format("{:.3f}", Maker(mesh, mapping, far).make(most(6.0)).seconds) : "";
        fmt::print("| {} | {:.3f} | {:.4f} | {:.4f} | {:.3f} | {:.3f} | {} |\n",
                   percent > 0.0 ? fmt::format("{:g}", percent) : "none",
                   100.0 * static_cast<double>(differing) / static_cast<double>(rays.rows.size()) / pixels,
                   std::sqrt(squares / static_cast<double>(rays.rows.size())), worst, rays.seconds, gridSeconds,
                   glText);
        std::fflush(stdout);
    }
}

void formsTable() {
    // Ganster 2002, table 3, as printed.
    constexpr std::array fovy{120, 130, 140, 150, 160, 170, 175};
    constexpr std::array sizes{8, 16, 32, 64, 128, 256};
    constexpr double printed[6][7]{
        {17.02, 20.76, 25.91, 33.41, 45.07, 63.67, 76.13}, {8.70, 10.73, 13.65, 18.26, 26.62, 45.29, 63.71},
        {4.38, 5.41, 6.92, 9.37, 14.07, 26.80, 45.35},     {2.19, 2.71, 3.47, 4.71, 7.14, 14.17, 26.84},
        {1.10, 1.36, 1.74, 2.36, 3.59, 7.20, 14.20},       {0.55, 0.68, 0.87, 1.18, 1.79, 3.61, 7.21}};
    fmt::print("first ray of SinglePlane, degrees off the normal (table 3 of the thesis)\n| size |");
    for (const int f : fovy) fmt::print(" {} |", f);
    fmt::print("\n|---|---|---|---|---|---|---|---|\n");
    double worst = 0.0;
    for (std::size_t s = 0; s < sizes.size(); ++s) {
        fmt::print("| {} |", sizes[s]);
        for (std::size_t f = 0; f < fovy.size(); ++f) {
            const double angle =
                single_plane::firstRayAngle(static_cast<std::uint32_t>(sizes[s]), fovy[f] * kDegree) / kDegree;
            worst = std::max(worst, std::abs(angle - printed[s][f]));
            fmt::print(" {:.2f} |", angle);
        }
        fmt::print("\n");
    }
    fmt::print("largest difference to the {} printed cells: {:.4f} degrees\n\n", sizes.size() * fovy.size(), worst);

    fmt::print(
        "sums of weights, largest difference to the closed total over all even sizes 2 to 128\n"
        "| map | cosine | solid angle |\n|---|---|---|\n");
    for (const MappingKind kind :
         {MappingKind::HemiCube, MappingKind::HemiSphere, MappingKind::Cube, MappingKind::SinglePlane}) {
        double cosine = 0.0, solid = 0.0;
        for (std::uint32_t s = 2; s <= 128; s += 2) {
            const Mapping m{kind, s, kind == MappingKind::SinglePlane ? 150.0 * kDegree : 0.0};
            long double sumCosine = 0.0, sumSolid = 0.0;
            for (std::uint32_t p = 0; p < pixelCount(m); ++p)
                sumCosine += cosineWeight(m, p), sumSolid += solidAngle(m, p);
            cosine = std::max(cosine, std::abs(static_cast<double>(sumCosine - totalCosineWeight(m))));
            // A square pyramid of half angle f/2 holds 4 asin(sin^2(f/2)).
            const double half = std::sin(0.5 * m.fovy);
            const double total = kind == MappingKind::SinglePlane ? 4.0 * std::asin(half * half)
                                 : kind == MappingKind::Cube      ? 4.0 * std::numbers::pi
                                                                  : 2.0 * std::numbers::pi;
            solid = std::max(solid, std::abs(static_cast<double>(sumSolid - total)));
        }
        fmt::print("| {} | {:.1e} | {:.1e} |\n", name(kind), cosine, solid);
    }

    fmt::print(
        "\nambient occlusion of walls and caps, rms as a share of the open sky\n| map | directions of the hemisphere | "
        "wall | cap |\n|---|---|---|---|\n");
    const auto line = [](const Mapping& m, std::uint32_t directions) {
        const test::FormErrors e = test::formErrors(m);
        const std::string fovy = m.fovy > 0.0 ? fmt::format(", {:.0f} degrees", m.fovy / kDegree) : "";
        fmt::print("| {} {}{} | {} | {:.4f} | {:.4f} |\n", name(m.kind), m.size, fovy, directions, e.wall, e.cap);
        std::fflush(stdout);
    };
    for (const std::uint32_t s : {8u, 16u, 32u, 64u}) line({MappingKind::HemiSphere, s}, s * s);
    for (const std::uint32_t s : {4u, 10u, 18u, 36u}) line({MappingKind::HemiCube, s}, 3 * s * s);
    line({MappingKind::Cube, 18}, 3 * 18 * 18);
    line({MappingKind::Octahedral, 46}, 46 * 46 / 2);
    for (const std::uint32_t s : {64u, 256u, 1024u, 4096u}) line({MappingKind::Fibonacci, s}, s);
    for (const double f : {120.0, 150.0, 165.0}) line({MappingKind::SinglePlane, 32, f * kDegree}, 1024);
}

}  // namespace
}  // namespace umbriel

int main(int argc, char** argv) {
    using namespace umbriel;
    const std::string table = bench::option(argc, argv, "--table", "");
    const auto wanted = [&](const char* name) { return table.empty() || table == name; };
    if (wanted("forms")) formsTable();
    if (wanted("sets")) {
        fmt::print("\ninstruction sets: bits of HemiSphere 64x16 that differ from avx2's, CPU seconds of the rays\n");
        fmt::print("| mesh | guard | set | bits that differ | share | rays s |\n|---|---|---|---|---|---|\n");
        for (const std::string name : {"cloth/dress-v5k-f10k.obj", "cloth/dress-v7k-f14k.obj"}) {
            const auto garment = visibility::test::loadShared(name);
            if (garment)
                instructionSetTable(name, bench::need(visibility::prepare(*garment)));
            else
                fmt::print("| {} | UMBRIEL_SHARED does not lead to it | | | | |\n", name);
        }
    }
    if (!wanted("makers") && !wanted("far")) return 0;
    const std::string file = bench::option(argc, argv, "--mesh", "cloth/dress-v7k-f14k.obj");
    auto loaded = file == "cloth3k"    ? std::optional(visibility::test::cloth(80, 40))
                  : file == "cloth35k" ? std::optional(visibility::test::cloth(280, 125))
                                       : visibility::test::loadShared(file);
    if (!loaded) loaded = visibility::test::load(file);
    if (!loaded) {
        fmt::print("{} is not there; the procedural cloth instead\n", file);
        loaded = visibility::test::cloth(120, 64);
    }
    const visibility::BakeMesh mesh = bench::need(visibility::prepare(*loaded));
    const double mostRays = 1e6 * std::atof(bench::option(argc, argv, "--most", "250").c_str());
    auto context = gl::HeadlessContext::create({});
    fmt::print("\n{}: {} rows, {} triangles; gl: {}\n\n", file, mesh.rows.size(), mesh.triangles.size(),
               context ? context->info().renderer : context.error().message);
    if (wanted("makers")) makersTable(mesh, context.has_value(), mostRays);
    fmt::print("\n");
    if (wanted("far")) farTable(mesh, context.has_value(), mostRays);
    return 0;
}
