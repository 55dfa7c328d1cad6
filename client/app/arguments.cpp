#include "client/app/arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

#include "client/session/shadow_fit.h"
#include "common/base/host_port.h"

namespace umbriel {
namespace {

std::vector<std::string_view> split(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    for (;;) {
        const std::size_t end = text.find(separator);
        parts.push_back(text.substr(0, end));
        if (end == std::string_view::npos) return parts;
        text.remove_prefix(end + 1);
    }
}

template <class Number>
std::optional<Number> toNumber(std::string_view text) {
    Number value{};
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

Error expected(std::string_view argument, std::string_view given, std::string_view form) {
    return badInput(fmt::format("{} '{}': expected {}", argument, given, form));
}

struct Pair {
    std::int32_t first, second;
};

std::optional<Pair> parsePair(std::string_view text, std::int32_t limit) {
    const auto parts = split(text, 'x');
    if (parts.size() != 2) return std::nullopt;
    const auto first = toNumber<std::int32_t>(parts[0]);
    const auto second = toNumber<std::int32_t>(parts[1]);
    if (!first || !second || *first < 1 || *second < 1 || *first > limit || *second > limit) return std::nullopt;
    return Pair{*first, *second};
}

struct ModeName {
    ShadowMode mode;
    std::string_view brief;
    std::string_view enumName;
};

constexpr std::array<ModeName, 16> kModes{{
    {ShadowMode::None, "none", "NO_SHADOW"},
    {ShadowMode::Standard, "std", "STD_SHADOW_MAP"},
    {ShadowMode::Perspective, "psm", "PERSPECTIVE_SHADOW_MAP"},
    {ShadowMode::LightSpacePerspective, "lisp", "LISP_SHADOW_MAP"},
    {ShadowMode::Trapezoid, "trapez", "TRAPEZ_SHADOW_MAP"},
    {ShadowMode::PercentageCloser, "pcf", "PCF_SHADOW_MAP"},
    {ShadowMode::PercentageCloserSoft, "ppcf", "PPCF_SHADOW_MAP"},
    {ShadowMode::Planar, "planar", "PLANAR"},
    {ShadowMode::PlanarStencil, "planar-stencil", "PLANAR_STENCIL"},
    {ShadowMode::VolumeZPass, "zpass", "VOLUME_ZPASS"},
    {ShadowMode::VolumeZFail, "zfail", "VOLUME_ZFAIL"},
    {ShadowMode::Blob, "blob", "BLOB"},
    {ShadowMode::LightMap, "light-map", "LIGHT_MAP"},
    {ShadowMode::DualParaboloid, "dual-paraboloid", "DUAL_PARABOLOID"},
    {ShadowMode::Cube, "cube", "CUBE_SHADOW_MAP"},
    {ShadowMode::VisibilityMap, "visibility-map", "VISIBILITY_MAP"},
}};

}  // namespace

Result<PixelSize> parseSize(std::string_view argument, std::string_view text) {
    const auto pair = parsePair(text, 65536);
    if (!pair) return expected(argument, text, "WIDTHxHEIGHT in pixels, each from 1 to 65536, as in 1280x720");
    return PixelSize{pair->first, pair->second};
}

Result<GridArgument> parseGrid(std::string_view argument, std::string_view text) {
    const auto pair = parsePair(text, 65536);
    if (!pair) return expected(argument, text, "COLUMNSxROWS, each from 1 to 65536, as in 3x2");
    return GridArgument{pair->first, pair->second};
}

Result<protocol::FailurePolicy> parsePolicy(std::string_view argument, std::string_view text) {
    if (text == "wait") return protocol::FailurePolicy::Wait;
    if (text == "strict") return protocol::FailurePolicy::Strict;
    if (text == "degrade") return protocol::FailurePolicy::Degrade;
    return expected(argument, text, "wait, strict or degrade");
}

Result<glm::dvec2> parseWallSize(std::string_view text) {
    const auto parts = split(text, 'x');
    glm::dvec2 size{0.0};
    for (int i = 0; i < 2 && parts.size() == 2; ++i)
        size[i] = toNumber<double>(parts[static_cast<std::size_t>(i)]).value_or(0.0);
    if (!(size.x > 0.0 && size.y > 0.0 && size.x < 1e6 && size.y < 1e6))
        return expected("--wall-size", text, "WIDTHxHEIGHT in metres, as in 3.2x1.8");
    return size;
}

Result<EnvironmentArgument> parseEnvironment(std::string_view text) {
    EnvironmentArgument result;
    constexpr std::string_view kCapture = "capture";
    if (text.substr(0, kCapture.size()) != kCapture ||
        (text.size() > kCapture.size() && text[kCapture.size()] != ':')) {
        result.file = text;
        return result;
    }
    const auto parts = split(text, ':');
    if (parts.size() < 2 || parts.size() > 3)
        return expected("--environment", text, "a file or capture:x,y,z[:times], as in capture:0,1,0:2");
    const auto position = parseVector("--environment", parts[1]);
    if (!position) return position.error();
    result.position = *position;
    if (parts.size() == 3) {
        const auto times = toNumber<int>(parts[2]);
        if (!times || *times < 1 || *times > 8) return expected("--environment", text, "1 to 8 captures");
        result.times = *times;
    }
    return result;
}

Result<double> parseNumber(std::string_view argument, std::string_view text) {
    const auto value = toNumber<double>(text);
    if (!value || !std::isfinite(*value)) return expected(argument, text, "a finite number");
    return *value;
}

Result<glm::dvec3> parseVector(std::string_view argument, std::string_view text) {
    const auto parts = split(text, ',');
    glm::dvec3 vector{0.0};
    if (parts.size() != 3) return expected(argument, text, "three numbers x,y,z");
    for (int i = 0; i < 3; ++i) {
        const auto value = toNumber<double>(parts[static_cast<std::size_t>(i)]);
        if (!value || !std::isfinite(*value)) return expected(argument, text, "three finite numbers x,y,z");
        vector[i] = *value;
    }
    return vector;
}

Result<glm::vec3> parseColour(std::string_view argument, std::string_view text) {
    const auto colour = parseVector(argument, text);
    for (int i = 0; i < 3; ++i)
        if (!colour || !((*colour)[i] >= 0.0 && (*colour)[i] <= 1e30))
            return expected(argument, text, "r,g,b, each from 0 to 1e30");
    return glm::vec3(*colour);
}

namespace {

constexpr std::string_view kLightForm =
    "dir:x,y,z or point:x,y,z or spot:x,y,z:dx,dy,dz:degrees or goniometric:FILE:x,y,z:dx,dy,dz, optionally followed "
    "by "
    "@r,g,b or @r,g,b,radius=m or other KEY=VALUE";

Result<void> parseLightOption(std::string_view text, std::string_view key, std::string_view value,
                              LightArgument& light) {
    const bool isSpot = light.kind == LightArgument::Kind::Spot;
    const bool isWeb = light.kind == LightArgument::Kind::Goniometric;
    const bool isSun = light.kind == LightArgument::Kind::Directional;
    const auto number = toNumber<float>(value);
    const bool isPositive = number && std::isfinite(*number) && *number >= 0.0f;
    const auto take = [&](auto& into, float limit, std::string_view form) -> Result<void> {
        if (!isPositive || *number > limit) return expected("--light", text, form);
        into = *number;
        return {};
    };
    if (key == "radius") return take(light.radius, 1e19f, "a radius of 0 or more metres after 'radius='");
    if (key == "ambient") return take(light.ambientShare, 1e6f, "a share of 0 or more after 'ambient='");
    if (key == "highlight") return take(light.highlightShare, 1e6f, "a share of 0 or more after 'highlight='");
    if (isSpot && (key == "exponent" || key == "product")) {
        light.isProduct = key == "product";
        return take(light.exponent, 1e6f, "an exponent from 0 to 1e6 after 'exponent=' or 'product='");
    }
    if (isWeb && key == "scale") return take(light.scale, 1e30f, "W/sr for a candela of the file after 'scale='");
    if (isWeb && key == "turn") {
        if (!number || !std::isfinite(*number)) return expected("--light", text, "degrees after 'turn='");
        light.turn = static_cast<double>(*number) * std::numbers::pi / 180.0;
        return {};
    }
    if (!isSun && key == "attenuation") {
        const auto parts = split(value, '/');
        glm::vec3 factors(-1.0f);
        for (int i = 0; i < 3 && parts.size() == 3; ++i)
            factors[i] = toNumber<float>(parts[static_cast<std::size_t>(i)]).value_or(-1.0f);
        for (int i = 0; i < 3; ++i)
            if (!(factors[i] >= 0.0f && factors[i] <= 1e30f))
                return expected("--light", text, "three factors of 0 or more, KC/KL/KQ, after 'attenuation='");
        light.attenuation = factors;
        return {};
    }
    return badInput(fmt::format("--light '{}': this kind of light has no '{}'", text, key));
}

// What stands behind the '@': three numbers, then KEY=VALUE; either may be missing.
Result<void> parseLightOptions(std::string_view text, std::string_view rest, LightArgument& light) {
    const auto parts = split(rest, ',');
    std::size_t next = 0;
    if (!parts.empty() && parts[0].find('=') == std::string_view::npos) {
        const std::size_t third = parts.size() < 3 ? 0 : static_cast<std::size_t>(parts[2].data() - rest.data());
        const auto power = parseVector("--light", parts.size() < 3 ? rest : rest.substr(0, third + parts[2].size()));
        if (!power) return expected("--light", text, kLightForm);
        if (power->x < 0 || power->y < 0 || power->z < 0)
            return badInput(fmt::format("--light '{}': a light cannot take light away: r,g,b must be 0 or more", text));
        light.power = glm::vec3(*power);
        for (int i = 0; i < 3; ++i)
            if (!std::isfinite((*light.power)[i])) return expected("--light", text, "r,g,b within the range of a float");
        next = 3;
    }
    for (; next < parts.size(); ++next) {
        const std::size_t equals = parts[next].find('=');
        if (equals == std::string_view::npos) return expected("--light", text, kLightForm);
        const auto option =
            parseLightOption(text, parts[next].substr(0, equals), parts[next].substr(equals + 1), light);
        if (!option) return option;
    }
    return {};
}

// Unit. Scaled before its length is taken, so that 1e-300 and 1e300 are directions too.
Result<glm::dvec3> parseLightDirection(std::string_view text, std::string_view part) {
    const auto vector = parseVector("--light", part);
    if (!vector) return expected("--light", text, kLightForm);
    const double largest = std::max({std::abs(vector->x), std::abs(vector->y), std::abs(vector->z)});
    if (largest == 0.0)
        return badInput(
            fmt::format("--light '{}': the direction 0,0,0 points nowhere; give the way the light travels", text));
    return glm::normalize(*vector / largest);
}

// What stands before the '@'.
Result<void> parseLightPlace(std::string_view text, std::string_view place, LightArgument& light) {
    using Kind = LightArgument::Kind;
    const auto parts = split(place, ':');
    const std::size_t count = parts.size();
    if (parts[0] == "dir" && count == 2)
        light.kind = Kind::Directional;
    else if (parts[0] == "point" && count == 2)
        light.kind = Kind::Point;
    else if (parts[0] == "spot" && count == 4)
        light.kind = Kind::Spot;
    else if (parts[0] == "goniometric" && count >= 4)
        light.kind = Kind::Goniometric;
    else
        return expected("--light", text, kLightForm);
    if (light.kind == Kind::Goniometric) {
        // The name is what is left when both vectors are taken off the end: it may hold colons.
        const auto begin = static_cast<std::size_t>(parts[1].data() - place.data());
        const auto end = static_cast<std::size_t>(parts[count - 2].data() - place.data()) - 1;
        light.file = place.substr(begin, end - begin);
    }
    if (light.kind != Kind::Directional) {
        const auto position = parseVector("--light", parts[light.kind == Kind::Goniometric ? count - 2 : 1]);
        if (!position) return expected("--light", text, kLightForm);
        light.position = *position;
    }
    if (light.kind != Kind::Point) {
        const std::size_t which = light.kind == Kind::Spot ? 2 : count - 1;
        const auto vector = parseLightDirection(text, parts[which]);
        if (!vector) return vector.error();
        light.direction = *vector;
    }
    if (light.kind != Kind::Spot) return {};
    const auto degrees = toNumber<double>(parts[3]);
    if (!degrees || !(*degrees > 0.0 && *degrees <= 360.0))
        return expected("--light", text, "a cone of more than 0 and at most 180 degrees (its full opening)");
    light.coneAngle = *degrees * std::numbers::pi / 180.0;
    return {};
}

}  // namespace

Result<LightArgument> parseLight(std::string_view text) {
    LightArgument light;
    // From the end: names of files may hold an '@' of their own.
    const std::size_t at = text.rfind('@');
    const bool hasOptions = at != std::string_view::npos && text.find(':', at) == std::string_view::npos;
    if (auto place = parseLightPlace(text, hasOptions ? text.substr(0, at) : text, light); !place) return place.error();
    if (hasOptions)
        if (auto options = parseLightOptions(text, text.substr(at + 1), light); !options) return options.error();
    // Only the exponent's cone may be wider than a half space.
    if (light.kind == LightArgument::Kind::Spot && !light.exponent && light.coneAngle > std::numbers::pi)
        return expected("--light", text, "a cone of more than 0 and at most 180 degrees (its full opening)");
    return light;
}

std::string_view briefOf(ShadowMode mode) {
    return kModes[static_cast<std::size_t>(mode)].brief;
}

std::string drawnModes() {
    std::string names;
    for (const ModeName& known : kModes)
        if (known.mode == ShadowMode::None || isFitted(known.mode))
            names += (names.empty() ? "" : ", ") + std::string(known.brief);
    return names;
}

Result<ShadowMode> parseShadowMode(std::string_view text) {
    for (const ModeName& known : kModes) {
        if (text != known.brief && text != known.enumName) continue;
        if (known.mode == ShadowMode::None || isFitted(known.mode)) return known.mode;
        return badInput(fmt::format("--shadow '{}': this version draws {} only", text, drawnModes()));
    }
    return badInput(fmt::format("--shadow '{}': unknown shadow mode; this version draws {}", text, drawnModes()));
}

namespace {
constexpr std::array<std::string_view, kEnumCount<ShadowShow>> kShows = {
    "picture", "light-view", "shadow-map", "color-map", "factor-map", "edge-map", "seen-area"};
}  // namespace

Result<ShadowShow> parseShow(std::string_view text) {
    std::string names;
    for (std::size_t i = 0; i < kShows.size(); ++i) {
        if (text == kShows[i]) return static_cast<ShadowShow>(i);
        names += (names.empty() ? "" : ", ") + std::string(kShows[i]);
    }
    return badInput(fmt::format("--show '{}': expected one of {}", text, names));
}

std::string_view nameOf(ShadowShow show) {
    return kShows[static_cast<std::size_t>(show)];
}

std::vector<std::string> drawnShadowModes() {
    std::vector<std::string> names;
    for (const ModeName& known : kModes)
        if (parseShadowMode(known.brief)) names.emplace_back(known.brief);
    return names;
}

namespace {

std::optional<ServerAddress> parseAddress(std::string_view text, bool mayBeZero) {
    auto address = parseHostPort(text, mayBeZero);
    if (!address) return std::nullopt;
    return ServerAddress{{}, std::move(address->host), address->port};
}

}  // namespace

Result<std::vector<ServerAddress>> parseServers(std::string_view text, bool namesOnly) {
    constexpr std::string_view kForm =
        "HOST:PORT or NAME=HOST:PORT, separated by commas, ports from 1 to 65535, an IPv6 address in "
        "brackets as in [::1]:7420; with --listen also NAME";
    std::vector<ServerAddress> servers;
    for (std::string_view part : split(text, ',')) {
        std::string name;
        if (const std::size_t equals = part.find('='); equals != std::string_view::npos) {
            name = part.substr(0, equals);
            part.remove_prefix(equals + 1);
            if (name.empty()) return expected("--servers", text, kForm);
        } else if (namesOnly && !part.empty() && part.find(':') == std::string_view::npos) {
            servers.push_back({std::string(part), {}, 0});
            continue;
        }
        auto server = parseAddress(part, false);
        if (!server) return expected("--servers", text, kForm);
        server->name = std::move(name);
        servers.push_back(std::move(*server));
    }
    for (auto one = servers.begin(); one != servers.end(); ++one) {
        const bool isTwice = std::any_of(servers.begin(), one, [&](const ServerAddress& other) {
            return (!one->name.empty() && one->name == other.name) ||
                   (!one->host.empty() && one->host == other.host && one->port == other.port);
        });
        if (isTwice)
            return expected("--servers", text,
                            fmt::format("every server once, and {} is there twice",
                                        one->name.empty() ? hostPortText(one->host, one->port) : one->name));
    }
    return servers;
}

Result<ServerAddress> parseListen(std::string_view text) {
    const auto address = parseAddress(text, true);
    if (!address) return expected("--listen", text, "HOST:PORT, for example 127.0.0.1:7421 or [::1]:7421");
    return *address;
}

Result<ColourPrecision> parseColourBits(int bits) {
    switch (bits) {
        case 8:
            return ColourPrecision::Byte;
        case 16:
            return ColourPrecision::Half;
        case 32:
            return ColourPrecision::Float;
        default:
            return badInput(fmt::format("--colour-bits {}: expected 8, 16 or 32", bits));
    }
}

Result<std::uint32_t> parseLayers(std::string_view text) {
    constexpr std::array<std::pair<std::string_view, Layer>, 6> kLayers{{{"colour", Layer::Colour},
                                                                         {"depth", Layer::Depth},
                                                                         {"position", Layer::Position},
                                                                         {"normal", Layer::Normal},
                                                                         {"ids", Layer::Ids},
                                                                         {"light", Layer::LightFactors}}};
    std::uint32_t mask = static_cast<std::uint32_t>(Layer::Colour);
    for (const std::string_view part : split(text, ',')) {
        bool known = false;
        for (const auto& [name, layer] : kLayers) {
            if (name != part) continue;
            mask |= static_cast<std::uint32_t>(layer);
            known = true;
        }
        if (!known) return expected("--layers", text, "names out of depth, position, normal, ids, light, separated by commas");
    }
    return mask;
}

}  // namespace umbriel
