#include "client/import/procedural_mesh.h"

#include <cmath>

namespace umbriel {

namespace {

float linearFromSrgb(std::uint32_t byte) {
    const float encoded = static_cast<float>(byte & 255) / 255.0f;
    return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

glm::vec3 safeNormalize(const glm::vec3& v, const glm::vec3& fallback) {
    const float length = glm::length(v);
    return length > 0.0f ? v / length : fallback;
}

}  // namespace

glm::vec4 linearColour(std::uint32_t srgb) {
    return {linearFromSrgb(srgb >> 16), linearFromSrgb(srgb >> 8), linearFromSrgb(srgb), 1.0f};
}

std::uint32_t Mesh::addVertex(const glm::vec3& position, const glm::vec3& normal, const glm::vec4& colour,
                              const glm::vec2& texCoord) {
    positions.push_back(position);
    normals.push_back(normal);
    colours.push_back(colour);
    texCoords.push_back(texCoord);
    return static_cast<std::uint32_t>(positions.size() - 1);
}

void Mesh::addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    indices.insert(indices.end(), {a, b, c});
}

void Mesh::addQuad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d,
                   const glm::vec4& colour, const glm::vec2& uvA, const glm::vec2& uvC) {
    const glm::vec3 normal = glm::normalize(glm::cross(b - a, d - a));
    const std::uint32_t first = addVertex(a, normal, colour, uvA);
    addVertex(b, normal, colour, {uvC.x, uvA.y});
    addVertex(c, normal, colour, uvC);
    addVertex(d, normal, colour, {uvA.x, uvC.y});
    addTriangle(first, first + 1, first + 2);
    addTriangle(first, first + 2, first + 3);
}

void Mesh::addFlatTriangle(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec4& colour) {
    const glm::vec3 normal = glm::normalize(glm::cross(b - a, c - a));
    const std::uint32_t first = addVertex(a, normal, colour);
    addVertex(b, normal, colour);
    addVertex(c, normal, colour);
    addTriangle(first, first + 1, first + 2);
}

void Mesh::addBox(const glm::vec3& l, const glm::vec3& u, const glm::vec4& colour, bool withBottom) {
    addQuad({l.x, l.y, u.z}, {u.x, l.y, u.z}, {u.x, u.y, u.z}, {l.x, u.y, u.z}, colour);
    addQuad({u.x, l.y, l.z}, {l.x, l.y, l.z}, {l.x, u.y, l.z}, {u.x, u.y, l.z}, colour);
    addQuad({u.x, l.y, u.z}, {u.x, l.y, l.z}, {u.x, u.y, l.z}, {u.x, u.y, u.z}, colour);
    addQuad({l.x, l.y, l.z}, {l.x, l.y, u.z}, {l.x, u.y, u.z}, {l.x, u.y, l.z}, colour);
    addQuad({l.x, u.y, u.z}, {u.x, u.y, u.z}, {u.x, u.y, l.z}, {l.x, u.y, l.z}, colour);
    if (withBottom) addQuad({l.x, l.y, l.z}, {u.x, l.y, l.z}, {u.x, l.y, u.z}, {l.x, l.y, u.z}, colour);
}

void Mesh::addLathe(std::span<const glm::vec2> profile, int segments, const glm::vec4& colour) {
    const int count = static_cast<int>(profile.size());
    // The outside of a profile running up is to its right: (dy, -dr). A vertex takes the sum over its (at most two)
    // neighbouring pieces; a doubled point has one piece of zero length, hence a crease.
    std::vector<glm::vec2> normal(profile.size(), glm::vec2(0.0f));
    for (int i = 0; i + 1 < count; ++i) {
        const glm::vec2 along = profile[i + 1] - profile[i];
        normal[i] += glm::vec2(along.y, -along.x);
        normal[i + 1] += glm::vec2(along.y, -along.x);
    }
    const auto first = static_cast<std::uint32_t>(positions.size());
    for (int segment = 0; segment <= segments; ++segment) {
        const float angle = 6.2831853f * static_cast<float>(segment % segments) / static_cast<float>(segments);
        const float cosine = std::cos(angle);
        const float sine = std::sin(angle);
        for (int i = 0; i < count; ++i) {
            const glm::vec2 n = glm::length(normal[i]) > 0.0f ? glm::normalize(normal[i]) : glm::vec2(0.0f, 1.0f);
            addVertex({profile[i].x * cosine, profile[i].y, profile[i].x * sine}, {n.x * cosine, n.y, n.x * sine},
                      colour,
                      {1.0f - static_cast<float>(segment) / static_cast<float>(segments),
                       1.0f - static_cast<float>(i) / static_cast<float>(count - 1)});
        }
    }
    for (int segment = 0; segment < segments; ++segment)
        for (int i = 0; i + 1 < count; ++i) {
            if (profile[i] == profile[i + 1]) continue;
            const std::uint32_t a = first + static_cast<std::uint32_t>(segment * count + i);
            const std::uint32_t b = a + static_cast<std::uint32_t>(count);
            if (profile[i + 1].x > 0.0f) addTriangle(a, a + 1, b + 1);
            if (profile[i].x > 0.0f) addTriangle(a, b + 1, b);
        }
}

