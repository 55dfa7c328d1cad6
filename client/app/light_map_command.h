#pragma once

#include <iosfwd>

#include "client/app/bake_command.h"

namespace umbriel {

// `umbriel bake SCENE --light-map N`: factors of the scene's static lights in an atlas of N x N texels
// (client/bake/light_map_bake.h), for `--shadow light-map`; by rays of this process, or drawn on servers
// (client/app/light_map_drawing.h).
//
// JSON: {from, size, lights: [names], surfaces, triangles, charts, covered (share of the texels that hold a surface),
// texel_metres (the side of a texel on the largest chart), rays, lookups (points whose factors were drawn), seconds,
// cpu_seconds (of all servers too), bytes, sha256}.
//
// Exit codes as those of runBake().
int runBakeLightMap(const BakeArguments& arguments, std::ostream& out, std::ostream& err);

}  // namespace umbriel
