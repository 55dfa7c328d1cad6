#pragma once

#include <gtest/gtest.h>

#include "client/session/camera.h"
#include "common/scene/core_types.h"
#include "common/scene/traversal.h"
#include "common/scene/windows.h"

namespace umbriel {

// A scene to put things into.
class SceneFixture : public testing::Test {
 protected:
    SceneFixture() : aspect(registered(), ids) { root = node({}); }

    Ref<Node> node(Ref<Node> parent, Ref<Container> core = {}) {
        const auto made = aspect.create<Node>();
        aspect.edit(made).set<&Node::core>(core);
        if (parent) aspect.edit(parent).append<&Node::children>(made);
        return made;
    }
    Ref<Node> placed(Ref<Node> parent, const glm::dvec3& translation, const glm::mat3& linear = glm::mat3(1.0f)) {
        const auto transform = aspect.create<Transform>();
        aspect.edit(transform).set<&Transform::linear>(linear).set<&Transform::translation>(translation);
        return node(parent, Ref<Container>(transform.id));
    }
    // Two opposite corners are enough for a box.
    void addBox(const glm::vec3& lower, const glm::vec3& upper) {
        const auto geometry = aspect.create<Geometry>();
        aspect.edit(geometry).assign<&Geometry::positions>(std::vector<glm::vec3>{lower, upper});
        node(root, Ref<Container>(geometry.id));
    }
    Result<View> resolve(Ref<Container> camera, const PixelRect& region = {0, 0, 1600, 900}) {
        return resolveCamera(aspect, camera, Hierarchy(aspect, root), region, worldBounds(aspect, root));
    }
    static glm::dvec3 project(const View& view, const glm::dvec3& world) {
        const glm::dvec4 clip = view.clipFromView * glm::dvec4(view.viewFromWorld * (world - view.eyeWorld), 1.0);
        return glm::dvec3(clip) / clip.w;
    }

    TypeRegistry types;
    IdSource ids;
    Aspect aspect;
    Ref<Node> root;

 private:
    const TypeRegistry& registered() {
        registerCoreTypes(types);
        return types;
    }
};

inline Ref<Container> any(ContainerId id) {
    return Ref<Container>(id);
}

}  // namespace umbriel
