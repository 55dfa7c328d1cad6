#include "tests/numerics/cases/formula_gpu.h"

#include <fmt/format.h>

#include <array>
#include <span>

#include "server/gl/buffer.h"
#include "server/gl/framebuffer.h"
#include "server/gl/program.h"
#include "server/gl/shader_source.h"
#include "server/gl/vertex_array.h"

namespace umbriel::gl {
namespace {

constexpr int kWidth = 512;

Result<Program> compile(const numerics::FormulaCase& formula) {
    const std::string text = fmt::format(
        "#include \"{}\"\n"
        "struct Input {{ vec4 a; vec4 b; vec4 c; vec4 d; }};\n"
        "layout(std430, binding = 0) readonly buffer Inputs {{ Input inputs[]; }};\n"
        "layout(location = 0) out vec4 colourOut;\n"
        "Vec3 evaluate(Vec3 a, Real aw, Vec3 b, Real bw, Vec3 c, Real cw, Vec3 d, Real dw) {{ {} }}\n"
        "void main() {{\n"
        "    int i = int(gl_FragCoord.y) * {} + int(gl_FragCoord.x);\n"
        "    if (i >= inputs.length()) discard;\n"
        "    Input p = inputs[i];\n"
        "    colourOut = vec4(evaluate(p.a.xyz, p.a.w, p.b.xyz, p.b.w, p.c.xyz, p.c.w, p.d.xyz, p.d.w), 1.0);\n"
        "}}\n",
        formula.file, formula.glslBody, kWidth);
    std::vector<shaders::ShaderFile> files(shaders::embeddedFiles().begin(), shaders::embeddedFiles().end());
    files.push_back({"case.frag.glsl", text});
    auto vertex = composeShader("stage/screen.vert.glsl");
    if (!vertex) return vertex.error();
    auto fragment = composeShader(files, "case.frag.glsl");
    if (!fragment) return fragment.error();
    return Program::link(std::array{ShaderStage{GL_VERTEX_SHADER, "screen.vert.glsl", *vertex},
                                    ShaderStage{GL_FRAGMENT_SHADER, "case.frag.glsl", *fragment}});
}

}  // namespace

Result<std::vector<glm::vec3>> drawFormula(const numerics::FormulaCase& formula,
                                           const std::vector<numerics::FormulaInput>& points) {
    const int height = static_cast<int>((points.size() + kWidth - 1) / kWidth);
    auto program = compile(formula);
    if (!program) return program.error();
    auto inputs = Buffer::create(std::as_bytes(std::span(points)));
    if (!inputs) return inputs.error();
    auto target = Texture2D::create(GL_RGBA32F, {kWidth, height});
    if (!target) return target.error();
    const Attachment attachment(*target);
    auto framebuffer = Framebuffer::create({&attachment, 1});
    if (!framebuffer) return framebuffer.error();

    framebuffer->bind();
    glViewport(0, 0, kWidth, height);
    glDisable(GL_BLEND);
    glDisable(GL_DEPTH_TEST);
    inputs->bindBase(GL_SHADER_STORAGE_BUFFER, 0);
    const VertexArray none = VertexArray::create();
    none.bind();
    program->use();
    glDrawArrays(GL_TRIANGLES, 0, 3);

    std::vector<glm::vec4> pixels(static_cast<size_t>(kWidth) * static_cast<size_t>(height));
    glGetTextureImage(target->id(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(pixels.size() * sizeof(glm::vec4)),
                      pixels.data());
    std::vector<glm::vec3> results(points.size());
    for (size_t i = 0; i < results.size(); ++i) results[i] = glm::vec3(pixels[i]);
    return results;
}

}  // namespace umbriel::gl
