#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace umbriel {

// The command line of `umbriel bake export`.
struct BakeExportArguments {
    std::filesystem::path maps;  // .umvis
    std::string out;             // .exr; .png: what it shows in 8 bits, for eyes only
    std::vector<std::uint64_t> rows;
    std::vector<std::uint32_t> vertices;  // as loaded; their rows, after `rows`
    std::uint32_t columns = 0;            // tiles beside each other; 0: about a square
    bool showDistance = false;            // as grey, in place of the masks
    std::uint32_t scale = 1;              // .png: edge of the square that shows one direction
    bool json = false;                    // {vertices, directions, width, height, layers}
};

// `umbriel bake export FILE`: maps as an OpenEXR picture (client/bake/atlas.h), or drawn as PNG. Exit codes as for
// runBake().
int runBakeExport(const BakeExportArguments& arguments, std::ostream& out, std::ostream& err);

// The command line of `umbriel bake import`.
struct BakeImportArguments {
    std::filesystem::path picture;  // .exr
    std::string mesh;               // what it was baked of: the picture says how, not what
    std::string out;                // .umvis
    bool json = false;              // {vertices, directions, sha256}
};

// `umbriel bake import FILE --mesh MESH`: the file of maps back from a picture of all of them. The picture is decoded
// in a process of its own under limits, as others may have made it. Exit codes as for runBake().
int runBakeImport(const BakeImportArguments& arguments, std::ostream& out, std::ostream& err);

}  // namespace umbriel
