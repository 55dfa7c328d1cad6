#include "client/app/trade_preset.h"

#include <fmt/format.h>

#include "client/app/trade_setting.h"

namespace umbriel {
namespace {

std::string shown(double value, FigureUnit unit) {
    return fmt::format("{:.4g}{}", value * unit.scale, unit.suffix);
}

}  // namespace

std::optional<double> errorOf(const TradeRow& row) {
    return row.errors.error.error();
}
std::optional<double> cpuOf(const TradeRow& row) {
    return row.cost.cpuMilliseconds;
}
std::optional<double> ratioOf(const TradeRow& row) {
    return row.cost.cpuRatio;
}
std::optional<double> texelOf(const TradeRow& row) {
    return row.errors.texelMetres;
}
Figure zoneErrorOf(std::size_t zone) {
    return [zone](const TradeRow& row) { return std::optional(row.errors.zoneErrors[zone]); };
}
Figure zoneTexelOf(std::size_t zone) {
    return [zone](const TradeRow& row) { return row.errors.zoneTexels[zone]; };
}
Figure zoneMissingOf(std::size_t zone) {
    return [zone](const TradeRow& row) { return row.errors.zoneMissing[zone]; };
}

std::optional<double> PresetOutcome::figure(std::size_t run, const std::string& label, const Figure& of) const {
    if (run >= results.size()) return std::nullopt;
    for (const TradeRow& row : results[run].rows)
        if (labelOf(row.setting) == label) return of(row);
    return std::nullopt;
}

void Expectations::add(const std::string& text, bool known, bool met, const std::string& figures,
                       const std::string& why, const std::string& whyNot) {
    if (!known)
        return open(text,
                    "needs a technique or a field that this version does not have, or a shadow that is not in view");
    Expectation one;
    one.text = text;
    one.state = met ? Expectation::State::Met : Expectation::State::NotMet;
    one.figures = figures;
    one.why = met || whyNot.empty() ? why : why.empty() ? whyNot : why + "; " + whyNot;
    _all.push_back(std::move(one));
}

void Expectations::open(const std::string& text, const std::string& reason) {
    Expectation one;
    one.text = text;
    one.figures = reason;
    _all.push_back(std::move(one));
}

void Expectations::less(const std::string& text, std::optional<double> a, std::optional<double> b, FigureUnit unit,
                        const std::string& why, const std::string& whyNot) {
    const bool known = a && b;
    add(text, known, known && *a < *b,
        known ? fmt::format("{} against {}", shown(*a, unit), shown(*b, unit)) : std::string(), why, whyNot);
}

void Expectations::atMost(const std::string& text, std::optional<double> a, double limit, FigureUnit unit,
                          const std::string& why, const std::string& whyNot) {
    add(text, a.has_value(), a && *a <= limit,
        a ? fmt::format("{}, at most {}", shown(*a, unit), shown(limit, unit)) : std::string(), why, whyNot);
}

void Expectations::atLeast(const std::string& text, std::optional<double> a, double limit, FigureUnit unit,
                           const std::string& why, const std::string& whyNot) {
    add(text, a.has_value(), a && *a >= limit,
        a ? fmt::format("{}, at least {}", shown(*a, unit), shown(limit, unit)) : std::string(), why, whyNot);
}

TradeSetting presetSetting(std::string technique, std::uint32_t mapSize, SettingFields fields) {
    const auto parsed = parseTechnique(technique);  // one that is none is refused where it is applied
    const bool mapped = !parsed || hasMap(parsed->mode);
    return {std::move(technique), mapSize, {}, {}, std::move(fields), mapped};
}

SceneArguments presetScene(const TradeArguments& arguments) {
    SceneArguments scene = arguments.scene;
    if (scene.scene.empty()) scene.scene = "demo:palms";
    return scene;
}

std::optional<double> ratio(std::optional<double> a, std::optional<double> b) {
    if (!a || !b || !(*b > 0.0)) return std::nullopt;
    return *a / *b;
}

std::optional<double> timesAtMost(double factor, std::optional<double> a) {
    if (!a) return std::nullopt;
    return factor * *a * (1.0 + 1e-12) + 1e-15;
}

}  // namespace umbriel
