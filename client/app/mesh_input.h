#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/visibility/mesh.h"

namespace umbriel {

// The triangles of a scene, for commands that look at meshes and not at pictures.
struct MeshInput {
    struct Part {
        std::string name;  // of its node, else "geometry N"
        visibility::Mesh mesh;
    };
    // Each visible geometry where the scene places it, in the order of the scene graph: world coordinates in metres,
    // rounded to single precision; a geometry that several nodes share is there several times. A placement that mirrors
    // turns the winding, so that fronts stay fronts.
    std::vector<Part> parts;
    std::vector<std::string> warnings;  // of the importer, one line each
    std::uint64_t polygons = 0;  // faces with more than three corners that the importer split
};

// A .gltf, .glb or .obj file (loadScene()), or demo:NAME. verticesAsWritten: an OBJ file is one part with the vertices
// it lists, as ImportLimits says; otherwise its vertices are split as they are for drawing. Errors as there; bad input
// too when there are no triangles.
Result<MeshInput> loadMeshes(const std::string& scene, bool verticesAsWritten = false);

// All parts one after the other: vertex and triangle numbers count on.
Result<visibility::Mesh> concatenated(const MeshInput& input);

// Whether writing one would take the other away: links are followed, names that lead nowhere yet compared as they are.
bool sameFile(const std::filesystem::path& a, const std::filesystem::path& b);

// Wavefront OBJ: v and f lines, coordinates that read back as the same bits. Appears whole or not at all.
Result<void> writeObj(const std::string& path, const visibility::Mesh& mesh);

}  // namespace umbriel
