#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace umbriel {

// The command line of `umbriel bake`.
struct BakeArguments {
    std::string scene;  // .gltf, .glb, .obj or demo:NAME
    std::string mapping = "hemisphere";
    std::uint32_t size = 32;      // Mapping::size
    std::string maker = "rays";   // grid, gl (on servers; without any, on one of this machine)
    std::optional<double> far;    // percent of the diagonal; none: no limit
    std::optional<double> fovy;   // degrees, singleplane only
    std::string guard = "exact";  // fast, fast-fan
    int threads = 0;              // 0: all; of each server with local
    std::uint32_t shards = 0;     // 0: chosen
    std::string shard;            // "i/n", i from 0
    bool resume = false;
    bool distance = false;                // signed distance maps as well
    bool hitDistance = false;             // distances of the nearest hits as well
    bool index = false;                   // index maps as well
    std::string environment = "256x128";  // texels that index maps name
    std::string atlas;                    // .exr
    std::string out;
    std::string servers;       // bake there: HOST:PORT or NAME=HOST:PORT, separated by commas
    std::optional<int> local;  // bake on so many servers of this machine
    bool insecureLan = false;  // servers beyond this machine may be reached without encryption
    double audit = 2.0;        // percent of the shards that two servers bake, and that must agree
    // Light maps (light_map_command.h), instead of visibility maps.
    std::optional<std::int64_t> lightMap;  // texels along each side of the atlas
    std::string from = "rays";             // or a mode that parseBakedMode() knows
    std::optional<std::int64_t> mapSize;   // texels of its shadow maps; none: 2048
    std::vector<std::string> shadowSet;    // FIELD=VALUE, as of render
    int texelSamples = 4;                  // along each side of a texel
    int lightSamples = 2;                  // along each side of a light with a size
    std::vector<std::string> lights;       // as of render; none: the scene's own
    std::vector<std::string> moving;       // names of nodes
    bool json = false;
    bool quiet = false;
};

// `umbriel bake MESH`: visibility maps of all geometries of a scene, as one mesh in world coordinates: vertices of the
// first geometry come first (client/app/mesh_input.h). On threads of this process, or on render servers, which draw
// nothing for us then. See shard_store.h for what happens on the disk.
//
// JSON: {vertices (rows of the file: unique positions and sides), directions, rays (traced by this call), seconds,
// cpu_seconds (both after loading and building the tree, of all servers too), rays_per_core_second, servers (that were
// ready to bake; 0: threads of this process), shards, redone (times that a shard was given out again), sha256}; with
// servers also audited (shards that two of them agree on).
//
// Exit codes: 0 done; 2 wrong usage or bad input; 1 it could not be done. The message of 1 and 2 goes to `err`.
int runBake(const BakeArguments& arguments, std::ostream& out, std::ostream& err);

// The command line of `umbriel bake merge`.
struct BakeMergeArguments {
    std::vector<std::filesystem::path> shards;
    std::string out;
    bool allowMixed = false;  // bake classes
    bool json = false;        // {vertices, directions, shards, sha256}
};

// `umbriel bake merge SHARD...`: one file of those that `--shard i/n` made. Exit codes as above.
int runBakeMerge(const BakeMergeArguments& arguments, std::ostream& out, std::ostream& err);

}  // namespace umbriel
