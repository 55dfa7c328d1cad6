#pragma once

#include <string>

#include "client/import/procedural_mesh.h"
#include "client/import/procedural_texture.h"
#include "common/scene/animation.h"
#include "common/scene/aspect.h"
#include "common/scene/cameras.h"
#include "common/scene/lights.h"
#include "common/scene/materials.h"
#include "common/scene/nodes.h"

namespace umbriel {

// A material by what matters of it here.
struct SurfaceSpec {
    glm::vec4 colour{1.0f};
    float metallic = 0.0f;
    float roughness = 0.8f;
    glm::vec3 emission{0.0f};
    bool doubleSided = false;
    Ref<Texture> colourTexture{};
    Ref<Texture> metallicRoughnessTexture{};
    Ref<Texture> normalTexture{};
    float normalScale = 1.0f;
};

// Rotation about an axis of the mesh or node builders, radians.
glm::mat3 turned(float angle, const glm::vec3& axis);

// What the procedural scenes have in common: a root lit by a sun and by ambient light, and short ways to put things
// below it.
class SceneKit {
 public:
    // sunTravel: the way the sunlight goes.
    SceneKit(Aspect& aspect, const std::string& name, const glm::vec3& sunTravel, const glm::vec3& sunIrradiance,
             const glm::vec3& ambientRadiance);

    Aspect& aspect() { return _aspect; }
    // Everything drawn goes below this node.
    Ref<Node> world() const { return _world; }

    Ref<Image> image(const std::string& name, const TexelGrid& texels);
    Ref<Texture> texture(Ref<Image> image, WrapMode wrap = WrapMode::Repeat);
    Ref<Material> material(const std::string& name, const SurfaceSpec& spec);
    // Keeps texture coordinates only when they are used (not all the same), colours only when not all white.
    Ref<Geometry> geometry(const std::string& name, const Mesh& mesh, Ref<Material> material);

    Ref<Node> node(Ref<Node> parent, const std::string& name, Ref<Container> core = {});
    Ref<Node> place(Ref<Node> parent, const std::string& name, const glm::dvec3& translation,
                    const glm::mat3& linear = glm::mat3(1.0f));
    // A placed node with the geometry below it.
    Ref<Node> placeShape(Ref<Node> parent, const std::string& name, Ref<Geometry> geometry,
                         const glm::dvec3& translation, const glm::mat3& linear = glm::mat3(1.0f));
    void pointLight(const std::string& name, const glm::dvec3& position, const glm::vec3& intensity);

    void camera(const std::string& name, const glm::dvec3& eye, const glm::dvec3& target, double fovYDegrees);

    // The pose of a placed node, for animation.
    Ref<AnimatedPose> pose(Ref<Node> placed, const glm::vec4& rotation = {0, 0, 0, 1});
    Ref<AnimationChannel> channel(Ref<AnimatedPose> pose, AnimationPath path, const std::vector<float>& times,
                                  const std::vector<float>& values);
    void animation(const std::string& name, const std::vector<Ref<AnimationChannel>>& channels, double duration);

    Ref<LoadedScene> scene() const { return _scene; }

 private:
    Aspect& _aspect;
    Ref<Node> _root;
    Ref<Node> _world;
    Ref<LoadedScene> _scene;
};

}  // namespace umbriel
