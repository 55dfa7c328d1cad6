#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace umbriel {

// What a scene file may cost. Files come by mail and from the net; these bounds are checked before memory is asked for,
// and the import process has the hard ones from the operating system.
struct ImportLimits {
    std::uint64_t fileBytes = std::uint64_t{1} << 30;     // the file and everything it names, together
    std::uint64_t sceneBytes = std::uint64_t{1} << 30;    // decoded vertices, indices, keys and texels
    std::uint64_t processBytes = std::uint64_t{2} << 30;  // address space of the import process
    std::chrono::seconds cpuTime{60};                     // of the import process
    std::chrono::seconds wallTime{60};                    // until the import process is ended
    std::uint32_t containers = 1'000'000;                 // nodes, geometries, materials, ... of the scene
    std::uint32_t imageSide = 16'384;                     // texels
    std::uint32_t depth = 100'000;                        // of nodes below each other
    std::uint32_t lights = 1'000;                         // they form a chain above the scene
    // Joints, lights and cameras stand where nodes do: who draws walks up from each of these in every frame. The nodes
    // on all these ways together, which may take seconds of a frame.
    std::uint64_t stepsUp = 100'000'000;
    // Of one face. tinyobjloader cuts polygons up by clipping ears, in the square of their corners: these take half a
    // second, 60 000 took seven. Of what Debian 12 has, CGAL and GLU's tessellator are faster; one needs another Boost
    // than ours, the other OpenGL in the client.
    std::uint32_t faceCorners = 16'384;
    // An .obj file as one geometry with exactly its vertices, numbered as there, unused ones included, instead of
    // geometries to draw, whose vertices are split by normals, texture coordinates, materials and objects.
    bool verticesAsWritten = false;
    // The program that is the import process, and its first arguments; `umbriel import-child` by default. The process
    // gets the arguments of importChildArguments() on top.
    std::vector<std::string> childCommand = {"/proc/self/exe", "import-child"};
};

}  // namespace umbriel
