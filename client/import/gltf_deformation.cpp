#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "client/import/gltf_builder.h"
#include "client/import/import_error.h"
#include "common/scene/deformed_bounds.h"

namespace umbriel {
namespace {

constexpr std::size_t kMostJoints = 65536;  // Geometry::joints holds 16 bits

int find(const std::map<std::string, int>& attributes, const std::string& name) {
    const auto found = attributes.find(name);
    return found == attributes.end() ? -1 : found->second;
}

struct Influence {
    std::uint32_t joint = 0;
    float weight = 0.0f;
};

}  // namespace

void GltfMeshes::requireMorphAccessors(const tinygltf::Primitive& source, const std::string& place) const {
    for (std::size_t t = 0; t < source.targets.size(); ++t)
        for (const auto& [name, accessor] : source.targets[t])
            if (accessor < 0 || static_cast<std::size_t>(accessor) >= _context.model().accessors.size())
                throw ImportRefused(place + "." + gltfPlace("targets", t) + "." + name,
                                    "accessor " + std::to_string(accessor) + " does not exist");
}

// Of all sets of four joints the four strongest of each vertex count.
void GltfMeshes::buildJoints(const tinygltf::Primitive& source, const std::string& place, std::size_t vertices,
                             Ref<Geometry> target) {
    std::vector<std::vector<Influence>> influences(find(source.attributes, "JOINTS_0") < 0 ? 0 : vertices);
    if (influences.empty()) return;
    std::size_t badWeights = 0;
    std::size_t badSums = 0;
    int sets = 0;
    for (;; ++sets) {
        const std::string jointsName = "JOINTS_" + std::to_string(sets);
        const std::string weightsName = "WEIGHTS_" + std::to_string(sets);
        const int joints = find(source.attributes, jointsName);
        if (joints < 0) break;
        if (find(source.attributes, weightsName) < 0)
            throw ImportRefused(place + ".attributes." + jointsName, "has no " + weightsName);
        if (_context.accessors.isFloat(joints))
            throw ImportRefused(place + ".attributes." + jointsName, "does not hold unsigned integers");
        const std::vector<float> numbers = attribute(source, jointsName.c_str(), place, vertices, 4);
        const std::vector<float> weights = attribute(source, weightsName.c_str(), place, vertices, 4);
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            if (!(weights[i] >= 0.0f) || !std::isfinite(weights[i])) ++badWeights;
            if (!(weights[i] > 0.0f) || !std::isfinite(weights[i])) continue;
            // Floats hold all 16 bit integers; negative ones are signed types.
            if (!(numbers[i] >= 0.0f && numbers[i] < float(kMostJoints)))
                throw ImportRefused(place + ".attributes." + jointsName,
                                    "element " + std::to_string(i / 4) + " names no joint");
            influences[i / 4].push_back({static_cast<std::uint32_t>(numbers[i]), weights[i]});
        }
    }
    _context.sceneBytes.take(vertices * (kJointsPerVertex * sizeof(std::uint16_t) + sizeof(glm::vec4)), place);
    std::vector<std::uint16_t> joints(vertices * kJointsPerVertex, 0);
    std::vector<glm::vec4> weights(vertices, glm::vec4(0.0f));
    std::size_t cut = 0;
    std::uint32_t largest = 0;
    for (std::size_t v = 0; v < vertices; ++v) {
        std::vector<Influence>& all = influences[v];
        // Integer weights of 8 bits sum to 1 within 4/255.
        const float sum = std::accumulate(all.begin(), all.end(), 0.0f,
                                          [](float total, const Influence& i) { return total + i.weight; });
        if (!(std::abs(sum - 1.0f) <= 0.02f)) ++badSums;
        if (all.size() > kJointsPerVertex) {
            std::stable_sort(all.begin(), all.end(),
                             [](const Influence& a, const Influence& b) { return a.weight > b.weight; });
            all.resize(kJointsPerVertex);
            ++cut;
        }
        for (std::size_t k = 0; k < all.size(); ++k) {
            joints[v * kJointsPerVertex + k] = static_cast<std::uint16_t>(all[k].joint);
            weights[v][static_cast<int>(k)] = all[k].weight;
            largest = std::max(largest, all[k].joint);
        }
    }
    const std::string where = place + ".attributes.WEIGHTS_0: ";
    if (badWeights != 0)
        _context.warnings.add(where + std::to_string(badWeights) + " weights are negative or not numbers; they are 0");
    if (badSums != 0)
        _context.warnings.add(where + std::to_string(badSums) +
                              " vertices have weights that do not sum to 1; they are scaled, and without any the first "
                              "joint counts");
    if (cut != 0)
        _context.warnings.add(where + std::to_string(cut) +
                              " vertices hang on more than four joints; the four "
                              "strongest count");
    auto edit = _context.scene.edit(target);
    edit.assign<&Geometry::joints>(joints);
    edit.assign<&Geometry::jointWeights>(weights);
    _largestJoint[target] = largest;
}

