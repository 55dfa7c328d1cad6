#include "server/bake/gl_maker.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "common/base/assert.h"
#include "common/visibility/chag.h"
#include "common/visibility/map_maker.h"
#include "common/visibility/raster_plan.h"
#include "common/visibility/triangle_cells.h"
#include "server/gl/buffer.h"
#include "server/gl/framebuffer.h"
#include "server/gl/program.h"
#include "server/gl/readback.h"
#include "server/gl/shader_source.h"
#include "server/gl/vertex_array.h"
#include "shaders/structs_cpp.h"

namespace umbriel {
namespace {

using visibility::RasterPlan;
using visibility::RasterView;
using visibility::TriangleCells;

// Tiles of so many texels make one picture; above some millions nothing becomes faster, and reading back waits longer.
constexpr std::uint32_t kPictureSide = 2048;
constexpr std::uint32_t kMostRowsAtOnce = 128;
// Small enough that most of a cell is seen when it is, large enough that drivers see few commands.
constexpr std::uint32_t kTrianglesPerCell = 48;
// Of glMultiDrawElementsIndirect.
struct DrawCommand {
    std::uint32_t count, instances, firstIndex, baseVertex, baseInstance;
};

template <class T>
std::span<const std::byte> bytesOf(const std::vector<T>& values) {
    return std::as_bytes(std::span(values));
}

// Grows in steps, so that batches of about one size share one buffer.
Result<void> fill(gl::Buffer& buffer, std::span<const std::byte> content) {
    if (buffer.size() < content.size()) {
        auto created = gl::Buffer::create(content.size() + content.size() / 2);
        if (!created) return created.error();
        buffer = std::move(*created);
    }
    if (!content.empty()) buffer.write(0, content);
    return {};
}

Result<gl::Program> linkProgram(bool far) {
    const std::vector<gl::ShaderDefine> defines =
        far ? std::vector<gl::ShaderDefine>{{"FEATURE_FAR"}} : std::vector<gl::ShaderDefine>{};
    std::vector<gl::ShaderStage> stages;
    for (const auto& [stage, file] : {std::pair{GL_VERTEX_SHADER, "stage/visibility_map.vert.glsl"},
                                      std::pair{GL_FRAGMENT_SHADER, "stage/visibility_map.frag.glsl"}}) {
        auto source = gl::composeShader(file, defines);
        if (!source) return source.error();
        stages.push_back({static_cast<GLenum>(stage), file, std::move(*source)});
    }
    return gl::Program::link(stages);
}

}  // namespace

struct GlMaker::State {
    const visibility::BakeMesh& mesh;
    visibility::Mapping mapping;
    RasterPlan plan;
    trace::NormalisedPositions points;  // in which everything below is measured
    TriangleCells cells;
    double farDistance = 0.0;
    std::uint32_t columns = 1, rowsAtOnce = 1;  // tiles of a picture
    std::vector<std::size_t> texel;             // for each pixel: index in the picture, from its tile's first

    gl::Program program;     // with the culling radius, if there is one
    gl::Program ownProgram;  // without
    gl::Buffer positions, indices, ownIndices, eyes, pictures, commands;
    gl::VertexArray vertexArray;
    gl::Renderbuffer image;
    std::optional<gl::Framebuffer> framebuffer;
    GLint farLocation = -1;
    Statistics statistics;

    // Scratch.
    std::vector<gpu::GpuRasterEye> eyeData;
    std::vector<std::vector<std::uint32_t>> shows;  // for each cell the pictures that may show it
    std::vector<std::uint32_t> pictureData;
    std::vector<DrawCommand> commandData;
    std::vector<std::uint32_t> ownIndexData;
    std::vector<std::byte> read;

    explicit State(const visibility::BakeMesh& bakeMesh) : mesh(bakeMesh) {}

