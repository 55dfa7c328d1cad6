#pragma once

#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "client/import/gltf_accessors.h"
#include "client/import/gltf_file.h"
#include "client/import/import_limits.h"
#include "common/scene/animation.h"
#include "common/scene/aspect.h"
#include "common/scene/materials.h"

namespace tinygltf {
class Node;
class Value;
struct Animation;
struct AnimationChannel;
struct Material;
struct Primitive;
}  // namespace tinygltf

namespace umbriel {

// What the parts of the glTF importer share while one file is built.
struct GltfContext {
    GltfFile& file;
    Aspect& scene;
    const ImportLimits& limits;
    ImportWarnings& warnings;
    ByteBudget& sceneBytes;
    GltfAccessors accessors;

    const tinygltf::Model& model() const { return file.model(); }
};

// Materials, textures and images; each is made when it is first used, so that nothing unused is decoded or shipped.
class GltfMaterials {
 public:
    explicit GltfMaterials(GltfContext& context) : _context(context) {}

    // index -1: glTF's default material.
    Ref<Material> material(int index);

 private:
    // A texture with its set of coordinates and its KHR_texture_transform.
    struct TextureUse {
        int texture = -1;
        int texCoord = 0;
        glm::vec2 offset{0.0f};
        float rotation = 0.0f;
        glm::vec2 scale{1.0f};
    };
    using TextureKey = std::tuple<int, int, float, float, float, float, float>;

    void build(const tinygltf::Material& source, const std::string& place, Ref<Material> target);
    template <class TextureInfo>
    Ref<Texture> texture(const TextureInfo& info, const std::string& place);
    Ref<Texture> texture(const TextureUse& use, const std::string& place);
    Ref<Image> image(int index);
    float clamped(double value, double low, double high, const std::string& place);

    GltfContext& _context;
    std::map<int, Ref<Material>> _materials;
    std::map<TextureKey, Ref<Texture>> _textures;
    std::map<int, Ref<Image>> _images;
};

// Geometry containers: one for each combination of accessors, mode and material, shared by everything that uses it.
class GltfMeshes {
 public:
    GltfMeshes(GltfContext& context, GltfMaterials& materials) : _context(context), _materials(materials) {}

    // One for each primitive that has triangles.
    const std::vector<Ref<Geometry>>& mesh(int index);
    // The largest joint that any vertex of a geometry hangs on; 0 without joints.
    std::uint32_t largestJoint(Ref<Geometry> geometry) const;
    // Morph targets of a mesh, the most of its primitives.
    std::size_t morphTargets(int index) const;

 private:
    using DataKey = std::vector<int>;

    Ref<Geometry> primitive(const tinygltf::Primitive& source, const std::string& place);
    bool build(const tinygltf::Primitive& source, const std::string& place, Ref<Geometry> target);
    std::vector<std::uint32_t> triangles(const tinygltf::Primitive& source, const std::string& place,
                                         std::size_t vertices);
    std::vector<float> attribute(const tinygltf::Primitive& source, const char* name, const std::string& place,
                                 std::size_t vertices, int components);
    void requireMorphAccessors(const tinygltf::Primitive& source, const std::string& place) const;
    void buildJoints(const tinygltf::Primitive& source, const std::string& place, std::size_t vertices,
                     Ref<Geometry> target);
    void buildMorphs(const tinygltf::Primitive& source, const std::string& place, std::size_t vertices,
                     Ref<Geometry> target);

    GltfContext& _context;
    GltfMaterials& _materials;
    std::map<ContainerId, std::uint32_t> _largestJoint;
    std::map<int, std::vector<Ref<Geometry>>> _meshes;
    std::map<DataKey, Ref<Geometry>> _geometries;  // by accessors, mode and material
    std::map<DataKey, Ref<Geometry>> _data;        // by accessors and mode: shares its memory
};

// Skins, made when a node first uses them; their joints are set when all nodes are there.
class GltfSkins {
 public:
    explicit GltfSkins(GltfContext& context) : _context(context) {}

