#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/math/pixel_rect.h"
#include "common/wall/view.h"
#include "shaders/structs_cpp.h"

namespace umbriel {

class ShadowMaps;

// What surface shaders must contain for a light's shadow; each is a `#define FEATURE_...` (Feature of
// server/draw/frame_plan.h, in this order from Feature::Shadows on).
enum class ShadowFeature : std::uint32_t {
    Maps,         // some light has a shadow; without View, from a map
    Warp,         // some map's texels vary over the map
    Perspective,  // some map spreads from a light that stands somewhere; without: all are parallel
    Cube,
    Hemispheres,
    Filter,          // percentage closer
    SoftFilter,      // the same, with a search for blockers
    NearestBlocker,  // of those that the search finds, not their mean
    Bilinear,        // samples of filters are mixed from four texels
    Skip,            // filters take no samples where the outcome is known
    Bounds,          // they read the bounds of blocks of texels first
    View,            // no maps: the view's own darkness images
    LightMap,        // some light's factors are in the light map, and the surface is
    LightMapPages,   // with it: the atlas takes several textures
    Mixed,           // some light is in the light map, and some has maps
    Copy,            // filters read the maps' depths from a buffer (ShadowMaps::reserve)
    Filter6,         // with it: filters have 6 x 6 samples
    Filter8,         // or 8 x 8
    Search6,         // and the search for blockers 6 x 6; without these: any number
    Count
};
using ShadowFeatureSet = std::uint32_t;  // a bit each
constexpr ShadowFeatureSet bit(ShadowFeature feature) {
    return ShadowFeatureSet{1} << static_cast<std::uint32_t>(feature);
}

// What one fit adds to the frame plan. Nothing of it exists for a module that no fit names.
struct ShadowDemand {
    std::string_view module;        // for people: "standard"
    std::string_view part;          // of the light, for people: "", "face +x"
    std::uint32_t mapTexels = 0;    // side of the fit's layer in the view's depth maps; 0: none, and no pass for it
    std::uint32_t boundsBlock = 0;  // side, in texels of the map, of the blocks whose bounds are kept; 0: none
    bool inView = false;            // a layer of the view's darkness images (view_module.h)
    bool positions = false;         // with it, the visible surfaces' positions
    bool inLightMap = false;        // a layer of the viewport's light map, and no pass
};

// How casters are drawn in a pass: stage/caster.vert.glsl with these.
struct CasterStage {
    enum class Projection { Matrix, Hemisphere };
    Projection projection = Projection::Matrix;
    // Matrix: to clip space. Hemisphere: to the light's frame, in metres; the shader does the rest.
    glm::dmat4 stageFromWorld{1.0};
    // Hemisphere: places on the map per unit of the paraboloid's plane, near and far distance, texels along the map.
    glm::vec4 hemisphere{0.0f};
};

// What a module asks for when it draws. Implemented by the painter, which knows the scene, what can be seen, and the
// shaders. Everything goes into the framebuffer and with the state that are bound.
class ShadowPainter {
 public:
    virtual ~ShadowPainter() = default;
    // Draws every caster that can darken something visible.
    virtual Result<void> drawCasters(const CasterStage& stage) = 0;
    // Runs a fragment stage (of shaders/stage) for every pixel of the viewport, with uniform 0 set.
    virtual Result<void> fill(const std::string& fragmentStage, const glm::ivec4& uniform) = 0;
};

// One way to make shadows. Modules have no state: what a pass draws into is given to it. All functions but draw() are
// pure and run without GL.
class ShadowModule {
 public:
    virtual ~ShadowModule() = default;

    virtual ShadowFeatureSet features(const ShadowFit& fit) const = 0;
    virtual ShadowDemand demand(const ShadowFit& fit) const = 0;
    // What the shaders read about the fit, for a view with this eye; the caller sets the layer.
    virtual gpu::GpuShadow describe(const ShadowFit& fit, const glm::dvec3& eyeWorld) const = 0;
    // Fills the fit's layer; texels: what of it will be sampled.
    virtual Result<void> draw(const ShadowFit& fit, ShadowMaps& maps, std::uint32_t layer, const PixelRect& texels,
                              ShadowPainter& painter) const = 0;
};

// The module of a mode, living as long as the program; null for modes without one (none, or not in this version).
const ShadowModule* shadowModule(ShadowMode mode);

}  // namespace umbriel
