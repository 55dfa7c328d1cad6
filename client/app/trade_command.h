#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/app/render_command.h"
#include "client/trade/expectation.h"
#include "client/trade/trade_row.h"

namespace umbriel {

// The command line of `umbriel trade`.
struct TradeArguments {
    SceneArguments scene;
    std::string techniques;  // "std,std:scene,lisp"; empty: all this version draws
    std::string mapSizes = "512,1024,2048";
    std::string filters;                 // filter widths of PCF; empty: its own
    std::string samples;                 // samples a row; empty: the technique's own
    int frames = 12;                     // timed, for each row
    std::optional<double> lightSize;
    int lightSamples = 256;
    std::string judge;  // a node's name
    bool bothSides = false;
    int flicker = 0;                 // frames
    std::optional<double> maxError;  // a share
    std::optional<double> budget;    // milliseconds of wall time
    bool store = false;
    std::string preset;
    std::vector<std::string> out;  // .csv, .json, .html
    bool json = false;
};

// umbriel trade (docs/commands.md). Exit code 0, 1 or 2.
int runTrade(const TradeArguments& arguments, const std::filesystem::path& serverProgram, std::ostream& out);

// Results as files by the ends of their names: .csv, .json, else a page; what was expected goes into the last two. Of a
// preset JSON is an object with its name.
Result<void> writeTradeReports(const std::vector<std::string>& outs, std::span<const TradeResult> results,
                               std::span<const Expectation> expected, const std::string& preset = {});

// The names of the presets, with what each is about, one a line.
std::string tradePresets();

}  // namespace umbriel
