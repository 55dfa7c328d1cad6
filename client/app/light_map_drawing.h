#pragma once

#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "client/bake/light_map_bake.h"
#include "common/base/result.h"
#include "common/scene/traversal.h"
#include "common/scene/windows.h"
#include "common/wall/tile_pixels.h"
#include "common/wall/view.h"

namespace umbriel {

// The modes that light maps can be baked from: those that look a factor up at any place of any surface. The others are
// bad input with their reason: made in the view, or a map that is warped for one. The message begins with the text.
Result<ShadowMode> parseBakedMode(std::string_view text);

// Finds the factors of a light map as a module of server/shadow does: the surfaces are drawn where they lie in the
// atlas (View::unwrapped), with maps that are fitted to the scene, and the light factors come back. For that the scene
// is changed: each surface of the map gets a geometry of its own, whose triangles share no vertex and whose TEXCOORD_1
// is the place in the atlas; what moves is taken out of its node. It is the caller's copy, of no other use afterwards.
class LightMapDrawing final : public LightMapDrawer {
 public:
    // Draws a frame on all servers and returns its tiles.
    using DrawFrame = std::function<Result<std::vector<TilePixels>>(Aspect& scene, const WallViews& views)>;

    // The window has this viewport alone, whose mode, map size and filter count; its fit and picture do not. All
    // must outlive this.
    LightMapDrawing(Aspect& scene, Ref<Window> window, Ref<Viewport> viewport, DrawFrame drawFrame)
        : _scene(scene), _window(window), _viewport(viewport), _drawFrame(std::move(drawFrame)) {}

    // surfaces: of the map, in its order; moving: what is to be gone; lights: of the map, as the servers number them.
    void describe(std::vector<Ref<Node>> surfaces, std::vector<Ref<Node>> moving, std::vector<std::size_t> lights);

    // The pixels along each side of the wall that one look-up is drawn on.
    static std::int32_t wallSide(std::uint32_t size, int samples);

    Result<void> unwrap(std::vector<std::vector<glm::dvec2>> corners, std::uint32_t size) override;
    Result<std::vector<std::vector<float>>> lookUp(std::uint32_t x, std::uint32_t y, std::uint32_t side,
                                                   int samples) override;

 private:
    void unwrapSurface(const Hierarchy& hierarchy, Ref<Node> node, const std::vector<glm::dvec2>& corners);
    Result<void> prepareView(std::int32_t wall);
    Result<std::vector<std::vector<float>>> factorsOf(std::span<const TilePixels> tiles, std::int32_t wall) const;

    Aspect& _scene;
    Ref<Window> _window;
    Ref<Viewport> _viewport;
    DrawFrame _drawFrame;
    std::vector<Ref<Node>> _surfaces, _moving;
    std::vector<std::size_t> _lights;
    std::uint32_t _size = 0;
    WallViews _views;  // without views until the first look-up
};

}  // namespace umbriel