    int width() const { return image.size().x; }
    glm::ivec2 tileOf(std::uint32_t slot) const {
        return {static_cast<int>(slot % columns * plan.width), static_cast<int>(slot / columns * plan.height)};
    }
    bool isFar() const { return std::isfinite(farDistance); }
    void addViews(std::uint32_t slot, std::uint32_t row);
    void addOwn(std::uint32_t slot, std::uint32_t row);
    Result<void> draw(std::uint32_t firstRow, std::uint32_t slots);
};

// The eye of each view, and which cells it may show.
void GlMaker::State::addViews(std::uint32_t slot, std::uint32_t row) {
    const double near = kNearShare * points.diagonal, epsilon = kLiftShare * points.diagonal;
    const trace::Origin origin = visibility::origin(mesh, row, directionFrame(mapping));
    const glm::dmat3 axes(origin.axes);
    const glm::dvec3 normal(origin.normal);
    std::array<double, 2> lift{};
    for (const bool lower : {false, true}) {
        if (lower && std::ranges::none_of(plan.views, &RasterView::lower)) continue;
        const double alpha = visibility::steepestAngle(mesh, row, lower);
        lift[lower] = plan.allAround ? visibility::cameraHeightAllAround(alpha, near, epsilon)
                                     : visibility::cameraHeight(mapping.kind, mapping.fovy, alpha, near, epsilon);
    }
    const glm::ivec2 tile = tileOf(slot);
    const glm::dvec2 whole(image.size());
    for (const RasterView& view : plan.views) {
        const glm::dvec3 out = axes * view.out, along = axes * view.along, up = axes * view.up;
        const glm::dvec3 eye = normal * (view.lower ? -lift[1] : lift[0]);  // from the origin
        const auto line = [&](const glm::dvec3& n) { return glm::vec4(glm::vec3(n), float(-glm::dot(n, eye))); };
        gpu::GpuRasterEye e;
        e.origin = points.positions[origin.position];
        e.nearest = static_cast<float>(near);
        e.depthRow = line(out);
        e.xRow = line((2.0 * along - (view.x0 + view.x1) * out) / (view.x1 - view.x0));
        e.yRow = line((2.0 * up - (view.y0 + view.y1) * out) / (view.y1 - view.y0));
        const glm::dvec2 size(view.width, view.height), first(tile.x, tile.y + static_cast<int>(view.bottom));
        e.place = glm::vec4(size / whole, (2.0 * first + size) / whole - 1.0);

        visibility::ViewPyramid pyramid;
        pyramid.eye = glm::vec3(glm::dvec3(e.origin) + eye);
        pyramid.normals[0] = glm::vec3(along - view.x0 * out);
        pyramid.normals[1] = glm::vec3(view.x1 * out - along);
        pyramid.normals[2] = glm::vec3(up - view.y0 * out);
        pyramid.normals[3] = glm::vec3(view.y1 * out - up);
        pyramid.radius = static_cast<float>(farDistance + glm::length(eye));
        pyramid.slack = static_cast<float>(1e-5 * points.diagonal * (1.0 + view.x1));
        const auto picture = static_cast<std::uint32_t>(eyeData.size());
        eyeData.push_back(e);
        for (std::size_t c = 0; c < cells.cells.size(); ++c) {
            if (pyramid.mayShow(cells.cells[c])) shows[c].push_back(picture);
        }
    }
}

// The own triangles block at any distance, as for rays.
void GlMaker::State::addOwn(std::uint32_t slot, std::uint32_t row) {
    const auto first = static_cast<std::uint32_t>(ownIndexData.size());
    for (const std::uint32_t triangle : mesh.ownTriangles(mesh.rows[row].position)) {
        for (int corner = 0; corner < 3; ++corner) {
            ownIndexData.push_back(static_cast<std::uint32_t>(cells.positions.size()) +
                                   mesh.triangles[triangle][corner]);
        }
    }
    const auto views = static_cast<std::uint32_t>(plan.views.size());
    commandData.push_back({static_cast<std::uint32_t>(ownIndexData.size()) - first, views, first, 0,
                           static_cast<std::uint32_t>(pictureData.size())});
    for (std::uint32_t view = 0; view < views; ++view) pictureData.push_back(slot * views + view);
}

Result<void> GlMaker::State::draw(std::uint32_t firstRow, std::uint32_t slots) {
    pictureData.clear();
    commandData.clear();
    ownIndexData.clear();
    for (std::size_t c = 0; c < shows.size(); ++c) {
        const auto instances = static_cast<std::uint32_t>(shows[c].size());
        if (instances == 0) continue;
        commandData.push_back({cells.cells[c].indexCount, instances, cells.cells[c].firstIndex, 0,
                               static_cast<std::uint32_t>(pictureData.size())});
        pictureData.insert(pictureData.end(), shows[c].begin(), shows[c].end());
        statistics.triangles += std::uint64_t{instances} * cells.cells[c].indexCount / 3;
        statistics.cellViews += instances;
        shows[c].clear();
    }
    const std::size_t cellCommands = commandData.size();
    if (isFar()) {
        for (std::uint32_t slot = 0; slot < slots; ++slot) addOwn(slot, firstRow + slot);
        if (auto done = fill(ownIndices, bytesOf(ownIndexData)); !done) return done;
    }
    if (auto done = fill(eyes, bytesOf(eyeData)); !done) return done;
    if (auto done = fill(pictures, bytesOf(pictureData)); !done) return done;
    if (auto done = fill(commands, bytesOf(commandData)); !done) return done;
    eyeData.clear();

    const auto height = static_cast<int>((slots + columns - 1) / columns * plan.height);
    framebuffer->bind();
    glDisable(GL_SCISSOR_TEST);
    framebuffer->clearColour(0, glm::vec4(0.0f));
    glViewport(0, 0, image.size().x, image.size().y);
    for (const GLenum state : {GL_DEPTH_TEST, GL_CULL_FACE, GL_BLEND, GL_DITHER, GL_DEPTH_CLAMP, GL_STENCIL_TEST})
        glDisable(state);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    for (GLenum plane = 0; plane < 4; ++plane) glEnable(GL_CLIP_DISTANCE0 + plane);
    program.use();
    program.set(farLocation, static_cast<float>(farDistance));
    eyes.bindBase(GL_SHADER_STORAGE_BUFFER, 0);
    vertexArray.vertexBuffer(1, pictures, 0, sizeof(std::uint32_t), 1);
    vertexArray.elementBuffer(indices);
    vertexArray.bind();
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, commands.id());
    glMultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_INT, nullptr, static_cast<GLsizei>(cellCommands), 0);
    if (isFar()) {
        ownProgram.use();
        vertexArray.elementBuffer(ownIndices);
        glMultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_INT,
                                    reinterpret_cast<const void*>(cellCommands * sizeof(DrawCommand)),
                                    static_cast<GLsizei>(commandData.size() - cellCommands), 0);
    }
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
    for (GLenum plane = 0; plane < 4; ++plane) glDisable(GL_CLIP_DISTANCE0 + plane);
    read.resize(static_cast<std::size_t>(image.size().x) * static_cast<std::size_t>(height));
    return gl::readPixels(*framebuffer, 0, {{0, 0}, {image.size().x, height}}, GL_RED, GL_UNSIGNED_BYTE, read);
}

