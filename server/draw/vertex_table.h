#pragma once

#include <cstdint>

#include "server/draw/gpu_geometry.h"
#include "server/gl/program.h"

namespace umbriel {

// What shading at vertices found, on its way to the pixels, for surfaces that more lights with a shadow reach than
// interpolants carry (Feature::VertexTable, shaders/snippet/vertex_table.glsl). One at a time: it is filled, then drawn
// from. Lives on the thread of the context.
class VertexTable {
 public:
    // Runs `shader` (ShaderLibrary::vertexTable) over all vertices, and readies `surface` to be drawn; of both the
    // item's uniforms, material and environment are set. shadows: lights with a shadow that reach it. Leaves `surface`
    // in use. Errors: more memory than the driver allows or has.
    Result<void> fill(const GpuGeometry& geometry, std::uint32_t shadows, bool doubleSided, const gl::Program& shader,
                      const gl::Program& surface);

 private:
    gl::Buffer _buffer;
};

}  // namespace umbriel
