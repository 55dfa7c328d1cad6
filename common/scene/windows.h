#pragma once

#include "common/scene/cameras.h"
#include "common/scene/light_map.h"
#include "common/scene/materials.h"

namespace umbriel {

// The names and order are those of the shadow modules in docs/shadows.md; a mode that this version does not have is
// refused by the client with a message.
enum class ShadowMode : std::uint32_t {
    None, Standard, Perspective, LightSpacePerspective, Trapezoid, PercentageCloser, PercentageCloserSoft, Planar,
    PlanarStencil, VolumeZPass, VolumeZFail, Blob, LightMap, DualParaboloid, Cube, VisibilityMap
};
template <> inline constexpr std::uint32_t kEnumCount<ShadowMode> = 16;

// How the maps of a viewport are fitted: to everything any tile or eye sees (union), to the whole scene, or per view.
enum class ShadowFitMode : std::uint32_t { Union, Scene, PerView };
template <> inline constexpr std::uint32_t kEnumCount<ShadowFitMode> = 3;

// What a viewport shows: its picture, or one of the views into how its shadows are made (docs/shadows.md says what
// their colours mean).
enum class ShadowShow : std::uint32_t { Picture, LightView, ShadowMap, ColorMap, FactorMap, EdgeMap, SeenArea };
template <>
inline constexpr std::uint32_t kEnumCount<ShadowShow> = 7;

// How much of a surface's own colour is left after a distance d from the eye (Euclidean, so that the walls of a CAVE
// agree): (end - d) / (end - start); its square; exp(-density d); exp(-(density d)^2).
enum class FogMode : std::uint32_t { Linear, Quadratic, Exponential, SquaredExponential };
template <> inline constexpr std::uint32_t kEnumCount<FogMode> = 4;

// Between the eye and every surface of a viewport, blended and unlit ones too. Backgrounds and foregrounds are without
// distance and stay as they are.
struct Fog : Container {
    static constexpr std::string_view kTypeName = "Fog";
    Single<FogMode> mode{FogMode::SquaredExponential};
    Single<glm::vec3> colour{glm::vec3(0.5f)};  // radiance
    Single<float> start{0.0f};                  // metres, linear and quadratic; from `end` on there is only fog
    Single<float> end{100.0f};
    Single<float> density{0.02f};               // 1/m, exponential

    static void declare(TypeBuilder<Fog>& type) {
        type.field<&Fog::mode>("mode");
        type.field<&Fog::colour>("colour");
        type.field<&Fog::start>("start");
        type.field<&Fog::end>("end");
        type.field<&Fog::density>("density");
    }
};

struct ColourBackground : Container {
    static constexpr std::string_view kTypeName = "ColourBackground";
    Single<glm::vec4> colour{glm::vec4(0.0f)};  // linear, associated alpha

    static void declare(TypeBuilder<ColourBackground>& type) { type.field<&ColourBackground::colour>("colour"); }
};

// From bottom to top of the viewport, in whole-wall coordinates.
struct GradientBackground : Container {
    static constexpr std::string_view kTypeName = "GradientBackground";
    Single<glm::vec4> bottom{glm::vec4(0.0f)};
    Single<glm::vec4> top{glm::vec4(0.0f)};

    static void declare(TypeBuilder<GradientBackground>& type) {
        type.field<&GradientBackground::bottom>("bottom");
        type.field<&GradientBackground::top>("top");
    }
};

// Stretched over the viewport.
struct ImageBackground : Container {
    static constexpr std::string_view kTypeName = "ImageBackground";
    Single<Ref<Image>> image;  // sRGB

    static void declare(TypeBuilder<ImageBackground>& type) { type.field<&ImageBackground::image>("image"); }
};

// A picture over everything, after shadows and filters, placed in wall coordinates: the lower left corner, relative to
// the viewport when <= 1, in pixels above; its size in pixels.
struct ImageForeground : Container {
    static constexpr std::string_view kTypeName = "ImageForeground";
    Single<Ref<Image>> image;  // sRGB, straight alpha
    Single<glm::vec2> lowerLeft;
    Single<glm::vec2> size{glm::vec2(64.0f)};

