#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/math/glm.h"

namespace umbriel::trace {

// Whether rays from anywhere are blocked by triangles, for what other programs' shadows are judged by. Positions are
// double and may lie far from the origin: they are traced relative to the middle of their box, scaled to a diagonal of
// 1 to 2. Embree finds candidates in single precision; those within 1e-4 of the diagonal of the origin are then decided
// in double (double_hit.h), so that a point that lies on a surface, or on one of two coplanar neighbours, does not
// shadow itself. Farther away Embree's word stands, which errs by about 1e-6 of the diagonal across the ray.
//
// Immutable after create(); from any thread; what is found does not depend on the number of threads.
class OcclusionScene {
 public:
    // False: the triangle has a hole where the weights of its second and third corner are u and v.
    using IsSolid = std::function<bool(std::uint32_t triangle, double u, double v)>;

    // mayHaveHoles: by triangle, empty: none has; only those are asked for by isSolid, from any thread. Failure when
    // Embree cannot allocate.
    static Result<std::unique_ptr<OcclusionScene>> create(std::span<const glm::dvec3> positions,
                                                          std::span<const glm::uvec3> corners,
                                                          std::vector<std::uint8_t> mayHaveHoles = {},
                                                          IsSolid isSolid = {});
    ~OcclusionScene();
    OcclusionScene(const OcclusionScene&) = delete;
    OcclusionScene& operator=(const OcclusionScene&) = delete;

    static constexpr std::uint32_t kNoTriangle = ~0u;
    // A direction and how far to look along it, in units of the direction's length: 1 for "up to this point".
    struct Ray {
        glm::dvec3 direction{0.0};
        double farDistance = std::numeric_limits<double>::infinity();
    };
    // For each ray whether a triangle other than `own` blocks it. Rays without a direction are not blocked.
    void blocked(const glm::dvec3& origin, std::uint32_t own, std::span<const Ray> rays,
                 std::span<std::uint8_t> blocked) const;
    bool blocked(const glm::dvec3& origin, std::uint32_t own, const Ray& ray) const;

    // The point of the triangle's plane that is nearest to `point`; the point itself when the triangle has no area.
    glm::dvec3 onPlaneOf(std::uint32_t triangle, const glm::dvec3& point) const;

    std::size_t triangleCount() const;

 private:
    struct Scene;
    explicit OcclusionScene(std::unique_ptr<Scene> scene);
    std::unique_ptr<Scene> _scene;
};

}  // namespace umbriel::trace
