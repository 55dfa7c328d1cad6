#pragma once

#include <cstdint>
#include <vector>

#include "common/trace/direction_packets.h"
#include "common/visibility/mesh.h"

namespace umbriel::visibility::test {

// The truth: the limit of visibility from P + delta n, delta -> 0+, in long double and by other formulas than the code
// it judges: a ray from n (the unit point above the apex) against the plane of each infinite wedge, and Moeller and
// Trumbore's test against every other triangle, found through a plain tree of boxes.
class Reference {
 public:
    explicit Reference(const BakeMesh& mesh);
    // farDistance in the positions' units; own triangles block at any distance.
    bool blocked(const trace::Origin& origin, const glm::vec3& direction, bool lower, double farDistance) const;
    // Distance to the nearest triangle that is not the origin's own; infinity if there is none.
    double distance(const trace::Origin& origin, const glm::vec3& direction) const;
    // The same without the tree.
    bool blockedBruteForce(const trace::Origin& origin, const glm::vec3& direction, bool lower,
                           double farDistance) const;

 private:
    struct Node {
        glm::dvec3 low, high;
        std::uint32_t first, count;  // leaf: triangles; inner: count 0, children first and first + 1
    };
    const BakeMesh& _mesh;
    std::vector<Node> _nodes;
    std::vector<std::uint32_t> _order;

    void build(std::uint32_t node, std::uint32_t begin, std::uint32_t end);
    bool own(std::uint32_t triangle, std::uint32_t position) const;
    bool fan(const trace::Origin& origin, const glm::vec3& direction, bool lower) const;
    double hit(std::uint32_t triangle, const glm::vec3& origin, const glm::vec3& direction) const;
};

struct Difference {
    std::uint64_t bits = 0;
    std::uint64_t blocked = 0;  // in the reference
    std::uint64_t falselyBlocked = 0;
    std::uint64_t falselyOpen = 0;
    double wrong() const { return static_cast<double>(falselyBlocked + falselyOpen) / static_cast<double>(bits); }
};

}  // namespace umbriel::visibility::test
