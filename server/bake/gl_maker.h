#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "common/base/result.h"
#include "common/visibility/mapping.h"
#include "common/visibility/mesh.h"

namespace umbriel {

// Draws visibility maps (Ganster 2002, 2.1.1): many vertices at once side by side into one picture, each cell of the
// mesh once for all the views that may show it, with the far plane at infinity, or a culling radius. The eye is lifted
// out of the surface so that the near plane cuts no hole (common/visibility/chag.h); nothing is sorted by depth, as
// only whether is asked, not what.
//
// Beside the exact rays a bit differs only where a silhouette runs through its pixel. The last bits depend on the
// driver, so maps of different ones are different bake classes.
//
// Lives on one thread, with one context current for as long as it lives; draws with that context's state.
class GlMaker {
 public:
    // The near plane, as a share of the diagonal: far below what a pixel shows, far above the rounding near the eye.
    static constexpr double kNearShare = 1e-7;
    // Lift of an eye whose own triangles do not rise above it: as far as the fast guard of rays.
    static constexpr double kLiftShare = 1e-6;

    // The mesh is borrowed. farDistance: as for rays, in the mesh's units; infinity: no limit. Failure: the driver,
    // among others when it lacks storage buffers in vertex shaders; bad input: maps larger than its pictures.
    static Result<std::unique_ptr<GlMaker>> create(const visibility::BakeMesh& mesh, const visibility::Mapping& mapping,
                                                   double farDistance);
    ~GlMaker();
    GlMaker(const GlMaker&) = delete;
    GlMaker& operator=(const GlMaker&) = delete;

    // The masks of these rows, maskBytes() each. Rows at a time make no difference to the bits. Failure: the driver.
    Result<void> masks(std::uint32_t firstRow, std::uint32_t rowCount, std::span<std::uint8_t> masks);
    // How many rows are drawn at once: the least work to interrupt between.
    std::uint32_t rowsAtOnce() const;

    // What was drawn so far, to see what culling leaves.
    struct Statistics {
        std::uint64_t rows = 0;
        std::uint64_t triangles = 0;  // of all instances
        std::uint64_t cellViews = 0;  // cells drawn, over views and rows; of rows x views x cells
    };
    const Statistics& statistics() const;
    std::uint32_t cells() const;
    std::uint32_t views() const;

 private:
    struct State;
    explicit GlMaker(std::unique_ptr<State> state);
    std::unique_ptr<State> _state;
};

}  // namespace umbriel
