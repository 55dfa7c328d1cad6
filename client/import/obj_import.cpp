#include "client/import/obj_import.h"

#include <tiny_obj_loader.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <unordered_map>

#include "client/import/obj_materials.h"
#include "client/import/obj_text.h"

namespace umbriel {
namespace {

// Reads MTL libraries from the file's folder only; a missing one costs the materials, not the scene.
class ConfinedMaterialReader final : public tinyobj::MaterialReader {
 public:
    ConfinedMaterialReader(SourceFolder& folder, ImportWarnings& warnings) : _folder(folder), _warnings(warnings) {}

    bool operator()(const std::string& name, std::vector<tinyobj::material_t>* materials,
                    std::map<std::string, int>* byName, std::string*, std::string*) override {
        // The format lists several libraries with blanks between them; programs write one whose name has blanks.
        try {
            load(spacedName(name), materials, byName);
        } catch (const ImportRefused& reason) {
            if (name.find(kJoint) == std::string::npos) warnOf(reason);
            for (std::size_t begin = 0; name.find(kJoint) != std::string::npos && begin < name.size();) {
                const std::size_t end = std::min(name.find(kJoint, begin), name.size());
                try {
                    if (end > begin) load(name.substr(begin, end - begin), materials, byName);
                } catch (const ImportRefused& partsReason) {
                    warnOf(partsReason);
                }
                begin = end + 1;
            }
        }
        return true;
    }

 private:
    void load(const std::string& name, std::vector<tinyobj::material_t>* materials, std::map<std::string, int>* byName) {
        const std::vector<std::byte> bytes = _folder.read(name, "mtllib", false);
        std::istringstream text(
            readableMtl({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, name, _warnings));
        std::string warning;
        std::string error;
        tinyobj::LoadMtl(byName, materials, &text, &warning, &error);
        if (!error.empty()) _warnings.add("mtllib '" + name + "': " + error);
    }

    void warnOf(const ImportRefused& reason) { _warnings.add(std::string(reason.what()) + "; its materials are grey"); }

    SourceFolder& _folder;
    ImportWarnings& _warnings;
};

struct Corner {
    int position;
    int normal;
    int texCoord;
    friend bool operator==(const Corner&, const Corner&) = default;
};

struct CornerHash {
    std::size_t operator()(const Corner& corner) const {
        const auto mix = [](std::uint64_t seed, int value) {
            return (seed ^ static_cast<std::uint32_t>(value)) * 0x9e3779b97f4a7c15ull;
        };
        const std::uint64_t mixed = mix(mix(mix(0, corner.position), corner.normal), corner.texCoord);
        return static_cast<std::size_t>(mixed ^ (mixed >> 29));
    }
};

// The faces of one shape that share a material, with one vertex for each combination of indices.
class GeometryBuilder {
 public:
    GeometryBuilder(const tinyobj::attrib_t& attributes, ByteBudget& sceneBytes)
        : _attributes(attributes), _sceneBytes(sceneBytes) {}

    void addTriangle(const tinyobj::index_t* corners, const std::string& place) {
        for (int i = 0; i < 3; ++i) {
            const Corner corner{corners[i].vertex_index, corners[i].normal_index, corners[i].texcoord_index};
            requireIndex(corner.position, _attributes.vertices.size() / 3, "vertex", place);
            if (corner.normal >= 0) requireIndex(corner.normal, _attributes.normals.size() / 3, "normal", place);
            if (corner.texCoord >= 0)
                requireIndex(corner.texCoord, _attributes.texcoords.size() / 2, "texture coordinate", place);
            _hasNormals = _hasNormals && corner.normal >= 0;
            _hasTexCoords = _hasTexCoords && corner.texCoord >= 0;
            const auto [found, isNew] = _vertexOf.try_emplace(corner, static_cast<std::uint32_t>(_corners.size()));
            if (isNew) {
                _sceneBytes.take(sizeof(glm::vec3) * 2 + sizeof(glm::vec2) + sizeof(glm::vec4), place);
                _corners.push_back(corner);
            }
            _indices.push_back(found->second);
        }
        _sceneBytes.take(3 * sizeof(std::uint32_t), place);
    }

