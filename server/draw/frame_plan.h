#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/wall/screen_shadow.h"
#include "common/wall/shadow_show.h"
#include "common/wall/view.h"
#include "server/shadow/shadow_module.h"

namespace umbriel {

// What a surface shader is composed of. A program is compiled for exactly the set that a scene's draw items need,
// whatever tile is drawn, so that every tile runs the same instructions.
enum class Feature : std::uint32_t {
    VertexNormals,  // without: the face normal
    VertexTangents,
    VertexColours,
    TexCoords0,
    TexCoords1,
    BaseColourTexture,
    MetallicRoughnessTexture,
    NormalTexture,
    OcclusionTexture,
    EmissionTexture,
    SpecularTexture,
    MetallicRoughness,  // no model: unlit
    BlinnPhong,
    Lambert,
    Phong,
    PhongGated,
    Schlick,
    NormalisedPhong,
    PhongBrdf,
    TorranceSparrow,
    Lafortune,
    PhongOriginal,
    GeneralSum,
    OpenGlSum,
    Emission,  // a colour of its own light that is not 0
    Matt,  // a specular colour of 0, of models whose highlight is a multiple of it: not computed
    AlphaMask,
    AlphaBlend,
    DoubleSided,
    AmbientLights,
    DirectionalLights,
    PointLights,
    SpotLights,
    GoniometricLights,
    SpotExponents,      // beside the spots with an inner and an outer angle
    ArtistAttenuation,  // beside 1/d^2
    LightAmbient,       // lights that add to the ambient light
    LightHighlights,    // lights whose highlights have a colour of their own
    VertexShading,      // Gouraud's; without: in pixels
    VertexTable,        // with VertexShading: from vertices to pixels by a table, not by interpolants
    FlatShading,        // with VertexShading: the first vertex's colour
    FlatMean,           // one colour a triangle, of its mean normal
    FogLinear,
    FogQuadratic,
    FogExponential,
    FogSquaredExponential,
    Environment,
    Orthographic,  // the view
    Unwrapped,     // the view; of layer shaders
    WorldAxes,     // the object is not turned or scaled: its face normals are the world's
    FirstVertexNormals,  // face normals come with each triangle's first vertex; without: from a table
    ShadowColour,  // something of a light is left in full shadow
    OneLight,      // as many lights reach the item, and come as constants (LightBlock); without any of these: as a list
    TwoLights,
    ThreeLights,
    FourLights,
    PassedConstants,  // what is the same for all of an item reaches pixels by its vertices (Workaround)
    ForeignShading,  // without a model: its colour times what shadows leave of the light
    Shadows,         // from here on, those of ShadowFeature, in its order
    ShadowWarp,
    ShadowPerspective,
    ShadowCube,
    ShadowHemispheres,
    ShadowFilter,
    ShadowSoftFilter,
    ShadowNearestBlocker,
    ShadowBilinear,
    ShadowSkip,
    ShadowBounds,
    ShadowView,
    ShadowLightMap,
    ShadowLightMapPages,
    ShadowMixed,
    ShadowCopy,
    ShadowFilter6,
    ShadowFilter8,
    ShadowSearch6,
    Count
};
inline constexpr std::uint32_t kFeatureCount = static_cast<std::uint32_t>(Feature::Count);

__extension__ using FeatureSet = unsigned __int128;  // a bit each, in the order of the enumeration
static_assert(kFeatureCount <= 128);
constexpr FeatureSet bit(Feature feature) {
    return FeatureSet{1} << static_cast<std::uint32_t>(feature);
}
constexpr bool has(FeatureSet set, Feature feature) {
    return (set & bit(feature)) != 0;
}

static_assert(kFeatureCount ==
              static_cast<std::uint32_t>(Feature::Shadows) + static_cast<std::uint32_t>(ShadowFeature::Count));
constexpr FeatureSet featuresOf(ShadowFeatureSet shadows) {
    return FeatureSet{shadows} << static_cast<std::uint32_t>(Feature::Shadows);
}

// The `#define` of a feature in shaders/stage, for example "FEATURE_ALPHA_MASK".
const char* defineOf(Feature feature);
// The features' short names, joined by spaces; "plain" for none.
std::string describe(FeatureSet set);

enum class PassKind : std::uint32_t {
    Deform,
    ShadowMap,
    Seen,
    Darkness,
    Factors,
    Edges,
    Gauss,
    Show,
    Background,
    Surfaces,
    Blend,
    Foreground,
    Resolve,
    Layers
};

enum class BackgroundKind : std::uint32_t { None, Colour, Gradient, Image, Environment };

// What a view needs, gathered from the scene.
struct ViewDemand {
    std::string name;  // of the viewport, for people
    Eye eye = Eye::Mono;
    PixelRect region;
    bool unwrapped = false;  // layers alone
    BackgroundKind background = BackgroundKind::None;
    std::uint32_t foregrounds = 0;
    std::map<FeatureSet, std::uint32_t> surfaces;  // draw items by the features of their shader
    std::uint32_t lights = 0;                      // that are on, ambient ones apart
    // Geometries that are morphed or skinned, once a frame and only when their pose has changed.
    struct Deformed {
        std::uint32_t geometries = 0;
        std::uint32_t vertices = 0;
        std::uint32_t joints = 0;
        std::uint32_t morphTargets = 0;
    };
    Deformed deformed;
    struct Shadow {
        std::string light;
        ShadowDemand demand;
        ShadowCasters among = ShadowCasters::All;
        std::uint32_t casters = 0;        // draw items
        std::uint32_t maskedCasters = 0;  // of these, cut out by a texture
    };
    std::vector<Shadow> shadows;
    bool copiedMaps = false;  // their depths are in a buffer, too
    struct LightMap {
        std::uint32_t size = 0;  // texels a side; 0: no surface looks one up
        std::uint32_t lights = 0;
        std::uint64_t bytes = 0;  // with its charts
    };
    LightMap lightMap;
    ScreenShadow screen;
    std::vector<std::string> darkLights;  // those with a shadow, by layer
    ShadowShow show = ShadowShow::Picture;
    std::string shownLight;  // whose shadow is shown
    std::uint32_t shownParts = 0;
    std::uint32_t shownTexels = 0;  // along each side of its map; 0: it has none
};

struct PlannedTarget {
    std::string name;
    std::string format;
    PixelSize size;
    std::uint32_t count = 1;    // layers of an array, copies
    std::uint32_t samples = 1;  // per pixel
    std::uint64_t bytes = 0;
};

struct PlannedPass {
    PassKind kind = PassKind::Surfaces;
    std::uint32_t view = 0;   // index in the demands
    // ShadowMap: index in the view's shadows; Layers: the first light, or kNoFactors; Edges: 1 when the surfaces that
    // they lie between were not drawn before.
    std::uint32_t first = 0;
    std::int32_t reach = 0;   // pixels beyond the tile that must be drawn for the tile to be right
    std::string target;       // what it draws into
    std::string detail;
};

// What a frame consists of: nothing but what the scene needs. Pure data, derived without GL.
struct FramePlan {
    std::vector<PlannedTarget> targets;
    std::vector<PlannedPass> passes;               // in the order they run, for every tile
    std::map<FeatureSet, std::uint32_t> variants;  // shader variants and how many draw items use each
    std::uint64_t bytes = 0;                       // of all targets
    std::int32_t apron = 0;                        // pixels around a block in offset mode

