#include "server/draw/tile_painter.h"

#include <algorithm>
#include <cstring>

namespace umbriel {
namespace {

constexpr GLuint kFrameBinding = 0;
constexpr GLuint kLightBlockBinding = 2;

// As the block in shaders/snippet/frame.glsl.
struct FrameBlock {
    glm::mat4 clipFromRelative;
    glm::vec4 forward;
    glm::vec4 shadowColour;
    glm::vec4 region;
    glm::vec4 wallOrigin;
    glm::vec4 fog;
    glm::vec4 fogColour;
};

bool isOfDarkness(PassKind kind) {
    return kind == PassKind::Darkness || kind == PassKind::Factors || kind == PassKind::Edges ||
           kind == PassKind::Gauss;
}

}  // namespace

Result<void> StreamBuffer::set(std::span<const std::byte> content) {
    if (_buffer && content.size() == _content.size() && std::equal(content.begin(), content.end(), _content.begin()))
        return {};
    if (!_buffer || content.size() > _buffer.size()) {
        auto buffer = gl::Buffer::create(std::max<std::size_t>(content.size() * 3 / 2, 256));
        if (!buffer) return buffer.error();
        _buffer = std::move(*buffer);
    }
    _content.assign(content.begin(), content.end());
    _buffer.write(0, content);
    return {};
}

void TilePainter::beginFrame() {
    if (!_noVertices) _noVertices = gl::VertexArray::create();
    _counts = {};
    // Depth from 1 at the near plane to 0 at infinity, in floating point: precise at every distance.
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glCullFace(GL_BACK);
    // Flat shading takes the colour of a triangle's first vertex.
    glProvokingVertex(GL_FIRST_VERTEX_CONVENTION);
    glDisable(GL_BLEND);
    glDisable(GL_DEPTH_CLAMP);
    glDisable(GL_POLYGON_OFFSET_FILL);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
}

Result<void> TilePainter::setLights(std::size_t view, LightList& lights) {
    fillLightBlocks(lights);
    LightBuffers& buffers = _lightBuffers[view];
    if (auto set = buffers.lights.set(std::as_bytes(std::span(lights.lights))); !set) return set;
    if (auto set = buffers.indices.set(std::as_bytes(std::span(lights.indices))); !set) return set;
    if (!lights.webs.empty())
        if (auto set = buffers.webs.set(std::as_bytes(std::span(lights.webs))); !set) return set;
    if (!lights.blocks.empty())
        if (auto set = buffers.blocks.set(std::as_bytes(std::span(lights.blocks))); !set) return set;
    return buffers.shadows.set(std::as_bytes(std::span(lights.shadows)));
}

void TilePainter::bindLights(const gl::Program& program, const LightList::Run& run) {
    constexpr std::size_t kBytes = gpu::kBlockLights * sizeof(gpu::BlockLight);
    static_assert(kBytes % 256 == 0);
    if (run.block)
        _lights->blocks.buffer().bindRange(GL_UNIFORM_BUFFER, kLightBlockBinding, *run.block * kBytes, kBytes);
    else
        glProgramUniform2ui(program.id(), 2, run.first, run.count);
}

void TilePainter::bindView(const ViewPainting& painting) {
    const View& view = *painting.scene.view;
    const glm::ivec2 origin = _targets.wallOrigin();
    FrameBlock block{};
    glm::dmat4 clipFromRelative = clipFromRelativeOf(view);
    glm::ivec4 viewport(view.region.x - origin.x, view.region.y - origin.y, view.region.width, view.region.height);
    if (view.region.width > _viewportLimit.x || view.region.height > _viewportLimit.y || viewport.x < -32768 ||
        viewport.y < -32768) {
        // Beyond what a viewport can be: the part of it that this block shows, as a crop of clip space in double;
        // of the whole block, so that it does not depend on the tile.
        const PixelRect& area = painting.block;
        const glm::dvec2 scale(double(view.region.width) / area.width, double(view.region.height) / area.height);
        const glm::dvec2 middle((2.0 * (area.x - view.region.x) + area.width) / view.region.width - 1.0,
                                (2.0 * (area.y - view.region.y) + area.height) / view.region.height - 1.0);
        glm::dmat4 crop(1.0);
        crop[0][0] = scale.x;
        crop[1][1] = scale.y;
        crop[3][0] = -scale.x * middle.x;
        crop[3][1] = -scale.y * middle.y;
        clipFromRelative = crop * clipFromRelative;
        viewport = {area.x - origin.x, area.y - origin.y, area.width, area.height};
    }
    block.clipFromRelative = glm::mat4(clipFromRelative);
    const glm::dvec3 forward =
        -glm::dvec3(view.viewFromWorld[0][2], view.viewFromWorld[1][2], view.viewFromWorld[2][2]);
    block.forward = glm::vec4(glm::vec3(forward), view.orthographic ? 1.0f : 0.0f);
    block.shadowColour = glm::vec4(
        painting.scene.viewport ? glm::clamp(painting.scene.viewport->shadowColor.get(), 0.0f, 1.0f) : glm::vec3(0), 0);
    block.region = glm::vec4(view.region.x, view.region.y, view.region.width, view.region.height);
    block.wallOrigin = glm::vec4(origin.x, origin.y, 0.0f, 0.0f);
    if (const Fog* fog = painting.scene.fog) {
        block.fog = glm::vec4(fog->start, fog->end, fog->density, 0.0f);
        block.fogColour = glm::vec4(fog->colour.get(), 0.0f);
    }
    if (!_frame.set(std::as_bytes(std::span(&block, 1)))) return;
    _frame.buffer().bindRange(GL_UNIFORM_BUFFER, kFrameBinding, 0, sizeof(FrameBlock));
    glViewportIndexedf(0, static_cast<float>(viewport.x), static_cast<float>(viewport.y),
                       static_cast<float>(viewport.z), static_cast<float>(viewport.w));
    glEnable(GL_SCISSOR_TEST);
    glScissor(painting.area.x - origin.x, painting.area.y - origin.y, painting.area.width, painting.area.height);
}

Result<void> TilePainter::drawEntries(const ViewPainting& painting, const DrawList& list, std::size_t first,
                                      std::size_t end, const std::function<Result<GLenum>(const SurfaceItem&)>& prepare) {
    if (first == end) return {};
    if (auto set = _commands.set(std::as_bytes(std::span(list.commands))); !set) return set;
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, _commands.buffer().id());
    for (std::size_t i = first; i < end; ++i) {
        const DrawList::Entry& entry = list.entries[i];
        const SurfaceItem& item = painting.scene.items[entry.item];
        const auto primitive = prepare(item);
        if (!primitive) return primitive.error();
        item.geometry->vertexArray().bind();
        const auto draw = [&](std::uint32_t command, std::uint32_t count) {
            glMultiDrawElementsIndirect(*primitive, GL_UNSIGNED_INT,
                                        reinterpret_cast<const void*>(command * sizeof(DrawList::Command)),
                                        static_cast<GLsizei>(count), 0);
        };
        if (entry.solid > 0) {
            glEnable(GL_CULL_FACE);
            glFrontFace(item.isMirrored != list.isMirrored ? GL_CW : GL_CCW);
            draw(entry.first, entry.solid);
            glDisable(GL_CULL_FACE);
        }
        if (entry.solid < entry.count) draw(entry.first + entry.solid, entry.count - entry.solid);
        for (std::uint32_t c = entry.first; c < entry.first + entry.count; ++c)
            _counts.triangles += list.commands[c].count / 3;
    }
    return {};
}

