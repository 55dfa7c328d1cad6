#include "client/app/compare_command.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "client/app/exit_code.h"
#include "common/image/isolated_reader.h"
#include "common/image/measures.h"
#include "common/image/picture_measures.h"
#include "common/image/printable.h"

namespace umbriel {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMaxExposure = 126.0;  // EV, either way: beyond it every float is black or white
constexpr std::size_t kWorstPixels = 5;
constexpr std::int64_t kMaxTiles = 65536;  // keeps the output of a mistyped grid in bounds

struct TileComparison {
    int column = 0;
    int row = 0;
    PixelRect rect;  // origin at the lower left
    ImageComparison comparison;
};

// JSON knows no infinity.
Json finiteOrNull(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

void addMeasures(const ImageComparison& comparison, Json& json) {
    json["pixels"] = comparison.pixels;
    json["differing"] = comparison.differing;
    json["bit_differing"] = comparison.bitDiffering;
    json["over_8_255"] = comparison.over8;
    json["holes"] = comparison.holes;
    json["max"] = finiteOrNull(comparison.max);
    json["mae"] = finiteOrNull(comparison.mae);
    json["rmse"] = finiteOrNull(comparison.rmse);
    if (comparison.nonFinite > 0) {
        json["non_finite"] = comparison.nonFinite;
    }
}

const char* presenceName(LayerComparison::Presence presence) {
    switch (presence) {
        case LayerComparison::Presence::Both:
            return "both";
        case LayerComparison::Presence::OnlyA:
            return "a";
        case LayerComparison::Presence::OnlyB:
            return "b";
        case LayerComparison::Presence::OtherChannels:
            break;
    }
    return "other channels";
}

Json jsonOf(const ImageComparison& comparison, const std::vector<TileComparison>& tiles) {
    Json json = Json::object();
    addMeasures(comparison, json);
    for (const LayerComparison& layer : comparison.layers) {
        Json entry = {
            {"name", layer.name}, {"type", layer.isUint ? "uint" : "float"}, {"in", presenceName(layer.presence)}};
        if (layer.presence == LayerComparison::Presence::Both) {
            entry["bit_differing"] = layer.bitDiffering;
        }
        json["layers"].push_back(std::move(entry));
    }
    for (const TileComparison& tile : tiles) {
        Json entry = {{"column", tile.column}, {"row", tile.row},          {"x", tile.rect.x},
                      {"y", tile.rect.y},      {"width", tile.rect.width}, {"height", tile.rect.height}};
        addMeasures(tile.comparison, entry);
        json["tiles"].push_back(std::move(entry));
    }
    return json;
}

Json jsonOf(const Spread& spread) {
    return {{"mean", finiteOrNull(spread.mean)},
            {"median", finiteOrNull(spread.median)},
            {"p95", finiteOrNull(spread.percentile95)},
            {"max", finiteOrNull(spread.max)}};
}

double shareAbove(const PictureMeasures& measures, const ImageComparison& comparison) {
    return static_cast<double>(measures.aboveThreshold) / static_cast<double>(comparison.pixels);
}

void addPictureMeasures(const CompareOptions& options, const PictureMeasures& measures,
                        const ImageComparison& comparison, Json& json) {
    json["above_threshold"] = {{"threshold", options.threshold},
                               {"pixels", measures.aboveThreshold},
                               {"share", shareAbove(measures, comparison)}};
    json["edge_displacement"] = {{"edges_a", measures.edges.edgesA},
                                 {"edges_b", measures.edges.edgesB},
                                 {"a_to_b", jsonOf(measures.edges.fromA)},
                                 {"b_to_a", jsonOf(measures.edges.fromB)}};
    json["mach_band"] = jsonOf(measures.machBands.response);
    json["mach_band"]["overshoot"] = jsonOf(measures.machBands.overshoot);
    json["delta_e"] = jsonOf(measures.deltaE);
}

void printPictureMeasures(const CompareOptions& options, const PictureMeasures& measures,
                          const ImageComparison& comparison, std::ostream& out) {
    out << fmt::format("above {:<8.6g}{:>12}  {:.4f} %\n", options.threshold, measures.aboveThreshold,
                       100.0 * shareAbove(measures, comparison));
    out << fmt::format("{:<26}{:>12}{:>12}{:>12}{:>12}\n", "", "mean", "median", "95 %", "max");
    const auto line = [&out](const std::string& name, const Spread& spread) {
        out << fmt::format("{:<26}{:>12.6g}{:>12.6g}{:>12.6g}{:>12.6g}\n", name, spread.mean, spread.median,
                           spread.percentile95, spread.max);
    };
    line(fmt::format("edges of A to B ({})", measures.edges.edgesA), measures.edges.fromA);
    line(fmt::format("edges of B to A ({})", measures.edges.edgesB), measures.edges.fromB);
    line("Mach bands, response", measures.machBands.response);
    line("Mach bands, overshoot", measures.machBands.overshoot);
    line("deltaE (CIE 1976)", measures.deltaE);
}

std::string pixelText(const std::array<float, 4>& pixel) {
    return fmt::format("({:.6g} {:.6g} {:.6g} {:.6g})", pixel[0], pixel[1], pixel[2], pixel[3]);
}

void printLayer(const LayerComparison& layer, std::ostream& out) {
    const char* type = layer.isUint ? "uint" : "float";
    const std::string name = layer.name.empty() ? "(top level)" : printable(layer.name);
    switch (layer.presence) {
        case LayerComparison::Presence::Both:
            out << fmt::format("layer {} ({}): bit_differing {}\n", name, type, layer.bitDiffering);
            break;
        case LayerComparison::Presence::OtherChannels:
            out << fmt::format("layer {} ({}): has other channels in A than in B\n", name, type);
            break;
        case LayerComparison::Presence::OnlyA:
        case LayerComparison::Presence::OnlyB:
            out << fmt::format("layer {} ({}): only in {}\n", name, type,
                               layer.presence == LayerComparison::Presence::OnlyA ? "A" : "B");
            break;
    }
}

void printTable(const CompareOptions& options, const LayeredImage& a, const LayeredImage& b,
                const ImageComparison& comparison, const std::vector<TileComparison>& tiles, std::ostream& out) {
    const auto count = [&](const char* name, std::uint64_t pixels) {
        out << fmt::format("{:<14}{:>12}  {:.4f} %\n", name, pixels,
                           100.0 * static_cast<double>(pixels) / static_cast<double>(comparison.pixels));
    };
    out << fmt::format("A {}\nB {}\n{} x {} pixels, exposure {} EV\n", options.a.string(), options.b.string(),
                       a.width(), a.height(), options.exposure);
    count("pixels", comparison.pixels);
    count("differing", comparison.differing);
    count("bit_differing", comparison.bitDiffering);
    count("over_8_255", comparison.over8);
    count("holes", comparison.holes);
    if (comparison.nonFinite > 0) {
        count("non_finite", comparison.nonFinite);
    }
    out << fmt::format("{:<14}{:>12.6g}\n{:<14}{:>12.6g}\n{:<14}{:>12.6g}\n", "max", comparison.max, "mae",
                       comparison.mae, "rmse", comparison.rmse);
    for (const LayerComparison& layer : comparison.layers) {
        printLayer(layer, out);
    }
    if (!tiles.empty()) {
        out << fmt::format("tile (column,row from the lower left)\n{:>9}{:>12}{:>14}{:>12}{:>9}{:>13}{:>13}{:>13}\n",
                           "", "differing", "bit_differing", "over_8_255", "holes", "max", "mae", "rmse");
    }
    for (const TileComparison& tile : tiles) {
        const ImageComparison& c = tile.comparison;
        out << fmt::format("{:>9}{:>12}{:>14}{:>12}{:>9}{:>13.6g}{:>13.6g}{:>13.6g}\n",
                           fmt::format("{},{}", tile.column, tile.row), c.differing, c.bitDiffering, c.over8, c.holes,
                           c.max, c.mae, c.rmse);
    }
    const std::vector<PixelDifference> worst =
        worstPixels(a.rgba, b.rgba, {0, 0, a.width(), a.height()}, kWorstPixels, ComparisonOptions{options.exposure});
    if (!worst.empty()) {
        out << "worst pixels (x, y from the top left; linear RGBA of A and B; 8-bit difference)\n";
    }
    for (const PixelDifference& pixel : worst) {
        out << fmt::format("  {}, {}  {}  {}  {}\n", pixel.x, pixel.y, pixelText(pixel.a), pixelText(pixel.b),
                           pixel.bytes);
    }
}

// Column i covers the pixels floor(i W / C) .. floor((i + 1) W / C), rows the same from below: the rule of `--grid`.
std::vector<TileComparison> compareTiles(const LayeredImage& a, const LayeredImage& b, const std::array<int, 2>& grid,
                                         const ComparisonOptions& options) {
    const auto edge = [](int i, int pixels, int parts) { return static_cast<int>(std::int64_t{i} * pixels / parts); };
    std::vector<TileComparison> tiles;
    for (int row = 0; row < grid[1]; ++row) {
        for (int column = 0; column < grid[0]; ++column) {
            PixelRect rect{edge(column, a.width(), grid[0]), edge(row, a.height(), grid[1]), 0, 0};
            rect.width = edge(column + 1, a.width(), grid[0]) - rect.x;
            rect.height = edge(row + 1, a.height(), grid[1]) - rect.y;
            tiles.push_back({column, row, rect, compareRegion(a.rgba, b.rgba, turnedOver(rect, a.height()), options)});
        }
    }
    return tiles;
}

Result<void> compare(const CompareOptions& options, std::ostream& out) {
    if (!std::isfinite(options.exposure) || std::abs(options.exposure) > kMaxExposure) {
        return badInput(fmt::format("the exposure must lie within +-{} EV", kMaxExposure));
    }
    if (options.measures != "basic" && options.measures != "all") {
        return badInput(fmt::format("--measures '{}': expected basic or all", printable(options.measures)));
    }
    if (!(options.threshold >= 0.0) || !std::isfinite(options.threshold)) {
        return badInput("the threshold must be 0 or more");
    }
    const Result<LayeredImage> a = readImageIsolated(options.a);
    if (!a) {
        return a.error();
    }
    const Result<LayeredImage> b = readImageIsolated(options.b);
    if (!b) {
        return b.error();
    }
    const ComparisonOptions comparisonOptions{options.exposure};
    const Result<ImageComparison> comparison = compareImages(*a, *b, comparisonOptions);
    if (!comparison) {
        return badInput(fmt::format("cannot compare '{}' with '{}': {}", options.a.string(), options.b.string(),
                                    comparison.error().message));
    }
    std::vector<TileComparison> tiles;
    if (options.grid) {
        const auto [columns, rows] = *options.grid;
        if (columns < 1 || rows < 1 || columns > a->width() || rows > a->height() ||
            std::int64_t{columns} * rows > kMaxTiles) {
            return badInput(fmt::format("a grid of {} x {} tiles does not fit {} x {} pixels", columns, rows,
                                        a->width(), a->height()));
        }
        tiles = compareTiles(*a, *b, *options.grid, comparisonOptions);
    }
    std::optional<PictureMeasures> measures;
    if (options.measures == "all") {
        measures = measurePictures(a->rgba, b->rgba, {.exposure = options.exposure, .threshold = options.threshold});
    }
    if (options.json) {
        Json json = jsonOf(*comparison, tiles);
        if (measures) {
            addPictureMeasures(options, *measures, *comparison, json);
        }
        // Layer names are a file's bytes: what is no UTF-8 is replaced, not thrown at us.
        out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    } else {
        printTable(options, *a, *b, *comparison, tiles, out);
        if (measures) {
            printPictureMeasures(options, *measures, *comparison, out);
        }
    }
    if (!out.flush()) {
        return failure("the result could not be written");
    }
    return {};
}

}  // namespace

int runCompare(const CompareOptions& options, std::ostream& out, std::ostream& err) {
    const Result<void> done = compare(options, out);
    if (!done) {
        err << "umbriel compare: " << done.error().message << '\n';
        return exitCode(done.error());
    }
    return 0;
}

}  // namespace umbriel
