#include "client/app/arguments.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

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
    const auto pair = parsePair(text, 1 << 20);
    if (!pair) return expected(argument, text, "WIDTHxHEIGHT in pixels, each from 1 to 1048576, as in 1280x720");
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

Result<LightArgument> parseLight(std::string_view text) {
    constexpr std::string_view kForm =
        "dir:x,y,z or point:x,y,z or spot:x,y,z:dx,dy,dz:degrees, optionally followed by @r,g,b or @r,g,b,radius=m";
    LightArgument light;
    std::string_view geometry = text;
    if (const std::size_t at = text.find('@'); at != std::string_view::npos) {
        geometry = text.substr(0, at);
        std::string_view rest = text.substr(at + 1);
        if (const std::size_t radiusAt = rest.find(",radius="); radiusAt != std::string_view::npos) {
            const auto radius = toNumber<float>(rest.substr(radiusAt + 8));
            if (!radius || !std::isfinite(*radius) || *radius < 0.0f)
                return expected("--light", text, "a radius of 0 or more metres after 'radius='");
            light.radius = *radius;
            rest = rest.substr(0, radiusAt);
        }
        const auto power = parseVector("--light", rest);
        if (!power) return expected("--light", text, kForm);
        if (power->x < 0 || power->y < 0 || power->z < 0)
            return badInput(fmt::format("--light '{}': a light cannot take light away: r,g,b must be 0 or more", text));
        light.power = glm::vec3(*power);
        for (int i = 0; i < 3; ++i)
            if (!std::isfinite((*light.power)[i])) return expected("--light", text, "r,g,b within the range of a float");
    }
    const auto parts = split(geometry, ':');
    const auto direction = [&](std::string_view part) -> Result<glm::dvec3> {
        const auto vector = parseVector("--light", part);
        if (!vector) return expected("--light", text, kForm);
        // Scaled before its length is taken, so that 1e-300 and 1e300 are directions too.
        const double largest = std::max({std::abs(vector->x), std::abs(vector->y), std::abs(vector->z)});
        if (largest == 0.0)
            return badInput(fmt::format("--light '{}': the direction 0,0,0 points nowhere; give the way the light travels", text));
        return glm::normalize(*vector / largest);
    };
    if (parts[0] == "dir" && parts.size() == 2) {
        light.kind = LightArgument::Kind::Directional;
        const auto vector = direction(parts[1]);
        if (!vector) return vector.error();
        light.direction = *vector;
        return light;
    }
    const bool spot = parts[0] == "spot" && parts.size() == 4;
    if (!spot && !(parts[0] == "point" && parts.size() == 2)) return expected("--light", text, kForm);
    const auto position = parseVector("--light", parts[1]);
    if (!position) return expected("--light", text, kForm);
    light.kind = spot ? LightArgument::Kind::Spot : LightArgument::Kind::Point;
    light.position = *position;
    if (!spot) return light;
    const auto vector = direction(parts[2]);
    if (!vector) return vector.error();
    light.direction = *vector;
    const auto degrees = toNumber<double>(parts[3]);
    if (!degrees || !(*degrees > 0.0 && *degrees <= 180.0))
        return expected("--light", text, "a cone of more than 0 and at most 180 degrees (its full opening)");
    light.coneAngle = *degrees * std::numbers::pi / 180.0;
    return light;
}

Result<ShadowMode> parseShadowMode(std::string_view text) {
    for (const ModeName& known : kModes) {
        if (text != known.brief && text != known.enumName) continue;
        if (known.mode == ShadowMode::None || known.mode == ShadowMode::Standard) return known.mode;
        return badInput(fmt::format("--shadow '{}': this version draws 'none' and 'std' only", text));
    }
    return badInput(fmt::format("--shadow '{}': unknown shadow mode; this version draws 'none' and 'std'", text));
}

std::vector<std::string> drawnShadowModes() {
    std::vector<std::string> names;
    for (const ModeName& known : kModes)
        if (parseShadowMode(known.brief)) names.emplace_back(known.brief);
    return names;
}

Result<std::vector<ServerAddress>> parseServers(std::string_view text) {
    constexpr std::string_view kForm = "HOST:PORT or NAME=HOST:PORT, separated by commas, ports from 1 to 65535";
    std::vector<ServerAddress> servers;
    for (std::string_view part : split(text, ',')) {
        ServerAddress server;
        if (const std::size_t equals = part.find('='); equals != std::string_view::npos) {
            server.name = part.substr(0, equals);
            part.remove_prefix(equals + 1);
            if (server.name.empty()) return expected("--servers", text, kForm);
        }
        const std::size_t colon = part.rfind(':');
        if (colon == std::string_view::npos || colon == 0) return expected("--servers", text, kForm);
        const auto port = toNumber<std::uint16_t>(part.substr(colon + 1));
        if (!port || *port == 0) return expected("--servers", text, kForm);
        std::string_view host = part.substr(0, colon);
        if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
        server.host = host;
        server.port = *port;
        servers.push_back(std::move(server));
    }
    return servers;
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
