#include "client/app/viewport_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "client/app/arguments.h"

namespace umbriel {
namespace {

constexpr std::array<std::string_view, kEnumCount<ShadowFitMode>> kFits = {"union", "scene", "per-view"};

template <class Named>
Result<std::string> numberOf(const Result<Named>& named) {
    if (!named) return named.error();
    return std::to_string(static_cast<std::uint32_t>(*named));
}

}  // namespace

Result<ShadowFitMode> parseShadowFit(std::string_view text) {
    const auto found = std::ranges::find(kFits, text);
    if (found == kFits.end()) return badInput(fmt::format("'{}' is no fit; expected union, scene or per-view", text));
    return static_cast<ShadowFitMode>(found - kFits.begin());
}

std::string_view nameOf(ShadowFitMode fit) {
    return kFits[static_cast<std::size_t>(fit)];
}

Result<std::string> viewportFieldText(std::string_view field, std::string_view value) {
    const bool isNumber = !value.empty() && std::ranges::all_of(value, [](char c) { return c >= '0' && c <= '9'; });
    if (isNumber) return std::string(value);
    if (field == "shadowMode" || field == "filteredMap") return numberOf(parseShadowMode(value));
    if (field == "show") return numberOf(parseShow(value));
    if (field == "shadowFit") return numberOf(parseShadowFit(value));
    return std::string(value);
}

}  // namespace umbriel
