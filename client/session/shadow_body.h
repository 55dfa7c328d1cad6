#pragma once

#include <optional>
#include <span>
#include <vector>

#include "client/session/receiver_range.h"
#include "client/session/shadow_fit.h"

namespace umbriel {

// Nobody stands with the nose on a receiver: eye distances below this share of the largest are taken as this. Without
// it the air before the eye would get most of the map wherever the eye is inside the scene's box.
inline constexpr double kNearShare = 1.0 / 16.0;

// What one light's map must hold, in the light's frame: relative to its origin, rotated by its axes; the light shines
// along -z. A place "across" the light is a point of a plane on which every ray of light is one point: (x, y) in metres
// for a directional light, (x, y) / -z for one that stands somewhere.
struct LightBody {
    bool perspective = false;
    glm::dmat3 worldFromLight{1.0};
    glm::dvec3 originWorld{0.0};     // the light; of a directional light a point near the eyes
    std::vector<glm::dvec3> points;  // corners of what some view sees (or of the whole scene), light frame; in front of
                                     // a perspective light
    struct Place {
        glm::dvec3 point{0.0};  // light frame, in front of a perspective light
        double depth = 0.0;     // from the eye, metres
        double weight = 0.0;
    };
    std::vector<Place> places;  // where things may be that the views see (seenPlaces()); empty when no view counts (fit
                                // `scene`), or where all is one point
    double nearDistance = 0.0;      // along -z from the origin; between them lies all that may cast
    double farDistance = 0.0;
    double smallest = 0.0;  // a map's least extent across
    double rim = 0.0;       // perspective: tangent of the cone's half angle; 0: not limited

    // How the views look, put together: the sum of their unit axes, in the light's frame and divided by their number.
    // Its length says how much they agree: 1 for one view, 0 for views all around.
    glm::dvec3 axisLight{0.0};
    glm::dvec3 eyeLight{0.0};  // the middle of their eyes

    glm::dvec2 across(const glm::dvec3& point) const {
        return perspective ? glm::dvec2(point) / -point.z : glm::dvec2(point);
    }
};

// Nothing when nobody sees anything of the scene that the light can reach. receivers: by view, what it sees of the
// scene; none: all of the scene's box that lies within its frustum.
std::optional<LightBody> directionalBody(const glm::dvec3& directionWorld, const Box3d& sceneBounds,
                                         std::span<const View> views, ShadowFitMode fit,
                                         std::span<const ReceiverRange> receivers = {});
// outerAngle: radians, at most half of kMaxShadowFov counts; range: metres, 0: unlimited.
std::optional<LightBody> spotBody(const glm::dvec3& positionWorld, const glm::dvec3& directionWorld, double outerAngle,
                                  double range, const Box3d& sceneBounds, std::span<const View> views,
                                  ShadowFitMode fit, std::span<const ReceiverRange> receivers = {});

// A map over the body. mapFromAcross: a homography of the plane across the light, positive third component on the body;
// whatever its scale and place, the map is fitted around the body's picture. One that is affine (see isAffine) is taken
// as the uniform fit, snapped to texels. Nothing when the result would not be finite.
std::optional<ShadowFit> fitMap(const LightBody& body, const glm::dmat3& mapFromAcross,
                                const ShadowFitRequest& request);

// The fit whose map coordinates, x and y in [-1, 1], are clipFromAcross of the places across the light.
std::optional<ShadowFit> composeFit(const LightBody& body, glm::dmat3 clipFromAcross, const ShadowFitRequest& request);

// Of a map's side, on both sides of it together: what biases, rounding, snapping and filters need around the body.
double borderShare(const ShadowFitRequest& request);

bool isAffine(const glm::dmat3& mapFromAcross);

}  // namespace umbriel
