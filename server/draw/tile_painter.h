#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/draw/backdrop_painter.h"
#include "server/draw/darkness_painter.h"
#include "server/draw/draw_list.h"
#include "server/draw/frame_plan.h"
#include "server/draw/gpu_scene.h"
#include "server/draw/shader_library.h"
#include "server/draw/show_painter.h"
#include "server/draw/tile_target.h"
#include "server/draw/vertex_table.h"
#include "server/shadow/shadow_maps.h"

namespace umbriel {

// A buffer whose content is replaced; equal content is not sent again.
class StreamBuffer {
 public:
    Result<void> set(std::span<const std::byte> content);
    const gl::Buffer& buffer() const { return _buffer; }

 private:
    std::vector<std::byte> _content;
    gl::Buffer _buffer;
};

// A view's shadow maps and what they hold, kept from tile to tile and from frame to frame.
struct KeptShadowMaps {
    // A layer as it was drawn last. It need not be drawn again for a tile whose lookups it covers, while its fit and all
    // that casts are the same.
    struct Layer {
        ShadowFit fit;
        std::uint64_t casters = 0;  // ViewScene::casterStates, and what is left out of them for being behind everything
        std::optional<CasterMask> mask;
    };
    ShadowMaps maps;
    std::vector<Layer> drawn;  // by layer
};

// One view while its tiles are drawn.
struct ViewPainting {
    ViewScene scene;
    KeptShadowMaps* shadowMaps = nullptr;
    std::vector<CasterMask> masks;  // by shadow, for the tile at hand
    // For the part of the tile at hand.
    DrawList visible;
    PixelRect area;   // of the part, grown by the reach, within the view's region
    PixelRect block;  // what the work images stand for, within the view's region
    bool isDarknessReplaced = false;  // by that of blended surfaces
};

// Runs the passes of a frame plan for one tile after the other.
class TilePainter {
 public:
    struct Counts {
        std::uint64_t triangles = 0;
        std::uint64_t shadowTriangles = 0;
    };
    TilePainter(GpuScene& scene, ShaderLibrary& shaders, TileTargets& targets, glm::ivec2 viewportLimit)
        : _gpuScene(scene), _shaders(shaders), _targets(targets), _viewportLimit(viewportLimit) {}

    // Fixed-function state that the driver starts without.
    void beginFrame();
    // views: by the plan's view index.
    Result<void> paint(const Aspect& scene, const WallViews& wall, const FramePlan& plan, std::span<ViewPainting> views,
                       const TileAssignment& tile, std::size_t tileIndex);
    Result<void> reserveDarkness(const DarknessImages::Needs& needs) { return _darkness.reserve(needs); }
    const Counts& counts() const { return _counts; }

 private:
    // What is drawn exceeds what is shown by this: coordinates are rounded to 1/256 pixel, matrices to float.
    static constexpr double kMarginPixels = 1.0;

    // Shadow maps, for all of the tile.
    Result<void> paintShadows(const Aspect& scene, const FramePlan& plan, std::span<ViewPainting> views,
                              const PixelRect& tile);
    // Everything else, for a part of the tile.
    Result<void> paintPart(const Aspect& scene, const WallViews& wall, const FramePlan& plan,
                           std::span<ViewPainting> views, Eye eye, const PixelRect& part, const PixelRect& block);
    Result<void> drawShadowMap(const Aspect& scene, ViewPainting& view, std::uint32_t shadow);
    bool isKept(const ViewPainting& view, std::uint32_t shadow) const;
    Result<void> drawCasters(const Aspect& scene, const ViewPainting& view, const DrawList& casters,
                             const CasterStage& stage);
    DarknessPainter::DrawEntries darknessEntries(const ViewPainting& painting);
    // The passes before the surfaces that make shadows in the view.
    Result<void> drawDarkness(const Aspect& scene, ViewPainting& painting, const PlannedPass& pass);
    // Of these, what modules in the view do, for surfaces of `visible` within `area`.
    Result<void> drawViewDarkness(const Aspect& scene, const ViewPainting& painting, const DrawList& visible,
                                  const PixelRect& area);
    // The same for one blended entry alone, and back to where surfaces are drawn.
    Result<void> drawDarknessOf(const Aspect& scene, ViewPainting& painting, const DrawList::Entry& entry);
    // What of a map the whole wall reads, for the views that show it; once a frame.
    Result<void> findSeen(const Aspect& scene, const WallViews& wall, const FramePlan& plan,
                          std::span<ViewPainting> views);
    // In place of the scene.
    Result<void> drawShow(const ViewPainting& painting);
    void bindBuffers(std::uint32_t view, const ViewPainting& painting);
    // Opaque or blended items into the colour image.
    Result<void> drawSurfaces(const Aspect& scene, ViewPainting& view, bool blended);
    Result<void> drawSurfaceEntries(const Aspect& scene, ViewPainting& view, std::size_t first, std::size_t end,
                                    bool blended);
    // Shades the vertices of an item with Feature::VertexTable for `surface`, its program, which will draw it; material
    // and environment are bound. Error: more memory than the driver gives.
    Result<void> fillVertexTable(const Aspect& scene, const ViewPainting& view, const SurfaceItem& item,
                                 const gl::Program& surface);
    // The uniforms of a surface's stages that its item and its view have.
    Result<void> setSurface(const Aspect& scene, const ViewPainting& view, const SurfaceItem& item,
                            const gl::Program& program);
    Result<void> drawLayers(const Aspect& scene, const WallViews& wall, ViewPainting& view, std::uint32_t firstLight);
    // Draws entries [first, end) of a list; program and uniforms of each item are the caller's.
    // prepare: returns what to draw as, GL_TRIANGLES or GL_PATCHES.
    Result<void> drawEntries(const ViewPainting& view, const DrawList& list, std::size_t first, std::size_t end,
                             const std::function<Result<GLenum>(const SurfaceItem&)>& prepare);
    void bindView(const ViewPainting& view);
    // The lights of an item, of the view that paintPart() is at.
    void bindLights(const gl::Program& program, const LightList::Run& run);

    GpuScene& _gpuScene;
    ShaderLibrary& _shaders;
    TileTargets& _targets;
    DarknessPainter _darkness{_gpuScene, _shaders};
    ShowPainter _show{_shaders};
    BackdropPainter _backdrop{_gpuScene, _shaders};
    glm::ivec2 _viewportLimit;
    Counts _counts;
    gl::VertexArray _noVertices;
    StreamBuffer _commands;
    StreamBuffer _frame;
    VertexTable _vertexTable;

 public:
    // The lights of a view as buffers; kept by view so that unchanged lights are not sent again.
    struct LightBuffers {
        StreamBuffer lights, indices, shadows, webs, blocks;
    };
    Result<void> setLights(std::size_t view, LightList& lights);

 private:
    std::map<std::size_t, LightBuffers> _lightBuffers;
    const LightBuffers* _lights = nullptr;  // of the view at hand
};

}  // namespace umbriel
