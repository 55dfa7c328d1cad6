#include <fmt/format.h>

#include <array>
#include <bit>
#include <chrono>
#include <thread>

#include "server/gl/query.h"
#include "server/gl/readback.h"
#include "server/gl/shader_source.h"
#include "server/gl/workarounds.h"
#include "tests/golden/gl_fixture.h"
#include "tests/support/wait_until.h"

namespace umbriel::gl {
namespace {

using GlObjects = GlTest;

// Covers the viewport with one triangle at a depth given by a uniform, without vertex buffers.
constexpr std::string_view kFillVertex = R"(#version 450 core
layout(location = 0) uniform vec2 depthAndW;
void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner * depthAndW.y, depthAndW.x, depthAndW.y);
}
)";
constexpr std::string_view kFillFragment = R"(#version 450 core
layout(location = 1) uniform vec4 colour;
layout(location = 0) out vec4 result;
void main() { result = colour; }
)";

std::vector<ShaderStage> fillStages() {
    return {{GL_VERTEX_SHADER, "fill.vert.glsl", std::string(kFillVertex)},
            {GL_FRAGMENT_SHADER, "fill.frag.glsl", std::string(kFillFragment)}};
}

TEST_F(GlObjects, ContextSaysWhoDraws) {
    const ContextInfo& info = context->info();
    EXPECT_FALSE(info.renderer.empty());
    EXPECT_FALSE(info.vendor.empty());
    EXPECT_GE(info.version, "4.5");
    EXPECT_FALSE(info.platform.empty());
    // The minima of OpenGL 4.5, table 23.
    EXPECT_GE(info.limits.maxTextureSize, 16384);
    EXPECT_GE(info.limits.maxViewportWidth, 16384);
    EXPECT_GE(info.limits.maxSamples, 4);
    EXPECT_GE(info.limits.maxColourAttachments, 8);
    EXPECT_EQ(info.isSoftware, info.renderer.find("llvmpipe") != std::string::npos);
    EXPECT_NE(report(info)[1].find(info.renderer), std::string::npos);
}

TEST_F(GlObjects, DevicePlatformGivesAContextToo) {
    if (listDevices().empty()) GTEST_SKIP() << "EGL lists no devices here";
    auto device = HeadlessContext::create({.deviceIndex = 0});
    ASSERT_TRUE(device) << device.error().message;
    EXPECT_EQ(device->info().platform, "device 0");
    EXPECT_TRUE(device->isCurrent());
    EXPECT_FALSE(context->isCurrent());
    ASSERT_TRUE(context->makeCurrent());
}

TEST_F(GlObjects, AMissingDeviceIsBadInput) {
    const auto device = HeadlessContext::create({.deviceIndex = 1000});
    ASSERT_FALSE(device);
    EXPECT_EQ(device.error().kind, Error::Kind::BadInput);
    EXPECT_NE(device.error().message.find("1000"), std::string::npos);
}

TEST_F(GlObjects, ContextMovesToAnotherThread) {
    context->releaseCurrent();
    std::string version;
    std::thread other([&] {
        if (!context->makeCurrent()) return;
        version = reinterpret_cast<const char*>(glGetString(GL_VERSION));
        context->releaseCurrent();
    });
    other.join();
    EXPECT_EQ(version, context->info().version);
    ASSERT_TRUE(context->makeCurrent());
}

