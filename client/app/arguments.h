#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/session/cluster.h"
#include "common/base/result.h"
#include "common/math/glm.h"
#include "common/math/pixel_rect.h"
#include "common/protocol/failure_policy.h"
#include "common/scene/windows.h"
#include "common/wall/view.h"

namespace umbriel {

// Parsers of what users type. Every error names the argument, what was given, and what is expected.

// "CxR": how many tiles a wall is cut into.
struct GridArgument {
    std::int32_t columns = 1;
    std::int32_t rows = 1;
};

// One --light: a direction the light travels, a position, or both, as `dir:`, `point:`, `spot:` and `goniometric:` say.
struct LightArgument {
    enum class Kind { Directional, Point, Spot, Goniometric };
    Kind kind = Kind::Directional;
    glm::dvec3 position{0.0};             // metres, point and spot
    glm::dvec3 direction{0.0, 0.0, -1.0}; // unit length, the way the light travels, directional and spot
    double coneAngle = 0.0;               // radians, full opening of the cone, spot
    std::optional<glm::vec3> power;       // W/m^2 (directional) or W/sr; none: chosen from the scene
    float radius = 0.0f;                  // metres
    std::optional<glm::vec3> attenuation;  // kc, kl, kq of the artist's; none: 1/d^2
    std::optional<float> exponent;         // of a spot that falls off with a power; none: a soft edge
    bool isProduct = false;                // that power is clamped with the attenuation, not cut at the cone
    float ambientShare = 0.0f;
    float highlightShare = 1.0f;
    std::string file;            // goniometric: .ies or .ldt
    double turn = 0.0;           // goniometric: radians about its axis
    std::optional<float> scale;  // goniometric: W/sr for a candela of the file
};

// One --environment: a file, or where the scene is captured.
struct EnvironmentArgument {
    std::string file;          // empty: captured
    glm::dvec3 position{0.0};  // metres
    int times = 1;
};
Result<EnvironmentArgument> parseEnvironment(std::string_view text);

// "1280x720": both 1 to 65536, as a wall has at most.
Result<PixelSize> parseSize(std::string_view argument, std::string_view text);
// "3x1", columns x rows.
Result<GridArgument> parseGrid(std::string_view argument, std::string_view text);
// "wait", "strict", "degrade".
Result<protocol::FailurePolicy> parsePolicy(std::string_view argument, std::string_view text);
// "3.2x1.8", metres.
Result<glm::dvec2> parseWallSize(std::string_view text);
// "1,2.5,-3": finite numbers.
Result<glm::dvec3> parseVector(std::string_view argument, std::string_view text);
// "0.5,1,2": linear radiance or colour, each 0 to 1e30, which a float holds.
Result<glm::vec3> parseColour(std::string_view argument, std::string_view text);
Result<double> parseNumber(std::string_view argument, std::string_view text);
// "dir:x,y,z", "point:x,y,z", "spot:x,y,z:dx,dy,dz:deg", "goniometric:FILE:x,y,z:dx,dy,dz", each with an optional
// "@[r,g,b][,key=value...]": radius, attenuation, exponent, product, ambient, highlight, turn, scale
// (docs/commands.md).
Result<LightArgument> parseLight(std::string_view text);
// The names of the shadow modes that this version draws, as in "none, std, lisp".
std::string drawnModes();
// Short or enum name, as in "std" or "STD_SHADOW_MAP"; a mode this version does not draw is refused as such.
Result<ShadowMode> parseShadowMode(std::string_view text);
// "std" of STD_SHADOW_MAP.
std::string_view briefOf(ShadowMode mode);
// The short names of the modes this version draws, in the order of ShadowMode, "none" first.
std::vector<std::string> drawnShadowModes();
// "shadow-map" and the other names of ShadowShow.
Result<ShadowShow> parseShow(std::string_view text);
std::string_view nameOf(ShadowShow show);
// "name=host:port,host:port": ports 1 to 65535, [::1]:7420 for IPv6.
// No name and no address twice. namesOnly: a NAME without an address is a server that dials this client.
Result<std::vector<ServerAddress>> parseServers(std::string_view text, bool namesOnly = false);
// HOST:PORT or [IPV6]:PORT; port 0: one that is free.
Result<ServerAddress> parseListen(std::string_view text);
// 8, 16 or 32 bits a channel of the colours that servers draw.
Result<ColourPrecision> parseColourBits(int bits);
// "depth,position,normal,ids,light", as a mask of Layer; colour is always in.
Result<std::uint32_t> parseLayers(std::string_view text);

}  // namespace umbriel
