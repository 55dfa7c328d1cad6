#pragma once

#include "common/visibility/mapping.h"

namespace umbriel::visibility {

// What HemiCube and Cube share: pixels on the faces of a cube about the vertex, planes at distance 1.

// Axes of a face: the direction is out + u * along + v * up.
struct FaceAxes {
    glm::dvec3 out;
    glm::dvec3 along;
    glm::dvec3 up;
};
// 0 to 3: +x, +y, -x, -y, up is z; 4: top, 5: bottom, whose rows run along y.
FaceAxes faceAxes(int face);
inline constexpr int kTopFace = 4;

// Where a pixel lies: on the plane [u0,u1] x [v0,v1] of a face.
struct FacePixel {
    int face = kTopFace;
    std::uint32_t row = 0;
    double u0 = 0.0, u1 = 0.0, v0 = 0.0, v1 = 0.0;
    double u() const { return 0.5 * (u0 + u1); }
    double v() const { return 0.5 * (v0 + v1); }
    bool isOnSide() const { return face < kTopFace; }
};

// Of the pixel's middle, unit length.
glm::dvec3 directionOf(const FacePixel& pixel);
// Exact: integrals of the cosine against z, and of the solid angle. s: pixels along a whole face, for the midpoint
// rule.
double cosineWeightOf(const FacePixel& pixel);
double solidAngleOf(const FacePixel& pixel);
double midpointCosineWeightOf(const FacePixel& pixel, std::uint32_t s);
double midpointSolidAngleOf(const FacePixel& pixel, std::uint32_t s);
// Directions of the four corners, counter-clockwise seen from outside.
std::vector<glm::dvec3> cornersOf(const FacePixel& pixel);

// Appends the pairs of pixel `number` with its neighbours of larger numbers; a step off a face lands on the face next
// to it. pixelOf: which pixel a direction falls into, if any. above, below: whether there is one in that direction.
template <class PixelOf>
void addNeighbours(const FacePixel& p, std::uint32_t number, std::uint32_t s, bool above, bool below,
                   const PixelOf& pixelOf, std::vector<Neighbours>& result) {
    const FaceAxes axes = faceAxes(p.face);
    const double step = 1e-3 / s;  // over the edge, and no further
    const auto add = [&](double u, double v, double edgeU, double edgeV) {
        const std::optional<std::uint32_t> other = pixelOf(axes.out + u * axes.along + v * axes.up);
        if (other && *other > number)
            result.push_back({number, *other, glm::normalize(axes.out + edgeU * axes.along + edgeV * axes.up)});
    };
    add(p.u1 + step, p.v(), p.u1, p.v());
    add(p.u0 - step, p.v(), p.u0, p.v());
    if (above) add(p.u(), p.v1 + step, p.u(), p.v1);
    if (below) add(p.u(), p.v0 - step, p.u(), p.v0);
}

}  // namespace umbriel::visibility
