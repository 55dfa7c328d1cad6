#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/aspect.h"
#include "common/wall/tile_pixels.h"
#include "common/wall/view.h"

namespace umbriel {

namespace gl {
class HeadlessContext;
}

struct DrawStatistics {
    double drawMilliseconds = 0.0;      // from the first command until the frame is finished
    double cpuMilliseconds = 0.0;       // of all threads of this process meanwhile, a software renderer's with them
    double gpuMilliseconds = 0.0;       // by a timer query; 0 where the driver's cannot be believed (gl/workarounds.h)
    std::uint64_t shadowMapBytes = 0;   // held for shadow maps of all views
    std::uint64_t triangles = 0;        // handed to GL in all passes of all tiles
    std::uint64_t shadowTriangles = 0;  // of these, in shadow passes
    float nearestDepth = 0.0f;  // of what is visible in the tiles, metres; 0: not measured (no fit needs it yet)
    float farthestDepth = 0.0f;
};

// Draws an aspect's scene into this server's tiles. Lives on the thread that has the context.
class Renderer {
 public:
    struct Options {
        std::size_t textureBudgetBytes = std::size_t{4} << 30;
        std::uint32_t largestLightMapPage = 0xffffffffu;  // texels a side; the driver's limit where that is less
        std::vector<std::string> disabledWorkarounds;     // by name (gl/workarounds.h)
    };
    static Result<std::unique_ptr<Renderer>> create(gl::HeadlessContext& context, const Options& options);
    virtual ~Renderer() = default;

    // Follows a change list that was just applied to the aspect this renderer draws.
    virtual void sceneChanged(const ChangeList& changes, const Aspect& scene) = 0;

    // Draws all tiles; returns when the GL has finished. time: seconds of the frame.
    virtual Result<DrawStatistics> draw(const Aspect& scene, const WallViews& views,
                                        std::span<const TileAssignment> tiles, double time) = 0;

    // The tiles of the last draw, with the layers its views asked for. Layers besides colour describe opaque and
    // cut-out surfaces (never blended ones) at the pixel's centre, also when colour has four samples.
    virtual Result<std::vector<TilePixels>> readTiles() = 0;

    // The frame plan of the last draw, for people: features, shader variants, passes with their reach, targets and
    // bytes.
    virtual std::string explain() const = 0;
};

}  // namespace umbriel