void GltfMeshes::buildMorphs(const tinygltf::Primitive& source, const std::string& place, std::size_t vertices,
                             Ref<Geometry> target) {
    const auto deltasOf = [&](const char* name) {
        std::vector<glm::vec3> deltas;
        for (std::size_t t = 0; t < source.targets.size(); ++t) {
            const int accessor = find(source.targets[t], name);
            if (accessor < 0) continue;
            const std::string where = place + "." + gltfPlace("targets", t) + "." + name;
            if (_context.accessors.count(accessor) != vertices)
                throw ImportRefused(where, "has " + std::to_string(_context.accessors.count(accessor)) +
                                               " elements, POSITION has " + std::to_string(vertices));
            if (_context.accessors.components(accessor) != 3)
                throw ImportRefused(where, "accessor " + std::to_string(accessor) + " is not of type VEC3");
            if (!_context.accessors.hasData(accessor)) {
                _context.warnings.add(where + ": its data is not in the file and counts as zeros");
                continue;
            }
            const std::vector<float> numbers = _context.accessors.floats(accessor);
            if (deltas.empty()) {
                _context.sceneBytes.take(source.targets.size() * vertices * sizeof(glm::vec3), where);
                deltas.resize(source.targets.size() * vertices, glm::vec3(0.0f));
            }
            for (std::size_t i = 0; i < numbers.size(); ++i) {
                if (!std::isfinite(numbers[i]))
                    throw ImportRefused(where, "element " + std::to_string(i / 3) + " is not finite");
                deltas[t * vertices + i / 3][static_cast<int>(i % 3)] = numbers[i];
            }
        }
        return deltas;
    };
    const bool hasNormals = find(source.attributes, "NORMAL") >= 0;
    auto edit = _context.scene.edit(target);
    std::vector<glm::vec3> positions = deltasOf("POSITION");
    // Without them the number of targets would be lost.
    if (positions.empty()) positions.resize(source.targets.size() * vertices, glm::vec3(0.0f));
    edit.assign<&Geometry::morphPositions>(positions);
    if (hasNormals) edit.assign<&Geometry::morphNormals>(deltasOf("NORMAL"));
    if (hasNormals && find(source.attributes, "TANGENT") >= 0)
        edit.assign<&Geometry::morphTangents>(deltasOf("TANGENT"));
}

Ref<Skin> GltfSkins::skin(int index, const std::vector<Ref<Geometry>>& geometries, const GltfMeshes& meshes,
                          const std::string& place) {
    const tinygltf::Skin& source = _context.model().skins[static_cast<std::size_t>(index)];
    const std::string where = gltfPlace("skins", static_cast<std::size_t>(index));
    if (source.joints.empty()) throw ImportRefused(where + ".joints", "is empty");
    if (source.joints.size() > kMostJoints)
        throw ImportRefused(where + ".joints", "has more than " + std::to_string(kMostJoints) + " joints");
    for (const Ref<Geometry>& geometry : geometries)
        if (const std::uint32_t largest = meshes.largestJoint(geometry); largest >= source.joints.size())
            throw ImportRefused(place + ".mesh", "its vertices name joint " + std::to_string(largest) + ", skin " +
                                                     std::to_string(index) + " has " +
                                                     std::to_string(source.joints.size()));
    const auto known = _skins.find(index);
    if (known != _skins.end()) return known->second;
    const Ref<Skin> made = _context.scene.create<Skin>(source.name);
    std::vector<glm::mat4> inverseBinds(source.joints.size(), glm::mat4(1.0f));
    if (source.inverseBindMatrices >= 0 && !_context.accessors.hasData(source.inverseBindMatrices)) {
        _context.warnings.add(where + ".inverseBindMatrices: its data is not in the file and counts as identities");
    } else if (source.inverseBindMatrices >= 0) {
        inverseBinds = matrices(source.inverseBindMatrices, source.joints.size(), where + ".inverseBindMatrices");
    }
    _context.scene.edit(made).assign<&Skin::inverseBinds>(inverseBinds);
    return _skins[index] = made;
}

