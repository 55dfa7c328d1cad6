#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/math/glm.h"

namespace umbriel {

// The colour of a material or vertex: linear, from the sRGB value 0xRRGGBB that a colour picker shows.
glm::vec4 linearColour(std::uint32_t srgb);

// Triangles under construction; counter-clockwise seen from outside. Colours and texture coordinates are kept for every
// vertex (white and (0,0) when not given) and dropped by the scene builder when all are.
struct Mesh {
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::vec4> tangents;  // see computeTangents
    std::vector<glm::vec4> colours;
    std::vector<glm::vec2> texCoords;
    std::vector<std::uint32_t> indices;

    std::uint32_t addVertex(const glm::vec3& position, const glm::vec3& normal, const glm::vec4& colour,
                            const glm::vec2& texCoord = {});
    void addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);

    // Flat, counter-clockwise a b c d; texture coordinates from lower left (a) to upper right (c).
    void addQuad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d,
                 const glm::vec4& colour, const glm::vec2& uvA = {}, const glm::vec2& uvC = {});
    // Flat.
    void addFlatTriangle(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec4& colour);
    void addBox(const glm::vec3& lower, const glm::vec3& upper, const glm::vec4& colour, bool withBottom = true);

    // A surface of revolution about y. The profile (radius, height) runs upwards along the outside; a point given twice
    // is a crease. uv: u once around, v along the profile.
    void addLathe(std::span<const glm::vec2> profile, int segments, const glm::vec4& colour);
    void addSphere(const glm::vec3& centre, float radius, int segments, int rings, const glm::vec4& colour);

    // A grid of (columns + 1) x (rows + 1) shared vertices; position(column, row). Smooth normals; the front is where
    // columns run right and rows run up. uv: the fractions of columns and rows.
    void addGrid(int columns, int rows, const glm::vec4& colour,
                 const std::function<glm::vec3(int column, int row)>& position);

    void append(const Mesh& other, const glm::mat4& meshFromOther = glm::mat4(1.0f));
    void transform(const glm::mat4& newFromOld);  // rigid or uniformly scaled

    // Area-weighted, from the triangles that share a vertex; only for vertices from first on.
    void smoothNormals(std::uint32_t first = 0);
    // For normal maps: tangent along u, bitangent along -v (rows of an image go down), as glTF has it.
    void computeTangents();
};

}  // namespace umbriel
