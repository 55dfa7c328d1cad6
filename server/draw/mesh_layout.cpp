#include "server/draw/mesh_layout.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace umbriel {

void sanitise(std::span<float> values) {
    for (float& value : values)
        if (!std::isfinite(value)) value = 0.0f;
}

TriangleOrder orderTriangles(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions,
                             bool sorted) {
    const std::size_t triangles = indices.size() / 3;
    TriangleOrder order;
    order.indices.assign(indices.begin(), indices.begin() + static_cast<std::ptrdiff_t>(triangles * 3));
    for (std::size_t i = 0; i < triangles; ++i) {
        const auto corner = order.indices.begin() + static_cast<std::ptrdiff_t>(i * 3);
        const bool valid =
            std::all_of(corner, corner + 3, [&](std::uint32_t index) { return index < positions.size(); });
        if (!valid) std::fill(corner, corner + 3, 0u);
    }
    if (!sorted || triangles < kSortFromTriangles || positions.empty()) return order;

    std::vector<glm::vec3> centres(triangles);
    for (std::size_t i = 0; i < triangles; ++i)
        centres[i] = (positions[order.indices[3 * i]] + positions[order.indices[3 * i + 1]] +
                      positions[order.indices[3 * i + 2]]) /
                     3.0f;
    std::vector<unsigned int> places(triangles);
    meshopt_spatialSortRemap(places.data(), &centres[0].x, triangles, sizeof(glm::vec3));
    TriangleOrder moved;
    moved.indices.resize(triangles * 3);
    moved.primitives.resize(triangles);
    for (std::size_t i = 0; i < triangles; ++i) {
        moved.primitives[places[i]] = static_cast<std::uint32_t>(i);
        for (std::size_t k = 0; k < 3; ++k) moved.indices[3 * places[i] + k] = order.indices[3 * i + k];
    }
    return moved;
}

void moveSolidsFirst(TriangleOrder& order, SolidParts& parts) {
    const std::size_t triangles = order.indices.size() / 3;
    if (parts.boxes.empty() || order.primitives.size() != triangles) return;
    TriangleOrder moved;
    moved.indices.reserve(order.indices.size());
    moved.primitives.reserve(triangles);
    std::vector<std::uint32_t> partOfMoved;
    partOfMoved.reserve(triangles);
    for (const bool solid : {true, false})
        for (std::size_t i = 0; i < triangles; ++i) {
            if ((parts.partOfTriangle[i] != SolidParts::kNone) != solid) continue;
            moved.primitives.push_back(order.primitives[i]);
            partOfMoved.push_back(parts.partOfTriangle[i]);
            for (std::size_t k = 0; k < 3; ++k) moved.indices.push_back(order.indices[3 * i + k]);
        }
    order = std::move(moved);
    parts.partOfTriangle = std::move(partOfMoved);
}

namespace {

struct FacingTriangle {
    glm::vec3 normal;
    std::uint32_t triangle;
};

// How much of the sphere of directions some normals take, times their number: 0 when they are the same.
double spreadOf(double count, const glm::dvec3& sum) {
    return std::sqrt(std::max(0.0, count * count - glm::dot(sum, sum)));
}

double clustersFor(std::size_t triangles) {
    return static_cast<double>((triangles + kSolidClusterTriangles - 1) / kSolidClusterTriangles);
}

// Splits across an axis, where both sides spread least, until clusters are left.
void splitByFacing(std::span<FacingTriangle> some, std::vector<std::uint32_t>& sizes) {
    const auto byPlace = [](const FacingTriangle& a, const FacingTriangle& b) { return a.triangle < b.triangle; };
    if (some.size() <= kSolidClusterTriangles) {
        std::sort(some.begin(), some.end(), byPlace);
        sizes.push_back(static_cast<std::uint32_t>(some.size()));
        return;
    }
    // A cluster more costs as much as so many triangles.
    constexpr double kClusterCost = 2.0;
    const auto along = [](int axis) {
        return [axis](const FacingTriangle& a, const FacingTriangle& b) {
            return a.normal[axis] != b.normal[axis] ? a.normal[axis] < b.normal[axis] : a.triangle < b.triangle;
        };
    };
    double best = std::numeric_limits<double>::infinity();
    int bestAxis = 0;
    std::size_t bestCount = some.size() / 2;
    for (int axis = 0; axis < 3; ++axis) {
        std::sort(some.begin(), some.end(), along(axis));
        glm::dvec3 above(0.0);
        for (const FacingTriangle& one : some) above += one.normal;
        glm::dvec3 below(0.0);
        for (std::size_t count = 1; count < some.size(); ++count) {
            below += some[count - 1].normal;
            above -= some[count - 1].normal;
            const std::size_t rest = some.size() - count;
            const double cost = spreadOf(static_cast<double>(count), below) +
                                spreadOf(static_cast<double>(rest), above) +
                                kClusterCost * (clustersFor(count) + clustersFor(rest));
            if (!(cost < best)) continue;
            best = cost;
            bestAxis = axis;
            bestCount = count;
        }
    }
    std::sort(some.begin(), some.end(), along(bestAxis));
    splitByFacing(some.first(bestCount), sizes);
    splitByFacing(some.subspan(bestCount), sizes);
}

}  // namespace