    Ref<Geometry> create(Aspect& scene, Ref<Material> material) const {
        std::vector<glm::vec3> positions;
        std::vector<glm::vec3> normals;
        std::vector<glm::vec2> texCoords;
        std::vector<glm::vec4> colours;
        const bool hasColours = _attributes.colors.size() == _attributes.vertices.size();
        bool normalsUsable = _hasNormals;
        for (const Corner& corner : _corners) {
            positions.push_back(triple(_attributes.vertices, corner.position));
            if (normalsUsable) {
                const glm::vec3 normal = triple(_attributes.normals, corner.normal);
                const float length = glm::length(normal);
                normalsUsable = length > 1e-12f && std::isfinite(length);
                normals.push_back(normalsUsable ? normal / length : normal);
            }
            // First row first here, lower left first in OBJ.
            if (_hasTexCoords) {
                const std::size_t at = static_cast<std::size_t>(corner.texCoord) * 2;
                texCoords.emplace_back(_attributes.texcoords[at], 1.0f - _attributes.texcoords[at + 1]);
            }
            if (hasColours) colours.emplace_back(triple(_attributes.colors, corner.position), 1.0f);
        }
        const Ref<Geometry> made = scene.create<Geometry>();
        auto edit = scene.edit(made);
        edit.assign<&Geometry::positions>(positions);
        edit.assign<&Geometry::indices>(_indices);
        if (normalsUsable) edit.assign<&Geometry::normals>(normals);
        if (_hasTexCoords) edit.assign<&Geometry::texCoords0>(texCoords);
        if (hasColours) edit.assign<&Geometry::colours>(colours);
        edit.set<&Geometry::material>(material);
        return made;
    }

 private:
    static void requireIndex(int index, std::size_t count, const char* what, const std::string& place) {
        if (index < 0 || static_cast<std::size_t>(index) >= count)
            throw ImportRefused(place, "names " + std::string(what) + " " + std::to_string(index + 1) + ", there are " +
                                           std::to_string(count));
    }

    static glm::vec3 triple(const std::vector<float>& numbers, int index) {
        const std::size_t at = static_cast<std::size_t>(index) * 3;
        return {numbers[at], numbers[at + 1], numbers[at + 2]};
    }

    const tinyobj::attrib_t& _attributes;
    ByteBudget& _sceneBytes;
    std::unordered_map<Corner, std::uint32_t, CornerHash> _vertexOf;
    std::vector<Corner> _corners;
    std::vector<std::uint32_t> _indices;
    bool _hasNormals = true;
    bool _hasTexCoords = true;
};

std::vector<std::string> linesOf(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);)
        if (line.size() > 1) lines.push_back(line);  // tinyobjloader ends some with a lone period
    return lines;
}

Ref<Node> createShape(const tinyobj::shape_t& shape, const tinyobj::attrib_t& attributes, Aspect& scene,
                      const std::vector<tinyobj::material_t>& sources, ObjMaterials& materials,
                      ByteBudget& sceneBytes) {
    std::map<int, GeometryBuilder> builders;
    std::size_t at = 0;
    for (std::size_t face = 0; face < shape.mesh.num_face_vertices.size(); ++face) {
        const std::size_t corners = shape.mesh.num_face_vertices[face];
        const std::string place = "object '" + shape.name + "', triangle " + std::to_string(face);
        if (corners == 3 && at + 3 <= shape.mesh.indices.size()) {
            const int material = face < shape.mesh.material_ids.size() ? shape.mesh.material_ids[face] : -1;
            builders.try_emplace(material, attributes, sceneBytes)
                .first->second.addTriangle(&shape.mesh.indices[at], place);
        }
        at += corners;
    }
    if (builders.empty()) return {};
    const Ref<Node> node = scene.create<Node>(shape.name);
    std::vector<Ref<Node>> leaves;
    for (const auto& [material, builder] : builders) {
        const Ref<Material> look = materials.material(sources, material);
        const Ref<Geometry> geometry = builder.create(scene, look);
        leaves.push_back(scene.create<Node>(scene.get(look).name));
        scene.edit(leaves.back()).set<&Node::core>(geometry);
    }
    scene.edit(node).assign<&Node::children>(leaves);
    return node;
}

// All triangles of the file over all of its vertices.
Ref<Node> createAsWritten(const std::vector<tinyobj::shape_t>& shapes, const tinyobj::attrib_t& attributes,
                          Aspect& scene, ByteBudget& sceneBytes) {
    const std::size_t count = attributes.vertices.size() / 3;
    sceneBytes.take(count * sizeof(glm::vec3), "vertices");
    std::vector<glm::vec3> positions(count);
    for (std::size_t i = 0; i < count; ++i) {
        positions[i] = {attributes.vertices[3 * i], attributes.vertices[3 * i + 1], attributes.vertices[3 * i + 2]};
    }
    std::vector<std::uint32_t> indices;
    for (const tinyobj::shape_t& shape : shapes) {
        std::size_t at = 0;
        for (std::size_t face = 0; face < shape.mesh.num_face_vertices.size(); ++face) {
            const std::size_t corners = shape.mesh.num_face_vertices[face];
            if (corners == 3 && at + 3 <= shape.mesh.indices.size()) {
                sceneBytes.take(3 * sizeof(std::uint32_t), "triangles");
                for (std::size_t i = at; i < at + 3; ++i) {
                    const int vertex = shape.mesh.indices[i].vertex_index;
                    if (vertex < 0 || static_cast<std::size_t>(vertex) >= count) {
                        throw ImportRefused(
                            "object '" + shape.name + "', triangle " + std::to_string(face),
                            "names vertex " + std::to_string(vertex + 1) + ", there are " + std::to_string(count));
                    }
                    indices.push_back(static_cast<std::uint32_t>(vertex));
                }
            }
            at += corners;
        }
    }
    if (indices.empty()) return {};
    const Ref<Geometry> geometry = scene.create<Geometry>();
    auto edit = scene.edit(geometry);
    edit.assign<&Geometry::positions>(positions);
    edit.assign<&Geometry::indices>(indices);
    const Ref<Node> node = scene.create<Node>("mesh");
    scene.edit(node).set<&Node::core>(geometry);
    return node;
}

}  // namespace