TEST_F(GlObjects, ContextsOfOneProcessDrawIndependently) {
    std::array<glm::vec4, 4> seen{};
    std::vector<std::thread> threads;
    for (size_t i = 0; i < seen.size(); ++i)
        threads.emplace_back([&seen, i] {
            auto own = HeadlessContext::create();
            if (!own) return;
            auto image = Texture2D::create(GL_RGBA32F, {4, 4});
            if (!image) return;
            auto framebuffer = Framebuffer::create(std::array{Attachment(*image)});
            if (!framebuffer) return;
            framebuffer->clearColour(0, glm::vec4(static_cast<float>(i + 1)));
            if (auto pixels = readPixelsFloat(*framebuffer, 0, {{3, 3}, {1, 1}})) seen[i] = pixels->front();
        });
    for (std::thread& thread : threads) thread.join();
    for (size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(seen[i], glm::vec4(static_cast<float>(i + 1)));
}

TEST_F(GlObjects, ClearedFloatImageReadsBackBitExact) {
    const Texture2D image = require(Texture2D::create(GL_RGBA32F, {5, 3}));
    Framebuffer framebuffer = require(Framebuffer::create(std::array{Attachment(image)}));
    // A denormal, a value with all mantissa bits, a huge one and a negative zero.
    const glm::vec4 value(1.0e-40f, 1.0f / 3.0f, 3.4e38f, -0.0f);
    framebuffer.clearColour(0, value);
    const auto pixels = require(readPixelsFloat(framebuffer, 0, {{0, 0}, {5, 3}}));
    ASSERT_EQ(pixels.size(), 15u);
    for (const glm::vec4& pixel : pixels)
        for (int i = 0; i < 4; ++i) EXPECT_EQ(std::bit_cast<uint32_t>(pixel[i]), std::bit_cast<uint32_t>(value[i]));
}

TEST_F(GlObjects, UnsignedAndDepthImagesReadBackExact) {
    const Texture2D ids = require(Texture2D::create(GL_RGBA32UI, {7, 2}));
    const Renderbuffer depth = require(Renderbuffer::create(GL_DEPTH_COMPONENT32F, {7, 2}));
    Framebuffer framebuffer = require(Framebuffer::create(std::array{Attachment(ids)}, Attachment(depth)));
    const glm::uvec4 value(0, 1, 0x80000000u, 0xffffffffu);
    framebuffer.clearColourUint(0, value);
    framebuffer.clearDepth(0.3f);
    EXPECT_EQ(require(readPixelsUint(framebuffer, 0, {{6, 1}, {1, 1}})).front(), value);
    EXPECT_EQ(require(readPixelsDepth(framebuffer, {{0, 0}, {7, 2}})).front(), 0.3f);
}

TEST_F(GlObjects, RowsComeBackBottomFirst) {
    Texture2D image = require(Texture2D::create(GL_RGBA32F, {2, 2}));
    const std::array<glm::vec4, 4> pixels{glm::vec4(0), glm::vec4(1), glm::vec4(2), glm::vec4(3)};
    image.upload(0, GL_RGBA, GL_FLOAT, std::as_bytes(std::span(pixels)));
    const Framebuffer framebuffer = require(Framebuffer::create(std::array{Attachment(image)}));
    EXPECT_EQ(require(readPixelsFloat(framebuffer, 0, {{0, 1}, {2, 1}})), (std::vector{glm::vec4(2), glm::vec4(3)}));
}

TEST_F(GlObjects, MipLevelsAverageInLinearLight) {
    // Black and white sRGB texels: their mean is 0.5 in linear light, sRGB code 187.5; averaging the codes gives 127.5.
    Texture2D image = require(Texture2D::create(GL_SRGB8_ALPHA8, {2, 1}, fullMipLevels({2, 1})));
    const std::array<unsigned char, 8> texels{0, 0, 0, 255, 255, 255, 255, 255};
    image.upload(0, GL_RGBA, GL_UNSIGNED_BYTE, std::as_bytes(std::span(texels)));
    image.generateMipmaps();
    std::array<unsigned char, 4> level1{};
    glGetTextureImage(image.id(), 1, GL_RGBA, GL_UNSIGNED_BYTE, sizeof level1, level1.data());
    EXPECT_NEAR(level1[0], 187.5, 1);  // drivers may round either way
}

TEST_F(GlObjects, FullMipLevelsReachOneTexel) {
    EXPECT_EQ(fullMipLevels({1, 1}), 1);
    EXPECT_EQ(fullMipLevels({1024, 3}), 11);
    EXPECT_EQ(fullMipLevels({1023, 1}), 10);
}

TEST_F(GlObjects, BuffersKeepTheirBytes) {
    Buffer buffer = require(Buffer::create(size_t{64}));
    const std::array<uint32_t, 4> written{1, 2, 3, 0xdeadbeef};
    buffer.write(16, std::as_bytes(std::span(written)));
    std::array<uint32_t, 4> read{};
    buffer.read(16, std::as_writable_bytes(std::span(read)));
    EXPECT_EQ(read, written);
    EXPECT_EQ(require(Buffer::create(std::span<const std::byte>())).size(), 0u);
}

TEST_F(GlObjects, AnImpossibleTextureIsAnError) {
    const auto texture = Texture2D::create(GL_RGBA32F, {1 << 24, 1});
    ASSERT_FALSE(texture);
    EXPECT_NE(texture.error().message.find("16777216x1"), std::string::npos) << texture.error().message;
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
}

TEST_F(GlObjects, AnIncompleteFramebufferIsAnError) {
    const Texture2D single = require(Texture2D::create(GL_RGBA32F, {4, 4}));
    const Renderbuffer several = require(Renderbuffer::create(GL_RGBA32F, {4, 4}, 4));
    const auto framebuffer = Framebuffer::create(std::array{Attachment(single), Attachment(several)});
    ASSERT_FALSE(framebuffer);
    EXPECT_NE(framebuffer.error().message.find("sample"), std::string::npos) << framebuffer.error().message;
}

TEST_F(GlObjects, ReversedDepthSeparatesNearlyEqualFarDistances) {
    // Infinite reversed-Z: depth = near / distance, with near 0.1 (feasibility: a float resolves it to 6e-8 relative).
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    const Texture2D image = require(Texture2D::create(GL_RGBA32F, {2, 2}));
    const Texture2D depth = require(Texture2D::create(GL_DEPTH_COMPONENT32F, {2, 2}));
    Framebuffer framebuffer = require(Framebuffer::create(std::array{Attachment(image)}, Attachment(depth)));
    framebuffer.clearColour(0, glm::vec4(0));
    framebuffer.clearDepth(0);
    const Program program = require(Program::link(fillStages()));
    const VertexArray vertices = VertexArray::create();
    vertices.bind();
    framebuffer.bind();
    program.use();
    glViewport(0, 0, 2, 2);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    const auto fill = [&](float distance, glm::vec4 colour) {
        program.set(0, glm::vec2(0.1f, distance));
        program.set(1, colour);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        return require(readPixelsDepth(framebuffer, {{0, 0}, {1, 1}})).front();
    };
    const float farther = fill(10000.0f, glm::vec4(1, 0, 0, 1));
    const float nearer = fill(9999.9f, glm::vec4(0, 1, 0, 1));
    EXPECT_GT(nearer, farther);
    EXPECT_NEAR(farther, 0.1f / 10000.0f, 1e-11);  // one ulp at 1e-5 is 9e-13; rasterisation costs a few
    fill(10000.0f, glm::vec4(0, 0, 1, 1));
    EXPECT_EQ(require(readPixelsFloat(framebuffer, 0, {{0, 0}, {1, 1}})).front(), glm::vec4(0, 1, 0, 1));
}

TEST_F(GlObjects, AShaderErrorQuotesItsLine) {
    std::vector<ShaderStage> stages = fillStages();
    stages[1].source =
        "#version 450 core\nlayout(location = 0) out vec4 result;\nvoid main() {\n    result = undeclaredThing;\n}\n";
    const auto program = Program::link(stages);
    ASSERT_FALSE(program);
    const std::string& message = program.error().message;
    EXPECT_NE(message.find("> fill.frag.glsl:4:     result = undeclaredThing;"), std::string::npos) << message;
    EXPECT_NE(message.find("fill.frag.glsl:3: void main() {"), std::string::npos) << message;
}

TEST_F(GlObjects, AShaderErrorInAnIncludeQuotesThatFile) {
    const std::array<shaders::ShaderFile, 2> files{
        {{"stage/a.frag.glsl",
          "layout(location = 0) out vec4 result;\n#include \"part.glsl\"\nvoid main() { result = vec4(broken()); }\n"},
         {"part.glsl", "// a comment\nfloat broken() {\n    return nothing;\n}\n"}}};
    const std::string source = require(composeShader(files, "stage/a.frag.glsl"));
    std::vector<ShaderStage> stages = fillStages();
    stages[1] = {GL_FRAGMENT_SHADER, "stage/a.frag.glsl", source};
    const auto program = Program::link(stages);
    ASSERT_FALSE(program);
    EXPECT_NE(program.error().message.find("> part.glsl:3:     return nothing;"), std::string::npos)
        << program.error().message;
}

TEST_F(GlObjects, StagesThatDoNotFitAreAnError) {
    std::vector<ShaderStage> stages = fillStages();
    stages[1].source = "#version 450 core\nin vec4 missing;\nout vec4 result;\nvoid main() { result = missing; }\n";
    const auto program = Program::link(stages);
    ASSERT_FALSE(program);
    EXPECT_NE(program.error().message.find("do not link"), std::string::npos) << program.error().message;
}

TEST_F(GlObjects, QueriesCountAndFencesPass) {
    const Texture2D image = require(Texture2D::create(GL_RGBA32F, {8, 4}));
    const Framebuffer framebuffer = require(Framebuffer::create(std::array{Attachment(image)}));
    const Program program = require(Program::link(fillStages()));
    program.set(0, glm::vec2(0, 1));
    const VertexArray vertices = VertexArray::create();
    vertices.bind();
    framebuffer.bind();
    program.use();
    glViewport(0, 0, 8, 4);
    Query samples(GL_SAMPLES_PASSED);
    samples.begin();
    glDrawArrays(GL_TRIANGLES, 0, 3);
    samples.end();
    Fence fence = Fence::insert();
    EXPECT_TRUE(require(fence.wait(umbriel::test::kPatience)));
    EXPECT_EQ(samples.result(), 32u);
}

TEST_F(GlObjects, MovedFromObjectsAreEmptyAndDeleteNothing) {
    Buffer first = require(Buffer::create(size_t{16}));
    const GLuint id = first.id();
    Buffer second = std::move(first);
    EXPECT_FALSE(first);
    EXPECT_EQ(second.id(), id);
    EXPECT_TRUE(glIsBuffer(id));
    second = Buffer();
    EXPECT_FALSE(glIsBuffer(id));
}

#ifdef UMBRIEL_DEBUG
TEST_F(GlObjects, DebugBuildsEndWhenAnObjectDiesWithoutItsContext) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    EXPECT_DEATH(
        {
            const Buffer orphan = require(Buffer::create(size_t{16}));
            context->releaseCurrent();
        },
        "its context is not current");
}
#endif

