#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/trade/trade_row.h"
#include "common/base/result.h"

namespace umbriel {

// What `umbriel trade` stores beside a scene: the setting that was chosen, and the measured front to step along.
struct StoredTrade {
    struct Point {
        TradeSetting setting;
        double error = 0.0;
        double wallMilliseconds = 0.0;
        double cpuMilliseconds = 0.0;
    };
    std::string scene;
    Point chosen;
    std::vector<Point> front;  // ascending by wallMilliseconds
};

// SCENE.umtrade.json beside a file; for a procedural scene ("demo:city?n=50") in the working folder, with what a file's
// name should not have replaced by '-'.
std::filesystem::path tradeFileOf(const std::string& scene);

// Appears whole or not at all.
Result<void> writeTrade(const std::filesystem::path& path, const StoredTrade& trade);
// Nothing when there is no such file; bad input, naming it, when it is not what writeTrade() writes.
Result<std::optional<StoredTrade>> readTrade(const std::filesystem::path& path);

// What to draw with when what was chosen cannot be: of the points of the front that can, the cheapest that is no more
// wrong, else the most accurate. None when there is none.
std::optional<TradeSetting> nextChoice(const StoredTrade& trade,
                                       const std::function<bool(const TradeSetting&)>& isPossible);

// What of a result goes into its file: the front, and the row that was chosen by its index.
StoredTrade storedTrade(const TradeResult& result, std::size_t chosen);

}  // namespace umbriel
