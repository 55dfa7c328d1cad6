#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "server/draw/draw_list.h"
#include "server/draw/gpu_scene.h"
#include "server/draw/shader_library.h"
#include "server/gl/vertex_array.h"
#include "server/shadow/darkness_images.h"

namespace umbriel {

// Draws what keeps lights from the visible surfaces: for modules that work in the view (server/shadow/view_module.h),
// shadow volumes, flattened casters, blobs; for those with maps, the factors of the screen-space path; and filters
// both.
class DarknessPainter {
 public:
    // Draws a list's entries [first, end) with the program and uniforms that `prepare` sets for each.
    using DrawEntries = std::function<Result<void>(const DrawList& list, std::size_t first, std::size_t end,
                                                   const std::function<Result<void>(const SurfaceItem&)>& prepare)>;

    // Gives a program the lights that reach an item.
    using BindLights = std::function<void(const gl::Program& program, const LightList::Run& run)>;

    DarknessPainter(GpuScene& scene, ShaderLibrary& shaders) : _gpuScene(scene), _shaders(shaders) {}

    Result<void> reserve(const DarknessImages::Needs& needs) { return _images.reserve(needs); }

    // All of these: for one view in one part of a tile. Viewport, scissor, frame block, and the buffers and maps of the
    // view's lights are set. visible: what the part shows.

    // Layers of modules in the view. frustum: of the part; wholeView: of the view, so that tiles choose alike. Returns
    // the triangles of volumes.
    Result<std::uint64_t> paint(const Aspect& scene, const ViewScene& view, const DrawList& visible,
                                const Frustum& frustum, const Frustum& wholeView, const DrawEntries& drawEntries);
    // Layers of shadow factors that surfaces have by their maps.
    Result<void> paintFactors(const Aspect& scene, const ViewScene& view, const DrawList& visible,
                              const BindLights& bindLights, const DrawEntries& drawEntries);
    // Where filters stop. withSurfaces: neither of the above was painted before.
    Result<void> paintEdges(const Aspect& scene, const ViewScene& view, const DrawList& visible, bool withSurfaces,
                            const DrawEntries& drawEntries);
    // What is visible: depth, and positions and normals where the view's settings want them.
    Result<void> paintSurfaces(const Aspect& scene, const ViewScene& view, const DrawList& visible,
                               const DrawEntries& drawEntries);
    // Filters all layers in place, after the edges when the view's filter has such.
    Result<void> filter(const ViewScene& view);
    const DarknessImages& images() const { return _images; }
    // For the surface shaders.
    void bind() const { _images.bind(static_cast<GLuint>(TextureUnit::Darkness)); }

 private:
    // The volume of one caster in one light, kept while neither moves.
    struct Volume {
        std::shared_ptr<const CasterShape> shape;
        glm::vec4 lightObject{0.0f};
        bool finite = false;
        GLsizei sides = 0;  // corners; the caps follow, the light cap first
        GLsizei lightCap = 0;
        GLsizei corners = 0;
        gl::Buffer buffer;
        gl::VertexArray vertexArray;
        std::uint64_t lastUse = 0;
    };
    void fill();
    Result<void> paintVolumes(const Aspect& scene, const ViewScene& view, const ShadowFit& fit, const Frustum& frustum,
                              const Frustum& wholeView);
    Result<void> paintPlanar(const Aspect& scene, const ViewScene& view, const ShadowFit& fit,
                             const DrawEntries& drawEntries);
    Result<void> paintBlobs(const ViewScene& view, const ShadowFit& fit, const Frustum& frustum);
    Result<Volume*> volumeOf(const SurfaceItem& item, const ShadowFit& fit, const glm::dvec4& lightRelative,
                             bool finite);

    GpuScene& _gpuScene;
    ShaderLibrary& _shaders;
    DarknessImages _images;
    gl::VertexArray _noVertices;
    std::map<std::pair<ContainerId, ContainerId>, Volume> _volumes;  // by caster's node and light
    std::set<ContainerId> _namedCutOuts;  // casters whose holes volumes do not have, that a warning has named
    std::uint64_t _use = 0;
    std::uint64_t _triangles = 0;
    gl::Buffer _blobVertices, _blobs;
};

// Whether a box, placed by relativeFromObject and drawn out to infinity away from the light (w 1: a position, w 0: the
// direction towards it), misses the frustum. Conservative: false when in doubt.
bool shadowMisses(const Frustum& frustum, const Box& box, const glm::dmat4& relativeFromObject,
                  const glm::dvec4& light);

// Whether a box may stand between the light and the near rectangle, so that counting what lies before a surface would
// start within its volume. Conservative: true when in doubt.
bool mayCoverEye(const Frustum& wholeView, const Box& box, const glm::dmat4& relativeFromObject,
                 const glm::dvec4& light);

}  // namespace umbriel
