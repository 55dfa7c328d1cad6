#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>

#include "client/import/gltf_builder.h"
#include "client/import/import_error.h"

namespace umbriel {
namespace {

constexpr const char* kAttributes[] = {"POSITION",   "NORMAL",   "TANGENT",   "COLOR_0",  "TEXCOORD_0",
                                       "TEXCOORD_1", "JOINTS_0", "WEIGHTS_0", "JOINTS_1", "WEIGHTS_1"};

int accessorOf(const tinygltf::Primitive& primitive, const char* name) {
    const auto found = primitive.attributes.find(name);
    return found == primitive.attributes.end() ? -1 : found->second;
}

template <class Vector>
std::vector<Vector> vectorsOf(const std::vector<float>& numbers) {
    std::vector<Vector> vectors(numbers.size() / static_cast<std::size_t>(Vector::length()));
    for (std::size_t i = 0; i < vectors.size(); ++i)
        for (int c = 0; c < Vector::length(); ++c)
            vectors[i][c] = numbers[i * static_cast<std::size_t>(Vector::length()) + static_cast<std::size_t>(c)];
    return vectors;
}

void requireFinite(const std::vector<float>& numbers, int components, const std::string& place) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
        if (!std::isfinite(numbers[i]))
            throw ImportRefused(
                place, "element " + std::to_string(i / static_cast<std::size_t>(components)) + " is not finite");
}

template <class Vector>
bool isDirection(const Vector& vector) {
    const glm::dvec3 wide(vector);
    const double squared = glm::dot(wide, wide);
    return std::isfinite(squared) && squared > 1e-24;
}

// Unit length; a normal without direction (zero, NaN: common at degenerate triangles) becomes that of its triangles.
std::size_t repairNormals(const std::vector<glm::vec3>& positions, const std::vector<std::uint32_t>& indices,
                          std::vector<glm::vec3>& normals) {
    std::vector<bool> broken(normals.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < normals.size(); ++i) {
        broken[i] = !isDirection(normals[i]);
        if (broken[i]) normals[i] = glm::vec3(0.0f), ++count;
        // Rounded normals of unit length are left as they are: exporters' bits survive a round trip.
        else if (std::abs(glm::dot(normals[i], normals[i]) - 1.0f) > 1e-3f)
            normals[i] = glm::vec3(glm::normalize(glm::dvec3(normals[i])));
    }
    if (count == 0) return 0;
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
        if (!broken[indices[i]] && !broken[indices[i + 1]] && !broken[indices[i + 2]]) continue;
        const glm::dvec3 a(positions[indices[i]]);
        const glm::dvec3 face =
            glm::cross(glm::dvec3(positions[indices[i + 1]]) - a, glm::dvec3(positions[indices[i + 2]]) - a);
        if (!isDirection(face)) continue;
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t vertex = indices[i + static_cast<std::size_t>(corner)];
            if (broken[vertex]) normals[vertex] += glm::vec3(glm::normalize(face));
        }
    }
    for (std::size_t i = 0; i < normals.size(); ++i)
        if (broken[i]) normals[i] = isDirection(normals[i]) ? glm::normalize(normals[i]) : glm::vec3(0.0f, 0.0f, 1.0f);
    return count;
}

// False when a tangent has no direction: then all of them are of no use.
bool repairTangents(std::vector<glm::vec4>& tangents) {
    for (glm::vec4& tangent : tangents) {
        if (!isDirection(tangent) || !std::isfinite(tangent.w)) return false;
        tangent.w = tangent.w < 0.0f ? -1.0f : 1.0f;
        const glm::vec3 direction(tangent);
        if (std::abs(glm::dot(direction, direction) - 1.0f) > 1e-3f)
            tangent = glm::vec4(glm::vec3(glm::normalize(glm::dvec3(direction))), tangent.w);
    }
    return true;
}

}  // namespace

const std::vector<Ref<Geometry>>& GltfMeshes::mesh(int index) {
    const auto known = _meshes.find(index);
    if (known != _meshes.end()) return known->second;
    const tinygltf::Mesh& source = _context.model().meshes[static_cast<std::size_t>(index)];
    std::vector<Ref<Geometry>> made;
    for (std::size_t i = 0; i < source.primitives.size(); ++i) {
        const std::string place =
            gltfPlace("meshes", static_cast<std::size_t>(index)) + "." + gltfPlace("primitives", i);
        if (const Ref<Geometry> geometry = primitive(source.primitives[i], place)) made.push_back(geometry);
    }
    return _meshes[index] = std::move(made);
}

