#include "client/trade/trade_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

namespace umbriel {
namespace {

using Json = nlohmann::ordered_json;

Json finite(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}
template <class T>
Json maybe(const std::optional<T>& value) {
    return value ? Json(*value) : Json(nullptr);
}

// Name and value of everything that is known of a row; the names of the contract first.
Json rowJson(const TradeRow& row) {
    const TradeErrors& e = row.errors;
    Json json = {{"technique", row.setting.technique},
                 {"map_size", row.setting.hasMap ? Json(row.setting.mapSize) : Json(nullptr)},
                 {"filter", maybe(row.setting.filter ? row.setting.filter : row.filterWidth)},
                 {"samples", maybe(row.setting.samples ? row.setting.samples : row.filterSamples)},
                 {"error", e.error.error()},
                 {"leak", e.error.leak},
                 {"acne", e.error.acne},
                 {"edge_median_px", finite(e.edges.distance.median)},
                 {"edge_p95_px", finite(e.edges.distance.percentile95)},
                 {"rmse", e.error.rmse},
                 {"wall_ms", row.cost.wallMilliseconds},
                 {"cpu_ms", row.cost.cpuMilliseconds},
                 {"map_bytes", row.cost.mapBytes},
                 {"gpu_ms", row.cost.gpuMilliseconds > 0.0 ? Json(row.cost.gpuMilliseconds) : Json(nullptr)},
                 {"cpu_ratio", row.cost.cpuRatio},
                 {"frames", row.cost.frames},
                 {"judged", e.error.judged},
                 {"wrong_side", e.error.wrongSide},
                 {"leak_away", e.error.leakAway},
                 {"acne_away", e.error.acneAway},
                 {"leak_beyond_texel", maybe(e.leakBeyondTexel)},
                 {"acne_beyond_texel", maybe(e.acneBeyondTexel)},
                 {"error_near", e.zoneErrors[0]},
                 {"error_middle", e.zoneErrors[1]},
                 {"error_far", e.zoneErrors[2]},
                 {"edge_near_px", maybe(e.zoneEdges[0])},
                 {"edge_middle_px", maybe(e.zoneEdges[1])},
                 {"edge_far_px", maybe(e.zoneEdges[2])},
                 {"texel_near_px", maybe(e.zoneTexels[0])},
                 {"texel_middle_px", maybe(e.zoneTexels[1])},
                 {"texel_far_px", maybe(e.zoneTexels[2])},
                 {"texel_m", maybe(e.texelMetres)},
                 {"missing_near", maybe(e.zoneMissing[0])},
                 {"missing_middle", maybe(e.zoneMissing[1])},
                 {"missing_far", maybe(e.zoneMissing[2])},
                 {"mach_band", e.machBand},
                 {"delta_e", e.deltaE},
                 {"seam_jump", e.seamJump},
                 {"flicker", maybe(e.flicker)},
                 {"eye_mismatch", maybe(e.eyeMismatch)},
                 {"error_everywhere", maybe(e.errorEverywhere)},
                 {"on_front", row.onFront},
                 {"chosen", row.chosen}};
    std::string fields;
    for (const auto& [field, value] : row.setting.fields) fields += (fields.empty() ? "" : ";") + field + "=" + value;
    json["fields"] = fields;
    return json;
}

std::size_t widestLabel(const TradeResult& result) {
    std::size_t widest = 20;
    for (const TradeRow& row : result.rows) widest = std::max(widest, labelOf(row.setting).size());
    return widest;
}

Json resultJson(const TradeResult& result) {
    Json rows = Json::array();
    for (const TradeRow& row : result.rows) rows.push_back(rowJson(row));
    return {{"scene", result.scene},
            {"version", result.version},
            {"machine", result.machine},
            {"size", {result.width, result.height}},
            {"judged_share", result.judgedShare},
            {"truth", result.truth},
            {"rows", rows},
            {"notes", result.notes}};
}

}  // namespace

const char* nameOf(Expectation::State state) {
    return state == Expectation::State::Met ? "met" : state == Expectation::State::NotMet ? "NOT MET" : "open";
}

std::string tradeJson(const TradeResult& result) {
    return resultJson(result).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string tradeJson(const std::string& preset, std::span<const TradeResult> results,
                      std::span<const Expectation> expected) {
    Json runs = Json::array(), claims = Json::array();
    for (const TradeResult& result : results) runs.push_back(resultJson(result));
    for (const Expectation& one : expected)
        claims.push_back(
            {{"text", one.text}, {"state", nameOf(one.state)}, {"figures", one.figures}, {"why", one.why}});
    return Json{{"preset", preset}, {"runs", runs}, {"expected", claims}}.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string tradeCsv(std::span<const TradeResult> results) {
    std::string text;
    std::vector<std::pair<const TradeResult*, const TradeRow*>> rows;
    for (const TradeResult& result : results)
        for (const TradeRow& row : result.rows) rows.emplace_back(&result, &row);
    for (const auto& [result, row] : rows) {
        Json json = rowJson(*row);
        json["scene"] = result->scene;
        if (text.empty()) {
            for (const auto& [name, value] : json.items()) text += (text.empty() ? "" : ",") + name;
            text += '\n';
        }
        bool first = true;
        for (const auto& [name, value] : json.items()) {
            if (!first) text += ',';
            first = false;
            if (value.is_string()) {
                std::string quoted = value.get<std::string>();
                if (quoted.find_first_of(",\"\n") != std::string::npos) {
                    for (std::size_t at = 0; (at = quoted.find('"', at)) != std::string::npos; at += 2)
                        quoted.insert(at, 1, '"');
                    quoted = '"' + quoted + '"';
                }
                text += quoted;
            } else if (!value.is_null()) {
                text += value.dump(-1, ' ', false, Json::error_handler_t::replace);
            }
        }
        text += '\n';
    }
    return text;
}

void printTrade(const TradeResult& result, std::ostream& out) {
    const std::size_t wide = widestLabel(result);
    out << fmt::format("{}, {}x{}, {:.1f} % of the covered pixels judged; {}\n", result.scene, result.width,
                       result.height, 100.0 * result.judgedShare, result.truth);
    out << fmt::format("  {:<{}} {:>8} {:>8} {:>8} {:>9} {:>7} {:>7} {:>8} {:>8} {:>9}\n", "setting", wide, "error %",
                       "leak %", "acne %", "edge px", "p95", "rmse", "wall ms", "cpu ms", "map KiB");
    for (const TradeRow& row : result.rows) {
        const ShadowError& e = row.errors.error;
        const auto pixels = [](double value) {
            return std::isfinite(value) ? fmt::format("{:.1f}", value) : std::string("-");
        };
        out << fmt::format("{} {:<{}} {:>8.3f} {:>8.3f} {:>8.3f} {:>9} {:>7} {:>7.4f} {:>8.1f} {:>8.1f} {:>9}\n",
                           row.chosen    ? '>'
                           : row.onFront ? '*'
                                         : ' ',
                           labelOf(row.setting), wide, 100.0 * e.error(), 100.0 * e.leak, 100.0 * e.acne,
                           pixels(row.errors.edges.distance.median), pixels(row.errors.edges.distance.percentile95),
                           e.rmse, row.cost.wallMilliseconds, row.cost.cpuMilliseconds, row.cost.mapBytes / 1024);
    }
    for (const std::string& note : result.notes) out << "  " << note << '\n';
}

void printZones(const TradeResult& result, std::ostream& out) {
    const std::size_t wide = widestLabel(result);
    out << fmt::format("  {:<{}} {:>8} {:>8} {:>8} {:>23} {:>10} {:>10} {:>8}\n", "setting", wide, "near %", "middle %",
                       "far %", "texel px, near mid far", "leak>1tx %", "acne>1tx %", "x cost");
    const auto shown = [](const std::optional<double>& value, double scale, int digits) {
        return value ? fmt::format("{:.{}f}", scale * *value, digits) : std::string("-");
    };
    for (const TradeRow& row : result.rows) {
        const TradeErrors& e = row.errors;
        out << fmt::format("  {:<{}} {:>8.3f} {:>8.3f} {:>8.3f} {:>9} {:>6} {:>6} {:>10} {:>10} {:>8.3f}\n",
                           labelOf(row.setting), wide, 100 * e.zoneErrors[0], 100 * e.zoneErrors[1],
                           100 * e.zoneErrors[2], shown(e.zoneTexels[0], 1, 2), shown(e.zoneTexels[1], 1, 2),
                           shown(e.zoneTexels[2], 1, 2), shown(e.leakBeyondTexel, 100, 4),
                           shown(e.acneBeyondTexel, 100, 4), row.cost.cpuRatio);
    }
}

void printCosts(const TradeResult& result, std::ostream& out) {
    const std::size_t wide = widestLabel(result);
    out << fmt::format("{}, {}x{}\n  {:<{}} {:>9} {:>9} {:>8} {:>10} {:>7}\n", result.scene, result.width,
                       result.height, "setting", wide, "wall ms", "cpu ms", "x first", "map KiB", "frames");
    for (const TradeRow& row : result.rows)
        out << fmt::format("  {:<{}} {:>9.1f} {:>9.1f} {:>8.3f} {:>10} {:>7}\n", labelOf(row.setting), wide,
                           row.cost.wallMilliseconds, row.cost.cpuMilliseconds, row.cost.cpuRatio,
                           row.cost.mapBytes / 1024, row.cost.frames);
    for (const std::string& note : result.notes) out << "  " << note << '\n';
}

void printExpectations(std::span<const Expectation> expected, std::ostream& out) {
    out << "expected:\n";
    int met = 0, open = 0;
    for (const Expectation& one : expected) {
        met += one.state == Expectation::State::Met ? 1 : 0;
        open += one.state == Expectation::State::Open ? 1 : 0;
        out << fmt::format("  {:<8} {}: {}\n", nameOf(one.state), one.text, one.figures);
        if (!one.why.empty()) out << fmt::format("           ({})\n", one.why);
    }
    out << fmt::format("{} of {} met, {} open\n", met, expected.size(), open);
}

}  // namespace umbriel