    // The largest reach of a view's passes: how far the scissor exceeds the tile.
    std::int32_t reachOf(std::uint32_t view) const;
    bool hasPass(PassKind kind) const;
    // For people; stable, so that it can be compared.
    std::string explain() const;
};

// Layers passes without light factors.
inline constexpr std::uint32_t kNoFactors = 0xffffffffu;
// Lights beyond the first kFactorLayersPerPass are read in further layer passes: a framebuffer has 8 attachments.
inline constexpr std::uint32_t kFactorLayersPerPass = 16;

// In offset mode the wall is drawn in blocks of this many pixels a side, each in window coordinates of its own,
// whatever tile asks for it: so a pixel's value does not depend on the grid of tiles, and no wall is too large. A
// multiple of the 2x2 pixels over which a texture's mip is chosen.
inline constexpr std::int32_t kBlockPixels = 1024;

// The largest reach of all views, in pixels that keep the 2x2 pixels of a texture's mip together.
std::int32_t apronOf(const std::vector<ViewDemand>& demands);

// What the work images must hold: the wall (exact mode), or a block with its apron.
PixelSize workSizeOf(const WallViews& views, std::int32_t apron);

// Whether the work images hold all that is finished at the end of a frame, so that nothing is copied: one tile, within
// one block, one sample.
bool isDrawnInPlace(const WallViews& views, std::span<const TileAssignment> tiles);

// tiles: of this server. factorLights: lights of all views together, for the light factors layer. Error: the exact mode
// needs a target larger than the driver allows (limit: texels a side).
Result<FramePlan> planFrame(const WallViews& views, const std::vector<ViewDemand>& demands,
                            std::span<const TileAssignment> tiles, std::uint32_t factorLights, std::int32_t limit);

}  // namespace umbriel