    static void declare(TypeBuilder<ImageForeground>& type) {
        type.field<&ImageForeground::image>("image");
        type.field<&ImageForeground::lowerLeft>("lowerLeft");
        type.field<&ImageForeground::size>("size");
    }
};

// A line of text (printable ASCII), over everything, in wall coordinates as ImageForeground.
struct TextForeground : Container {
    static constexpr std::string_view kTypeName = "TextForeground";
    Single<std::string> text;
    Single<glm::vec2> lowerLeft;
    Single<float> height{16.0f};               // pixels of a line
    Single<glm::vec4> colour{glm::vec4(1.0f)};  // linear, straight alpha

    static void declare(TypeBuilder<TextForeground>& type) {
        type.field<&TextForeground::text>("text");
        type.field<&TextForeground::lowerLeft>("lowerLeft");
        type.field<&TextForeground::height>("height");
        type.field<&TextForeground::colour>("colour");
    }
};

// A part of the window with its own camera, scene root, background and shadows. Corners are relative to the window when
// <= 1, in pixels above; (0,0) is the lower left. Shadow parameters bear the names of spec "the shadow viewport".
struct Viewport : Container {
    static constexpr std::string_view kTypeName = "Viewport";
    Single<glm::vec2> lowerLeft;
    Single<glm::vec2> upperRight{glm::vec2(1.0f)};
    Single<bool> passive{false};  // true: draws nothing
    Single<Ref<Node>> root;
    Single<Ref<Container>> camera;
    Single<Ref<Container>> background;
    Single<Ref<Fog>> fog;
    Multi<Ref<Container>> foregrounds;  // drawn in this order
    Single<ShadowMode> shadowMode{ShadowMode::None};
    Single<bool> shadowOn{true};
    Single<ShadowFitMode> shadowFit{ShadowFitMode::Union};
    Single<std::uint32_t> mapSize{512u};   // texels; 0: the largest power of two within the wall
    Single<float> offFactor{-1.0f};        // slope bias; negative: automatic
    Single<float> offBias{-1.0f};          // constant bias in texels; negative: automatic
    Single<glm::vec3> shadowColor;         // 0: physical
    Multi<Ref<Node>> lightNodes;           // none: all lights found below root
    Multi<Ref<Node>> excludeNodes;         // cast no shadow
    Single<bool> qualityMode{false};       // filters: wider penumbrae, more samples; warps: see docs/shadows.md
    Single<float> range{0.3f};             // trapezoid: share of the view's depth that gets 80 % of the map; (0, 0.8)
    Single<float> maxSideAngle{1.5f};      // trapezoid: radians between its sides; beyond, the warp is weakened
    Single<float> lispFactor{1.0f};        // LISP: the optimal near distance times this; infinity is no warp
    Single<ShadowMode> filteredMap{ShadowMode::Standard};  // PCF, PPCF: std, psm, lisp or trapez
    Single<float> filterWidth{8.0f};       // PCF: texels from side to side
    Single<float> filterMetres{0.0f};      // PCF: where positive, metres instead
    Single<std::uint32_t> samplesPerRow{6u};   // PCF: at most so many samples along each side
    Single<std::uint32_t> blockerSamples{6u};  // PPCF: along each side of the search for blockers
    Single<std::uint32_t> filterSamples{8u};   // PPCF: along each side of the filter
    Single<bool> nearestBlocker{false};    // PPCF: the penumbra is that of the nearest to the light, not of the mean
    Single<float> lightSize{-1.0f};        // PPCF: metres across, or radians (directional); negative: the light's own
    Single<float> maxPenumbra{32.0f};      // PPCF: texels
    Single<bool> hardwareFilter{false};    // PCF: each sample is the mix of its four nearest texels
    Single<bool> skipUniform{true};        // PCF, PPCF: no samples where a map's bounds decide; the result is the same
    Single<glm::dvec3> planeNormal;        // planar: the plane's normal in world coordinates; 0: the plane is found
    Single<double> planeOffset{0.0};       // planar: normal . point + offset = 0
    Single<float> blobSize{1.0f};          // blob: radius over that of the object, seen from the light
    Single<bool> reuseMaps{true};          // a map is drawn again only when its fit or a caster changed
    Single<bool> screenSpace{false};       // factors of opaque surfaces are drawn into a map of pixels first
    Single<float> gauss{0.0f};             // pixels: radius of the filter over that map, which it calls for; 0: none
    Single<float> edgeThreshold{0.01f};    // of that filter: share of the distance by which a pixel may leave its
                                           // neighbour's plane and still be mixed with it; 0: edges are mixed, too
    Single<bool> foreignShading{false};    // unlit surfaces, whose light is in their colour, are darkened as a whole
    Single<ShadowShow> show{ShadowShow::Picture};
    Single<std::uint32_t> showLight{0u};  // of what is shown: which of the lights with a shadow, by their ids
    Single<Ref<LightMap>> lightMap;        // light map: what was baked; none: standard maps

