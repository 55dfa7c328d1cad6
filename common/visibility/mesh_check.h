#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/visibility/mesh.h"

namespace umbriel::visibility {

// The conditions under which visibility maps light a mesh well (Ganster 2002, 2.6), counted. Only coordinates that are
// not finite and indices out of range make a mesh impossible; everything else is reported and baked as it is.
struct MeshFinding {
    std::string condition;  // a stable name: "open-edges"
    std::string meaning;    // what it does to the picture
    std::uint64_t count = 0;
    std::vector<std::string> examples;  // the first five, with numbers of vertices and triangles as loaded, from 0
};

// What checkMesh() finds. Components are counted without degenerate triangles.
struct MeshReport {
    std::uint64_t vertices = 0;
    std::uint64_t triangles = 0;
    std::uint64_t components = 0;  // connected by edges, equal positions being one
    bool closed = false;           // no open edges
    // Always all of them, in this order: intersecting-faces, open-edges, non-manifold-edges, cracks,
    // duplicate-vertices, inner-components, inconsistent-winding, polygons, unused-vertices, degenerate-faces,
    // non-finite-coordinates.
    std::vector<MeshFinding> findings;

    const MeshFinding& finding(const std::string& condition) const;
};

// What the caller knows of the file, and how near is a crack.
struct MeshCheckOptions {
    // Open edges nearer than this share of the diagonal to another open vertex are a crack.
    double crackShare = 1e-4;
    // Polygons with more than three corners that the importer split; reported only.
    std::uint64_t polygons = 0;
};

// Bad input: no triangles, indices out of range. Coordinates that are not finite are counted, and nothing else then.
Result<MeshReport> checkMesh(const Mesh& mesh, const MeshCheckOptions& options = {});
// How many edges two triangles share that are wound to different sides: "inconsistent-winding" of the report, alone. 0
// for a mesh that checkMesh() says little about.
std::uint64_t inconsistentEdges(const Mesh& mesh);
// A line for each condition, with its examples.
std::string toText(const MeshReport& report);

// One vertex for those within `tolerance` (a length; 0: equal coordinates) of the first of them in order; vertices that
// no triangle uses and triangles that lose their area are dropped. Bad input as for checkMesh, and coordinates that are
// not finite.
Result<Mesh> weld(const Mesh& mesh, double tolerance);

// What orient() makes.
struct Oriented {
    Mesh mesh;
    std::uint64_t flipped = 0;       // triangles turned around
    std::uint64_t unorientable = 0;  // edges that stay inconsistent: a Moebius strip, or more than two triangles
};
// The same winding within each component: closed ones outwards, open ones as most of their triangles are. Vertices with
// equal coordinates count as one; edges of more than two triangles do not connect. Bad input as for weld().
Result<Oriented> orient(const Mesh& mesh);

}  // namespace umbriel::visibility