Result<void> TilePainter::drawSurfaces(const Aspect& scene, ViewPainting& painting, bool blended) {
    const DrawList& list = painting.visible;
    if (!blended) return drawSurfaceEntries(scene, painting, 0, list.opaqueEntries, false);
    // What lies before others has a darkness of its own, which no image of the nearest surfaces holds: each such item
    // is given one, right before it is drawn.
    bool replaced = false;
    for (std::size_t i = list.opaqueEntries; i < list.entries.size();) {
        const auto isDark = [&](std::size_t entry) {
            return has(painting.scene.items[list.entries[entry].item].features, Feature::ShadowView);
        };
        std::size_t end = i + 1;
        if (isDark(i)) {
            if (auto drawn = drawDarknessOf(scene, painting, list.entries[i]); !drawn) return drawn;
            replaced = true;
        } else {
            while (end < list.entries.size() && !isDark(end)) ++end;
        }
        if (auto drawn = drawSurfaceEntries(scene, painting, i, end, true); !drawn) return drawn;
        i = end;
    }
    painting.isDarknessReplaced |= replaced;
    return {};
}

Result<void> TilePainter::drawSurfaceEntries(const Aspect& scene, ViewPainting& painting, std::size_t first,
                                             std::size_t end, bool blended) {
    const DrawList& list = painting.visible;
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glDepthMask(blended ? GL_FALSE : GL_TRUE);
    if (blended) {
        glEnable(GL_BLEND);
        glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    }
    const gl::Program* current = nullptr;
    const GpuMaterial* material = nullptr;
    auto drawn = drawEntries(painting, list, first, end, [&](const SurfaceItem& item) -> Result<GLenum> {
        auto program = _shaders.surface(item.features);
        if (!program) return program.error();
        if (*program != current) (*program)->use();
        current = *program;
        if (auto set = setSurface(scene, painting, item, *current); !set) return set.error();
        setSides(item);
        if (item.geometry->faceNormals())
            item.geometry->faceNormals().bind(static_cast<GLuint>(TextureUnit::FaceNormals));
        if (has(item.features, Feature::ShadowLightMap)) bindLightMap(painting.scene, item);
        if (has(item.features, Feature::FlatMean))
            item.geometry->flatFaces().bind(static_cast<GLuint>(TextureUnit::FlatFaces));
        if (material != item.material) {
            material = item.material;
            if (auto bound = _gpuScene.materials().bind(scene, *material, _gpuScene.textures()); !bound)
                return bound.error();
        }
        if (has(item.features, Feature::VertexTable))
            if (auto filled = fillVertexTable(scene, painting, item, *current); !filled) return filled.error();
        return GLenum{GL_TRIANGLES};
    });
    glDisable(GL_BLEND);
    glDepthMask(GL_TRUE);
    return drawn;
}

