#pragma once

#include <map>
#include <optional>
#include <vector>

#include "common/scene/environment.h"
#include "common/scene/windows.h"
#include "server/draw/scene_tree.h"
#include "server/gl/program.h"
#include "server/gl/texture.h"

namespace umbriel {

// An environment light as shaders see it.
struct EnvironmentUse {
    ContainerId map;  // a usable one
    glm::mat3 environmentFromWorld{1.0f};
    glm::vec3 scale{1.0f};
};

// Nothing when the light is off, is none, or its map's sizes do not suit its texels. placement: where it stands when it
// has no beacon.
std::optional<EnvironmentUse> useOf(const Aspect& scene, const SceneTree& tree, ContainerId light,
                                    const std::optional<Placement>& placement);
// The environment that reaches each of the tree's light sets: the innermost one that is on.
std::vector<std::optional<EnvironmentUse>> environmentsBySet(const Aspect& scene, const SceneTree& tree,
                                                             const Viewport& viewport);

// Environment maps on the GPU, uploaded when they are first bound.
class GpuEnvironments {
 public:
    // The map changed or is gone.
    void forget(ContainerId map) { _entries.erase(map); }
    // Textures and uniforms of snippet/environment.glsl; the program is in use. Error: the driver is out of memory.
    Result<void> bind(const Aspect& scene, const EnvironmentUse& use, const gl::Program& program);

 private:
    struct Entry {
        gl::Name<gl::deleteTexture> radiance;
        gl::Name<gl::deleteTexture> convolved;
        gl::Texture2D shares;
        std::uint32_t levels = 0;
    };
    Result<Entry> upload(const EnvironmentMap& map);

    std::map<ContainerId, Entry> _entries;
    gl::Sampler _cubes;
    gl::Sampler _table;
};

}  // namespace umbriel
