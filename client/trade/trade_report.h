#pragma once

#include <iosfwd>
#include <span>
#include <string>

#include "client/trade/expectation.h"
#include "client/trade/trade_row.h"
#include "common/base/result.h"

namespace umbriel {

// The rows as text files. CSV: a line of names, a line a row. JSON: {scene, version, machine, size, judged_share,
// truth, rows: [{technique, map_size, filter, samples, error, leak, acne, ...}], notes}. An error is a share of the
// judged pixels; numbers that do not exist are null, in CSV empty.
std::string tradeCsv(std::span<const TradeResult> results);
std::string tradeJson(const TradeResult& result);
// Of an experiment: {preset, runs: [as above], expected: [{text, state, figures, why}]}.
std::string tradeJson(const std::string& preset, std::span<const TradeResult> results,
                      std::span<const Expectation> expected);

// One page that needs nothing else: what was expected, and of each result the front as SVG, a table, and for each row
// thumbnails of result, truth and difference (red: lit where truth is dark, blue: dark where it is lit).
Result<std::string> tradeHtml(std::span<const TradeResult> results, std::span<const Expectation> expected = {});

// For a terminal: errors and costs; what is known by zones; costs alone; what was expected.
void printTrade(const TradeResult& result, std::ostream& out);
void printZones(const TradeResult& result, std::ostream& out);
void printCosts(const TradeResult& result, std::ostream& out);
void printExpectations(std::span<const Expectation> expected, std::ostream& out);

}  // namespace umbriel