Ref<Geometry> GltfMeshes::primitive(const tinygltf::Primitive& source, const std::string& place) {
    const int mode = source.mode < 0 ? TINYGLTF_MODE_TRIANGLES : source.mode;
    if (mode < TINYGLTF_MODE_TRIANGLES) {
        _context.warnings.add(place + ": points and lines are not drawn");
        return {};
    }
    if (accessorOf(source, "POSITION") < 0) {
        _context.warnings.add(place + ": has no POSITION and is not drawn");
        return {};
    }
    DataKey key{mode, source.indices};
    for (const char* attribute : kAttributes) key.push_back(accessorOf(source, attribute));
    for (std::size_t i = 1; i < key.size(); ++i)
        if (key[i] >= 0 && !_context.accessors.hasData(key[i])) {
            _context.warnings.add(place + ": its data is not in the file (a buffer without uri) and it is not drawn");
            return {};
        }
    requireMorphAccessors(source, place);
    for (const auto& target : source.targets)
        for (const char* attribute : {"POSITION", "NORMAL", "TANGENT"}) {
            const auto found = target.find(attribute);
            key.push_back(found == target.end() ? -1 : found->second);
        }
    DataKey withMaterial = key;
    withMaterial.push_back(source.material);
    const auto known = _geometries.find(withMaterial);
    if (known != _geometries.end()) return known->second;

    const Ref<Material> material = _materials.material(source.material);
    const Ref<Geometry> made = _context.scene.create<Geometry>();
    const auto same = _data.find(key);
    if (same != _data.end()) {
        // The same vertices with another material: the chunks are shared, in memory and on the wire.
        const Geometry& geometry = _context.scene.get(same->second);
        RawEdit raw(_context.scene);
        const auto& fields = geometry.type().fields;
        for (std::uint32_t i = 0; i < fields.size(); ++i)
            if (fields[i].isMulti) raw.assignMulti(made, i, fields[i].multi(geometry));
        _largestJoint[made] = largestJoint(same->second);
    } else if (build(source, place, made)) {
        _data[key] = made;
    } else {
        _context.scene.destroy(made);
        return _geometries[withMaterial] = {};
    }
    _context.scene.edit(made).set<&Geometry::material>(material);
    return _geometries[withMaterial] = made;
}

std::uint32_t GltfMeshes::largestJoint(Ref<Geometry> geometry) const {
    const auto found = _largestJoint.find(geometry);
    return found == _largestJoint.end() ? 0 : found->second;
}

std::size_t GltfMeshes::morphTargets(int index) const {
    std::size_t most = 0;
    for (const tinygltf::Primitive& source : _context.model().meshes[static_cast<std::size_t>(index)].primitives)
        most = std::max(most, source.targets.size());
    return most;
}

std::vector<float> GltfMeshes::attribute(const tinygltf::Primitive& source, const char* name, const std::string& place,
                                         std::size_t vertices, int components) {
    const int accessor = accessorOf(source, name);
    if (accessor < 0) return {};
    const std::string where = place + ".attributes." + name;
    if (_context.accessors.count(accessor) != vertices)
        throw ImportRefused(where, "has " + std::to_string(_context.accessors.count(accessor)) +
                                       " elements, POSITION has " + std::to_string(vertices));
    if (_context.accessors.components(accessor) != components)
        throw ImportRefused(where, "accessor " + std::to_string(accessor) + " is not of type " +
                                       (components == 2   ? "VEC2"
                                        : components == 3 ? "VEC3"
                                                          : "VEC4"));
    return _context.accessors.floats(accessor);
}

