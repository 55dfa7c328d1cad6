#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/scene/windows.h"
#include "common/wall/view.h"
#include "server/draw/frame_plan.h"
#include "server/draw/scene_tree.h"
#include "server/shadow/shadow_module.h"
#include "shaders/structs_cpp.h"

namespace umbriel {

// The lights of one view as the shaders read them, and which of them reach which draw items.
struct LightList {
    // The lights that reach the items of one SceneTree light set: a run of indices, and the ambient light summed up.
    struct Run {
        std::uint32_t first = 0;
        std::uint32_t count = 0;
        std::uint32_t shadows = 0;  // of these, with a shadow
        glm::vec3 ambient{0.0f};
        FeatureSet features = 0;  // the light kinds among them, Shadows
        std::optional<std::uint32_t> block;  // its number; none: too many lights
    };
    std::vector<gpu::GpuLight> lights;
    std::vector<ContainerId> nodes;  // of each light
    std::vector<std::string> names;  // of each light: its name, else its id
    std::vector<std::uint32_t> indices;
    std::vector<Run> runs;  // by SceneTree::Item::lightSet
    std::span<const std::uint32_t> lightsOf(std::uint32_t run) const {
        return std::span(indices).subspan(runs[run].first, runs[run].count);
    }
    std::vector<float> webs;  // the tables of goniometric lights, one after the other
    std::vector<gpu::GpuShadow> shadows;      // those of a light with several parts follow each other
    std::vector<gpu::BlockLight> blocks;      // kBlockLights a block, of each run with few lights
    std::vector<const ShadowFit*> fits;       // of each shadow; borrowed from the view
    std::vector<std::uint32_t> shadowLights;  // the light of each shadow
    std::vector<std::uint32_t> darkLights;    // the lights with a shadow: layers of darkness, where there are such
};

// Lights that are off, invisible or not among the viewport's lightNodes are left out. A light casts shadows when it
// may, the viewport's shadows are on, and the view brings a fit for it, of a module that this server has.
LightList listLights(const Aspect& scene, const SceneTree& tree, const View& view, const Viewport* viewport);
// Copies lights and shadows as they are now into the blocks.
void fillLightBlocks(LightList& list);

}  // namespace umbriel
