#include "server/draw/tile_painter.h"

#include <algorithm>

// What a tile needs before its surfaces: shadow maps, and darkness in the view.

namespace umbriel {
namespace {

// Of the view's maps, for a shadow that has one.
std::uint32_t mapLayerOf(const ViewPainting& painting, std::uint32_t shadow) {
    return static_cast<std::uint32_t>(painting.scene.lights.shadows[shadow].layer);
}

// Of everything that the map of a fit is drawn from.
std::uint64_t casterStateOf(const ViewScene& scene, const ShadowFit& fit) {
    return scene.casterStates[static_cast<std::size_t>(fit.casters)] ^ backmostState(scene, fit);
}

}  // namespace

Result<void> TilePainter::paintShadows(const Aspect& scene, const FramePlan& plan, std::span<ViewPainting> views,
                                       const PixelRect& tile) {
    if (!plan.hasPass(PassKind::ShadowMap)) return {};
    for (std::uint32_t i = 0; i < views.size(); ++i) {
        ViewPainting& painting = views[i];
        painting.masks.clear();
        if (painting.area.empty() || !painting.shadowMaps) continue;
        const View& view = *painting.scene.view;
        const std::int32_t reach = plan.reachOf(i);
        const PixelRect grown{tile.x - reach, tile.y - reach, tile.width + 2 * reach, tile.height + 2 * reach};
        bool anyOpen = false;
        for (std::uint32_t shadow = 0; shadow < painting.scene.lights.fits.size(); ++shadow) {
            painting.masks.emplace_back(*painting.scene.lights.fits[shadow], view.eyeWorld);
            if (painting.scene.lights.fits[shadow]->mapSize == 0) continue;  // beside maps: a light map
            // What is shown is all of the map, not what this tile reads of it.
            if (painting.scene.isMapShown() ||
                (isKept(painting, shadow) &&
                 painting.shadowMaps->drawn[mapLayerOf(painting, shadow)].mask->isEverything()))
                painting.masks.back().markEverything();
            else
                anyOpen = true;
        }
        if (!anyOpen) continue;
        markReceivers(painting.scene, tileFrustum(view, intersect(grown, view.region), kMarginPixels), painting.masks);
    }
    for (const PlannedPass& pass : plan.passes) {
        if (pass.kind != PassKind::ShadowMap || views[pass.view].area.empty()) continue;
        if (auto drawn = drawShadowMap(scene, views[pass.view], pass.first); !drawn) return drawn;
    }
    return {};
}

Result<void> TilePainter::drawCasters(const Aspect& scene, const ViewPainting& painting, const DrawList& casters,
                                      const CasterStage& stage) {
    const std::uint64_t before = _counts.triangles;
    const gl::Program* current = nullptr;
    const GpuMaterial* material = nullptr;
    if (stage.projection == CasterStage::Projection::Hemisphere) glPatchParameteri(GL_PATCH_VERTICES, 3);
    auto drawn =
        drawEntries(painting, casters, 0, casters.entries.size(), [&](const SurfaceItem& item) -> Result<GLenum> {
            const bool hemisphere = stage.projection == CasterStage::Projection::Hemisphere;
            auto program = _shaders.caster(item.casterFeatures, hemisphere);
            if (!program) return program.error();
            if (*program != current) {
                (*program)->use();
                if (hemisphere) (*program)->set(1, stage.hemisphere);
            }
            current = *program;
            // From the object to the light without the eye in between, so that a map's bits are the same whoever looks.
            current->set(0, glm::mat4(stage.stageFromWorld * item.worldFromObject));
            const GLenum primitive = hemisphere && item.casterFeatures == 0 ? GL_PATCHES : GL_TRIANGLES;
            if (item.casterFeatures == 0 || material == item.material) return primitive;
            material = item.material;
            if (auto bound = _gpuScene.materials().bind(scene, *material, _gpuScene.textures()); !bound)
                return bound.error();
            return primitive;
        });
    _counts.shadowTriangles += _counts.triangles - before;
    return drawn;
}

bool TilePainter::isKept(const ViewPainting& painting, std::uint32_t shadow) const {
    if (!painting.scene.viewport->reuseMaps) return false;
    const KeptShadowMaps::Layer& layer = painting.shadowMaps->drawn[mapLayerOf(painting, shadow)];
    const ShadowFit& fit = *painting.scene.lights.fits[shadow];
    return layer.mask && layer.fit == fit && layer.casters == casterStateOf(painting.scene, fit);
}

Result<void> TilePainter::drawShadowMap(const Aspect& scene, ViewPainting& painting, std::uint32_t shadow) {
    CasterMask& mask = painting.masks[shadow];
    if (mask.empty()) return {};
    const std::uint32_t mapLayer = mapLayerOf(painting, shadow);
    KeptShadowMaps::Layer& layer = painting.shadowMaps->drawn[mapLayer];
    if (isKept(painting, shadow)) {
        if (layer.mask->covers(mask)) return {};
        // Drawn for other lookups, and nothing moves: all of it, once, for whoever comes next.
        mask.markEverything();
    }
    class Painter final : public ShadowPainter {
     public:
        Painter(TilePainter& painter, const Aspect& scene, const ViewPainting& painting, const DrawList& list)
            : _painter(painter), _scene(scene), _painting(painting), _list(list) {}
        Result<void> drawCasters(const CasterStage& stage) override {
            return _painter.drawCasters(_scene, _painting, _list, stage);
        }
        Result<void> fill(const std::string& fragmentStage, const glm::ivec4& uniform) override {
            auto program = _painter._shaders.screen(fragmentStage);
            if (!program) return program.error();
            (*program)->use();
            glProgramUniform4i((*program)->id(), 0, uniform.x, uniform.y, uniform.z, uniform.w);
            _painter._noVertices.bind();
            glDisable(GL_CULL_FACE);
            glDrawArrays(GL_TRIANGLES, 0, 3);
            return {};
        }

     private:
        TilePainter& _painter;
        const Aspect& _scene;
        const ViewPainting& _painting;
        const DrawList& _list;
    };
    const ShadowFit& fit = *painting.scene.lights.fits[shadow];
    const DrawList list = listCasters(painting.scene, mask, fit);
    Painter painter(*this, scene, painting, list);
    layer.mask.reset();
    auto drawn = shadowModule(fit.mode)->draw(fit, painting.shadowMaps->maps, mapLayer, mask.texels(), painter);
    if (!drawn) return drawn;
    layer = {fit, casterStateOf(painting.scene, fit), std::move(mask)};
    return {};
}

DarknessPainter::DrawEntries TilePainter::darknessEntries(const ViewPainting& painting) {
    return [this, &painting](const DrawList& list, std::size_t first, std::size_t end,
                             const std::function<Result<void>(const SurfaceItem&)>& prepare) {
        return drawEntries(painting, list, first, end, [&](const SurfaceItem& item) -> Result<GLenum> {
            if (auto prepared = prepare(item); !prepared) return prepared.error();
            return GLenum{GL_TRIANGLES};
        });
    };
}

Result<void> TilePainter::drawDarkness(const Aspect& scene, ViewPainting& painting, const PlannedPass& pass) {
    if (pass.kind == PassKind::Darkness) return drawViewDarkness(scene, painting, painting.visible, painting.area);
    bindView(painting);
    if (pass.kind == PassKind::Gauss) return _darkness.filter(painting.scene);
    const auto entries = darknessEntries(painting);
    const std::uint64_t before = _counts.triangles;
    auto painted =
        pass.kind == PassKind::Factors
            ? _darkness.paintFactors(
                  scene, painting.scene, painting.visible,
                  [&](const gl::Program& program, const LightList::Run& run) { bindLights(program, run); }, entries)
            : _darkness.paintEdges(scene, painting.scene, painting.visible, pass.first != 0, entries);
    _counts.shadowTriangles += _counts.triangles - before;
    return painted;
}

Result<void> TilePainter::drawViewDarkness(const Aspect& scene, const ViewPainting& painting, const DrawList& visible,
                                           const PixelRect& area) {
    bindView(painting);
    const glm::ivec2 origin = _targets.wallOrigin();
    glScissor(area.x - origin.x, area.y - origin.y, area.width, area.height);
    const View& view = *painting.scene.view;
    const Frustum part = tileFrustum(view, area, kMarginPixels);
    const Frustum whole = tileFrustum(view, view.region, kMarginPixels);
    const std::uint64_t before = _counts.triangles;
    const auto volumes = _darkness.paint(scene, painting.scene, visible, part, whole, darknessEntries(painting));
    if (!volumes) return volumes.error();
    _counts.triangles += *volumes;
    _counts.shadowTriangles += _counts.triangles - before;
    return {};
}

Result<void> TilePainter::drawDarknessOf(const Aspect& scene, ViewPainting& painting, const DrawList::Entry& entry) {
    const SurfaceItem& item = painting.scene.items[entry.item];
    const DrawList& all = painting.visible;
    DrawList alone;
    const auto first = all.commands.begin() + entry.first;
    alone.commands.assign(first, first + entry.count);
    alone.entries.push_back({entry.item, 0, entry.count, entry.solid});
    alone.opaqueEntries = 1;
    const PixelRect area = intersect(
        pixelsOf(*painting.scene.view, item.geometry->box(), item.relativeFromObject, kMarginPixels), painting.area);
    Result<void> drawn = area.empty() ? Result<void>() : drawViewDarkness(scene, painting, alone, area);
    _targets.bindColour();
    bindView(painting);
    _darkness.bind();
    return drawn;
}

Result<void> TilePainter::findSeen(const Aspect& scene, const WallViews& wall, const FramePlan& plan,
                                   std::span<ViewPainting> views) {
    const PixelSize work = workSizeOf(wall, plan.apron);
    const bool whole = wall.tiles == TileMode::Exact;
    const std::int32_t stepX = whole ? wall.wall.width : kBlockPixels;
    const std::int32_t stepY = whole ? wall.wall.height : kBlockPixels;
    for (const PlannedPass& pass : plan.passes) {
        if (pass.kind != PassKind::Seen) continue;
        ViewPainting painting = views[pass.view];
        const PixelRect& region = painting.scene.view->region;
        if (auto begun = _show.beginSeen(painting.scene); !begun) return begun;
        for (std::int32_t y = 0; y < wall.wall.height; y += stepY)
            for (std::int32_t x = 0; x < wall.wall.width; x += stepX) {
                const std::int32_t apron = whole ? 0 : plan.apron;
                const PixelRect block{x - apron, y - apron, work.width, work.height};
                painting.block = intersect(block, region);
                painting.area = intersect(
                    {x, y, std::min(stepX, wall.wall.width - x), std::min(stepY, wall.wall.height - y)}, region);
                if (painting.area.empty()) continue;
                _targets.beginPart(0, {x, y, 0, 0}, block, 0);
                painting.visible =
                    listVisible(painting.scene, tileFrustum(*painting.scene.view, painting.area, kMarginPixels));
                bindBuffers(pass.view, painting);
                bindView(painting);
                auto painted = _darkness.paintSurfaces(scene, painting.scene, painting.visible, darknessEntries(painting));
                if (!painted) return painted;
                const glm::ivec2 origin = _targets.wallOrigin();
                const PixelRect inWork{painting.area.x - origin.x, painting.area.y - origin.y, painting.area.width,
                                       painting.area.height};
                if (auto added = _show.addSeen(painting.scene, _darkness.images(), inWork); !added) return added;
            }
        _show.endSeen();
    }
    return {};
}

}  // namespace umbriel
