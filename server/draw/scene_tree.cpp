#include "server/draw/scene_tree.h"

#include <algorithm>
#include <map>

#include "common/scene/deformation.h"
#include "common/scene/environment.h"
#include "common/scene/lights.h"

namespace umbriel {
namespace {

bool isLight(const Container& core) {
    return isA<DirectionalLight>(core) || isA<PointLight>(core) || isA<SpotLight>(core) ||
           isA<GoniometricLight>(core) || isA<AmbientLight>(core) || isA<EnvironmentLight>(core);
}

// One node whose children are being visited.
struct Visit {
    std::uint32_t entry = 0;
    ContainerId material;  // of the innermost group; none: the geometry's own
    std::uint32_t lightSet = 0;
    std::vector<ContainerId> children;  // that are drawn or not, all of them: beacons may be below
    std::int32_t choice = Switch::kAll;
    std::size_t next = 0;
    std::size_t level = SIZE_MAX;  // index of the level-of-detail record
};

}  // namespace

glm::dmat4 Placement::relativeTo(const glm::dvec3& eyeWorld) const {
    glm::dmat4 matrix(linear);
    matrix[3] = glm::dvec4(translation - eyeWorld, 1.0);
    return matrix;
}

Placement SceneTree::localOf(const Aspect& scene, ContainerId nodeId) {
    const Node* node = scene.findAs<Node>(nodeId);
    const Transform* transform = node ? scene.findAs<Transform>(node->core.get().id) : nullptr;
    if (!transform) return {};
    return {glm::dmat3(transform->linear.get()), transform->translation.get()};
}

void SceneTree::rebuild(const Aspect& scene, ContainerId root) {
    _entries.clear();
    _items.clear();
    _lights.clear();
    _levels.clear();
    _lightSets.assign(1, {});
    _entryOf.clear();
    _usersOfTransform.clear();
    _warnings.clear();
    std::size_t lightsLeftOut = 0;
    std::map<std::vector<std::uint32_t>, std::uint32_t> setNumbers{{{}, 0u}};
    std::vector<Visit> stack;

    const auto enter = [&](ContainerId id, const Visit* parent, bool chosen) {
        const Node* node = scene.findAs<Node>(id);
        if (!node) return;
        const auto index = static_cast<std::uint32_t>(_entries.size());
        if (!_entryOf.emplace(id, index).second) {
            _warnings.push_back("node " + std::to_string(id.value) +
                                " is reached twice; it is drawn where it came first");
            return;
        }
        Entry entry;
        entry.node = id;
        entry.parent = parent ? parent->entry : index;
        entry.end = index + 1;
        entry.world = parent ? _entries[parent->entry].world * localOf(scene, id) : localOf(scene, id);
        entry.visible = chosen && node->visible.get() && (!parent || _entries[parent->entry].visible);
        _entries.push_back(entry);

        Visit visit;
        visit.entry = index;
        if (parent) {
            visit.material = parent->material;
            visit.lightSet = parent->lightSet;
        }
        const ContainerId coreId = node->core.get().id;
        if (const Container* core = scene.find(coreId)) {
            if (isA<Transform>(*core)) {
                _usersOfTransform[coreId].push_back(index);
            } else if (isA<MaterialGroup>(*core)) {
                visit.material = static_cast<const MaterialGroup*>(core)->material.get().id;
            } else if (isA<Switch>(*core)) {
                visit.choice = static_cast<const Switch*>(core)->choice.get();
            } else if (isA<LevelOfDetail>(*core)) {
                visit.level = _levels.size();
                _levels.push_back({index, coreId, {}});
            } else if (isA<Geometry>(*core) || isA<DeformedGeometry>(*core)) {
                const auto* deformed = scene.findAs<DeformedGeometry>(coreId);
                const ContainerId geometryId = deformed ? deformed->geometry.get().id : coreId;
                const auto* geometry = scene.findAs<Geometry>(geometryId);
                if (entry.visible && geometry)
                    _items.push_back({index, id, geometryId, deformed ? coreId : ContainerId{},
                                      visit.material ? visit.material : geometry->material.get().id, visit.lightSet});
            } else if (isLight(*core) && entry.visible) {
                if (_lights.size() < kMaxLights) {
                    std::vector<std::uint32_t> set = _lightSets[visit.lightSet];
                    set.push_back(static_cast<std::uint32_t>(_lights.size()));
                    _lights.push_back({index, id, coreId});
                    const auto [found, isNew] = setNumbers.emplace(set, static_cast<std::uint32_t>(_lightSets.size()));
                    if (isNew) _lightSets.push_back(std::move(set));
                    visit.lightSet = found->second;
                } else {
                    ++lightsLeftOut;
                }
            }
        }
        visit.children.resize(node->children.size());
        for (std::size_t i = 0; i < visit.children.size(); ++i) visit.children[i] = node->children[i].id;
        stack.push_back(std::move(visit));
    };

    enter(root, nullptr, true);
    while (!stack.empty()) {
        Visit& top = stack.back();
        if (top.next == top.children.size()) {
            _entries[top.entry].end = static_cast<std::uint32_t>(_entries.size());
            stack.pop_back();
            continue;
        }
        const std::size_t child = top.next++;
        const bool chosen = top.choice == Switch::kAll || top.choice == static_cast<std::int64_t>(child);
        const std::size_t level = top.level;
        const auto before = static_cast<std::uint32_t>(_entries.size());
        // enter() grows the stack, so what it needs of the parent is copied.
        Visit parent;
        parent.entry = top.entry;
        parent.material = top.material;
        parent.lightSet = top.lightSet;
        const ContainerId id = top.children[child];
        enter(id, &parent, chosen);
        // A child that does not exist keeps its place in the ranges.
        if (level != SIZE_MAX) _levels[level].children.push_back(_entries.size() > before ? before : UINT32_MAX);
    }
    if (lightsLeftOut > 0)
        _warnings.push_back("of " + std::to_string(kMaxLights + lightsLeftOut) + " lights the last " +
                            std::to_string(lightsLeftOut) + " are left out: a scene has at most " +
                            std::to_string(kMaxLights));
}

void SceneTree::moved(const Aspect& scene, std::span<const ContainerId> transforms) {
    std::vector<std::uint32_t> starts;
    for (const ContainerId transform : transforms) {
        const auto users = _usersOfTransform.find(transform);
        if (users != _usersOfTransform.end()) starts.insert(starts.end(), users->second.begin(), users->second.end());
    }
    std::sort(starts.begin(), starts.end());
    std::uint32_t done = 0;
    for (const std::uint32_t start : starts) {
        if (start < done) continue;  // below one that was handled already
        done = _entries[start].end;
        for (std::uint32_t i = start; i < done; ++i) {
            Entry& entry = _entries[i];
            const Placement local = localOf(scene, entry.node);
            entry.world = entry.parent == i ? local : _entries[entry.parent].world * local;
        }
    }
}

std::optional<Placement> SceneTree::placementOf(const Aspect& scene, ContainerId node) const {
    if (const auto found = _entryOf.find(node); found != _entryOf.end()) return _entries[found->second].world;
    if (!scene.findAs<Node>(node)) return std::nullopt;
    // Nodes know no parents; a beacon outside the drawn tree is rare enough for a search.
    std::unordered_map<ContainerId, ContainerId> parentOf;
    for (const ContainerId id : scene.ids())
        if (const Node* candidate = scene.findAs<Node>(id))
            for (std::size_t i = 0; i < candidate->children.size(); ++i)
                parentOf.emplace(candidate->children[i].id, id);
    Placement world = localOf(scene, node);
    ContainerId at = node;
    for (std::size_t steps = 0; steps <= parentOf.size(); ++steps) {
        const auto parent = parentOf.find(at);
        if (parent == parentOf.end()) break;
        at = parent->second;
        world = localOf(scene, at) * world;
    }
    return world;
}

std::pair<std::uint32_t, std::uint32_t> SceneTree::rangeOf(ContainerId node) const {
    const auto found = _entryOf.find(node);
    if (found == _entryOf.end()) return {0, 0};
    return {found->second, _entries[found->second].end};
}

std::vector<std::uint8_t> SceneTree::hiddenByDetail(const Aspect& scene, const glm::dvec3& eyeWorld) const {
    std::vector<std::uint8_t> hidden(_entries.size(), 0);
    for (const Level& level : _levels) {
        const LevelOfDetail* core = scene.findAs<LevelOfDetail>(level.core);
        if (!core || level.children.empty()) continue;
        const double distance = glm::length(_entries[level.entry].world.translation - eyeWorld);
        std::size_t chosen = 0;
        while (chosen < core->ranges.size() && distance >= static_cast<double>(core->ranges[chosen])) ++chosen;
        chosen = std::min(chosen, level.children.size() - 1);
        for (std::size_t i = 0; i < level.children.size(); ++i) {
            if (i == chosen || level.children[i] >= _entries.size()) continue;
            const std::uint32_t first = level.children[i];
            std::fill(hidden.begin() + first, hidden.begin() + _entries[first].end, std::uint8_t{1});
        }
    }
    return hidden;
}

}  // namespace umbriel
