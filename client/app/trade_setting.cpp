#include "client/app/trade_setting.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/app/arguments.h"
#include "client/app/light_map_drawing.h"
#include "client/app/viewport_text.h"
#include "client/session/field_text.h"

namespace umbriel {

std::vector<std::string> listOf(const std::string& text) {
    std::vector<std::string> parts;
    std::size_t begin = 0;
    while (begin <= text.size() && !text.empty()) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        parts.push_back(text.substr(begin, end - begin));
        begin = end + 1;
    }
    return parts;
}

Result<Technique> parseTechnique(const std::string& text) {
    Technique technique;
    const std::size_t colon = text.find(':');
    const auto mode = parseShadowMode(text.substr(0, colon));
    if (!mode) return mode.error();
    technique.mode = *mode;
    if (colon == std::string::npos) return technique;
    const std::string how = text.substr(colon + 1);
    const auto fit = parseShadowFit(how);
    if (!fit && *mode == ShadowMode::LightMap) {
        if (how == "rays") return technique;
        const auto from = parseBakedMode(how);
        if (!from) return badInput(fmt::format("technique '{}': {}", text, from.error().message));
        technique.bakedFrom = *from;
        return technique;
    }
    if (!fit) return badInput(fmt::format("technique '{}': {}", text, fit.error().message));
    technique.fit = *fit;
    return technique;
}

bool hasMap(ShadowMode mode) {
    switch (mode) {
        case ShadowMode::None:
        case ShadowMode::Planar:
        case ShadowMode::PlanarStencil:
        case ShadowMode::VolumeZPass:
        case ShadowMode::VolumeZFail:
        case ShadowMode::Blob:
        case ShadowMode::VisibilityMap:
            return false;
        default:
            return true;
    }
}

bool takesFilter(ShadowMode mode) {
    return mode == ShadowMode::PercentageCloser;
}

bool takesSamples(ShadowMode mode) {
    return mode == ShadowMode::PercentageCloser || mode == ShadowMode::PercentageCloserSoft;
}

bool isLightMap(const TradeSetting& setting) {
    const auto technique = parseTechnique(setting.technique);
    return technique && technique->mode == ShadowMode::LightMap;
}

Result<void> applySetting(Aspect& scene, Ref<Window> window, const TradeSetting& setting) {
    return SettingSwitch(scene, window).apply(setting);
}

void SettingSwitch::keep(ContainerId viewport, std::string_view name) {
    const Container* container = _scene->find(viewport);
    const auto& fields = container->type().fields;
    for (std::uint32_t i = 0; i < fields.size(); ++i) {
        if (fields[i].name != name || fields[i].isMulti || fields[i].kind == ElementKind::String) continue;
        const auto* value = static_cast<const std::byte*>(fields[i].address_(*container));
        _kept.push_back({viewport, i, {value, value + infoOf(fields[i].kind).size}});
    }
}

Result<void> SettingSwitch::apply(const TradeSetting& setting) {
    const auto technique = parseTechnique(setting.technique);
    if (!technique) return technique.error();
    // Backwards, so that of a field that was set twice the first value is put back.
    for (; !_kept.empty(); _kept.pop_back())
        if (_scene->find(_kept.back().viewport))
            RawEdit(*_scene).setSingle(_kept.back().viewport, _kept.back().field, _kept.back().value);
    for (const Ref<Viewport>& viewport : _scene->get(_window).viewports.toVector()) {
        _scene->edit(viewport)
            .set<&Viewport::shadowMode>(technique->mode)
            .set<&Viewport::shadowFit>(technique->fit.value_or(ShadowFitMode::Union))
            .set<&Viewport::mapSize>(setting.mapSize);
        const auto set = [&](std::string_view field, const std::string& value) {
            keep(viewport.id, field);
            return setField(*_scene, viewport, field, value);
        };
        if (setting.filter)
            if (const auto done = set("filterWidth", fmt::format("{}", *setting.filter)); !done) return done.error();
        if (setting.samples) {
            const bool soft = technique->mode == ShadowMode::PercentageCloserSoft;
            if (const auto done = set(soft ? "filterSamples" : "samplesPerRow", fmt::format("{}", *setting.samples));
                !done)
                return done.error();
        }
        for (const auto& [field, value] : setting.fields)
            if (const auto done = set(field, value); !done) return done.error();
    }
    return {};
}

}  // namespace umbriel