bool GltfMeshes::build(const tinygltf::Primitive& source, const std::string& place, Ref<Geometry> target) {
    const std::size_t count = _context.accessors.count(accessorOf(source, "POSITION"));
    const std::vector<std::uint32_t> indices = triangles(source, place, count);
    if (indices.empty()) {
        _context.warnings.add(place + ": has no triangle");
        return false;
    }
    const std::vector<float> points = attribute(source, "POSITION", place, count, 3);
    requireFinite(points, 3, place + ".attributes.POSITION");
    const std::vector<glm::vec3> positions = vectorsOf<glm::vec3>(points);
    buildJoints(source, place, count, target);
    if (!source.targets.empty()) buildMorphs(source, place, count, target);
    auto edit = _context.scene.edit(target);
    edit.assign<&Geometry::positions>(positions);
    edit.assign<&Geometry::indices>(indices);

    std::vector<glm::vec3> normals = vectorsOf<glm::vec3>(attribute(source, "NORMAL", place, count, 3));
    if (!normals.empty()) {
        const std::size_t repaired = repairNormals(positions, indices, normals);
        if (repaired != 0)
            _context.warnings.add(place + ".attributes.NORMAL: " + std::to_string(repaired) +
                                  " normals have no direction; those of their triangles are taken");
        edit.assign<&Geometry::normals>(normals);
        std::vector<glm::vec4> tangents = vectorsOf<glm::vec4>(attribute(source, "TANGENT", place, count, 4));
        // Tangents count only together with normals (glTF 2.0, section 3.7.2.1).
        if (repairTangents(tangents))
            edit.assign<&Geometry::tangents>(tangents);
        else
            _context.warnings.add(place + ".attributes.TANGENT: some have no direction; tangents are ignored");
    }
    for (int set = 0; set < 2; ++set) {
        const char* name = set == 0 ? "TEXCOORD_0" : "TEXCOORD_1";
        const std::vector<float> coordinates = attribute(source, name, place, count, 2);
        requireFinite(coordinates, 2, place + ".attributes." + name);
        if (set == 0)
            edit.assign<&Geometry::texCoords0>(vectorsOf<glm::vec2>(coordinates));
        else
            edit.assign<&Geometry::texCoords1>(vectorsOf<glm::vec2>(coordinates));
    }
    if (const int accessor = accessorOf(source, "COLOR_0"); accessor >= 0) {
        const bool hasAlpha = _context.accessors.components(accessor) == 4;
        std::vector<float> numbers = attribute(source, "COLOR_0", place, count, hasAlpha ? 4 : 3);
        if (_context.accessors.isPlainInteger(accessor)) numbers = _context.accessors.floats(accessor, true);
        requireFinite(numbers, hasAlpha ? 4 : 3, place + ".attributes.COLOR_0");
        std::vector<glm::vec4> colours;
        if (hasAlpha)
            colours = vectorsOf<glm::vec4>(numbers);
        else
            for (const glm::vec3& colour : vectorsOf<glm::vec3>(numbers)) colours.emplace_back(colour, 1.0f);
        edit.assign<&Geometry::colours>(colours);
    }
    return true;
}

std::vector<std::uint32_t> GltfMeshes::triangles(const tinygltf::Primitive& source, const std::string& place,
                                                 std::size_t vertices) {
    std::vector<std::uint32_t> listed;
    if (source.indices >= 0) {
        listed = _context.accessors.indices(source.indices, place + ".indices");
        for (std::size_t i = 0; i < listed.size(); ++i)
            if (listed[i] >= vertices)
                throw ImportRefused(place + ".indices", "element " + std::to_string(i) + " is " +
                                                            std::to_string(listed[i]) + ", there are " +
                                                            std::to_string(vertices) + " vertices");
    } else {
        _context.sceneBytes.take(vertices * sizeof(std::uint32_t), place);
        listed.resize(vertices);
        for (std::size_t i = 0; i < vertices; ++i) listed[i] = static_cast<std::uint32_t>(i);
    }
    const int mode = source.mode < 0 ? TINYGLTF_MODE_TRIANGLES : source.mode;
    if (mode == TINYGLTF_MODE_TRIANGLES) {
        if (listed.size() % 3 != 0) {
            _context.warnings.add(place + ": the last triangle is incomplete and ignored");
            listed.resize(listed.size() - listed.size() % 3);
        }
        return listed;
    }
    if (listed.size() < 3) return {};
    _context.sceneBytes.take((listed.size() - 2) * 3 * sizeof(std::uint32_t), place);
    std::vector<std::uint32_t> list;
    list.reserve((listed.size() - 2) * 3);
    for (std::size_t i = 0; i + 2 < listed.size(); ++i) {
        // glTF 2.0, section 3.7.2.1: strip p_i = {v_i, v_(i+(1+i%2)), v_(i+(2-i%2))}; fan p_i = {v_(i+1), v_(i+2),
        // v_0}.
        if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
            list.insert(list.end(), {listed[i], listed[i + 1 + i % 2], listed[i + 2 - i % 2]});
        else
            list.insert(list.end(), {listed[i + 1], listed[i + 2], listed[0]});
    }
    return list;
}

}  // namespace umbriel