Result<void> TilePainter::setSurface(const Aspect& scene, const ViewPainting& painting, const SurfaceItem& item,
                                     const gl::Program& program) {
    const LightList::Run& run = painting.scene.lights.runs[item.run];
    program.set(0, glm::mat4(item.relativeFromObject));
    program.set(1, item.normalFromObject);
    bindLights(program, run);
    program.set(3, run.ambient);
    if (!has(item.features, Feature::Environment)) return {};
    return _gpuScene.environments().bind(scene, *painting.scene.environments[item.run], program);
}

Result<void> TilePainter::fillVertexTable(const Aspect& scene, const ViewPainting& painting, const SurfaceItem& item,
                                          const gl::Program& surface) {
    auto program = _shaders.vertexTable(item.features);
    if (!program) return program.error();
    if (auto set = setSurface(scene, painting, item, **program); !set) return set;
    return _vertexTable.fill(*item.geometry, painting.scene.lights.runs[item.run].shadows,
                             has(item.features, Feature::DoubleSided), **program, surface);
}

Result<void> TilePainter::drawLayers(const Aspect& scene, const WallViews& wall, ViewPainting& painting,
                                     std::uint32_t firstLight) {
    const bool factors = firstLight != kNoFactors;
    if (factors)
        _targets.bindFactors();
    else
        _targets.bindLayers();
    bindView(painting);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_TRUE);
    _targets.clearDepth(true);
    if (factors) _targets.clearFactors();
    constexpr FeatureSet kMaskOnly = bit(Feature::AlphaMask) | bit(Feature::BaseColourTexture) |
                                     bit(Feature::TexCoords0) | bit(Feature::TexCoords1) | bit(Feature::VertexColours) |
                                     bit(Feature::WorldAxes) | bit(Feature::Unwrapped) |
                                     bit(Feature::FirstVertexNormals);
    const gl::Program* current = nullptr;
    const GpuMaterial* material = nullptr;
    const DrawList& list = painting.visible;
    auto drawn = drawEntries(painting, list, 0, list.opaqueEntries, [&](const SurfaceItem& item) -> Result<GLenum> {
        auto program = _shaders.layers(factors ? item.layerFeatures : item.layerFeatures & kMaskOnly, wall.layers,
                                       factors ? _targets.factorImages() : 0);
        if (!program) return program.error();
        if (*program != current) (*program)->use();
        current = *program;
        current->set(0, glm::mat4(item.relativeFromObject));
        current->set(1, item.normalFromObject);
        setSides(item);
        if (painting.scene.view->unwrapped) glDisable(GL_CULL_FACE);
        item.geometry->faceNormals().bind(static_cast<GLuint>(TextureUnit::FaceNormals));
        if (factors) {
            bindLights(*current, painting.scene.lights.runs[item.run]);
            current->set(5, firstLight);
            if (has(item.layerFeatures, Feature::ShadowLightMap)) bindLightMap(painting.scene, item);
        } else if (wall.layers & static_cast<std::uint32_t>(Layer::Ids)) {
            glProgramUniform2ui(current->id(), 4, static_cast<GLuint>(item.node.value),
                                item.geometry->isReordered() ? 1 : 0);
            if (item.geometry->isReordered())
                item.geometry->primitives().bind(static_cast<GLuint>(TextureUnit::Primitives));
        }
        if (item.layerFeatures == 0 || material == item.material) return GLenum{GL_TRIANGLES};
        material = item.material;
        if (auto bound = _gpuScene.materials().bind(scene, *material, _gpuScene.textures()); !bound)
            return bound.error();
        return GLenum{GL_TRIANGLES};
    });
    if (!drawn) return drawn;
    return factors ? _targets.keepFactors(firstLight, painting.area) : drawn;
}

