#include "client/app/trade_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <ostream>
#include <span>

#include "client/app/progress.h"
#include "client/app/trade_bench.h"
#include "client/app/trade_presets.h"
#include "client/trade/trade_choice.h"
#include "client/trade/trade_report.h"
#include "common/base/log.h"
#include "common/image/atomic_file.h"

namespace umbriel {
namespace {

constexpr std::size_t kMaxRows = 1000;

template <class T>
Result<std::vector<T>> numbersOf(std::string_view argument, const std::string& text, T lowest, T highest) {
    std::vector<T> numbers;
    for (const std::string& part : listOf(text)) {
        T value{};
        const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
        if (error != std::errc{} || end != part.data() + part.size() || !(value >= lowest && value <= highest))
            return badInput(fmt::format("{} '{}': expected numbers from {} to {}, separated by commas", argument, text,
                                        lowest, highest));
        numbers.push_back(value);
    }
    return numbers;
}

Result<std::vector<TradeRow>> rowsOf(const TradeArguments& arguments) {
    std::vector<std::string> techniques = listOf(arguments.techniques);
    if (techniques.empty()) {
        techniques = drawnShadowModes();
        // Maps that do not depend on the view are another row, the thesis' standard.
        if (std::find(techniques.begin(), techniques.end(), "std") != techniques.end())
            techniques.push_back("std:scene");
        std::erase(techniques, "visibility-map");
    }
    const auto sizes = numbersOf<std::uint32_t>("--map-sizes", arguments.mapSizes, 0u, 16384u);
    if (!sizes) return sizes.error();
    if (sizes->empty()) return badInput("--map-sizes: expected numbers from 0 to 16384, separated by commas");
    const auto filters = numbersOf<double>("--filters", arguments.filters, 0.0, 1e6);
    if (!filters) return filters.error();
    const auto samples = numbersOf<int>("--filter-samples", arguments.samples, 1, 64);
    if (!samples) return samples.error();
    std::vector<TradeRow> rows;
    for (const std::string& technique : techniques) {
        const auto parsed = parseTechnique(technique);
        if (!parsed) return parsed.error();
        const bool mapped = hasMap(parsed->mode);
        for (std::size_t m = 0; m < (mapped ? sizes->size() : 1); ++m)
            for (std::size_t f = 0; f < (takesFilter(parsed->mode) ? std::max<std::size_t>(1, filters->size()) : 1);
                 ++f)
                for (std::size_t s = 0;
                     s < (takesSamples(parsed->mode) ? std::max<std::size_t>(1, samples->size()) : 1); ++s) {
                    TradeRow row;
                    row.setting.technique = technique;
                    row.setting.hasMap = mapped;
                    if (mapped) row.setting.mapSize = (*sizes)[m];
                    if (takesFilter(parsed->mode) && !filters->empty()) row.setting.filter = (*filters)[f];
                    if (takesSamples(parsed->mode) && !samples->empty()) row.setting.samples = (*samples)[s];
                    rows.push_back(std::move(row));
                }
    }
    if (rows.empty() || rows.size() > kMaxRows)
        return badInput(
            fmt::format("{} settings to measure; at least 1 and at most {} make sense", rows.size(), kMaxRows));
    return rows;
}

Result<void> writeText(const std::string& path, const std::string& text) {
    auto file = AtomicFile::create(path);
    if (!file) return file.error();
    (*file)->write(std::as_bytes(std::span(text)));
    return (*file)->commit();
}

Result<TradeResult> sweep(const TradeArguments& arguments, const std::filesystem::path& serverProgram) {
    auto rows = rowsOf(arguments);
    if (!rows) return rows.error();
    TradeBenchOptions options;
    options.lightSize = arguments.lightSize;
    options.truth.lightSamplesPerSide = static_cast<int>(std::ceil(std::sqrt(arguments.lightSamples)));
    options.judgeNode = arguments.judge;
    options.bothSides = arguments.bothSides;
    options.flickerFrames = arguments.flicker;
    auto bench = TradeBench::open(arguments.scene, serverProgram, options);
    if (!bench) return bench.error();
    if (const auto looked = (*bench)->look(); !looked) return looked.error();
    Progress progress("setting", rows->size(), arguments.scene.quiet || arguments.json);
    bool leavesOut = false;
    for (TradeRow& row : *rows) {
        if (leavesOut && isLightMap(row.setting)) continue;
        if (const auto measured = (*bench)->measure(row); !measured) {
            // Who asks for everything is not refused everything where no light stays where it is.
            leavesOut = arguments.techniques.empty() && isLightMap(row.setting) &&
                        measured.error().kind == Error::Kind::BadInput;
            if (!leavesOut) return measured.error();
            log::warning(fmt::format("{} is left out: {}", row.setting.technique, measured.error().message));
        }
        progress.step();
    }
    progress.finish();
    if (leavesOut) std::erase_if(*rows, [](const TradeRow& row) { return isLightMap(row.setting); });
    // Timed by map size, so that few maps are made anew.
    std::stable_sort(rows->begin(), rows->end(),
                     [](const TradeRow& a, const TradeRow& b) { return a.setting.mapSize < b.setting.mapSize; });
    for (std::size_t first = 0; first < rows->size();) {
        std::size_t end = first;
        while (end < rows->size() && (*rows)[end].setting.mapSize == (*rows)[first].setting.mapSize) ++end;
        std::vector<TradeRow> group(std::make_move_iterator(rows->begin() + static_cast<std::ptrdiff_t>(first)),
                                    std::make_move_iterator(rows->begin() + static_cast<std::ptrdiff_t>(end)));
        if (const auto timed = (*bench)->time(group, arguments.frames); !timed) return timed.error();
        std::move(group.begin(), group.end(), rows->begin() + static_cast<std::ptrdiff_t>(first));
        first = end;
    }
    TradeResult result = (*bench)->describe();
    result.rows = std::move(*rows);
    for (const std::size_t i : paretoFront(result.rows)) result.rows[i].onFront = true;
    for (const TradeRow& row : result.rows)
        if (row.errors.errorEverywhere)
            result.notes.push_back(
                fmt::format("{} is judged on its plane; over all judged pixels {:.3f} % are wrong, "
                            "which is what the front and a choice go by",
                            labelOf(row.setting), 100.0 * *row.errors.errorEverywhere));
    if (result.judgedShare < 0.8)
        result.notes.push_back(
            fmt::format("{:.1f} % of the covered pixels are judged: the others face away from the light, lie on "
                        "silhouettes or are left out",
                        100.0 * result.judgedShare));
    return result;
}

}  // namespace

Result<void> writeTradeReports(const std::vector<std::string>& outs, std::span<const TradeResult> results,
                               std::span<const Expectation> expected, const std::string& preset) {
    for (const std::string& path : outs) {
        std::string text;
        if (path.ends_with(".csv"))
            text = tradeCsv(results);
        else if (path.ends_with(".json"))
            text = preset.empty() ? tradeJson(results.front()) : tradeJson(preset, results, expected);
        else {
            auto html = tradeHtml(results, expected);
            if (!html) return html.error();
            text = std::move(*html);
        }
        if (const auto written = writeText(path, text); !written) return written.error();
        log::info(fmt::format("wrote {}", path));
    }
    return {};
}

int runTrade(const TradeArguments& arguments, const std::filesystem::path& serverProgram, std::ostream& out) {
    if (arguments.frames < 1 || arguments.frames > 1'000'000)
        return exitCodeOf(badInput(fmt::format("--frames {}: expected 1 to 1000000", arguments.frames)));
    if (arguments.lightSamples < 1 || arguments.lightSamples > 65536)
        return exitCodeOf(badInput(fmt::format("--light-samples {}: expected 1 to 65536", arguments.lightSamples)));
    if (arguments.lightSize && !(*arguments.lightSize >= 0.0 && *arguments.lightSize < 1e6))
        return exitCodeOf(badInput("--light-size: expected 0 or more metres, of a directional light radians"));
    if (arguments.flicker != 0 && (arguments.flicker < 2 || arguments.flicker > 1000))
        return exitCodeOf(badInput(fmt::format("--flicker {}: expected 2 to 1000 frames, or 0", arguments.flicker)));
    if (arguments.maxError && !(*arguments.maxError >= 0.0))
        return exitCodeOf(badInput("--max-error: expected a share of the judged pixels of 0 or more, as in 0.005"));
    if (arguments.budget && !(*arguments.budget > 0.0))
        return exitCodeOf(badInput("--budget: expected more than 0 milliseconds"));
    for (const std::string& path : arguments.out)
        if (!path.ends_with(".csv") && !path.ends_with(".json") && !path.ends_with(".html"))
            return exitCodeOf(
                badInput(fmt::format("--out '{}': expected a name ending in .csv, .json or .html", path)));
    // What cannot be written is known before minutes of measuring.
    std::vector<std::filesystem::path> files(arguments.out.begin(), arguments.out.end());
    if (arguments.store && arguments.preset.empty()) files.push_back(tradeFileOf(arguments.scene.scene));
    for (const std::filesystem::path& file : files)
        if (const auto probe = AtomicFile::create(file); !probe) return exitCodeOf(probe.error());
    if (!arguments.preset.empty()) return runTradePreset(arguments, serverProgram, out);

    auto result = sweep(arguments, serverProgram);
    if (!result) return exitCodeOf(result.error());
    std::optional<std::size_t> chosen;
    const bool chooses = arguments.maxError || arguments.budget || arguments.store;
    if (chooses && !(result->judgedShare > 0.0)) {
        // Every setting would be without error.
        result->notes.push_back("nothing is chosen: no light reaches what is seen, so no shadow was judged");
    } else if (chooses) {
        chosen = choose(result->rows, arguments.maxError, arguments.budget);
        if (chosen) {
            TradeRow& row = result->rows[*chosen];
            row.chosen = true;
            result->notes.push_back(fmt::format("chosen: {}, {:.3f} % error, {:.1f} ms, {:.1f} ms of processors",
                                                labelOf(row.setting), 100.0 * comparedError(row),
                                                row.cost.wallMilliseconds, row.cost.cpuMilliseconds));
        } else {
            result->notes.push_back("nothing that was measured stays within the error and the budget asked for");
        }
    }
    if (chosen && arguments.store) {
        const auto path = tradeFileOf(arguments.scene.scene);
        if (const auto stored = writeTrade(path, storedTrade(*result, *chosen)); !stored)
            return exitCodeOf(stored.error());
        result->notes.push_back(fmt::format("stored in {}: umbriel render and view take it", path.string()));
        const TradeSetting& setting = result->rows[*chosen].setting;
        if (const auto technique = parseTechnique(setting.technique); isLightMap(setting))
            result->notes.push_back(fmt::format(
                "they need the light map: umbriel bake {} --light-map {}{}", arguments.scene.scene, setting.mapSize,
                technique->bakedFrom ? " --from " + setting.technique.substr(setting.technique.find(':') + 1) : ""));
    }
    // First what needs no disk.
    if (arguments.json)
        out << tradeJson(*result);
    else if (!arguments.scene.quiet)
        printTrade(*result, out);
    if (const auto written = writeTradeReports(arguments.out, {&*result, 1}, {}); !written)
        return exitCodeOf(written.error());
    return out.good() && (chosen || !chooses) ? 0 : 1;
}

}  // namespace umbriel
