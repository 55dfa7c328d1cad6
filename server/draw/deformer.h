#pragma once

#include <map>
#include <optional>
#include <vector>

#include "common/scene/deformed_bounds.h"
#include "server/draw/gpu_geometry.h"
#include "server/draw/scene_tree.h"
#include "server/draw/shader_library.h"

namespace umbriel {

// Geometries that are morphed and skinned: each DeformedGeometry core has vertex buffers of its own, which a compute
// shader fills when its joints or weights have changed. Every pass, tile and view then draws the same vertices, so they
// agree to the bit on what is where.
class Deformer {
 public:
    // What to draw in place of the rest pose.
    struct Drawn {
        GpuGeometry* geometry = nullptr;  // null: nothing
        Placement world;                  // of its buffers' coordinates
        bool isMirrored = false;
    };

    // Something that changed or was destroyed: geometries, skins and cores are made anew when they are next drawn.
    void changed(ContainerId id);
    // The geometry of a core as it is now. nodeWorld: where its node stands, for what has no skin.
    Result<Drawn> prepare(const Aspect& scene, const SceneTree& tree, ContainerId core, const Placement& nodeWorld,
                          const GpuGeometry::Needs& needs, ShaderLibrary& shaders);

    // Vertices that were deformed since the start: a test counts them.
    std::uint64_t deformedVertices() const { return _deformedVertices; }
    // What a core consists of, for the frame plan.
    struct Size {
        std::uint32_t vertices = 0;
        std::uint32_t joints = 0;
        std::uint32_t morphTargets = 0;
    };
    Size sizeOf(ContainerId core) const;

 private:
    struct Entry {
        ContainerId geometry, skin;
        GpuGeometry::Needs needs;
        GpuGeometry drawn;
        std::vector<DeformedBounds> clusterBounds;
        gl::Buffer rest, influences, morphs, joints, morphWeights;
        std::uint32_t vertices = 0;
        std::uint32_t jointCount = 0;
        std::uint32_t targets = 0;
        std::uint32_t restNormals = 0;   // first float
        std::uint32_t restTangents = 0;  // first float
        // The pose that the buffers hold.
        std::vector<Affine> maps;
        std::vector<float> weights;
        bool isMirrored = false;
    };
    static Result<void> build(Entry& entry, const Geometry& geometry, std::size_t jointCount);
    static Result<void> buildRest(Entry& entry, const Geometry& geometry);
    Result<void> deform(Entry& entry, ShaderLibrary& shaders);

    std::map<ContainerId, Entry> _entries;  // by core
    std::uint64_t _deformedVertices = 0;
};

}  // namespace umbriel