Result<void> TilePainter::drawShow(const ViewPainting& painting) {
    return _show.show(painting.scene, _darkness.images());
}

Result<void> TilePainter::paint(const Aspect& scene, const WallViews& wall, const FramePlan& plan,
                                std::span<ViewPainting> views, const TileAssignment& tile, std::size_t tileIndex) {
    const PixelRect& pixels = tile.pixels;
    std::int32_t reach = 0;
    for (std::uint32_t i = 0; i < views.size(); ++i) {
        reach = std::max(reach, plan.reachOf(i));
        // What no tile of this eye shows is empty.
        const bool shown = views[i].scene.viewport && views[i].scene.view->eye == tile.eye;
        views[i].area = shown ? intersect(pixels, views[i].scene.view->region) : PixelRect{};
    }
    if (auto painted = paintShadows(scene, plan, views, pixels); !painted) return painted;
    if (tileIndex == 0 && plan.hasPass(PassKind::Seen))
        if (auto found = findSeen(scene, wall, plan, views); !found) return found;
    const PixelSize work = workSizeOf(wall, plan.apron);
    const bool whole = wall.tiles == TileMode::Exact;
    const std::int32_t apron = whole ? 0 : plan.apron;
    const std::int32_t stepX = whole ? wall.wall.width : kBlockPixels;
    const std::int32_t stepY = whole ? wall.wall.height : kBlockPixels;
    for (std::int32_t y = pixels.y / stepY * stepY; y < pixels.y + pixels.height; y += stepY)
        for (std::int32_t x = pixels.x / stepX * stepX; x < pixels.x + pixels.width; x += stepX) {
            const PixelRect block{x - apron, y - apron, work.width, work.height};
            const PixelRect part = intersect(pixels, {x, y, stepX, stepY});
            _targets.beginPart(tileIndex, part, block, reach);
            if (auto painted = paintPart(scene, wall, plan, views, tile.eye, part, block); !painted) return painted;
            _targets.endPart();
        }
    return {};
}

