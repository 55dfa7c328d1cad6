#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/app/trade_command.h"
#include "client/trade/expectation.h"
#include "client/trade/trade_row.h"

namespace umbriel {

// One table of an experiment: settings in one view of one scene.
struct PresetRun {
    std::string title;
    SceneArguments scene = {};
    std::string camera = {};  // of the scene; empty: its first. Arguments of the command line come first
    std::vector<TradeSetting> settings = {};
    std::string judge = {};
    bool bothSides = false;
    std::optional<double> lightSize = {};
    double scale = 1.0;   // of everything, the camera's near plane with it
    double offset = 0.0;  // metres along each axis, after that
    bool errors = true;   // false: cost only
    int frames = 12;
};

// What a figure is called, and how it is shown.
struct FigureUnit {
    double scale = 1.0;
    const char* suffix = "";
};
inline constexpr FigureUnit kPercent{100.0, " %"}, kMilliseconds{1.0, " ms"}, kTimes{1.0, " x"}, kPixels{1.0, " px"},
    kMetres{1.0, " m"}, kPlain{1.0, ""};

// A figure of a row, when there is one.
using Figure = std::function<std::optional<double>(const TradeRow&)>;
std::optional<double> errorOf(const TradeRow& row);
std::optional<double> cpuOf(const TradeRow& row);
std::optional<double> ratioOf(const TradeRow& row);  // of processor time, paired, to the first setting
std::optional<double> texelOf(const TradeRow& row);  // metres, seen along the light
Figure zoneErrorOf(std::size_t zone);                // 0 near, 1 middle, 2 far
Figure zoneTexelOf(std::size_t zone);                // pixels
Figure zoneMissingOf(std::size_t zone);              // of its dark pixels, the share that is lit

// Runs and their tables.
struct PresetOutcome {
    std::vector<PresetRun> runs;
    std::vector<TradeResult> results;
    std::set<std::string> missing;  // techniques and fields that are not in this version

    // Of the row with this label (labelOf()); none when it was not drawn.
    std::optional<double> figure(std::size_t run, const std::string& label, const Figure& of) const;
};

// What is expected of an outcome, in the order it is said. A figure that is not there leaves it open.
class Expectations {
 public:
    // a < b. why: what is known to cause what is seen, when it is met too; whyNot only when it is not.
    void less(const std::string& text, std::optional<double> a, std::optional<double> b, FigureUnit unit = kPercent,
              const std::string& why = {}, const std::string& whyNot = {});
    void atMost(const std::string& text, std::optional<double> a, double limit, FigureUnit unit = kPercent,
                const std::string& why = {}, const std::string& whyNot = {});
    void atLeast(const std::string& text, std::optional<double> a, double limit, FigureUnit unit = kPercent,
                 const std::string& why = {}, const std::string& whyNot = {});
    // Neither: what the figures cannot say here.
    void open(const std::string& text, const std::string& reason);
    std::vector<Expectation> take() { return std::move(_all); }

 private:
    void add(const std::string& text, bool known, bool met, const std::string& figures, const std::string& why,
             const std::string& whyNot);
    std::vector<Expectation> _all;
};

// An experiment: its runs, from the command line, and what is expected of them.
struct TradePreset {
    std::string name;
    std::string about;
    std::vector<PresetRun> (*runs)(const TradeArguments& arguments);
    void (*judge)(const PresetOutcome& outcome, Expectations& expect);
};
std::vector<TradePreset> hardShadowPresets();   // Hempe 2005, 10.1
std::vector<TradePreset> softShadowPresets();   // 10.2
std::vector<TradePreset> shadowCostPresets();   // 4.2, 11; Ganster 2002, 1.3
std::vector<TradePreset> shadowLimitPresets();  // our own: convergence, extremes

// Shorthand of the experiments.
using SettingFields = std::vector<std::pair<std::string, std::string>>;
TradeSetting presetSetting(std::string technique, std::uint32_t mapSize, SettingFields fields = {});
// The command line's scene; demo:palms when it has none.
SceneArguments presetScene(const TradeArguments& arguments);
// a / b.
std::optional<double> ratio(std::optional<double> a, std::optional<double> b);
// factor * a, a little more so that what is equal counts as less.
std::optional<double> timesAtMost(double factor, std::optional<double> a);

}  // namespace umbriel
