#include "server/draw/solid_parts.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <numeric>
#include <tuple>

namespace umbriel {
namespace {

// For every vertex the number of its place.
std::vector<std::uint32_t> placesOf(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions) {
    std::vector<glm::vec3> places(positions.begin(), positions.end());
    for (glm::vec3& place : places) place += glm::vec3(0.0f);  // -0 is 0
    std::vector<unsigned int> remap(places.size());
    meshopt_generateVertexRemap(remap.data(), indices.data(), indices.size(), places.data(), places.size(),
                                sizeof(glm::vec3));
    return remap;
}

struct Edge {
    std::uint32_t low, high;  // places
    std::uint32_t triangle;
    bool isUp;  // runs from low to high
};

std::uint32_t rootOf(std::vector<std::uint32_t>& parents, std::uint32_t node) {
    while (parents[node] != node) node = parents[node] = parents[parents[node]];
    return node;
}

// What is connected by edges, by triangle the first triangle of its part; kNone: of a part that is not closed, or a
// triangle without an area.
std::vector<std::uint32_t> closedParts(std::span<const std::uint32_t> indices, std::span<const std::uint32_t> places) {
    const auto triangles = static_cast<std::uint32_t>(indices.size() / 3);
    std::vector<Edge> edges;
    edges.reserve(indices.size());
    std::vector<std::uint32_t> parents(triangles);
    std::iota(parents.begin(), parents.end(), 0u);
    std::vector<bool> isOpen(triangles, false);
    for (std::uint32_t t = 0; t < triangles; ++t) {
        const std::uint32_t corner[3] = {places[indices[3 * t]], places[indices[3 * t + 1]],
                                         places[indices[3 * t + 2]]};
        isOpen[t] = corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0];
        for (int k = 0; k < 3 && !isOpen[t]; ++k) {
            const std::uint32_t from = corner[k];
            const std::uint32_t to = corner[(k + 1) % 3];
            edges.push_back({std::min(from, to), std::max(from, to), t, from < to});
        }
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    std::vector<std::uint32_t> torn;  // triangles of edges that do not lie between two of one orientation
    for (std::size_t first = 0; first < edges.size();) {
        std::size_t end = first + 1;
        while (end < edges.size() && edges[end].low == edges[first].low && edges[end].high == edges[first].high) ++end;
        if (end - first != 2 || edges[first].isUp == edges[first + 1].isUp) torn.push_back(edges[first].triangle);
        const std::uint32_t root = rootOf(parents, edges[first].triangle);
        for (std::size_t i = first + 1; i < end; ++i) {
            const std::uint32_t other = rootOf(parents, edges[i].triangle);
            const std::uint32_t mine = rootOf(parents, root);
            parents[std::max(mine, other)] = std::min(mine, other);
        }
        first = end;
    }
    for (const std::uint32_t triangle : torn) isOpen[rootOf(parents, triangle)] = true;
    std::vector<std::uint32_t> parts(triangles);
    for (std::uint32_t t = 0; t < triangles; ++t) {
        const std::uint32_t root = rootOf(parents, t);
        parts[t] = isOpen[root] ? SolidParts::kNone : root;
    }
    return parts;
}

// Whether all corners lie on the inner side of all triangles; three corners a triangle.
bool isConvex(std::span<const glm::dvec3> corners, std::span<const glm::dvec3> vertices) {
    glm::dvec3 lower(vertices.front());
    glm::dvec3 upper(lower);
    for (const glm::dvec3& vertex : vertices) {
        lower = glm::min(lower, vertex);
        upper = glm::max(upper, vertex);
    }
    const glm::dvec3 largest = glm::max(glm::abs(lower), glm::abs(upper));
    // Four units in the last place of a coordinate; and a thousandth of the part, for files with few digits.
    const double tolerance = 4.8e-7 * std::max({largest.x, largest.y, largest.z}) + 1e-3 * glm::length(upper - lower);
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
        const glm::dvec3 normal = glm::cross(corners[i + 1] - corners[i], corners[i + 2] - corners[i]);
        const double allowed = tolerance * glm::length(normal) + glm::dot(normal, corners[i]);
        for (const glm::dvec3& vertex : vertices)
            if (!(glm::dot(normal, vertex) <= allowed)) return false;
    }
    return true;
}

}  // namespace

SolidParts solidPartsOf(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions) {
    SolidParts solids;
    if (indices.empty() || positions.empty()) return solids;
    const std::vector<std::uint32_t> places = placesOf(indices, positions);
    const std::vector<std::uint32_t> parts = closedParts(indices, places);
    std::vector<std::uint32_t> order;  // triangles of closed parts, part by part
    for (std::uint32_t t = 0; t < parts.size(); ++t)
        if (parts[t] != SolidParts::kNone) order.push_back(t);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return parts[a] < parts[b]; });
    std::vector<std::uint32_t> solidOf(parts.size(), SolidParts::kNone);
    std::vector<std::uint32_t> solidOfPlace(positions.size(), SolidParts::kNone);
    std::vector<std::uint32_t> lastPart(positions.size(), SolidParts::kNone);  // that had a vertex at the place
    std::vector<glm::dvec3> corners;
    std::vector<glm::dvec3> vertices;
    for (std::size_t first = 0; first < order.size();) {
        std::size_t end = first + 1;
        while (end < order.size() && parts[order[end]] == parts[order[first]]) ++end;
        if (end - first <= kSolidTriangles) {
            const auto number = static_cast<std::uint32_t>(solids.boxes.size());
            Box box;
            corners.clear();
            vertices.clear();
            for (std::size_t i = first; i < end; ++i)
                for (std::size_t k = 0; k < 3; ++k) {
                    const std::uint32_t vertex = indices[3 * std::size_t{order[i]} + k];
                    box.add(positions[vertex]);
                    corners.emplace_back(positions[vertex]);
                    if (lastPart[places[vertex]] == parts[order[first]]) continue;
                    lastPart[places[vertex]] = parts[order[first]];
                    vertices.emplace_back(positions[vertex]);
                }
            if (isConvex(corners, vertices)) {
                solids.boxes.push_back(box);
                for (std::size_t i = first; i < end; ++i) {
                    solidOf[order[i]] = number;
                    for (std::size_t k = 0; k < 3; ++k)
                        solidOfPlace[places[indices[3 * std::size_t{order[i]} + k]]] = number;
                }
            }
        }
        first = end;
    }
    if (solids.boxes.empty()) return solids;
    // Triangles without an area draw nothing: they go with what they touch.
    for (std::uint32_t t = 0; t < parts.size(); ++t) {
        const std::uint32_t corner[3] = {places[indices[3 * t]], places[indices[3 * t + 1]],
                                         places[indices[3 * t + 2]]};
        const bool isEmpty = corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0];
        const std::uint32_t touched = solidOfPlace[corner[0]];
        if (isEmpty) solidOf[t] = touched;
    }
    solids.partOfTriangle = std::move(solidOf);
    return solids;
}

}  // namespace umbriel