GlMaker::GlMaker(std::unique_ptr<State> state) : _state(std::move(state)) {}
GlMaker::~GlMaker() = default;

Result<std::unique_ptr<GlMaker>> GlMaker::create(const visibility::BakeMesh& mesh, const visibility::Mapping& mapping,
                                                 double farDistance) {
    if (const auto valid = check(mapping); !valid) return valid.error();
    auto state = std::make_unique<State>(mesh);
    State& s = *state;
    s.mapping = mapping;
    s.plan = visibility::rasterPlan(mapping);
    s.points = trace::normalise(mesh.positions);
    s.farDistance = farDistance * s.points.scale;
    s.cells = TriangleCells::make({s.points.positions, mesh.triangles}, kTrianglesPerCell);
    s.shows.resize(s.cells.cells.size());

    GLint maxSide = 0, maxBlocks = 0;
    glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &maxSide);
    glGetIntegerv(GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS, &maxBlocks);
    if (maxBlocks < 1) return failure("OpenGL: this driver has no storage buffers in vertex shaders");
    const auto most = static_cast<std::uint32_t>(maxSide);
    if (s.plan.width > most || s.plan.height > most) {
        return badInput(
            fmt::format("maps of {} x {} texels do not fit this driver's pictures of {}; choose a smaller size",
                        s.plan.width, s.plan.height, most));
    }
    const std::uint32_t side = std::min(kPictureSide, most);
    s.columns = std::max(1u, side / s.plan.width);
    s.rowsAtOnce = std::clamp(s.columns * std::max(1u, side / s.plan.height), 1u, kMostRowsAtOnce);
    s.columns = std::min(s.columns, s.rowsAtOnce);
    const glm::ivec2 size(s.columns * s.plan.width, (s.rowsAtOnce + s.columns - 1) / s.columns * s.plan.height);
    for (const std::uint32_t texel : s.plan.texel) {
        s.texel.push_back(std::size_t{texel / s.plan.width} * static_cast<std::size_t>(size.x) + texel % s.plan.width);
    }

    auto program = linkProgram(s.isFar());
    if (!program) return program.error();
    s.program = std::move(*program);
    if (s.isFar()) {
        auto own = linkProgram(false);
        if (!own) return own.error();
        s.ownProgram = std::move(*own);
    }
    s.farLocation = s.program.location("farDistance");
    auto image = gl::Renderbuffer::create(GL_R8, size);
    if (!image) return image.error();
    s.image = std::move(*image);
    const std::array attachments{gl::Attachment(s.image)};
    auto framebuffer = gl::Framebuffer::create(attachments);
    if (!framebuffer) return framebuffer.error();
    s.framebuffer = std::move(*framebuffer);
    std::vector<glm::vec3> all = s.cells.positions;
    if (s.isFar()) all.insert(all.end(), s.points.positions.begin(), s.points.positions.end());
    auto positions = gl::Buffer::create(bytesOf(all));
    if (!positions) return positions.error();
    s.positions = std::move(*positions);
    auto indices = gl::Buffer::create(bytesOf(s.cells.indices));
    if (!indices) return indices.error();
    s.indices = std::move(*indices);
    s.vertexArray = gl::VertexArray::create();
    s.vertexArray.attribute({.location = 0, .binding = 0, .components = 3});
    s.vertexArray.attribute({.location = 1, .binding = 1, .components = 1, .type = GL_UNSIGNED_INT, .integer = true});
    s.vertexArray.vertexBuffer(0, s.positions, 0, sizeof(glm::vec3));
    if (auto checked = gl::checkError("the pictures of visibility maps"); !checked) return checked.error();
    return std::unique_ptr<GlMaker>(new GlMaker(std::move(state)));
}

