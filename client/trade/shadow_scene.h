#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/base/result.h"
#include "common/scene/aspect.h"
#include "common/scene/traversal.h"
#include "common/trace/occlusion.h"

namespace umbriel {

// A light as truth needs it.
struct TruthLight {
    Ref<Node> node;
    std::string name;
    LightKind kind = LightKind::Directional;
    bool castsShadow = true;
    glm::dvec3 positionWorld{0.0};
    glm::dvec3 directionWorld{0, 0, -1};  // the way it travels
    double range = 0.0;                   // metres; 0: unlimited
    double cosOuter = -1.0;               // spot
    // Of the luminous disc that faces the receiver: metres; directional: radians, half the angle it is seen under. 0:
    // hard shadows.
    double radius = 0.0;
};

// A scene's triangles where a viewport's renderer has them, with what casts a shadow and what a light reaches, for rays
// against the very surfaces that are drawn. Built from one state of the scene; keeps no reference to it.
class ShadowScene {
 public:
    struct Options {
        std::vector<Ref<Node>> excludeNodes;  // nothing below them casts
        std::vector<Ref<Node>> lightNodes;    // none: all lights
        std::optional<glm::dvec3> eyeWorld;   // chooses levels of detail
    };
    static Result<std::unique_ptr<ShadowScene>> create(const Aspect& scene, Ref<Node> root, const Options& options);

    // All but ambient ones, in the order in which servers number them: as the scene graph is walked.
    const std::vector<TruthLight>& lights() const { return _lights; }
    std::vector<TruthLight>& lights() { return _lights; }
    const trace::OcclusionScene& rays() const { return *_rays; }

    // From the layer "ids": the low 32 bits of a node's id, and a triangle of its geometry. kNoTriangle for what is not
    // there.
    std::uint32_t triangleOf(std::uint32_t node, std::uint32_t primitive) const;
    // Whether the light is above the node in the scene graph.
    bool reaches(std::size_t light, std::uint32_t node) const;
    // Nodes (low 32 bits) with this name, or below one with it.
    std::vector<std::uint32_t> nodesNamed(const std::string& name) const;
    std::size_t triangleCount() const { return _rays->triangleCount(); }

 private:
    struct Instance {
        std::uint32_t firstTriangle = 0;
        std::uint32_t triangles = 0;
        std::uint64_t lights = 0;        // bits, by index in _lights; the first 64
        std::vector<std::string> names;  // its own and those above
    };
    std::vector<TruthLight> _lights;
    std::unordered_map<std::uint32_t, Instance> _instances;  // looked up only
    std::unique_ptr<trace::OcclusionScene> _rays;
};

}  // namespace umbriel