std::vector<std::uint32_t> sortSolidsByFacing(TriangleOrder& order, SolidParts& parts,
                                              std::span<const glm::vec3> positions) {
    const std::size_t triangles = order.indices.size() / 3;
    if (parts.boxes.empty() || order.primitives.size() != triangles) return {};
    std::size_t solids = 0;
    std::vector<std::uint32_t> rankOfPart(parts.boxes.size(), SolidParts::kNone);  // by first triangle
    std::uint32_t ranks = 0;
    for (; solids < triangles && parts.partOfTriangle[solids] != SolidParts::kNone; ++solids)
        if (std::uint32_t& rank = rankOfPart[parts.partOfTriangle[solids]]; rank == SolidParts::kNone) rank = ranks++;
    std::vector<FacingTriangle> facing(solids);
    for (std::size_t i = 0; i < solids; ++i)
        facing[i] = {faceNormal(positions[order.indices[3 * i]], positions[order.indices[3 * i + 1]],
                                positions[order.indices[3 * i + 2]]),
                     static_cast<std::uint32_t>(i)};
    const auto rankOf = [&](const FacingTriangle& one) { return rankOfPart[parts.partOfTriangle[one.triangle]]; };
    std::stable_sort(facing.begin(), facing.end(),
                     [&](const FacingTriangle& a, const FacingTriangle& b) { return rankOf(a) < rankOf(b); });
    std::vector<std::uint32_t> sizes;
    for (std::size_t first = 0; first < solids;) {
        std::size_t end = first;
        while (end < solids && end - first < kSortedTogether)  // whole parts
            for (const std::uint32_t rank = rankOf(facing[end]); end < solids && rankOf(facing[end]) == rank;) ++end;
        splitByFacing(std::span(facing).subspan(first, end - first), sizes);
        first = end;
    }
    const TriangleOrder before = order;
    const std::vector<std::uint32_t> partsBefore = parts.partOfTriangle;
    for (std::size_t i = 0; i < solids; ++i) {
        const std::size_t from = facing[i].triangle;
        order.primitives[i] = before.primitives[from];
        parts.partOfTriangle[i] = partsBefore[from];
        for (std::size_t k = 0; k < 3; ++k) order.indices[3 * i + k] = before.indices[3 * from + k];
    }
    return sizes;
}

std::vector<Cluster> clustersOf(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions,
                                std::span<const std::uint32_t> sizes) {
    std::vector<Cluster> clusters;
    const std::size_t triangles = indices.size() / 3;
    if (positions.empty()) return clusters;
    clusters.reserve(sizes.size() + (triangles + kClusterTriangles - 1) / kClusterTriangles);
    for (std::size_t first = 0; first < triangles;) {
        const std::size_t size = clusters.size() < sizes.size() ? sizes[clusters.size()] : kClusterTriangles;
        Cluster cluster;
        cluster.firstTriangle = static_cast<std::uint32_t>(first);
        cluster.triangles = static_cast<std::uint32_t>(std::min(size, triangles - first));
        for (std::size_t i = first * 3; i < (first + cluster.triangles) * 3; ++i)
            cluster.box.add(positions[indices[i]]);
        clusters.push_back(cluster);
        first += cluster.triangles;
    }
    return clusters;
}

void markSolids(std::span<Cluster> clusters, const SolidParts& parts, std::span<const std::uint32_t> indices,
                std::span<const glm::vec3> positions) {
    if (parts.boxes.empty()) return;
    for (Cluster& cluster : clusters) {
        Box solids;
        bool isSolid = true;
        for (std::size_t i = cluster.firstTriangle; i < cluster.firstTriangle + cluster.triangles && isSolid; ++i) {
            const std::uint32_t part = parts.partOfTriangle[i];
            isSolid = part != SolidParts::kNone;
            if (isSolid) solids.add(parts.boxes[part]);
        }
        if (!isSolid) continue;
        cluster.solids = solids;
        cluster.normals = normalConeOf(
            indices.subspan(std::size_t{cluster.firstTriangle} * 3, std::size_t{cluster.triangles} * 3), positions);
    }
}