void TilePainter::bindBuffers(std::uint32_t view, const ViewPainting& painting) {
    const LightBuffers& lights = _lightBuffers[view];
    _lights = &lights;
    lights.lights.buffer().bindBase(GL_SHADER_STORAGE_BUFFER, 0);
    lights.indices.buffer().bindBase(GL_SHADER_STORAGE_BUFFER, 1);
    lights.shadows.buffer().bindBase(GL_SHADER_STORAGE_BUFFER, 2);
    if (lights.webs.buffer()) lights.webs.buffer().bindBase(GL_SHADER_STORAGE_BUFFER, 5);
    if (painting.shadowMaps)
        painting.shadowMaps->maps.bind(static_cast<GLuint>(TextureUnit::ShadowMaps),
                                       static_cast<GLuint>(TextureUnit::ShadowBounds));
}

Result<void> TilePainter::paintPart(const Aspect& scene, const WallViews& wall, const FramePlan& plan,
                                    std::span<ViewPainting> views, Eye eye, const PixelRect& part,
                                    const PixelRect& block) {
    for (std::uint32_t i = 0; i < views.size(); ++i) {
        ViewPainting& painting = views[i];
        painting.area = {};
        painting.isDarknessReplaced = false;
        if (!painting.scene.viewport || painting.scene.view->eye != eye) continue;
        const View& view = *painting.scene.view;
        const std::int32_t reach = plan.reachOf(i);
        const PixelRect grown{part.x - reach, part.y - reach, part.width + 2 * reach, part.height + 2 * reach};
        painting.block = intersect(block, view.region);
        painting.area = intersect(grown, painting.block);
        if (painting.area.empty()) continue;
        painting.visible = listVisible(painting.scene, tileFrustum(view, painting.area, kMarginPixels));
    }
    std::size_t current = SIZE_MAX;  // the view whose colours are being drawn
    for (const PlannedPass& pass : plan.passes) {
        if (pass.kind == PassKind::Deform || pass.kind == PassKind::ShadowMap || pass.kind == PassKind::Seen ||
            pass.kind == PassKind::Resolve)
            continue;
        ViewPainting& painting = views[pass.view];
        if (painting.area.empty()) continue;
        bindBuffers(pass.view, painting);
        if (pass.kind != PassKind::Layers) {
            _targets.bindColour();
            bindView(painting);
            if (current != pass.view) {
                _targets.clearDepth(false);
                if (pass.kind == PassKind::Background) _targets.clearLayers();
            }
            current = pass.view;
        }
        Result<void> done;
        switch (pass.kind) {
            case PassKind::Darkness:
            case PassKind::Factors:
            case PassKind::Edges:
            case PassKind::Gauss:
                done = drawDarkness(scene, painting, pass);
                _darkness.bind();
                break;
            case PassKind::Show:
                done = drawShow(painting);
                break;
            case PassKind::Background:
                done = _backdrop.drawBackground(scene, painting.scene);
                break;
            case PassKind::Surfaces:
                done = drawSurfaces(scene, painting, false);
                break;
            case PassKind::Blend:
                done = drawSurfaces(scene, painting, true);
                break;
            case PassKind::Foreground:
                done = _backdrop.drawForegrounds(scene, painting.scene);
                break;
            case PassKind::Layers:
                // Light factors are those of opaque surfaces.
                if (painting.isDarknessReplaced && pass.first != kNoFactors) {
                    for (const PlannedPass& before : plan.passes)
                        if (done && before.view == pass.view && isOfDarkness(before.kind))
                            done = drawDarkness(scene, painting, before);
                    if (!done) return done;
                    _darkness.bind();
                    painting.isDarknessReplaced = false;
                }
                done = drawLayers(scene, wall, painting, pass.first);
                break;
            case PassKind::Deform:
            case PassKind::ShadowMap:
            case PassKind::Seen:
            case PassKind::Resolve:
                break;
        }
        if (!done) return done;
    }
    return {};
}

}  // namespace umbriel
