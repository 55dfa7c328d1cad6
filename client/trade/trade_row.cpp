#include "client/trade/trade_row.h"

#include <fmt/format.h>

#include <algorithm>

namespace umbriel {

std::string labelOf(const TradeSetting& setting) {
    std::string label = setting.technique;
    if (setting.hasMap) label += fmt::format(" {}", setting.mapSize);
    if (setting.filter) label += fmt::format(" w{:g}", *setting.filter);
    if (setting.samples) label += fmt::format(" n{}", *setting.samples);
    for (const auto& [field, value] : setting.fields) label += fmt::format(" {}={}", field, value);
    return label;
}

double comparedError(const TradeRow& row) {
    return row.errors.errorEverywhere.value_or(row.errors.error.error());
}

std::vector<std::size_t> paretoFront(const std::vector<TradeRow>& rows) {
    std::vector<std::size_t> order(rows.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    const auto cost = [&](std::size_t i) { return rows[i].cost.cpuMilliseconds; };
    const auto error = [&](std::size_t i) { return comparedError(rows[i]); };
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        if (cost(a) != cost(b)) return cost(a) < cost(b);
        if (error(a) != error(b)) return error(a) < error(b);
        return a < b;
    });
    std::vector<std::size_t> front;
    for (const std::size_t i : order)
        if (front.empty() || error(i) < error(front.back())) front.push_back(i);
    return front;
}

std::optional<std::size_t> choose(const std::vector<TradeRow>& rows, std::optional<double> maxError,
                                  std::optional<double> budgetMilliseconds) {
    std::optional<std::size_t> best;
    const auto better = [&](const TradeRow& a, const TradeRow& b) {
        if (maxError && a.cost.cpuMilliseconds != b.cost.cpuMilliseconds)
            return a.cost.cpuMilliseconds < b.cost.cpuMilliseconds;
        if (comparedError(a) != comparedError(b)) return comparedError(a) < comparedError(b);
        return a.cost.cpuMilliseconds < b.cost.cpuMilliseconds;
    };
    for (std::size_t i = 0; i < rows.size(); ++i) {
        if (maxError && comparedError(rows[i]) > *maxError) continue;
        if (budgetMilliseconds && rows[i].cost.wallMilliseconds > *budgetMilliseconds) continue;
        if (!best || better(rows[i], rows[*best])) best = i;
    }
    return best;
}

}  // namespace umbriel