    // place: the node that hangs these geometries on the skin.
    Ref<Skin> skin(int index, const std::vector<Ref<Geometry>>& geometries, const GltfMeshes& meshes,
                   const std::string& place);
    void setJoints(const std::map<int, Ref<Node>>& nodes);
    // The skins that were made.
    std::vector<int> used() const;

 private:
    std::vector<glm::mat4> matrices(int accessor, std::size_t joints, const std::string& place);

    GltfContext& _context;
    std::map<int, Ref<Skin>> _skins;
};

// The weights that a node starts with, its mesh's where it has none of its own.
Ref<MorphWeights> makeMorphWeights(GltfContext& context, const tinygltf::Node& node, int mesh, std::size_t targets,
                                   const std::string& place);

// The node tree with cameras and lights.
class GltfNodes {
 public:
    GltfNodes(GltfContext& context, GltfMeshes& meshes) : _context(context), _meshes(meshes), _skins(context) {}

    // Builds the default scene; the root of everything is returned.
    Ref<Node> build(const std::string& sceneName);
    // Cameras of the scene, in the order of the file.
    std::vector<Ref<Container>> cameras();
    // The transform of a glTF node; none when it is not part of the scene.
    Ref<Transform> transformOf(int node) const;
    // The morph weights of a glTF node's mesh; none when it has no targets or is not part of the scene.
    Ref<MorphWeights> morphWeightsOf(int node) const;

 private:
    void requireTree() const;
    std::vector<int> rootsOfScene(std::string& sceneName);
    Ref<Node> buildTree(int root);
    // Without its children.
    Ref<Node> buildNode(int index, std::uint32_t depth, std::vector<Ref<Node>>& leaves);
    // Limits what finding the places of joints, lights and cameras may cost.
    void requireShortWays() const;
    // A node for each geometry of its mesh.
    std::vector<Ref<Node>> buildLeaves(const tinygltf::Node& source, int index);
    void place(const tinygltf::Node& source, const std::string& where, Ref<Transform> transform);
    Ref<Container> light(int index, const std::string& name, Ref<Node> beacon);

    GltfContext& _context;
    GltfMeshes& _meshes;
    GltfSkins _skins;
    std::map<int, Ref<Node>> _nodes;
    std::map<int, std::uint32_t> _depths;  // of the same nodes below the scene
    std::map<int, Ref<Transform>> _transforms;
    std::map<int, Ref<MorphWeights>> _morphWeights;
    std::vector<std::pair<int, int>> _cameraNodes;  // (camera, node)
    std::vector<std::pair<int, int>> _lightNodes;   // (node, light), in the order of the tree
};

// Animations; needs the nodes.
class GltfAnimations {
 public:
    GltfAnimations(GltfContext& context, const GltfNodes& nodes) : _context(context), _nodes(nodes) {}

    std::vector<Ref<Animation>> build();

 private:
    Ref<AnimationChannel> channel(const tinygltf::Animation& animation, const tinygltf::AnimationChannel& source,
                                  const std::string& place, double& duration);
    Ref<AnimatedPose> pose(int node);
    // How many numbers a key of the channel has; 0 when it is left out, with a warning.
    std::size_t componentsOf(const tinygltf::AnimationChannel& source, const std::string& place);
    std::vector<float> times(int accessor, const std::string& place);
    void normaliseRotations(std::vector<float>& values, bool cubic, const std::string& place);

    GltfContext& _context;
    const GltfNodes& _nodes;
    std::map<int, Ref<AnimatedPose>> _poses;
};

// Quaternion x y z w scaled to unit length; throws ImportRefused when it has no direction. Says so in a warning when it
// was not of unit length before.
void normaliseQuaternion(float* quaternion, const std::string& place, ImportWarnings& warnings);

}  // namespace umbriel
