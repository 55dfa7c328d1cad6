#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>

#include "client/import/gltf_builder.h"
#include "client/import/import_error.h"
#include "common/scene/cameras.h"
#include "common/scene/lights.h"

namespace umbriel {
namespace {

constexpr double kPi = 3.14159265358979323846;

std::string nodePlace(int index) {
    return gltfPlace("nodes", static_cast<std::size_t>(index));
}

int lightOf(const tinygltf::Node& node) {
    const auto found = node.extensions.find("KHR_lights_punctual");
    if (found == node.extensions.end() || !found->second.Has("light")) return -1;
    return found->second.Get("light").GetNumberAsInt();
}

bool isVisible(const tinygltf::Node& node) {
    const auto found = node.extensions.find("KHR_node_visibility");
    if (found == node.extensions.end() || !found->second.Has("visible")) return true;
    return found->second.Get("visible").Get<bool>();
}

template <std::size_t Count>
void requireFinite(const double (&numbers)[Count], const std::string& place) {
    for (const double number : numbers)
        if (!std::isfinite(number) || std::abs(number) > 1e30) throw ImportRefused(place, "its numbers are too large");
}

}  // namespace

void normaliseQuaternion(float* quaternion, const std::string& place, ImportWarnings& warnings) {
    double squared = 0.0;
    for (int i = 0; i < 4; ++i) squared += static_cast<double>(quaternion[i]) * quaternion[i];
    if (!std::isfinite(squared) || squared < 1e-24) throw ImportRefused(place, "the quaternion has no direction");
    // Floats of unit length are off by 1e-7, quantised ones (16 bits) by 1e-4, 8 bits by 1e-2.
    if (std::abs(squared - 1.0) < 1e-6) return;
    if (std::abs(squared - 1.0) > 0.03)
        warnings.add(place + ": the quaternion is not of unit length and is normalised");
    for (int i = 0; i < 4; ++i) quaternion[i] = static_cast<float>(quaternion[i] / std::sqrt(squared));
}

Ref<Node> GltfNodes::build(const std::string& sceneName) {
    requireTree();
    std::string name = sceneName;
    const std::vector<int> roots = rootsOfScene(name);
    const Ref<Node> scene = _context.scene.create<Node>(name);
    std::vector<Ref<Node>> children;
    for (const int root : roots) children.push_back(buildTree(root));
    _skins.setJoints(_nodes);
    requireShortWays();
    _context.scene.edit(scene).assign<&Node::children>(children);

    // A light acts on what is below its node, and glTF's lights act on everything: so their nodes form a chain above
    // the scene, and each stands where its glTF node, its beacon, does.
    if (_lightNodes.size() > _context.limits.lights)
        throw ImportRefused("extensions.KHR_lights_punctual",
                            "more than " + std::to_string(_context.limits.lights) + " lights");
    Ref<Node> top = scene;
    for (auto it = _lightNodes.rbegin(); it != _lightNodes.rend(); ++it) {
        const auto [node, lightIndex] = *it;
        const tinygltf::Light& source = _context.model().lights[static_cast<std::size_t>(lightIndex)];
        const std::string& nodeName = _context.model().nodes[static_cast<std::size_t>(node)].name;
        std::string name = source.name.empty() ? nodeName : source.name;
        if (name.empty()) name = "light " + std::to_string(lightIndex);
        const Ref<Container> core = light(lightIndex, name, _nodes.at(node));
        const Ref<Node> above = _context.scene.create<Node>(name);
        auto edit = _context.scene.edit(above);
        edit.set<&Node::core>(core);
        edit.append<&Node::children>(top);
        top = above;
    }
    return top;
}

// Every node has at most one parent and none is its own ancestor; walks up with a stamp per start, linear in all.
void GltfNodes::requireTree() const {
    const auto& nodes = _context.model().nodes;
    std::vector<int> parent(nodes.size(), -1);
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (std::size_t k = 0; k < nodes[i].children.size(); ++k) {
            int& known = parent[static_cast<std::size_t>(nodes[i].children[k])];
            if (known >= 0)
                throw ImportRefused(gltfPlace("nodes", i) + "." + gltfPlace("children", k),
                                    "node " + std::to_string(nodes[i].children[k]) + " already has the parent " +
                                        std::to_string(known));
            known = static_cast<int>(i);
        }
    std::vector<std::size_t> stamp(nodes.size(), 0);
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (int at = static_cast<int>(i); at >= 0 && stamp[static_cast<std::size_t>(at)] != i + 1;) {
            if (stamp[static_cast<std::size_t>(at)] != 0) break;
            stamp[static_cast<std::size_t>(at)] = i + 1;
            at = parent[static_cast<std::size_t>(at)];
            if (at >= 0 && stamp[static_cast<std::size_t>(at)] == i + 1)
                throw ImportRefused(nodePlace(at), "is its own ancestor");
        }
    for (std::size_t s = 0; s < _context.model().scenes.size(); ++s)
        for (std::size_t k = 0; k < _context.model().scenes[s].nodes.size(); ++k) {
            const int node = _context.model().scenes[s].nodes[k];
            if (parent[static_cast<std::size_t>(node)] >= 0)
                throw ImportRefused(gltfPlace("scenes", s) + "." + gltfPlace("nodes", k),
                                    "node " + std::to_string(node) + " is not a root: its parent is " +
                                        std::to_string(parent[static_cast<std::size_t>(node)]));
        }
}

std::vector<int> GltfNodes::rootsOfScene(std::string& sceneName) {
    const auto& model = _context.model();
    if (model.scenes.empty()) {  // a library of parts: all of them
        std::vector<bool> isChild(model.nodes.size());
        for (const tinygltf::Node& node : model.nodes)
            for (const int child : node.children) isChild[static_cast<std::size_t>(child)] = true;
        std::vector<int> roots;
        for (std::size_t i = 0; i < model.nodes.size(); ++i)
            if (!isChild[i]) roots.push_back(static_cast<int>(i));
        return roots;
    }
    const std::size_t index = static_cast<std::size_t>(std::max(model.defaultScene, 0));
    if (model.scenes.size() > 1)
        _context.warnings.add("the file has " + std::to_string(model.scenes.size()) + " scenes; scene " +
                              std::to_string(index) + " is loaded");
    const tinygltf::Scene& scene = model.scenes[index];
    if (!scene.name.empty()) sceneName = scene.name;
    std::vector<int> roots = scene.nodes;
    std::vector<int> sorted = roots;
    std::sort(sorted.begin(), sorted.end());
    if (const auto twice = std::adjacent_find(sorted.begin(), sorted.end()); twice != sorted.end())
        throw ImportRefused(gltfPlace("scenes", index) + ".nodes", "names node " + std::to_string(*twice) + " twice");
    return roots;
}

// Parents before children, in the order of children. Without recursion: the depth is the file's.
Ref<Node> GltfNodes::buildTree(int root) {
    struct Open {
        int index;
        Ref<Node> node;
        std::vector<Ref<Node>> children;
        std::size_t next = 0;  // of the source's children
    };
    std::vector<Open> open;
    const auto enter = [&](int index) {
        std::vector<Ref<Node>> leaves;
        const Ref<Node> node = buildNode(index, static_cast<std::uint32_t>(open.size()), leaves);
        open.push_back({index, node, std::move(leaves)});
    };
    enter(root);
    for (;;) {
        Open& top = open.back();
        const tinygltf::Node& source = _context.model().nodes[static_cast<std::size_t>(top.index)];
        if (top.next < source.children.size()) {
            enter(source.children[top.next++]);
            continue;
        }
        const Ref<Node> done = top.node;
        _context.scene.edit(done).assign<&Node::children>(top.children);
        open.pop_back();
        if (open.empty()) return done;
        open.back().children.push_back(done);
    }
}

Ref<Node> GltfNodes::buildNode(int index, std::uint32_t depth, std::vector<Ref<Node>>& leaves) {
    if (depth > _context.limits.depth)
        throw ImportRefused(nodePlace(index), "lies deeper than " + std::to_string(_context.limits.depth) +
                                                  " nodes; merge nodes that have a single child into it");
    if (_context.scene.containerCount() > _context.limits.containers)
        throw ImportRefused(nodePlace(index),
                            "the scene has more than " + std::to_string(_context.limits.containers) + " parts");
    const tinygltf::Node& source = _context.model().nodes[static_cast<std::size_t>(index)];
    const Ref<Node> node = _context.scene.create<Node>(source.name);
    const Ref<Transform> transform = _context.scene.create<Transform>();
    _nodes[index] = node;
    _depths[index] = depth;
    _transforms[index] = transform;
    place(source, nodePlace(index), transform);
    if (source.camera >= 0) _cameraNodes.emplace_back(source.camera, index);
    if (const int light = lightOf(source); light >= 0) _lightNodes.emplace_back(index, light);

    if (source.mesh >= 0) leaves = buildLeaves(source, index);
    auto edit = _context.scene.edit(node);
    edit.set<&Node::core>(transform);
    edit.set<&Node::visible>(isVisible(source));
    return node;
}

void GltfNodes::requireShortWays() const {
    std::uint64_t steps = 0;
    const auto walk = [&](int node, const std::string& place) {
        // Itself, and the scene and the chain of lights above its root.
        steps += _depths.at(node) + _lightNodes.size() + 2;
        if (steps > _context.limits.stepsUp)
            throw ImportRefused(place, "joints, lights and cameras lie too deep: more than " +
                                           std::to_string(_context.limits.stepsUp) +
                                           " nodes above them, counted for each; hang them higher up");
    };
    for (const int skin : _skins.used()) {
        const std::vector<int>& joints = _context.model().skins[static_cast<std::size_t>(skin)].joints;
        for (std::size_t i = 0; i < joints.size(); ++i)
            walk(joints[i], gltfPlace("skins", static_cast<std::size_t>(skin)) + "." + gltfPlace("joints", i));
    }
    for (const auto& [node, light] : _lightNodes) walk(node, nodePlace(node));
    for (const auto& [camera, node] : _cameraNodes) walk(node, nodePlace(node));
}

std::vector<Ref<Node>> GltfNodes::buildLeaves(const tinygltf::Node& source, int index) {
    const std::string& name = _context.model().meshes[static_cast<std::size_t>(source.mesh)].name;
    const std::vector<Ref<Geometry>>& geometries = _meshes.mesh(source.mesh);
    Ref<Skin> skin;
    Ref<MorphWeights> morph;
    if (source.skin >= 0 && !geometries.empty()) skin = _skins.skin(source.skin, geometries, _meshes, nodePlace(index));
    if (const std::size_t targets = _meshes.morphTargets(source.mesh); targets > 0 && !geometries.empty())
        morph = _morphWeights[index] = makeMorphWeights(_context, source, source.mesh, targets, nodePlace(index));
    std::vector<Ref<Node>> leaves;
    for (const Ref<Geometry>& geometry : geometries) {
        Ref<Container> core(geometry.id);
        if (skin || morph) {
            const Ref<DeformedGeometry> deformed = _context.scene.create<DeformedGeometry>();
            auto edit = _context.scene.edit(deformed);
            edit.set<&DeformedGeometry::geometry>(geometry);
            edit.set<&DeformedGeometry::skin>(skin);
            edit.set<&DeformedGeometry::morph>(morph);
            core = Ref<Container>(deformed.id);
        }
        const Ref<Node> leaf = _context.scene.create<Node>(name);
        _context.scene.edit(leaf).set<&Node::core>(core);
        leaves.push_back(leaf);
    }
    return leaves;
}

void GltfNodes::place(const tinygltf::Node& source, const std::string& where, Ref<Transform> transform) {
    double linear[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // column by column
    double translation[3] = {0, 0, 0};
    if (!source.matrix.empty()) {
        if (!source.translation.empty() || !source.rotation.empty() || !source.scale.empty())
            _context.warnings.add(where + ": has a matrix and translation, rotation or scale; the matrix is taken");
        const std::vector<double>& m = source.matrix;
        if (m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || m[15] != 1.0)
            throw ImportRefused(where + ".matrix", "its last row is not 0 0 0 1");
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t row = 0; row < 3; ++row) linear[column * 3 + row] = m[column * 4 + row];
        for (std::size_t row = 0; row < 3; ++row) translation[row] = m[12 + row];
    } else {
        glm::dquat rotation(1.0, 0.0, 0.0, 0.0);
        if (!source.rotation.empty()) {
            float xyzw[4];
            for (std::size_t i = 0; i < 4; ++i) xyzw[i] = static_cast<float>(source.rotation[i]);
            normaliseQuaternion(xyzw, where + ".rotation", _context.warnings);
            const std::vector<double>& q = source.rotation;
            rotation = glm::normalize(glm::dquat(q[3], q[0], q[1], q[2]));
        }
        const glm::dmat3 axes = glm::mat3_cast(rotation);
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t row = 0; row < 3; ++row)
                linear[column * 3 + row] = axes[static_cast<int>(column)][static_cast<int>(row)] *
                                           (source.scale.empty() ? 1.0 : source.scale[column]);
        for (std::size_t row = 0; row < 3 && !source.translation.empty(); ++row)
            translation[row] = source.translation[row];
    }
    requireFinite(linear, where);
    requireFinite(translation, where);
    glm::mat3 rounded;
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) rounded[column][row] = static_cast<float>(linear[column * 3 + row]);
    auto edit = _context.scene.edit(transform);
    edit.set<&Transform::linear>(rounded);
    edit.set<&Transform::translation>(glm::dvec3(translation[0], translation[1], translation[2]));
}

