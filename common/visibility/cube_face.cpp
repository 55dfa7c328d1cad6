#include "common/visibility/cube_face.h"

#include <cmath>

#include "common/visibility/planar_pixels.h"

namespace umbriel::visibility {

FaceAxes faceAxes(int face) {
    switch (face) {
        case 0:
            return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        case 1:
            return {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}};
        case 2:
            return {{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
        case 3:
            return {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};
        case kTopFace:
            return {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
        default:
            return {{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}};
    }
}

glm::dvec3 directionOf(const FacePixel& p) {
    const FaceAxes axes = faceAxes(p.face);
    return glm::normalize(axes.out + p.u() * axes.along + p.v() * axes.up);
}

double cosineWeightOf(const FacePixel& p) {
    return p.isOnSide() ? perpendicularCosine(p.u0, p.u1, p.v0, p.v1) : parallelCosine(p.u0, p.u1, p.v0, p.v1);
}

double solidAngleOf(const FacePixel& p) {
    return planeSolidAngle(p.u0, p.u1, p.v0, p.v1);
}

double midpointCosineWeightOf(const FacePixel& p, std::uint32_t s) {
    const double r2 = 1.0 + p.u() * p.u() + p.v() * p.v();
    return 4.0 / (static_cast<double>(s) * s) * (p.isOnSide() ? std::abs(p.v()) : 1.0) / (r2 * r2);
}

double midpointSolidAngleOf(const FacePixel& p, std::uint32_t s) {
    const double r2 = 1.0 + p.u() * p.u() + p.v() * p.v();
    return 4.0 / (static_cast<double>(s) * s) / (r2 * std::sqrt(r2));
}

std::vector<glm::dvec3> cornersOf(const FacePixel& p) {
    const FaceAxes axes = faceAxes(p.face);
    const auto at = [&](double u, double v) { return axes.out + u * axes.along + v * axes.up; };
    return {at(p.u0, p.v0), at(p.u1, p.v0), at(p.u1, p.v1), at(p.u0, p.v1)};
}

}  // namespace umbriel::visibility
