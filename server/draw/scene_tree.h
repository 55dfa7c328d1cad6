#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/math/glm.h"
#include "common/scene/aspect.h"
#include "common/scene/nodes.h"

namespace umbriel {

inline constexpr std::size_t kMaxLights = 256;

// worldPoint = linear * point + translation, in double throughout.
struct Placement {
    glm::dmat3 linear{1.0};
    glm::dvec3 translation{0.0};

    // The placement of what is placed by inner inside this one.
    Placement operator*(const Placement& inner) const {
        return {linear * inner.linear, linear * inner.translation + translation};
    }
    // As a matrix to eye-relative world coordinates.
    glm::dmat4 relativeTo(const glm::dvec3& eyeWorld) const;
};

// The scene below one root, flattened in depth-first order, so that a subtree is a range. Follows the scene: structural
// changes rebuild it (cost: the number of nodes, never their content), moved transforms only touch what is below them.
class SceneTree {
 public:
    struct Entry {
        ContainerId node;
        std::uint32_t parent = 0;  // index; the root is its own parent
        std::uint32_t end = 0;     // one past the last entry below this one
        Placement world;           // of what is at and below the node, its own Transform included
        bool visible = true;       // no invisible node on the way from the root
    };
    // Something to draw: a geometry at a node.
    struct Item {
        std::uint32_t entry = 0;
        ContainerId node;
        ContainerId geometry;
        ContainerId deformation;     // a DeformedGeometry of that geometry; none: drawn at rest
        ContainerId material;        // none: the default one
        std::uint32_t lightSet = 0;  // which lights reach it, see lightSets()
    };
    struct Light {
        std::uint32_t entry = 0;
        ContainerId node;
        ContainerId light;  // the core
    };

    // root may name nothing: the tree is then empty.
    void rebuild(const Aspect& scene, ContainerId root);
    // Some Transform cores have new values.
    void moved(const Aspect& scene, std::span<const ContainerId> transforms);

    std::span<const Entry> entries() const { return _entries; }
    std::span<const Item> items() const { return _items; }
    std::span<const Light> lights() const { return _lights; }
    // Distinct sets of lights() indices, ascending; items name theirs.
    std::span<const std::vector<std::uint32_t>> lightSets() const { return _lightSets; }

    // Where a node stands, also one outside this tree (a beacon); nothing when there is no such node.
    std::optional<Placement> placementOf(const Aspect& scene, ContainerId node) const;
    // The entries at and below a node: [first, end); empty when it is not in this tree.
    std::pair<std::uint32_t, std::uint32_t> rangeOf(ContainerId node) const;

    bool hasLevelsOfDetail() const { return !_levels.empty(); }
    // Marks the entries that the wall's eye makes invisible through levels of detail: 1 where hidden.
    std::vector<std::uint8_t> hiddenByDetail(const Aspect& scene, const glm::dvec3& eyeWorld) const;

    // More lights than kMaxLights, nodes reachable twice: what was left out, for the log.
    std::span<const std::string> warnings() const { return _warnings; }

 private:
    struct Level {
        std::uint32_t entry = 0;
        ContainerId core;
        std::vector<std::uint32_t> children;  // entries
    };
    static Placement localOf(const Aspect& scene, ContainerId node);

    std::vector<Entry> _entries;
    std::vector<Item> _items;
    std::vector<Light> _lights;
    std::vector<Level> _levels;
    std::vector<std::vector<std::uint32_t>> _lightSets;
    std::unordered_map<ContainerId, std::uint32_t> _entryOf;
    std::unordered_map<ContainerId, std::vector<std::uint32_t>> _usersOfTransform;
    std::vector<std::string> _warnings;
};

}  // namespace umbriel
