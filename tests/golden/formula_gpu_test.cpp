#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "server/gl/buffer.h"
#include "server/gl/shader_source.h"
#include "shaders/formula_cpp.h"
#include "shaders/structs_cpp.h"
#include "tests/golden/gl_fixture.h"
#include "tests/numerics/points.h"

// The formulas as the driver compiles them against the same lines compiled as C++ float.
//
// Why they differ at all, by cause:
//   - division and square root: GLSL allows 2.5 units in the last place; C++ rounds right, and so does llvmpipe
//   - exp and log: llvmpipe's polynomials are good to about 1e-6 relative; times the exponent they raise
//   - the order of sums in dot() is the driver's
// The first and last are what `sensitivity` (tests/numerics/points.h) multiplies: 1 / alpha in a lobe, 1 / cos at
// grazing.
namespace umbriel::gl {
namespace {

namespace f32 = formula_f32;
using numerics::ReflectionPoint;

using FormulaGpu = GlTest;

struct Worst {
    double relative = 0;   // of points that are well conditioned
    double roundings = 0;  // of all, in units of 2^-24 times the point's sensitivity
    size_t judged = 0;
};

// Runs `body` (GLSL; reads a, b, c, d, writes result) once per quadruple of inputs.
class Runner {
 public:
    Result<std::vector<glm::vec4>> run(std::string_view includes, std::string_view body,
                                       const std::vector<std::array<glm::vec4, 4>>& inputs) {
        const std::string text = fmt::format(
            "{}\n"
            "layout(local_size_x = 64) in;\n"
            "struct Input {{ vec4 a; vec4 b; vec4 c; vec4 d; }};\n"
            "layout(std430, binding = 0) readonly buffer Inputs {{ Input inputs[]; }};\n"
            "layout(std430, binding = 1) writeonly buffer Results {{ vec4 results[]; }};\n"
            "vec4 evaluate(vec4 a, vec4 b, vec4 c, vec4 d) {{\n{}\n}}\n"
            "void main() {{\n"
            "    uint i = gl_GlobalInvocationID.x;\n"
            "    if (i < uint(inputs.length())) results[i] = evaluate(inputs[i].a, inputs[i].b, inputs[i].c, "
            "inputs[i].d);\n"
            "}}\n",
            includes, body);
        std::vector<shaders::ShaderFile> files(shaders::embeddedFiles().begin(), shaders::embeddedFiles().end());
        files.push_back({"test.comp.glsl", text});
        auto source = composeShader(files, "test.comp.glsl");
        if (!source) return source.error();
        const std::array stages{ShaderStage{GL_COMPUTE_SHADER, "test.comp.glsl", *source}};
        auto program = Program::link(stages);
        if (!program) return program.error();
        auto in = Buffer::create(std::as_bytes(std::span(inputs)));
        if (!in) return in.error();
        auto out = Buffer::create(inputs.size() * sizeof(glm::vec4));
        if (!out) return out.error();
        in->bindBase(GL_SHADER_STORAGE_BUFFER, 0);
        out->bindBase(GL_SHADER_STORAGE_BUFFER, 1);
        program->use();
        glDispatchCompute(static_cast<GLuint>((inputs.size() + 63) / 64), 1, 1);
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        std::vector<glm::vec4> results(inputs.size());
        out->read(0, std::as_writable_bytes(std::span(results)));
        return results;
    }
};

void note(Worst& worst, double gpu, double cpu, double sensitivity) {
    // Below this share of the largest values a relative error says nothing about the picture.
    if (std::abs(cpu) < 1e-20) {
        EXPECT_LT(std::abs(gpu), 1e-19);
        return;
    }
    const double relative = std::abs(gpu - cpu) / std::abs(cpu);
    worst.roundings = std::max(worst.roundings, relative / (0x1p-24 * sensitivity));
    if (sensitivity > 20) return;
    ++worst.judged;
    worst.relative = std::max(worst.relative, relative);
}

TEST_F(FormulaGpu, MetallicRoughnessIsTheSameAsInCpp) {
    const std::vector<ReflectionPoint> points = numerics::reflectionPoints(8192, 11);
    std::vector<std::array<glm::vec4, 4>> inputs;
    for (const ReflectionPoint& p : points)
        inputs.push_back({glm::vec4(p.normal, p.metallic), glm::vec4(p.toLight, p.roughness), glm::vec4(p.toEye, 0),
                          glm::vec4(p.colour, 0)});
    const auto results = require(Runner().run("#include \"formula/metallic_roughness.glsl\"",
                                              "MetallicRoughness m;\n"
                                              "m.baseColour = d.xyz; m.metallic = a.w; m.roughness = b.w;\n"
                                              "return vec4(metallicRoughnessReflect(m, a.xyz, b.xyz, c.xyz), 0.0);",
                                              inputs));
    Worst worst;
    for (size_t i = 0; i < points.size(); ++i) {
        const ReflectionPoint& p = points[i];
        if (glm::dot(p.normal, p.toLight) < 1e-5f) continue;  // either side of the gate
        f32::MetallicRoughness m;
        m.baseColour = p.colour;
        m.metallic = p.metallic;
        m.roughness = p.roughness;
        const glm::vec3 expected = f32::metallicRoughnessReflect(m, p.normal, p.toLight, p.toEye);
        const double sensitivity = numerics::sensitivity(p, f32::alphaFromRoughness(p.roughness));
        for (int k = 0; k < 3; ++k) note(worst, results[i][k], expected[k], sensitivity);
    }
    EXPECT_GT(worst.judged, 8192u) << "most points are well conditioned";
    EXPECT_LE(worst.relative, 1e-5);
    EXPECT_LE(worst.roundings, 16);
    RecordProperty("relative", fmt::format("{:.2e}", worst.relative));
    RecordProperty("roundings", fmt::format("{:.2f}", worst.roundings));
}

TEST_F(FormulaGpu, BlinnPhongIsTheSameAsInCpp) {
    const std::vector<ReflectionPoint> points = numerics::reflectionPoints(8192, 12);
    std::vector<std::array<glm::vec4, 4>> inputs;
    for (const ReflectionPoint& p : points)
        inputs.push_back(
            {glm::vec4(p.normal, p.shininess), glm::vec4(p.toLight, 0), glm::vec4(p.toEye, 0), glm::vec4(p.colour, 0)});
    const auto results = require(Runner().run("#include \"formula/blinn_phong.glsl\"",
                                              "BlinnPhong m;\n"
                                              "m.diffuse = d.xyz; m.specular = d.xyz; m.shininess = a.w;\n"
                                              "return vec4(blinnPhongReflect(m, a.xyz, b.xyz, c.xyz),\n"
                                              "            blinnPhongHighlight(a.xyz, b.xyz, c.xyz, a.w));",
                                              inputs));
    Worst whole;
    double highlight = 0;
    for (size_t i = 0; i < points.size(); ++i) {
        const ReflectionPoint& p = points[i];
        if (glm::dot(p.normal, p.toLight) < 1e-5f) continue;
        f32::BlinnPhong m;
        m.diffuse = p.colour;
        m.specular = p.colour;
        m.shininess = p.shininess;
        const glm::vec3 expected = f32::blinnPhongReflect(m, p.normal, p.toLight, p.toEye);
        const float power = f32::blinnPhongHighlight(p.normal, p.toLight, p.toEye, p.shininess);
        // A lobe (n.h)^s is about 1 / sqrt(s) wide.
        const double sensitivity = numerics::sensitivity(p, 1 / std::sqrt(1 + p.shininess));
        for (int k = 0; k < 3; ++k) note(whole, results[i][k], expected[k], sensitivity);
        highlight = std::max(highlight, static_cast<double>(std::abs(results[i].w - power)));
    }
    EXPECT_LE(whole.relative, 1e-5);
    EXPECT_LE(highlight, 1e-4) << "absolute; the highlight's peak is 1 (exp and log of the driver, times the exponent)";
    RecordProperty("relative", fmt::format("{:.2e}", whole.relative));
    RecordProperty("highlight", fmt::format("{:.2e}", highlight));
}

TEST_F(FormulaGpu, LightsColourAndBiasAreTheSameAsInCpp) {
    numerics::Sequence sequence(13);
    std::vector<std::array<glm::vec4, 4>> inputs(8192);
    for (auto& i : inputs) {
        i[0] =
            glm::vec4(sequence.direction() * std::exp2(sequence.between(-20, 40)), std::exp2(sequence.between(-5, 25)));
        const float cosOuter = sequence.between(-1, 1);
        i[1] = glm::vec4(sequence.between(-1, 1), cosOuter, sequence.between(cosOuter, 1), sequence.unit());
        i[2] = glm::vec4(sequence.direction(), sequence.unit());
        i[3] = glm::vec4(sequence.unit(), sequence.unit(), sequence.unit(), sequence.unit());
    }
    const std::string_view includes =
        "#include \"formula/light.glsl\"\n#include \"formula/colour.glsl\"\n#include \"formula/shadow.glsl\"";
    const auto lights =
        require(Runner().run(includes,
                             "float distanceSquared;\n"
                             "vec3 l = directionTo(a.xyz, vec3(0.0), distanceSquared);\n"
                             "return vec4(inverseSquare(distanceSquared), rangeWindow(distanceSquared, a.w),\n"
                             "            spotFactor(b.x, b.y, spotScale(b.z, b.y)), l.x);",
                             inputs));
    const auto rest = require(Runner().run(includes,
                                           "return vec4(linearFromSrgb(b.w), srgbFromLinear(b.w),\n"
                                           "            shadowNormalOffset(c.xyz, c.w, 1.0),\n"
                                           "            shadowMix2x2(1.0, 0.0, d.x, d.y, d.z, d.w));",
                                           inputs));
    double worst = 0;
    for (size_t k = 0; k < inputs.size(); ++k) {
        const auto& [a, b, c, d] = inputs[k];
        float distanceSquared = 0;
        const glm::vec3 l = f32::directionTo(glm::vec3(a), glm::vec3(0), distanceSquared);
        const float arriving = f32::inverseSquare(distanceSquared);
        worst = std::max<double>(worst, std::abs(lights[k].x - arriving) / arriving);
        // These are shares of 1, so absolute errors are what counts.
        worst = std::max<double>(worst, std::abs(lights[k].y - f32::rangeWindow(distanceSquared, a.w)));
        worst = std::max<double>(worst, std::abs(lights[k].z - f32::spotFactor(b.x, b.y, f32::spotScale(b.z, b.y))));
        worst = std::max<double>(worst, std::abs(lights[k].w - l.x));
        worst = std::max<double>(worst, std::abs(rest[k].x - f32::linearFromSrgb(b.w)));
        worst = std::max<double>(worst, std::abs(rest[k].y - f32::srgbFromLinear(b.w)));
        worst = std::max<double>(worst, std::abs(rest[k].z - f32::shadowNormalOffset(glm::vec3(c), c.w, 1.0f)));
        worst = std::max<double>(worst, std::abs(rest[k].w - f32::shadowMix2x2(1.0f, 0.0f, d.x, d.y, d.z, d.w)));
    }
    EXPECT_LE(worst, 1e-5);
    RecordProperty("worst", fmt::format("{:.2e}", worst));
}

TEST_F(FormulaGpu, MappedNormalsAreTheSameAsInCpp) {
    numerics::Sequence sequence(14);
    std::vector<std::array<glm::vec4, 4>> inputs(8192);
    for (auto& i : inputs)
        i = {glm::vec4(sequence.direction() * std::exp2(sequence.between(-30, 30)), 0),
             glm::vec4(sequence.direction() * std::exp2(sequence.between(-30, 30)), -1),
             glm::vec4(sequence.unit(), sequence.unit(), sequence.between(0.5f, 1.0f), 0.7f), glm::vec4(0)};
    const auto results = require(Runner().run(
        "#include \"formula/normal_map.glsl\"",
        "return vec4(mappedNormal(a.xyz, b.xyz, b.w, normalFromTexel(c.xyz, c.w), vec3(0.0, 0.0, 1.0)), 0.0);",
        inputs));
    double worst = 0;
    for (size_t k = 0; k < inputs.size(); ++k) {
        const auto& [a, b, c, d] = inputs[k];
        const glm::vec3 expected = f32::mappedNormal(glm::vec3(a), glm::vec3(b), b.w,
                                                     f32::normalFromTexel(glm::vec3(c), c.w), glm::vec3(0, 0, 1));
        const float sine = glm::length(glm::cross(glm::normalize(glm::vec3(a)), glm::normalize(glm::vec3(b))));
        const float mapped = glm::length(f32::normalFromTexel(glm::vec3(c), c.w));
        const double sensitivity = 1 / sine + 1 / mapped;
        worst = std::max(worst, glm::distance(glm::vec3(results[k]), expected) / sensitivity);
    }
    EXPECT_LE(worst, 2e-6);
    RecordProperty("worst", fmt::format("{:.2e}", worst));
}

// A file that names all it needs compiles alone, whatever a stage includes before it.
TEST_F(FormulaGpu, EverySharedFileCompilesAlone) {
    size_t compiled = 0;
    for (const shaders::ShaderFile& file : shaders::embeddedFiles()) {
        if (!file.path.starts_with("formula/") && !file.path.starts_with("structs/")) continue;
        const auto result = Runner().run(fmt::format("#include \"{}\"", file.path), "return a;", {{}});
        EXPECT_TRUE(result) << (result ? "" : result.error().message);
        ++compiled;
    }
    EXPECT_GE(compiled, 12u);
}

TEST_F(FormulaGpu, StructsHaveTheLayoutOfCpp) {
    gpu::GpuLight light{};
    light.position = {1, 2, 3};
    light.kind = gpu::kLightSpot;
    light.direction = {4, 5, 6};
    light.range = 7;
    light.irradianceOrIntensity = {8, 9, 10};
    light.spotCosOuter = 11;
    light.spotScale = 12;
    light.radius = 13;
    light.shadowIndex = -1;
    light.index = 14;
    const std::array lights{gpu::GpuLight{}, light};
    const Buffer buffer = require(Buffer::create(std::as_bytes(std::span(lights))));
    for (const auto& [layout, target] : {std::pair{"std430, binding = 2) readonly buffer", GL_SHADER_STORAGE_BUFFER},
                                         std::pair{"std140, binding = 2) uniform", GL_UNIFORM_BUFFER}}) {
        buffer.bindBase(static_cast<GLenum>(target), 2);
        const auto results = require(Runner().run(
            fmt::format("#include \"structs/light.glsl\"\nlayout({} Lights {{ GpuLight lights[2]; }};", layout),
            "GpuLight l = lights[1];\n"
            "if (a.x == 0.0) return vec4(l.position, l.kind);\n"
            "if (a.x == 1.0) return vec4(l.direction, l.range);\n"
            "if (a.x == 2.0) return vec4(l.irradianceOrIntensity, l.spotCosOuter);\n"
            "return vec4(l.spotScale, l.radius, l.shadowIndex, l.index);",
            {{glm::vec4(0)}, {glm::vec4(1)}, {glm::vec4(2)}, {glm::vec4(3)}}));
        EXPECT_EQ(results, (std::vector{glm::vec4(1, 2, 3, 2), glm::vec4(4, 5, 6, 7), glm::vec4(8, 9, 10, 11),
                                        glm::vec4(12, 13, -1, 14)}))
            << layout;
    }
}

// The corners where GLSL leaves results open, on this driver.
TEST_F(FormulaGpu, GuardsHoldOnTheDriver) {
    const std::vector<std::array<glm::vec4, 4>> inputs{
        {glm::vec4(0), glm::vec4(1e25f, 0, 0, 1), glm::vec4(0, 0, 1, 0), glm::vec4(0)}};
    const std::string_view includes =
        "#include \"formula/metallic_roughness.glsl\"\n#include \"formula/blinn_phong.glsl\"\n#include "
        "\"formula/light.glsl\"";
    // Inputs, not constants: a compiler may fold 0/0 into anything.
    const auto run = [&](std::string_view body) { return require(Runner().run(includes, body, inputs)).front(); };
    EXPECT_EQ(run("return vec4(positivePower(a.x, a.x), positivePower(a.x, 2.0), positivePower(-b.w, 2.0), 0.0);"),
              glm::vec4(1, 0, 0, 0));
    EXPECT_EQ(run("return vec4(normalizeOr(a.xyz, c.xyz), 0.0);"), glm::vec4(0, 0, 1, 0));
    EXPECT_EQ(run("return vec4(normalizeOr(b.xyz, c.xyz), 0.0);"), glm::vec4(1, 0, 0, 0));
    EXPECT_EQ(run("return vec4(blinnPhongHighlight(c.xyz, c.xyz, -c.xyz, a.x), blinnPhongHighlight(c.xyz, c.xyz, "
                  "c.xyz, a.x),\n"
                  "            inverseSquare(a.x) / 1.0e4, rangeWindow(b.x, a.x));"),
              glm::vec4(0, 1, 1, 1));
    const glm::vec4 mirror =
        run("MetallicRoughness m;\n"
            "m.baseColour = vec3(1.0); m.metallic = b.w; m.roughness = a.x;\n"
            "return vec4(metallicRoughnessReflect(m, c.xyz, c.xyz, c.xyz).x,\n"
            "            metallicRoughnessReflect(m, c.xyz, c.xyz, -c.xyz).x,\n"
            "            metallicRoughnessReflect(m, c.xyz, a.xyz, c.xyz).x, 0.0);");
    // 1 / (4 pi alpha^2) at the smallest roughness, 0.045.
    EXPECT_NEAR(mirror.x, 19406.0f, 1.0f);
    EXPECT_EQ(mirror.y, 0);
    EXPECT_EQ(mirror.z, 0);
}

}  // namespace
}  // namespace umbriel::gl
