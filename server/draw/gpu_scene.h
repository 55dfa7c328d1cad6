#pragma once

#include <array>
#include <map>
#include <unordered_map>
#include <vector>

#include "common/scene/aspect.h"
#include "common/scene/windows.h"
#include "common/wall/screen_shadow.h"
#include "common/wall/view.h"
#include "server/draw/deformer.h"
#include "server/draw/gpu_environments.h"
#include "server/draw/gpu_geometry.h"
#include "server/draw/gpu_light_map.h"
#include "server/draw/gpu_materials.h"
#include "server/draw/gpu_textures.h"
#include "server/draw/light_list.h"
#include "server/draw/scene_tree.h"

namespace umbriel {

// One thing to draw in one view.
struct SurfaceItem {
    ContainerId node;
    GpuGeometry* geometry = nullptr;
    const GpuMaterial* material = nullptr;
    FeatureSet features = 0;        // of its surface shader
    FeatureSet layerFeatures = 0;   // of its layer shader
    FeatureSet casterFeatures = 0;  // of its caster shader; 0: depth only
    FeatureSet factorFeatures = 0;  // of the shader of its shadow factors, where the screen-space path needs them
    glm::dmat4 relativeFromObject{1.0};
    glm::dmat4 worldFromObject{1.0};  // for what must not depend on the eye
    glm::mat3 normalFromObject{1.0f};
    std::uint32_t run = 0;  // index in LightList::runs
    double distance = 0.0;  // from the wall's eye to the middle of its box; orders blending
    int depthBucket = 0;    // of the distance; orders opaque items, near ones first
    bool isMirrored = false;
    bool castsShadow = true;
    bool hidesBacks = false;  // of solid parts: both sides are looked at, and have no holes
    bool isInLightMap = false;                   // of the view
    const gl::Buffer* lightMapPlaces = nullptr;  // then: the charts of its triangles

    // Whether it is one of these.
    bool isAmong(ShadowCasters casters) const {
        return casters == ShadowCasters::All || (casters == ShadowCasters::Fixed) == isInLightMap;
    }
};

// Which sides of an item are drawn, and which way they are wound.
void setSides(const SurfaceItem& item);

struct ViewScene;
// The shadows of the light that the viewport shows something of: parts from `first` in LightList::fits on.
struct ShownLight {
    std::uint32_t first = 0;
    std::uint32_t parts = 0;  // 0: no light has a shadow
};
ShownLight shownLightOf(const ViewScene& view);
// What the light map's shaders read for a surface that is in one.
void bindLightMap(const ViewScene& view, const SurfaceItem& item);

// Everything about one view that does not depend on the tile, so that all tiles draw the same in the same order.
struct ViewScene {
    const View* view = nullptr;
    const Viewport* viewport = nullptr;  // null: nothing to draw
    const Fog* fog = nullptr;  // null: clear air
    ScreenShadow screen;
    LightList lights;
    std::vector<SurfaceItem> items;  // opaque and cut out first, roughly front to back; then blended, back to front
    std::size_t opaqueItems = 0;
    Box3d boxWorld;  // around all items
    std::vector<std::optional<EnvironmentUse>> environments;  // by run; none: no environment lights it
    std::vector<Deformer::Size> deformed;  // of the geometries that are not at rest
    GpuLightMap* lightMap = nullptr;       // null: no light's factors are in one
    // People who look at a map want to see all that casts.
    bool isMapShown() const;
    // By ShadowCasters: a hash of everything that shadow maps are drawn from, beside their fits.
    std::array<std::uint64_t, 3> casterStates{};
};

// The scene on the GPU. Follows change lists; a frame costs what changed plus a pass over the draw items.
class GpuScene {
 public:
    // largestPage: of light maps (GpuLightMap::upload). passesConstants: Workaround::LlvmpipeGathersConstants is in force.
    GpuScene(std::size_t textureBudgetBytes, int maxTextureSize, std::uint32_t largestPage, bool passesConstants);

    void changed(const ChangeList& changes, const Aspect& scene);
    // Brings geometries that are on the GPU up to date.
    Result<void> update(const Aspect& scene);
    // What a view draws; uploads what it needs and is not there yet. layers: WallViews::layers.
    Result<ViewScene> prepare(const Aspect& scene, const View& view, std::uint32_t layers, ShaderLibrary& shaders);

    GpuTextures& textures() { return _textures; }
    GpuMaterials& materials() { return _materials; }
    GpuEnvironments& environments() { return _environments; }
    // How an environment light is drawn in a view; nothing when it is off or has no map.
    std::optional<EnvironmentUse> environmentOf(const Aspect& scene, const ViewScene& view, ContainerId light);
    // Bytes that geometries sent to the GPU since the start: what a change costs.
    std::uint64_t uploadedGeometryBytes() const;
    std::uint64_t deformedVertices() const { return _deformer.deformedVertices(); }
    std::size_t geometryCount() const { return _geometries.size(); }

 private:
    SceneTree& treeOf(const Aspect& scene, ContainerId root);
    Result<GpuGeometry*> geometryOf(const Aspect& scene, ContainerId id, const GpuGeometry::Needs& needs);

    GpuTextures _textures;
    bool _passesConstants;
    GpuMaterials _materials;
    Deformer _deformer;
    GpuEnvironments _environments;
    GpuLightMaps _lightMaps;
    std::unordered_map<ContainerId, GpuGeometry> _geometries;
    std::map<ContainerId, std::vector<MultiChange>> _pending;
    std::uint64_t _uploadedByForgotten = 0;
    std::map<ContainerId, SceneTree> _trees;
    std::vector<ContainerId> _movedTransforms;
    std::uint64_t _revision = 0;  // of everything but where things stand and the geometries' content
    bool _structureChanged = true;
};

}  // namespace umbriel
