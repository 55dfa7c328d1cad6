#include "client/app/mesh_input.h"

#include <fmt/format.h>

#include <limits>
#include <memory>
#include <span>
#include <system_error>

#include "client/import/load_scene.h"
#include "client/import/procedural.h"
#include "common/image/atomic_file.h"
#include "common/scene/aspect.h"
#include "common/scene/core_types.h"
#include "common/scene/traversal.h"

namespace umbriel {
namespace {

visibility::Mesh placed(const Geometry& geometry, const Affine& worldFromNode) {
    visibility::Mesh mesh{geometry.positions.toVector(), geometry.indices.toVector()};
    // Files without transforms keep their bits.
    if (!(worldFromNode == Affine{})) {
        for (glm::vec3& p : mesh.positions) p = glm::vec3(worldFromNode.point(glm::dvec3(p)));
    }
    if (glm::determinant(worldFromNode.linear) < 0.0) {
        for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
            std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
    }
    return mesh;
}

// In the pose that the file has it in.
visibility::Mesh posed(const Aspect& scene, const DeformedGeometry& core, const Affine& worldFromNode,
                       const Hierarchy& hierarchy) {
    const Geometry* geometry = scene.find(core.geometry.get());
    if (!geometry) return {};
    std::vector<Affine> maps{worldFromNode};
    if (const Skin* skin = scene.find(core.skin.get()); skin && !skin->joints.empty()) {
        maps.clear();
        for (std::size_t i = 0; i < skin->joints.size(); ++i)
            maps.push_back(hierarchy.worldFromNode(scene, skin->joints[i]));
        maps = jointMapsOf(*skin, maps, glm::dvec3(0.0));
    }
    // Mirrored when the first map is; the vertices are then replaced.
    visibility::Mesh mesh = placed(*geometry, {maps.front().linear, glm::dvec3(0.0)});
    const std::vector<glm::dvec3> positions = deformedPositions(scene, core, maps);
    for (std::size_t i = 0; i < positions.size(); ++i) mesh.positions[i] = glm::vec3(positions[i]);
    return mesh;
}

}  // namespace

Result<MeshInput> loadMeshes(const std::string& scene, bool verticesAsWritten) {
    TypeRegistry types;
    registerCoreTypes(types);
    IdSource ids;
    Aspect aspect(types, ids);
    MeshInput input;
    Ref<LoadedScene> loaded;
    if (isDemo(scene)) {
        auto demo = buildDemo(scene, aspect);
        if (!demo) return demo.error();
        loaded = *demo;
    } else {
        auto file = loadScene(scene, aspect, ids, {.verticesAsWritten = verticesAsWritten});
        if (!file) return file.error();
        loaded = file->scene;
        input.warnings = std::move(file->warnings);
        input.polygons = file->polygons;
    }
    const Hierarchy hierarchy(aspect, aspect.get(loaded).root);
    traverse(aspect, aspect.get(loaded).root, std::nullopt, [&](const VisitedNode& visited) {
        if (visited.core == nullptr) return Descend::Yes;
        visibility::Mesh mesh;
        if (isA<Geometry>(*visited.core))
            mesh = placed(static_cast<const Geometry&>(*visited.core), visited.worldFromNode);
        else if (isA<DeformedGeometry>(*visited.core))
            mesh = posed(aspect, static_cast<const DeformedGeometry&>(*visited.core), visited.worldFromNode, hierarchy);
        if (mesh.indices.empty()) return Descend::Yes;
        std::string name = visited.node.name;
        if (name.empty()) name = fmt::format("geometry {}", input.parts.size());
        input.parts.push_back({std::move(name), std::move(mesh)});
        return Descend::Yes;
    });
    if (input.parts.empty()) {
        const std::string why = input.warnings.empty() ? "" : fmt::format(" ({})", input.warnings.front());
        return badInput(fmt::format("{}: there are no triangles in it{}", scene, why));
    }
    return input;
}

Result<visibility::Mesh> concatenated(const MeshInput& input) {
    visibility::Mesh all;
    for (const MeshInput::Part& part : input.parts) {
        const std::size_t first = all.positions.size();
        if (first + part.mesh.positions.size() > std::numeric_limits<std::uint32_t>::max()) {
            return badInput("the scene has more than 2^32 vertices");
        }
        all.positions.insert(all.positions.end(), part.mesh.positions.begin(), part.mesh.positions.end());
        for (const std::uint32_t index : part.mesh.indices) {
            all.indices.push_back(static_cast<std::uint32_t>(first + index));
        }
    }
    return all;
}

bool sameFile(const std::filesystem::path& a, const std::filesystem::path& b) {
    std::error_code error;
    const bool same = std::filesystem::equivalent(a, b, error);
    return error ? a.lexically_normal() == b.lexically_normal() : same;
}

Result<void> writeObj(const std::string& path, const visibility::Mesh& mesh) {
    auto file = AtomicFile::create(path);
    if (!file) return file.error();
    const auto line = [&](const std::string& text) { (*file)->write(std::as_bytes(std::span(text))); };
    for (const glm::vec3& p : mesh.positions) line(fmt::format("v {} {} {}\n", p.x, p.y, p.z));
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        line(fmt::format("f {} {} {}\n", mesh.indices[i] + 1, mesh.indices[i + 1] + 1, mesh.indices[i + 2] + 1));
    }
    return (*file)->commit();
}

}  // namespace umbriel
