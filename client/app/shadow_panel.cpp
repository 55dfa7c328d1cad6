#include "client/app/shadow_panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "client/app/arguments.h"
#include "client/app/viewport_text.h"
#include "client/session/field_text.h"
#include "client/session/shadow_fit.h"
#include "common/scene/type_descriptor.h"

namespace umbriel {
namespace {

constexpr std::size_t kLines = 14;  // of fields; one more for what was typed
constexpr float kLineHeight = 16.0f;
constexpr float kLineStep = 20.0f;  // what hangs below a line stays clear of the next

const FieldDescriptor& descriptorOf(const Viewport& viewport, std::string_view name) {
    const auto& fields = viewport.type().fields;
    const auto found = std::find_if(fields.begin(), fields.end(),
                                    [&](const FieldDescriptor& field) { return field.name == name && !field.isMulti; });
    UMBRIEL_ASSERT(found != fields.end(), "the panel's fields are the viewport's");
    return *found;
}

template <class T>
T numberOf(const std::string& text) {
    T value{};
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
}

bool isMode(std::string_view name) {
    return name == "shadowMode" || name == "filteredMap";
}

// What a number of an enum means.
std::string meaningOf(std::string_view name, const std::string& value) {
    const auto number = numberOf<std::uint32_t>(value);
    if (isMode(name)) return std::string(briefOf(static_cast<ShadowMode>(number)));
    if (name == "show") return std::string(nameOf(static_cast<ShadowShow>(number)));
    if (name == "shadowFit") return std::string(nameOf(static_cast<ShadowFitMode>(number)));
    return {};
}

std::string stepped(const FieldDescriptor& field, const std::string& value, int steps) {
    if (field.kind == ElementKind::Bool) return steps % 2 != 0 ? (value == "true" ? "false" : "true") : value;
    if (field.enumCount > 0) {
        auto number = static_cast<std::int64_t>(numberOf<std::uint32_t>(value));
        const std::int64_t count = field.enumCount;
        for (int i = 0; i < std::abs(steps); ++i) do {
                number = (number + (steps > 0 ? 1 : count - 1)) % count;
            } while (isMode(field.name) && number != 0 && !isFitted(static_cast<ShadowMode>(number)));
        return std::to_string(number);
    }
    if (field.kind == ElementKind::U32) {
        auto number = static_cast<std::int64_t>(numberOf<std::uint32_t>(value));
        if (field.name == "mapSize")
            for (int i = 0; i < std::abs(steps); ++i)
                number = steps > 0 ? std::max<std::int64_t>(1, 2 * number) : number / 2;
        else
            number += steps;
        return std::to_string(std::clamp<std::int64_t>(number, 0, 1 << 20));
    }
    double number = numberOf<double>(value);
    for (int i = 0; i < std::abs(steps); ++i) {
        const bool grows = (steps > 0) == (number >= 0.0);
        if (std::abs(number) < 0.005)
            number = steps > 0 ? 0.01 : -0.01;
        else
            number = grows ? number * 1.25 : number / 1.25;
    }
    return fmt::format("{:.6g}", std::abs(number) < 0.005 ? 0.0 : number);
}

}  // namespace

ShadowPanel::ShadowPanel(Aspect& scene, Ref<Window> window, Ref<Viewport> viewport)
    : _scene(scene), _window(window), _viewport(viewport) {
    bool isShadow = false;  // from the first shadow field on, all are
    for (const FieldDescriptor& field : scene.get(viewport).type().fields) {
        isShadow = isShadow || field.name == "shadowMode";
        if (isShadow && fieldText(scene, viewport, field.name)) _fields.emplace_back(field.name);
    }
}

void ShadowPanel::toggle() {
    _isOpen = !_isOpen;
}

void ShadowPanel::choose(int fields) {
    const auto count = static_cast<int>(_fields.size());
    _chosen = static_cast<std::size_t>(((static_cast<int>(_chosen) + fields) % count + count) % count);
    _typed.clear();
    _message.clear();
}

void ShadowPanel::change(std::string_view value) {
    _message.clear();
    _lastField = field();
    _lastValue = *fieldText(_scene, _viewport, field());
    for (const Ref<Viewport>& viewport : _scene.get(_window).viewports.toVector())
        if (const auto done = setField(_scene, viewport, field(), value); !done) _message = done.error().message;
}

void ShadowPanel::step(int steps) {
    if (steps == 0) return;
    const FieldDescriptor& chosen = descriptorOf(_scene.get(_viewport), field());
    if (chosen.kind == ElementKind::Vec3 || chosen.kind == ElementKind::DVec3) {
        _message = "type three numbers x,y,z and Enter";
        return;
    }
    change(stepped(chosen, *fieldText(_scene, _viewport, field()), steps));
}

void ShadowPanel::type(std::string_view characters) {
    constexpr std::size_t kMost = 60;
    for (const char c : characters)
        if (c > ' ' && c <= '~' && _typed.size() < kMost) _typed += c;
}

void ShadowPanel::erase() {
    if (!_typed.empty()) _typed.pop_back();
}

void ShadowPanel::set() {
    if (_typed.empty()) return;
    std::string value;
    std::swap(value, _typed);
    // Modes, views and fits by their names, too.
    if (const auto text = viewportFieldText(field(), value))
        change(*text);
    else
        _message = text.error().message;
}

void ShadowPanel::refuse(const std::string& why) {
    if (_lastField.empty()) return;
    for (const Ref<Viewport>& viewport : _scene.get(_window).viewports.toVector())
        static_cast<void>(setField(_scene, viewport, _lastField, _lastValue));  // it had this value
    _lastField.clear();
    _message = why;
}

void ShadowPanel::show() {
    if (!_isOpen && _lines.empty()) return;
    if (_lines.empty())
        for (std::size_t i = 0; i <= kLines; ++i) {
            _lines.push_back(_scene.create<TextForeground>(fmt::format("panel {}", i)));
            _scene.edit(_lines.back())
                .set<&TextForeground::lowerLeft>(glm::vec2(8.0f, 8.0f + kLineStep * static_cast<float>(kLines - i)))
                .set<&TextForeground::height>(kLineHeight);
            _scene.edit(_viewport).append<&Viewport::foregrounds>(Ref<Container>(_lines.back().id));
        }
    const std::size_t first =
        std::min(_chosen < kLines / 2 ? 0 : _chosen - kLines / 2, _fields.size() - std::min(kLines, _fields.size()));
    for (std::size_t i = 0; i <= kLines; ++i) {
        std::string text;
        const bool isField = i < kLines && first + i < _fields.size();
        if (_isOpen && isField) {
            const std::string& name = _fields[first + i];
            const std::string value = *fieldText(_scene, _viewport, name);
            const std::string meaning = meaningOf(name, value);
            text = fmt::format("{} {} = {}", first + i == _chosen ? ">" : " ", name, meaning.empty() ? value : meaning);
        } else if (_isOpen && i == kLines) {
            text = _typed.empty() ? _message : fmt::format("{} = {}_", field(), _typed);
        }
        if (_scene.get(_lines[i]).text.get() == text) continue;
        const bool isChosen = isField && first + i == _chosen;
        _scene.edit(_lines[i]).set<&TextForeground::text>(text).set<&TextForeground::colour>(
            isChosen ? glm::vec4(1.0f, 0.8f, 0.2f, 1.0f) : glm::vec4(1.0f));
    }
}

}  // namespace umbriel
