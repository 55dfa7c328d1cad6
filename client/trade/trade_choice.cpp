#include "client/trade/trade_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

#include "common/image/atomic_file.h"

namespace umbriel {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

// A front has a few points; a file that is longer is none of ours.
constexpr std::uintmax_t kMaxBytes = 1 << 20;
// What umbriel trade measures at most.
constexpr double kMostTexels = 16384.0;
constexpr double kWidestFilter = 1e6;
constexpr double kMostSamples = 64.0;

Json toJson(const StoredTrade::Point& point) {
    Json json = {{"technique", point.setting.technique}, {"map_size", nullptr}};
    if (point.setting.hasMap) json["map_size"] = point.setting.mapSize;
    if (point.setting.filter) json["filter"] = *point.setting.filter;
    if (point.setting.samples) json["samples"] = *point.setting.samples;
    if (!point.setting.fields.empty()) {
        Json fields = Json::object();
        for (const auto& [field, value] : point.setting.fields) fields[field] = value;
        json["fields"] = fields;
    }
    json["error"] = point.error;
    json["wall_ms"] = point.wallMilliseconds;
    json["cpu_ms"] = point.cpuMilliseconds;
    return json;
}

// Numbers of another sign or size would wrap around. Empty when all are possible. Throws what nlohmann throws.
std::string impossible(const Json& point) {
    const auto within = [&](const char* key, double lowest, double highest) -> std::string {
        if (!point.contains(key) || point[key].is_null()) return {};
        const double value = point[key].get<double>();
        if (value >= lowest && value <= highest) return {};
        return fmt::format("a {} of {} is not between {} and {}", key, value, lowest, highest);
    };
    for (const std::string& problem : {within("map_size", 0.0, kMostTexels), within("filter", 0.0, kWidestFilter),
                                       within("samples", 1.0, kMostSamples)})
        if (!problem.empty()) return problem;
    return {};
}

// Throws what nlohmann throws; readTrade() catches.
StoredTrade::Point pointOf(const Json& json) {
    StoredTrade::Point point;
    point.setting.technique = json.at("technique").get<std::string>();
    point.setting.hasMap = !json.at("map_size").is_null();
    if (point.setting.hasMap) point.setting.mapSize = json["map_size"].get<std::uint32_t>();
    if (json.contains("filter")) point.setting.filter = json["filter"].get<double>();
    if (json.contains("samples")) point.setting.samples = json["samples"].get<int>();
    if (json.contains("fields"))
        for (const auto& [field, value] : json["fields"].items())
            point.setting.fields.emplace_back(field, value.get<std::string>());
    point.error = json.at("error").get<double>();
    point.wallMilliseconds = json.at("wall_ms").get<double>();
    point.cpuMilliseconds = json.at("cpu_ms").get<double>();
    return point;
}

}  // namespace

fs::path tradeFileOf(const std::string& scene) {
    if (!scene.starts_with("demo:")) return scene + ".umtrade.json";
    std::string name = scene;
    std::replace_if(
        name.begin(), name.end(),
        [](unsigned char c) { return !((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9')); },
        '-');
    return name + ".umtrade.json";
}

Result<void> writeTrade(const fs::path& path, const StoredTrade& trade) {
    Json front = Json::array();
    for (const StoredTrade::Point& point : trade.front) front.push_back(toJson(point));
    const Json json = {
        {"umbriel_trade", 1}, {"scene", trade.scene}, {"chosen", toJson(trade.chosen)}, {"front", front}};
    auto file = AtomicFile::create(path);
    if (!file) return file.error();
    const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
    (*file)->write(std::as_bytes(std::span(text)));
    return (*file)->commit();
}

Result<std::optional<StoredTrade>> readTrade(const fs::path& path) {
    std::error_code error;
    const std::uintmax_t size = fs::file_size(path, error);
    if (error) return std::optional<StoredTrade>();
    const auto bad = [&](const std::string& why) {
        return badInput(fmt::format(
            "{}: not a choice stored by umbriel trade ({}); remove it or run umbriel trade again", path.string(), why));
    };
    if (size > kMaxBytes) return bad("too long");
    std::ifstream stream(path, std::ios::binary);
    const Json json = Json::parse(stream, nullptr, false);
    if (json.is_discarded() || !json.is_object()) return bad("no JSON object");
    try {
        if (json.at("umbriel_trade").get<int>() != 1) return bad("of another version");
        StoredTrade trade;
        trade.scene = json.at("scene").get<std::string>();
        if (const std::string why = impossible(json.at("chosen")); !why.empty()) return bad(why);
        trade.chosen = pointOf(json.at("chosen"));
        for (const Json& point : json.at("front")) {
            if (const std::string why = impossible(point); !why.empty()) return bad(why);
            trade.front.push_back(pointOf(point));
        }
        return std::optional(std::move(trade));
    } catch (const nlohmann::json::exception& problem) {
        return bad(problem.what());
    }
}

StoredTrade storedTrade(const TradeResult& result, std::size_t chosen) {
    const auto point = [&](const TradeRow& row) {
        return StoredTrade::Point{row.setting, comparedError(row), row.cost.wallMilliseconds, row.cost.cpuMilliseconds};
    };
    StoredTrade trade;
    trade.scene = result.scene;
    trade.chosen = point(result.rows[chosen]);
    std::vector<StoredTrade::Point> points;
    for (const TradeRow& row : result.rows) points.push_back(point(row));
    std::stable_sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
        return std::pair(a.wallMilliseconds, a.error) < std::pair(b.wallMilliseconds, b.error);
    });
    // By wall time, which is what a budget is about.
    for (StoredTrade::Point& one : points)
        if (trade.front.empty() || one.error < trade.front.back().error) trade.front.push_back(std::move(one));
    return trade;
}

std::optional<TradeSetting> nextChoice(const StoredTrade& trade,
                                       const std::function<bool(const TradeSetting&)>& isPossible) {
    const StoredTrade::Point* best = nullptr;
    for (const StoredTrade::Point& point : trade.front) {
        if (!isPossible(point.setting)) continue;
        if (point.error <= trade.chosen.error) return point.setting;
        if (!best || point.error < best->error) best = &point;
    }
    return best ? std::optional(best->setting) : std::nullopt;
}

}  // namespace umbriel