void Mesh::addSphere(const glm::vec3& centre, float radius, int segments, int rings, const glm::vec4& colour) {
    std::vector<glm::vec2> profile;
    for (int ring = 0; ring <= rings; ++ring) {
        const float angle = 3.14159265f * (static_cast<float>(ring) / static_cast<float>(rings) - 0.5f);
        const bool pole = ring == 0 || ring == rings;
        profile.push_back({pole ? 0.0f : radius * std::cos(angle), radius * std::sin(angle)});
    }
    const std::size_t first = positions.size();
    addLathe(profile, segments, colour);
    for (std::size_t i = first; i < positions.size(); ++i) {
        normals[i] = positions[i] / radius;
        positions[i] += centre;
    }
}

void Mesh::addGrid(int columns, int rows, const glm::vec4& colour,
                   const std::function<glm::vec3(int column, int row)>& position) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    for (int row = 0; row <= rows; ++row)
        for (int column = 0; column <= columns; ++column)
            addVertex(position(column, row), {0, 0, 0}, colour,
                      {static_cast<float>(column) / static_cast<float>(columns),
                       1.0f - static_cast<float>(row) / static_cast<float>(rows)});
    const auto stride = static_cast<std::uint32_t>(columns + 1);
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const std::uint32_t a =
                first + static_cast<std::uint32_t>(row) * stride + static_cast<std::uint32_t>(column);
            addTriangle(a, a + 1, a + stride + 1);
            addTriangle(a, a + stride + 1, a + stride);
        }
    smoothNormals(first);
}

void Mesh::append(const Mesh& other, const glm::mat4& meshFromOther) {
    Mesh moved = other;
    moved.transform(meshFromOther);
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), moved.positions.begin(), moved.positions.end());
    normals.insert(normals.end(), moved.normals.begin(), moved.normals.end());
    colours.insert(colours.end(), moved.colours.begin(), moved.colours.end());
    texCoords.insert(texCoords.end(), moved.texCoords.begin(), moved.texCoords.end());
    for (std::uint32_t index : moved.indices) indices.push_back(first + index);
}

void Mesh::transform(const glm::mat4& newFromOld) {
    if (newFromOld == glm::mat4(1.0f)) return;
    const glm::mat3 turn(newFromOld);
    for (glm::vec3& position : positions) position = glm::vec3(newFromOld * glm::vec4(position, 1.0f));
    for (glm::vec3& normal : normals) normal = safeNormalize(turn * normal, normal);
}

void Mesh::smoothNormals(std::uint32_t first) {
    for (std::size_t i = first; i < normals.size(); ++i) normals[i] = glm::vec3(0.0f);
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
        if (indices[i] < first) continue;
        const glm::vec3& a = positions[indices[i]];
        const glm::vec3 weighted = glm::cross(positions[indices[i + 1]] - a, positions[indices[i + 2]] - a);
        for (int corner = 0; corner < 3; ++corner) normals[indices[i + static_cast<std::size_t>(corner)]] += weighted;
    }
    for (std::size_t i = first; i < normals.size(); ++i) normals[i] = safeNormalize(normals[i], {0, 1, 0});
}

void Mesh::computeTangents() {
    std::vector<glm::vec3> along(positions.size(), glm::vec3(0.0f));
    std::vector<glm::vec3> upward(positions.size(), glm::vec3(0.0f));
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
        const std::uint32_t a = indices[i];
        const std::uint32_t b = indices[i + 1];
        const std::uint32_t c = indices[i + 2];
        const glm::vec3 edgeB = positions[b] - positions[a];
        const glm::vec3 edgeC = positions[c] - positions[a];
        const glm::vec2 uvB = texCoords[b] - texCoords[a];
        const glm::vec2 uvC = texCoords[c] - texCoords[a];
        const float area = uvB.x * uvC.y - uvC.x * uvB.y;
        if (area == 0.0f) continue;
        const float sign = area > 0.0f ? 1.0f : -1.0f;
        const glm::vec3 du = sign * (edgeB * uvC.y - edgeC * uvB.y);
        const glm::vec3 dv = sign * (edgeC * uvB.x - edgeB * uvC.x);
        for (std::uint32_t vertex : {a, b, c}) {
            along[vertex] += du;
            upward[vertex] -= dv;
        }
    }
    tangents.assign(positions.size(), glm::vec4(1, 0, 0, 1));
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const glm::vec3& n = normals[i];
        const glm::vec3 anyAcross =
            glm::normalize(glm::cross(n, std::abs(n.x) < 0.5f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0)));
        const glm::vec3 tangent = safeNormalize(along[i] - n * glm::dot(n, along[i]), anyAcross);
        const float sign = glm::dot(glm::cross(n, tangent), upward[i]) < 0.0f ? -1.0f : 1.0f;
        tangents[i] = glm::vec4(tangent, sign);
    }
}

}  // namespace umbriel