TEST(ShaderSource, IncludesEachFileOnceAndPutsDefinesFirst) {
    const std::array<shaders::ShaderFile, 3> files{{{"main.glsl", "#include \"b.glsl\"\n#include \"a.glsl\"\nmain\n"},
                                                    {"a.glsl", "a\n"},
                                                    {"b.glsl", "#include \"a.glsl\"\nb\n"}}};
    const std::array<ShaderDefine, 2> defines{{{"USE_X"}, {"COUNT", "3"}}};
    const auto text = composeShader(files, "main.glsl", defines);
    ASSERT_TRUE(text);
    EXPECT_EQ(*text,
              "#version 450 core\n#define USE_X 1\n#define COUNT 3\n//@ main.glsl:1\n//@ b.glsl:1\n"
              "//@ a.glsl:1\na\n//@ b.glsl:2\nb\n//@ main.glsl:2\n//@ main.glsl:3\nmain\n");
}

TEST(ShaderSource, ADefineMayNameTheIncludedFile) {
    const std::array<shaders::ShaderFile, 3> files{
        {{"main.glsl", "#include MODEL\nmain\n"}, {"a.glsl", "a\n"}, {"b.glsl", "b\n"}}};
    const std::array<ShaderDefine, 1> defines{{{"MODEL", "\"b.glsl\""}}};
    const auto text = composeShader(files, "main.glsl", defines);
    ASSERT_TRUE(text);
    EXPECT_EQ(*text, "#version 450 core\n//@ main.glsl:1\n//@ b.glsl:1\nb\n//@ main.glsl:2\nmain\n");
    EXPECT_FALSE(composeShader(files, "main.glsl"));
}

