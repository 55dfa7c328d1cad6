#pragma once

#include <epoxy/gl.h>

#include <span>
#include <vector>

#include "server/draw/caster_mask.h"
#include "server/draw/gpu_scene.h"

namespace umbriel {

// The draw commands of some items: which clusters of which item.
struct DrawList {
    // As glMultiDrawElementsIndirect reads it.
    struct Command {
        GLuint count = 0;
        GLuint instances = 1;
        GLuint firstIndex = 0;
        GLint baseVertex = 0;
        GLuint baseInstance = 0;  // the cluster: picks the first triangle's number
    };
    struct Entry {
        std::uint32_t item = 0;   // in ViewScene::items
        std::uint32_t first = 0;  // command
        std::uint32_t count = 0;
        std::uint32_t solid = 0;  // the first so many commands hide their own backs, which are not drawn
    };
    std::vector<Command> commands;
    std::vector<Entry> entries;
    std::uint64_t triangles = 0;
    std::size_t opaqueEntries = 0;  // entries of opaque items come first
    bool isMirrored = false;        // what they are drawn with turns windings round
    bool joins = true;              // neighbouring clusters become one command

    // isSolid: it hides its own backs; of an item's clusters these come first.
    void addCluster(std::uint32_t item, const Cluster& cluster, std::uint32_t index, bool isSolid = false);
};

// What can be seen through the frustum.
DrawList listVisible(const ViewScene& scene, const Frustum& frustum);
// Tells the masks (of the view's shadows, by index) which surfaces can be seen through the frustum.
void markReceivers(const ViewScene& scene, const Frustum& frustum, std::span<CasterMask> masks);
// What of the fit's casters can darken something visible through its mask; never what is behind everything (backmost.h).
DrawList listCasters(const ViewScene& scene, const CasterMask& mask, const ShadowFit& fit);
// A hash of what listCasters leaves out for being behind everything: that depends on more than the casters.
std::uint64_t backmostState(const ViewScene& scene, const ShadowFit& fit);

}  // namespace umbriel
