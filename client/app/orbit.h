#pragma once

#include "common/math/glm.h"

namespace umbriel {

// A camera that circles a point: heading around +y, elevation above the horizon (short of the poles), distance. Radians
// and metres, world frame.
struct Orbit {
    glm::dvec3 centre{0.0};
    double heading = 0.0;
    double elevation = 0.0;
    double distance = 1.0;

    // The orbit of a camera that stands at eye and looks at centre.
    static Orbit around(const glm::dvec3& centre, const glm::dvec3& eye);

    glm::dvec3 eye() const;
    // Fractions of a half turn.
    void turn(double right, double up);
    // Moves the centre across the view by fractions of the distance.
    void pan(double right, double up);
    // Positive comes nearer, by about a tenth a notch.
    void approach(double notches);
};

}  // namespace umbriel