std::vector<Ref<Container>> GltfNodes::cameras() {
    // In the order of the file's cameras; one that several nodes use is several cameras, one that none uses is none.
    std::stable_sort(_cameraNodes.begin(), _cameraNodes.end());
    std::vector<Ref<Container>> made;
    std::map<std::string, int> uses;
    for (const auto& [index, node] : _cameraNodes) {
        const tinygltf::Camera& source = _context.model().cameras[static_cast<std::size_t>(index)];
        const std::string where = gltfPlace("cameras", static_cast<std::size_t>(index));
        std::string name = source.name;
        if (name.empty()) name = _context.model().nodes[static_cast<std::size_t>(node)].name;
        if (name.empty()) name = "camera " + std::to_string(made.size());
        // The format allows a name twice; whoever chooses a camera by its name has to reach both.
        while (const int before = uses[name]++) name += " " + std::to_string(before + 1);
        if (source.type == "perspective") {
            const auto& lens = source.perspective;
            if (!(lens.yfov > 0.0 && lens.yfov < kPi))
                throw ImportRefused(where + ".perspective.yfov", "is not within 0 and pi");
            if (!(lens.znear > 0.0)) throw ImportRefused(where + ".perspective.znear", "is not positive");
            if (lens.zfar != 0.0 && !(lens.zfar > lens.znear))
                throw ImportRefused(where + ".perspective.zfar", "is not beyond znear");
            const Ref<PerspectiveCamera> camera = _context.scene.create<PerspectiveCamera>(name);
            auto edit = _context.scene.edit(camera);
            edit.set<&PerspectiveCamera::beacon>(_nodes.at(node));
            edit.set<&PerspectiveCamera::fovY>(lens.yfov);
            edit.set<&PerspectiveCamera::aspect>(lens.aspectRatio);
            edit.set<&PerspectiveCamera::nearDistance>(lens.znear);
            edit.set<&PerspectiveCamera::farDistance>(lens.zfar);
            made.emplace_back(camera.id);
        } else {
            const auto& box = source.orthographic;
            if (box.xmag == 0.0 || box.ymag == 0.0)
                throw ImportRefused(where + ".orthographic", "xmag or ymag is zero");
            if (!(box.zfar > box.znear)) throw ImportRefused(where + ".orthographic.zfar", "is not beyond znear");
            const Ref<OrthographicCamera> camera = _context.scene.create<OrthographicCamera>(name);
            auto edit = _context.scene.edit(camera);
            edit.set<&OrthographicCamera::beacon>(_nodes.at(node));
            edit.set<&OrthographicCamera::halfWidth>(std::abs(box.xmag));
            edit.set<&OrthographicCamera::halfHeight>(std::abs(box.ymag));
            edit.set<&OrthographicCamera::nearDistance>(box.znear);
            edit.set<&OrthographicCamera::farDistance>(box.zfar);
            made.emplace_back(camera.id);
        }
    }
    return made;
}

