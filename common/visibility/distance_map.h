#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/math/glm.h"
#include "common/visibility/mapping.h"

namespace umbriel::visibility {

// Signed angles to the nearest silhouette, radians (Ganster 2002, 2.4.3). Positive in open pixels, negative in blocked
// ones. The silhouette is made of the middles of what two opposite neighbours share, so the value changes its sign
// between them without a step (the thesis seeds both pixels with 0: 2.8 degrees of bias at 64 x 16). Open pixels of a
// hemisphere also count the horizon, pi/2 - gamma away, as a boundary (the thesis prints pi - gamma, and foreground and
// background swapped); blocked ones do not, as below it is blocked too.
// Defined everywhere: a map without a boundary is +pi where it is open and has no horizon, -pi where it is blocked.
//
// Exact: the nearest of all boundary points. For one direction these are about a hundred, so a point light needs no
// stored map.
class DistanceMaps {
 public:
    // Not for Fibonacci, whose pixels have no neighbours (asserted).
    explicit DistanceMaps(const Mapping& mapping);

    // Boundary points of a mask (map_maker.h), as a structure of arrays.
    struct Silhouette {
        std::vector<float> x, y, z;
        std::size_t size() const { return x.size(); }
        void clear();
    };
    void silhouette(std::span<const std::uint8_t> mask, Silhouette& out) const;

    // Signed angle of each pixel's centre. distances: pixelCount() values.
    void compute(std::span<const std::uint8_t> mask, Silhouette& scratch, std::span<float> distances) const;
    // Signed angle of one direction (unit, in the mapping's frame); `open` is the bit of the pixel it falls into.
    float signedDistance(const Silhouette& silhouette, const glm::vec3& direction, bool open) const;

 private:
    Mapping _mapping;
    std::vector<Neighbours> _neighbours;
    std::vector<glm::vec3> _middles;
    std::vector<glm::vec3> _directions;
    bool _horizon;
};

}  // namespace umbriel::visibility