TEST(ShaderSource, AMissingIncludeNamesItsPlace) {
    const std::array<shaders::ShaderFile, 1> files{{{"main.glsl", "\n#include \"gone.glsl\"\n"}}};
    const auto text = composeShader(files, "main.glsl");
    ASSERT_FALSE(text);
    EXPECT_NE(text.error().message.find("gone.glsl"), std::string::npos);
    EXPECT_NE(text.error().message.find("main.glsl:2"), std::string::npos);
}

TEST(ShaderLog, PlacesOfEveryDriverAreFound) {
    const std::string_view source = "#version 450 core\nfirst\nsecond\nthird\n";
    for (const char* message : {"0:3(5): error: x", "0(3) : error C1008: x", "ERROR: 0:3: x"})
        EXPECT_NE(explainShaderLog("s.glsl", source, message).find("> s.glsl:3: second"), std::string::npos) << message;
}

TEST(GlWorkarounds, ApplyByRendererAndSwitchOffByName) {
    ContextInfo software;
    software.renderer = "llvmpipe (LLVM 15.0.6, 256 bits)";
    EXPECT_TRUE(Workarounds::detect(software)->isActive(Workaround::LlvmpipeTimerQueriesLie));
    const std::array<std::string, 1> off{"mesa-llvmpipe-timer-queries-lie"};
    const auto disabled = Workarounds::detect(software, off);
    EXPECT_FALSE(disabled->isActive(Workaround::LlvmpipeTimerQueriesLie));
    EXPECT_NE(disabled->report().front().find("(off)"), std::string::npos);
    ContextInfo hardware;
    hardware.renderer = "NVIDIA H200/PCIe/SSE2";
    EXPECT_TRUE(Workarounds::detect(hardware)->report().empty());
    const std::array<std::string, 1> unknown{"no-such-thing"};
    EXPECT_EQ(Workarounds::detect(hardware, unknown).error().kind, Error::Kind::BadInput);
}

}  // namespace
}  // namespace umbriel::gl
