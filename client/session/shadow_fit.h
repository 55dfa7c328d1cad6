#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/session/receiver_range.h"
#include "common/math/box.h"
#include "common/scene/traversal.h"
#include "common/scene/windows.h"
#include "common/wall/view.h"

namespace umbriel {

// Fits of standard shadow maps (Williams 1978), in double, from everything that any tile or eye sees: servers get the
// finished matrix and so build the same map.
//
// Scene: the map covers the scene's box, whoever looks. Union: it covers the receivers that some view sees: the scene's
// box cut by each view's frustum (its planes come from the view's matrix, so off-axis walls are like any other). In
// both, depth spans the whole scene along the light, so casters outside the views are there: a caster that reaches a
// receiver along the light has the receiver's place on the map.
//
// So that edges do not crawl, a map's side is rounded up to one of eight steps per doubling and its corner lies on a
// whole texel of a grid fixed in the world: while the eye moves, the map moves in whole texels. Maps below 16 texels
// are not snapped. A light that turns moves the corners with it, and by at most one texel more; along the world's x
// axis the map's orientation is singular (its up vector is x there and z instead).
//
// Biases, as the shader applies them (shaders/formula/shadow.glsl): a receiver is compared with the nearest texel,
// whose centre is at most half a texel away in each direction of the map, so on a plane with normal n (in map axes) the
// texel's depth differs from the receiver's as much as if the receiver stood (|nx| + |ny|) / 2 texels above that plane.
// Moving it to that height ends acne at every slope: kNormalOffset is that half plus a tenth for the rasteriser's 1/256
// texel and for facets that meet at small angles. It moves towards the light, which leaves its place on the map alone:
// along the normal, the usual way, it would look the shadow up to half a texel beside itself, which was a third of all
// error. What stands less than that high on the plane casts no shadow on it, which is the same either way. No slope
// bias is then needed. kConstantBias covers what remains when facing the light: 24 bits of depth over a range of 100
// map sides, on maps of up to 16384 texels. Both are in texels, hence the same at every scale.
inline constexpr float kNormalOffset = 0.55f;
inline constexpr float kConstantBias = 0.1f;

// A point light that sees the scene's sphere within a cone of this half angle has one map, like a spot; nearer and
// inside it has six.
inline constexpr double kWidestSingle = 1.0471975511965976;  // 60 degrees

// One that sees it within this half angle has one map even where a mode asks for maps all around, with a message: of a
// cube's face the scene would fill less than a third of the width, farther away not a texel.
inline constexpr double kNarrowestAround = 0.2617993877991494;  // 15 degrees

// Spot cones wider than this get a cube, with a message: tan(87.5 degrees) is 23, beyond it texels are wasted on the
// rim.
inline constexpr double kMaxShadowFov = 3.0543261909900767;  // 175 degrees

// A viewport's shadow fields, checked: requestOf() has replaced what is impossible.
struct ShadowFitRequest {
    ShadowFitMode fit = ShadowFitMode::Union;
    std::uint32_t mapSize = 512;             // texels, resolved (resolveMapSize)
    float offFactor = -1.0f;                 // slope bias; negative: automatic
    float offBias = -1.0f;                   // constant bias in texels; negative: automatic
    ShadowMode mode = ShadowMode::Standard;  // the module
    ShadowMode map = ShadowMode::Standard;   // whose map it uses: std, psm, lisp or trapez
    double borderTexels = 0.0;               // around the map, beside what biases need: for filters
    float range = 0.3f;                      // trapezoid
    float maxSideAngle = 1.5f;               // trapezoid, radians
    float lispFactor = 1.0f;                 // LISP
    ShadowFilter filter{};                   // but for lightSize, which is the light's unless given
    float lightSize = -1.0f;                 // of every light; negative: the light's own
    glm::dvec4 planeWorld{0.0};              // planar: unit normal and offset; 0: not known
    float blobSize = 1.0f;                   // blob
    bool tight = false;                      // a warp fits what views really see, not all the scene's box within them
    Ref<LightMap> lightMap{};                // light map
    friend bool operator==(const ShadowFitRequest&, const ShadowFitRequest&) = default;
};

// 0 becomes the largest power of two within the wall (at least 1); beyond limit the limit, with a message.
std::uint32_t resolveMapSize(std::uint32_t mapSize, PixelSize wall, std::uint32_t limit,
                             std::vector<std::string>& messages);

// receivers: by view, for the fits that are tight.
//
// Nothing when no view sees a receiver, or the bounds are empty: then there is nothing to shadow. views are not looked
// at in Scene mode.
std::optional<ShadowFit> fitDirectional(const glm::dvec3& directionWorld, const Box3d& sceneBounds,
                                        std::span<const View> views, const ShadowFitRequest& request,
                                        std::span<const ReceiverRange> receivers = {});

// A perspective map down the cone, cut down to what the request's views see of it. outerAngle: radians from the axis;
// range: metres, 0: unlimited. Nothing also when the scene lies behind the light or out of range.
std::optional<ShadowFit> fitSpot(const glm::dvec3& positionWorld, const glm::dvec3& directionWorld, double outerAngle,
                                 double range, const Box3d& sceneBounds, std::span<const View> views,
                                 const ShadowFitRequest& request, std::span<const ReceiverRange> receivers = {});

// Shadows on one plane alone.
bool isPlanar(ShadowMode mode);
// The modules that this version can fit.
bool isFitted(ShadowMode mode);
// A viewport's wishes, with what does not fit together put right; a message for each such thing. mapSize: resolved.
ShadowFitRequest requestOf(const Viewport& viewport, std::uint32_t mapSize, std::vector<std::string>& messages);
// What a viewport's shadowColor can be at most and least: shares of each light, 0 to 1; what is no number is 0.
glm::vec3 possibleShadowColour(const glm::vec3& given);

// Fits for all lights that cast shadows, ascending by the light's node, which is the fit's id. A point light well
// outside the sphere around the scene gets a spot's map aimed at it; near and inside it, a cube map, in the warped
// modes too: a view's direction means nothing all around a light. Messages name the light.
struct ShadowFits {
    std::vector<ShadowFit> fits;
    std::vector<std::string> messages;
};
ShadowFits fitShadows(const Aspect& aspect, const std::vector<LightInEffect>& lights, const Box3d& sceneBounds,
                      std::span<const View> views, const ShadowFitRequest& request,
                      std::span<const ReceiverRange> receivers = {});

}  // namespace umbriel
