#pragma once

#include <iosfwd>
#include <string>

#include "client/trade/trade_row.h"
#include "common/base/result.h"

namespace umbriel {

// The rows as text files. CSV: a line of names, a line a row. JSON: {scene, version, machine, size, judged_share,
// truth, rows: [{technique, map_size, filter, samples, error, leak, acne, ...}], notes}. An error is a share of the
// judged pixels; numbers that do not exist are null, in CSV empty.
std::string tradeCsv(const TradeResult& result);
std::string tradeJson(const TradeResult& result);

// One page that needs nothing else: the front as SVG, a table, and for each row thumbnails of result, truth and
// difference (red: lit where truth is dark, blue: dark where it is lit).
Result<std::string> tradeHtml(const TradeResult& result);

// For a terminal.
void printTrade(const TradeResult& result, std::ostream& out);

}  // namespace umbriel