Ref<Transform> GltfNodes::transformOf(int node) const {
    const auto found = _transforms.find(node);
    return found == _transforms.end() ? Ref<Transform>() : found->second;
}

Ref<MorphWeights> GltfNodes::morphWeightsOf(int node) const {
    const auto found = _morphWeights.find(node);
    return found == _morphWeights.end() ? Ref<MorphWeights>() : found->second;
}

// Candela and lux are taken as W/sr and W/m^2, unscaled: the file's author chose the numbers against an exposure.
Ref<Container> GltfNodes::light(int index, const std::string& name, Ref<Node> beacon) {
    const tinygltf::Light& source = _context.model().lights[static_cast<std::size_t>(index)];
    glm::vec3 strength(static_cast<float>(source.intensity));
    for (int i = 0; i < 3 && !source.color.empty(); ++i)
        strength[i] = static_cast<float>(source.intensity * source.color[static_cast<std::size_t>(i)]);
    if (!std::isfinite(strength.x + strength.y + strength.z))
        throw ImportRefused("extensions.KHR_lights_punctual." + gltfPlace("lights", static_cast<std::size_t>(index)),
                            "its intensity is too large");
    if (source.type == "directional") {
        const Ref<DirectionalLight> light = _context.scene.create<DirectionalLight>(name);
        auto edit = _context.scene.edit(light);
        edit.set<&DirectionalLight::beacon>(beacon);
        edit.set<&DirectionalLight::irradiance>(strength);
        return Ref<Container>(light.id);
    }
    if (source.type == "point") {
        const Ref<PointLight> light = _context.scene.create<PointLight>(name);
        auto edit = _context.scene.edit(light);
        edit.set<&PointLight::beacon>(beacon);
        edit.set<&PointLight::intensity>(strength);
        edit.set<&PointLight::range>(static_cast<float>(source.range));
        return Ref<Container>(light.id);
    }
    const std::string where =
        "extensions.KHR_lights_punctual." + gltfPlace("lights", static_cast<std::size_t>(index)) + ".spot";
    if (!(source.spot.innerConeAngle < source.spot.outerConeAngle))
        throw ImportRefused(where, "innerConeAngle is not below outerConeAngle");
    const Ref<SpotLight> light = _context.scene.create<SpotLight>(name);
    auto edit = _context.scene.edit(light);
    edit.set<&SpotLight::beacon>(beacon);
    edit.set<&SpotLight::intensity>(strength);
    edit.set<&SpotLight::range>(static_cast<float>(source.range));
    edit.set<&SpotLight::innerAngle>(static_cast<float>(source.spot.innerConeAngle));
    edit.set<&SpotLight::outerAngle>(static_cast<float>(std::min(source.spot.outerConeAngle, kPi / 2)));
    return Ref<Container>(light.id);
}

}  // namespace umbriel