    static void declare(TypeBuilder<Viewport>& type) {
        type.field<&Viewport::lowerLeft>("lowerLeft");
        type.field<&Viewport::upperRight>("upperRight");
        type.field<&Viewport::passive>("passive");
        type.field<&Viewport::root>("root");
        type.field<&Viewport::camera>("camera");
        type.field<&Viewport::background>("background");
        type.field<&Viewport::fog>("fog");
        type.field<&Viewport::foregrounds>("foregrounds");
        type.field<&Viewport::shadowMode>("shadowMode");
        type.field<&Viewport::shadowOn>("shadowOn");
        type.field<&Viewport::shadowFit>("shadowFit");
        type.field<&Viewport::mapSize>("mapSize");
        type.field<&Viewport::offFactor>("offFactor");
        type.field<&Viewport::offBias>("offBias");
        type.field<&Viewport::shadowColor>("shadowColor");
        type.field<&Viewport::lightNodes>("lightNodes");
        type.field<&Viewport::excludeNodes>("excludeNodes");
        type.field<&Viewport::qualityMode>("qualityMode");
        type.field<&Viewport::range>("range");
        type.field<&Viewport::maxSideAngle>("maxSideAngle");
        type.field<&Viewport::lispFactor>("lispFactor");
        type.field<&Viewport::filteredMap>("filteredMap");
        type.field<&Viewport::filterWidth>("filterWidth");
        type.field<&Viewport::filterMetres>("filterMetres");
        type.field<&Viewport::samplesPerRow>("samplesPerRow");
        type.field<&Viewport::blockerSamples>("blockerSamples");
        type.field<&Viewport::filterSamples>("filterSamples");
        type.field<&Viewport::nearestBlocker>("nearestBlocker");
        type.field<&Viewport::lightSize>("lightSize");
        type.field<&Viewport::maxPenumbra>("maxPenumbra");
        type.field<&Viewport::hardwareFilter>("hardwareFilter");
        type.field<&Viewport::skipUniform>("skipUniform");
        type.field<&Viewport::planeNormal>("planeNormal");
        type.field<&Viewport::planeOffset>("planeOffset");
        type.field<&Viewport::blobSize>("blobSize");
        type.field<&Viewport::reuseMaps>("reuseMaps");
        type.field<&Viewport::screenSpace>("screenSpace");
        type.field<&Viewport::gauss>("gauss");
        type.field<&Viewport::edgeThreshold>("edgeThreshold");
        type.field<&Viewport::foreignShading>("foreignShading");
        type.field<&Viewport::show>("show");
        type.field<&Viewport::showLight>("showLight");
        type.field<&Viewport::lightMap>("lightMap");
    }
};

// What the wall shows: its viewports, later ones over earlier ones.
struct Window : Container {
    static constexpr std::string_view kTypeName = "Window";
    Multi<Ref<Viewport>> viewports;

    static void declare(TypeBuilder<Window>& type) { type.field<&Window::viewports>("viewports"); }
};

}  // namespace umbriel
