#include "server/draw/vertex_table.h"

#include <fmt/format.h>

namespace umbriel {
namespace {

// As in shaders/snippet/vertex_table.glsl.
constexpr GLuint kTableBinding = 4;
constexpr GLuint kCornersBinding = 6;
constexpr GLint kShapeLocation = 4;

}  // namespace

Result<void> VertexTable::fill(const GpuGeometry& geometry, std::uint32_t shadows, bool doubleSided,
                               const gl::Program& shader, const gl::Program& surface) {
    const std::uint32_t floatsOfSide = 3 * (1 + shadows);
    const std::uint32_t floatsOfVertex = 3 + (doubleSided ? 2 : 1) * floatsOfSide;
    const std::uint64_t bytes = std::uint64_t{geometry.vertices()} * floatsOfVertex * sizeof(float);
    GLint64 limit = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
    if (bytes > static_cast<std::uint64_t>(limit))
        return failure(
            fmt::format("a geometry of {} vertices that is shaded at its vertices, where {} lights cast "
                        "shadows, needs a table of {} MiB, and the driver allows {}: shade it in pixels "
                        "(--shading phong), or let fewer lights cast shadows",
                        geometry.vertices(), shadows, bytes >> 20, limit >> 20));
    if (bytes > _buffer.size()) {
        auto buffer = gl::Buffer::create(bytes, 0);
        if (!buffer) return buffer.error();
        _buffer = std::move(*buffer);
    }
    for (const gl::Program* program : {&shader, &surface})
        glProgramUniform2ui(program->id(), kShapeLocation, floatsOfVertex, floatsOfSide);
    _buffer.bindBase(GL_SHADER_STORAGE_BUFFER, kTableBinding);
    geometry.indices().bindBase(GL_SHADER_STORAGE_BUFFER, kCornersBinding);
    geometry.vertexArray().bind();
    shader.use();
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);  // pixels of the surface before may still be reading
    glEnable(GL_RASTERIZER_DISCARD);
    glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(geometry.vertices()));
    glDisable(GL_RASTERIZER_DISCARD);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    surface.use();
    return {};
}

}  // namespace umbriel