std::vector<glm::mat4> GltfSkins::matrices(int accessor, std::size_t joints, const std::string& place) {
    if (_context.accessors.components(accessor) != 16 || !_context.accessors.isFloat(accessor))
        throw ImportRefused(place, "accessor " + std::to_string(accessor) + " does not hold float MAT4s");
    if (_context.accessors.count(accessor) < joints)
        throw ImportRefused(place, "has " + std::to_string(_context.accessors.count(accessor)) + " matrices for " +
                                       std::to_string(joints) + " joints");
    const std::vector<float> numbers = _context.accessors.floats(accessor);
    std::vector<glm::mat4> result(joints);
    std::size_t singular = 0;
    std::size_t projective = 0;
    for (std::size_t i = 0; i < joints; ++i) {
        for (std::size_t k = 0; k < 16; ++k) {
            if (!std::isfinite(numbers[16 * i + k]))
                throw ImportRefused(place, "matrix " + std::to_string(i) + " is not finite");
            result[i][static_cast<int>(k / 4)][static_cast<int>(k % 4)] = numbers[16 * i + k];
        }
        glm::mat4& matrix = result[i];
        const glm::vec4 last(matrix[0][3], matrix[1][3], matrix[2][3], matrix[3][3]);
        // Exporters round; more than that is another kind of map.
        if (glm::any(glm::greaterThan(glm::abs(last - glm::vec4(0, 0, 0, 1)), glm::vec4(1e-3f)))) ++projective;
        for (int column = 0; column < 4; ++column) matrix[column][3] = column == 3 ? 1.0f : 0.0f;
        const glm::dmat3 linear{glm::mat3(matrix)};
        const double volume = glm::length(linear[0]) * glm::length(linear[1]) * glm::length(linear[2]);
        if (!(std::abs(glm::determinant(linear)) > 1e-9 * volume)) ++singular;
    }
    if (projective != 0)
        _context.warnings.add(place + ": " + std::to_string(projective) +
                              " matrices do not end in the row 0 0 0 1, which is taken instead");
    if (singular != 0)
        _context.warnings.add(place + ": " + std::to_string(singular) +
                              " matrices are singular; what hangs on these joints is flat");
    return result;
}

void GltfSkins::setJoints(const std::map<int, Ref<Node>>& nodes) {
    for (const auto& [index, skin] : _skins) {
        const tinygltf::Skin& source = _context.model().skins[static_cast<std::size_t>(index)];
        std::vector<Ref<Node>> joints;
        for (std::size_t i = 0; i < source.joints.size(); ++i) {
            const auto found = nodes.find(source.joints[i]);
            if (found == nodes.end())
                throw ImportRefused(gltfPlace("skins", static_cast<std::size_t>(index)) + "." + gltfPlace("joints", i),
                                    "node " + std::to_string(source.joints[i]) + " is not in the scene of the mesh");
            joints.push_back(found->second);
        }
        _context.scene.edit(skin).assign<&Skin::joints>(joints);
    }
}

std::vector<int> GltfSkins::used() const {
    std::vector<int> indices;
    for (const auto& [index, skin] : _skins) indices.push_back(index);
    return indices;
}

Ref<MorphWeights> makeMorphWeights(GltfContext& context, const tinygltf::Node& node, int meshIndex, std::size_t targets,
                                   const std::string& place) {
    const tinygltf::Mesh& mesh = context.model().meshes[static_cast<std::size_t>(meshIndex)];
    const std::vector<double>& given = node.weights.empty() ? mesh.weights : node.weights;
    const std::string where = node.weights.empty()
                                  ? gltfPlace("meshes", static_cast<std::size_t>(meshIndex)) + ".weights"
                                  : place + ".weights";
    if (!given.empty() && given.size() != targets)
        context.warnings.add(where + ": has " + std::to_string(given.size()) + " weights for " +
                             std::to_string(targets) + " morph targets; those that are missing are 0");
    std::vector<float> weights(targets, 0.0f);
    for (std::size_t i = 0; i < std::min(targets, given.size()); ++i) {
        weights[i] = static_cast<float>(given[i]);
        if (!std::isfinite(weights[i])) throw ImportRefused(where, "weight " + std::to_string(i) + " is too large");
    }
    const Ref<MorphWeights> made = context.scene.create<MorphWeights>(node.name);
    context.scene.edit(made).assign<&MorphWeights::weights>(weights);
    return made;
}

}  // namespace umbriel