std::vector<ClusterGroup> groupsOf(std::span<const Cluster> clusters) {
    std::vector<ClusterGroup> groups;
    groups.reserve((clusters.size() + kGroupClusters - 1) / kGroupClusters);
    for (std::size_t first = 0; first < clusters.size(); first += kGroupClusters) {
        ClusterGroup group;
        group.firstCluster = static_cast<std::uint32_t>(first);
        group.clusters = static_cast<std::uint32_t>(std::min(kGroupClusters, clusters.size() - first));
        for (std::size_t i = 0; i < group.clusters; ++i) {
            group.box.add(clusters[first + i].box);
            group.solids.add(clusters[first + i].solids);
        }
        groups.push_back(group);
    }
    return groups;
}

glm::vec3 faceNormal(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    const glm::dvec3 normal = glm::cross(glm::dvec3(b) - glm::dvec3(a), glm::dvec3(c) - glm::dvec3(a));
    const double length = glm::length(normal);
    if (!(length > 0.0)) return {0.0f, 0.0f, 1.0f};
    return glm::vec3(normal / length);
}

std::vector<glm::vec4> deriveTangents(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions,
                                      std::span<const glm::vec3> normals, std::span<const glm::vec2> texCoords) {
    std::vector<glm::dvec3> tangents(positions.size(), glm::dvec3(0.0));
    std::vector<glm::dvec3> bitangents(positions.size(), glm::dvec3(0.0));
    std::vector<glm::dvec3> vertexNormals(positions.size(), glm::dvec3(0.0));
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
        const std::uint32_t corner[3] = {indices[i], indices[i + 1], indices[i + 2]};
        const glm::dvec3 ab(positions[corner[1]] - positions[corner[0]]);
        const glm::dvec3 ac(positions[corner[2]] - positions[corner[0]]);
        const glm::dvec2 uvAb(texCoords[corner[1]] - texCoords[corner[0]]);
        const glm::dvec2 uvAc(texCoords[corner[2]] - texCoords[corner[0]]);
        const double area = uvAb.x * uvAc.y - uvAb.y * uvAc.x;
        const glm::dvec3 normal(faceNormal(positions[corner[0]], positions[corner[1]], positions[corner[2]]));
        const double sign = area < 0.0 ? -1.0 : 1.0;
        const glm::dvec3 tangent = (ab * uvAc.y - ac * uvAb.y) * sign;
        const glm::dvec3 bitangent = (ac * uvAb.x - ab * uvAc.x) * sign;
        const double tangentLength = glm::length(tangent);
        const double bitangentLength = glm::length(bitangent);
        for (int k = 0; k < 3; ++k) {
            const glm::dvec3 p(positions[corner[k]]);
            const glm::dvec3 toNext = glm::dvec3(positions[corner[(k + 1) % 3]]) - p;
            const glm::dvec3 toPrevious = glm::dvec3(positions[corner[(k + 2) % 3]]) - p;
            const double lengths = glm::length(toNext) * glm::length(toPrevious);
            if (!(lengths > 0.0)) continue;
            const double angle = std::acos(std::clamp(glm::dot(toNext, toPrevious) / lengths, -1.0, 1.0));
            vertexNormals[corner[k]] += normal * angle;
            if (area == 0.0 || !(tangentLength > 0.0) || !(bitangentLength > 0.0)) continue;
            tangents[corner[k]] += tangent / tangentLength * angle;
            bitangents[corner[k]] += bitangent / bitangentLength * angle;
        }
    }
    std::vector<glm::vec4> result(positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i) {
        glm::dvec3 normal = i < normals.size() ? glm::dvec3(normals[i]) : vertexNormals[i];
        const double normalLength = glm::length(normal);
        normal = normalLength > 0.0 ? normal / normalLength : glm::dvec3(0.0, 0.0, 1.0);
        glm::dvec3 tangent = tangents[i] - normal * glm::dot(normal, tangents[i]);
        double length = glm::length(tangent);
        if (!(length > 1e-12)) {
            // No texture direction here: any tangent will do, as long as it is always the same one.
            const glm::dvec3 axis = std::abs(normal.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
            tangent = axis - normal * glm::dot(normal, axis);
            length = glm::length(tangent);
        }
        tangent /= length;
        const double handedness = glm::dot(glm::cross(normal, tangent), bitangents[i]);
        result[i] = glm::vec4(glm::vec3(tangent), handedness < 0.0 ? -1.0f : 1.0f);
    }
    return result;
}

}  // namespace umbriel
