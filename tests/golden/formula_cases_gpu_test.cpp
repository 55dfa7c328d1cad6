#include <fmt/format.h>

#include <array>
#include <cmath>

#include "server/gl/buffer.h"
#include "server/gl/framebuffer.h"
#include "server/gl/shader_source.h"
#include "shaders/formula_cpp.h"
#include "tests/golden/gl_fixture.h"
#include "tests/numerics/cases/formula_case.h"
#include "tests/numerics/cases/formula_gpu.h"
#include "tests/numerics/points.h"

// Every formula as the driver draws it, to float targets, against the same lines as C++ float.
namespace umbriel::gl {
namespace {

using numerics::FormulaCase;
using numerics::FormulaDomain;
using numerics::FormulaInput;

constexpr size_t kPoints = 100000;

class FormulaCasesGpu : public GlTest, public ::testing::WithParamInterface<FormulaDomain> {};

TEST_P(FormulaCasesGpu, AreTheSameAsInCpp) {
    const std::vector<FormulaInput> points = numerics::formulaPoints(GetParam(), kPoints);
    size_t formulas = 0;
    for (const FormulaCase& formula : numerics::formulaCases()) {
        if (formula.domain != GetParam()) continue;
        SCOPED_TRACE(formula.name);
        const auto drawn = require(drawFormula(formula, points));
        numerics::FormulaWorst worst;
        for (size_t i = 0; i < points.size(); ++i) worst.add(formula, points[i], drawn[i], formula.single(points[i]));
        EXPECT_EQ(worst.notFinite, 0u) << numerics::describe(worst.at);
        EXPECT_LE(worst.error, numerics::kFormulaTolerance) << numerics::describe(worst.at);
        // What a driver may add: 2.5 units in the last place for each division, exp and log of its own, sums in its own
        // order. The most is srgbFromLinear with 12, exp and log of llvmpipe.
        EXPECT_LE(worst.roundings, 16) << numerics::describe(worst.roundingsAt);
        RecordProperty(formula.name, fmt::format("{:.1e}, {:.1f} roundings", worst.error, worst.roundings));
        ++formulas;
    }
    EXPECT_GT(formulas, 0u);
}

INSTANTIATE_TEST_SUITE_P(Domains, FormulaCasesGpu,
                         ::testing::Values(FormulaDomain::Reflection, FormulaDomain::Distance, FormulaDomain::Spot,
                                           FormulaDomain::Fog, FormulaDomain::Direction, FormulaDomain::Unit,
                                           FormulaDomain::Frame));

// cubeFace() and cubePlace() against the driver's own cube maps: every texel of one says where it is.
using FormulaCube = GlTest;

TEST_F(FormulaCube, PlacesAreThoseThatTheDriverSamples) {
    constexpr int kSize = 32;
    constexpr int kCount = 4096;
    GLuint cube = 0;
    glCreateTextures(GL_TEXTURE_CUBE_MAP, 1, &cube);
    glTextureStorage2D(cube, 1, GL_RGBA32F, kSize, kSize);
    glTextureParameteri(cube, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(cube, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    for (int face = 0; face < 6; ++face) {
        std::vector<glm::vec4> texels;
        for (int y = 0; y < kSize; ++y)
            for (int x = 0; x < kSize; ++x) texels.push_back({face, x, y, 1});
        glTextureSubImage3D(cube, 0, 0, 0, face, kSize, kSize, 1, GL_RGBA, GL_FLOAT, texels.data());
    }
    glBindTextureUnit(0, cube);

    const std::vector<shaders::ShaderFile> files{
        {"cube.comp.glsl",
         "layout(local_size_x = 64) in;\n"
         "layout(binding = 0) uniform samplerCube cube;\n"
         "layout(std430, binding = 0) readonly buffer Inputs { vec4 inputs[]; };\n"
         "layout(std430, binding = 1) writeonly buffer Results { vec4 results[]; };\n"
         "void main() { uint i = gl_GlobalInvocationID.x; results[i] = textureLod(cube, inputs[i].xyz, 0.0); }\n"}};
    const auto source = require(composeShader(files, "cube.comp.glsl"));
    const auto program = require(Program::link(std::array{ShaderStage{GL_COMPUTE_SHADER, "cube.comp.glsl", source}}));
    numerics::Sequence sequence(51);
    std::vector<glm::vec4> directions(kCount);
    for (glm::vec4& d : directions) d = glm::vec4(sequence.direction(), 0);
    const Buffer in = require(Buffer::create(std::as_bytes(std::span(directions))));
    const Buffer out = require(Buffer::create(kCount * sizeof(glm::vec4)));
    in.bindBase(GL_SHADER_STORAGE_BUFFER, 0);
    out.bindBase(GL_SHADER_STORAGE_BUFFER, 1);
    program.use();
    glDispatchCompute(kCount / 64, 1, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    std::vector<glm::vec4> results(kCount);
    out.read(0, std::as_writable_bytes(std::span(results)));
    glDeleteTextures(1, &cube);

    int judged = 0;
    for (int i = 0; i < kCount; ++i) {
        const glm::vec3 d(directions[static_cast<size_t>(i)]);
        const glm::vec2 texel = formula_f32::cubePlace(d) * static_cast<float>(kSize);
        // On the border of two texels either may be taken.
        const glm::vec2 border = glm::abs(glm::fract(texel + 0.5f) - 0.5f);
        if (border.x < 1e-3f || border.y < 1e-3f) continue;
        ++judged;
        const glm::vec4 expected(formula_f32::cubeFace(d), std::floor(texel.x), std::floor(texel.y), 1);
        EXPECT_EQ(results[static_cast<size_t>(i)], expected) << d.x << " " << d.y << " " << d.z;
    }
    EXPECT_GT(judged, kCount * 9 / 10);
}

}  // namespace
}  // namespace umbriel::gl
