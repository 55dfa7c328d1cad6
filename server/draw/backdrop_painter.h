#pragma once

#include <map>
#include <string>
#include <utility>

#include "server/draw/gpu_scene.h"
#include "server/draw/shader_library.h"
#include "server/gl/texture.h"
#include "server/gl/vertex_array.h"

namespace umbriel {

// Draws what lies behind and before everything in a viewport, into the framebuffer, viewport and scissor that are
// bound.
class BackdropPainter {
 public:
    BackdropPainter(GpuScene& scene, ShaderLibrary& shaders) : _gpuScene(scene), _shaders(shaders) {}

    // Errors: a shader that does not compile, an image that does not fit into the driver's memory.
    Result<void> drawBackground(const Aspect& scene, const ViewScene& view);
    Result<void> drawForegrounds(const Aspect& scene, const ViewScene& view);

 private:
    // A triangle over all of the viewport.
    void drawScreen();
    Result<const gl::Texture2D*> textOf(ContainerId id, const std::string& text);

    GpuScene& _gpuScene;
    ShaderLibrary& _shaders;
    gl::VertexArray _noVertices;
    std::map<ContainerId, std::pair<std::string, gl::Texture2D>> _texts;
};

}  // namespace umbriel
