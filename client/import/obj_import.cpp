#include "client/import/obj_import.h"

#include <tiny_obj_loader.h>

#include <charconv>
#include <cmath>
#include <map>
#include <sstream>
#include <unordered_map>

#include "client/import/obj_materials.h"

namespace umbriel {
namespace {

constexpr double kLargest = 1e30;

bool isBlank(char c) {
    return c == ' ' || c == '\t' || c == '\r';
}

// tinyobjloader reads what is no number as 0, so the numbers of vertices are checked first, where the line is known.
class VertexLines {
 public:
    explicit VertexLines(std::string_view text) : _text(text) {}

    // Throws ImportRefused.
    void check() const {
        std::size_t number = 0;
        for (std::size_t begin = 0; begin < _text.size();) {
            const std::size_t end = std::min(_text.find('\n', begin), _text.size());
            checkLine(_text.substr(begin, end - begin), ++number);
            begin = end + 1;
        }
    }

 private:
    static void checkLine(std::string_view line, std::size_t number) {
        std::string_view rest = line;
        const std::string_view keyword = nextWord(rest);
        const std::size_t needed = keyword == "v" || keyword == "vn" ? 3 : keyword == "vt" ? 1 : 0;
        if (needed == 0) return;
        const std::string place = "line " + std::to_string(number);
        std::size_t count = 0;
        for (std::string_view word = nextWord(rest); !word.empty() && word.front() != '#';
             word = nextWord(rest), ++count) {
            if (word.front() == '+') word.remove_prefix(1);
            double value = 0.0;
            const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
            const bool underflow = error == std::errc::result_out_of_range && std::abs(value) < 1.0;
            if ((error != std::errc() && !underflow) || stop != word.data() + word.size())
                throw ImportRefused(place, "'" + std::string(word.substr(0, 40)) + "' is not a number");
            if (!std::isfinite(value) || std::abs(value) > kLargest)
                throw ImportRefused(place, "'" + std::string(word.substr(0, 40)) + "' is not a finite coordinate");
        }
        if (count < needed)
            throw ImportRefused(
                place, "has " + std::to_string(count) + " numbers where " + std::to_string(needed) + " are needed");
    }

    static std::string_view nextWord(std::string_view& rest) {
        while (!rest.empty() && isBlank(rest.front())) rest.remove_prefix(1);
        std::size_t size = 0;
        while (size < rest.size() && !isBlank(rest[size])) ++size;
        const std::string_view word = rest.substr(0, size);
        rest.remove_prefix(size);
        return word;
    }

    std::string_view _text;
};

// "f 1/2/ 3//" leaves the normal out with its slash; other programs read that, tinyobjloader wants no slash then.
void dropTrailingSlashes(std::string& text) {
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        const std::size_t word = std::min(text.find_first_not_of(" \t", begin), end);
        if (word + 1 < end && text[word] == 'f' && isBlank(text[word + 1]))
            for (std::size_t i = end; i-- > word;)
                if (text[i] == '/' && (i + 1 == end || isBlank(text[i + 1]))) text[i] = ' ';
        begin = end + 1;
    }
}

// Faces of more than three corners. Throws ImportRefused for one of more than `most`.
std::uint64_t countPolygons(std::string_view text, std::size_t most) {
    std::uint64_t polygons = 0;
    std::size_t number = 0;
    for (std::size_t begin = 0; begin < text.size();) {
        ++number;
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        std::size_t words = 0;
        for (std::size_t at = begin; at < end; ++words) {
            while (at < end && isBlank(text[at])) ++at;
            if (at == end || text[at] == '#') break;
            const std::size_t word = at;
            while (at < end && !isBlank(text[at])) ++at;
            if (words == 0 && text.substr(word, at - word) != "f") break;
        }
        if (words > most + 1)
            throw ImportRefused("line " + std::to_string(number),
                                "is a face of " + std::to_string(words - 1) + " corners, and at most " +
                                    std::to_string(most) +
                                    " are cut into triangles: divide it in the program it is from");
        if (words > 4) ++polygons;
        begin = end + 1;
    }
    return polygons;
}

// Reads MTL libraries from the file's folder only; a missing one costs the materials, not the scene.
class ConfinedMaterialReader final : public tinyobj::MaterialReader {
 public:
    ConfinedMaterialReader(SourceFolder& folder, ImportWarnings& warnings) : _folder(folder), _warnings(warnings) {}

    bool operator()(const std::string& name, std::vector<tinyobj::material_t>* materials,
                    std::map<std::string, int>* byName, std::string*, std::string*) override {
        try {
            const std::vector<std::byte> bytes = _folder.read(name, "mtllib", false);
            std::istringstream text(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
            std::string warning;
            std::string error;
            tinyobj::LoadMtl(byName, materials, &text, &warning, &error);
            if (!error.empty()) _warnings.add("mtllib '" + name + "': " + error);
        } catch (const ImportRefused& reason) {
            _warnings.add(std::string(reason.what()) + "; its materials are grey");
        }
        return true;
    }

 private:
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
        std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        VertexLines(text).check();
        dropTrailingSlashes(text);
        warnings.addPolygons(countPolygons(text, limits.faceCorners));
        std::istringstream stream(text);
        ConfinedMaterialReader reader(folder, warnings);
        std::string warning;
        std::string error;
        if (!tinyobj::LoadObj(&attributes, &shapes, &sources, &warning, &error, &stream, &reader, true, false))
            throw ImportRefused(error.empty() ? "cannot be understood" : error);
        for (std::string& line : linesOf(warning)) warnings.add(std::move(line));
    }

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