Ref<LoadedScene> importObj(const std::string& file, Aspect& scene, const ImportLimits& limits,
                           ImportWarnings& warnings) {
    ByteBudget fileBytes(limits.fileBytes, "file and those it names");
    ByteBudget sceneBytes(limits.sceneBytes, "scene");
    SourceFolder folder(file, fileBytes);
    tinyobj::attrib_t attributes;
    std::vector<tinyobj::shape_t> shapes;
    std::vector<tinyobj::material_t> sources;
    {
        const std::vector<std::byte> bytes = folder.readMain();
        if (bytes.empty()) throw ImportRefused("the file is empty");
        std::istringstream stream(
            readableObj({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, limits.faceCorners, warnings));
        ConfinedMaterialReader reader(folder, warnings);
        std::string warning;
        std::string error;
        if (!tinyobj::LoadObj(&attributes, &shapes, &sources, &warning, &error, &stream, &reader, true, false))
            throw ImportRefused(error.empty() ? "cannot be understood" : error);
        for (std::string& line : linesOf(warning)) warnings.add(spacedName(std::move(line)));
    }
    for (tinyobj::material_t& source : sources) source.name = spacedName(std::move(source.name));

    ObjMaterials materials(folder, scene, limits, sceneBytes, warnings);
    std::vector<Ref<Node>> nodes;
    if (limits.verticesAsWritten) {
        if (const Ref<Node> node = createAsWritten(shapes, attributes, scene, sceneBytes)) nodes.push_back(node);
        shapes.clear();
    }
    for (const tinyobj::shape_t& shape : shapes) {
        if (!shape.lines.indices.empty() || !shape.points.indices.empty())
            warnings.add("points and lines are not drawn");
        if (scene.containerCount() > limits.containers)
            throw ImportRefused("the scene has more than " + std::to_string(limits.containers) + " parts");
        if (const Ref<Node> node = createShape(shape, attributes, scene, sources, materials, sceneBytes))
            nodes.push_back(node);
    }
    const Ref<Node> root = scene.create<Node>(folder.fileName());
    scene.edit(root).assign<&Node::children>(nodes);
    const Ref<LoadedScene> loaded = scene.create<LoadedScene>(folder.fileName());
    scene.edit(loaded).set<&LoadedScene::root>(root);
    return loaded;
}

}  // namespace umbriel