Result<void> GlMaker::masks(std::uint32_t firstRow, std::uint32_t rowCount, std::span<std::uint8_t> masks) {
    State& s = *_state;
    const std::size_t bytes = visibility::maskBytes(visibility::pixelCount(s.mapping));
    UMBRIEL_ASSERT(std::uint64_t{firstRow} + rowCount <= s.mesh.rows.size(), "rows outside the mesh");
    UMBRIEL_ASSERT(masks.size() == rowCount * bytes, "a mask for each row");
    std::ranges::fill(masks, std::uint8_t{0});
    for (std::uint32_t done = 0; done < rowCount;) {
        const std::uint32_t slots = std::min(s.rowsAtOnce, rowCount - done);
        for (std::uint32_t slot = 0; slot < slots; ++slot) s.addViews(slot, firstRow + done + slot);
        if (auto drawn = s.draw(firstRow + done, slots); !drawn) return drawn;
        for (std::uint32_t slot = 0; slot < slots; ++slot) {
            const glm::ivec2 tile = s.tileOf(slot);
            const std::byte* first = s.read.data() + static_cast<std::size_t>(tile.y) * s.width() + tile.x;
            std::uint8_t* mask = masks.data() + (done + slot) * bytes;
            for (std::size_t pixel = 0; pixel < s.texel.size(); ++pixel) {
                if (first[s.texel[pixel]] == std::byte{0})
                    mask[pixel / 8] |= static_cast<std::uint8_t>(1u << pixel % 8);
            }
        }
        done += slots;
        s.statistics.rows += slots;
    }
    return {};
}

std::uint32_t GlMaker::rowsAtOnce() const {
    return _state->rowsAtOnce;
}
const GlMaker::Statistics& GlMaker::statistics() const {
    return _state->statistics;
}
std::uint32_t GlMaker::cells() const {
    return static_cast<std::uint32_t>(_state->cells.cells.size());
}
std::uint32_t GlMaker::views() const {
    return static_cast<std::uint32_t>(_state->plan.views.size());
}

}  // namespace umbriel
