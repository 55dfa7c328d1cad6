#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>

#include "client/app/mesh_input.h"

namespace umbriel {

// The command line of `umbriel check`.
struct CheckArguments {
    std::string scene;             // .gltf, .glb, .obj or demo:NAME
    std::optional<double> weld{};  // vertices nearer than this become one; metres, 0: equal coordinates
    bool orient = false;           // the same winding within each component
    std::string out{};             // the mesh after both, as OBJ
    bool json = false;
};

// `umbriel check FILE`: the conditions under which visibility maps light a mesh well (common/visibility/mesh_check.h),
// counted with their first examples: for each geometry where there are several, and for all together as they are baked.
// An OBJ file is looked at as one mesh of the vertices that it lists, numbered from 0. With weld or
// orient, the report of the changed mesh follows.
//
// JSON: {file, geometries: [REPORT with name] (where there are several), whole: REPORT, repaired: REPORT with
// {flipped, unorientable}, warnings}; REPORT {vertices, triangles, components, closed, findings: [{condition, meaning,
// count, examples}]}.
//
// Exit codes: 0 the check was made, whatever it found; 2 bad input, and coordinates that are not finite; 1 it could not
// be done. The message of 1 and 2 goes to `err`.
int runCheck(const CheckArguments& arguments, std::ostream& out, std::ostream& err);

// The same for a mesh that was loaded already.
Result<void> checkInput(const MeshInput& input, const CheckArguments& arguments, std::ostream& out);

}  // namespace umbriel
