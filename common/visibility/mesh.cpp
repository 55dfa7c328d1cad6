#include "common/visibility/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/assert.h"

namespace umbriel::visibility {
namespace {

constexpr float kLargestCoordinate = 1e18f;
constexpr std::size_t kMostIndices = std::size_t{1} << 31;
// Corners at one position share a map while their normals are less than 120 degrees apart: a cube's corner is one, the
// two sides of a sheet with a back are two.
constexpr double kSameSide = -0.5;
// Of a mean of normals shorter than this share of its weights only the rounding of positions is left, 2^-24 of them.
constexpr double kCancelled = 1e-6;

// Spreads 21 bits to every third.
std::uint64_t spread(std::uint64_t x) {
    x = (x | x << 32) & 0x1f00000000ffffull;
    x = (x | x << 16) & 0x1f0000ff0000ffull;
    x = (x | x << 8) & 0x100f00f00f00f00full;
    x = (x | x << 4) & 0x10c30c30c30c30c3ull;
    return (x | x << 2) & 0x1249249249249249ull;
}

template <class T>
std::span<const std::byte> bytesOf(const std::vector<T>& values) {
    return std::as_bytes(std::span(values));
}

Result<void> validate(const Mesh& mesh) {
    if (mesh.indices.empty()) return badInput("the mesh has no triangles");
    if (mesh.indices.size() % 3 != 0) {
        return badInput(fmt::format("the mesh has {} indices, not three for each triangle", mesh.indices.size()));
    }
    if (mesh.indices.size() > kMostIndices || mesh.positions.size() > kMostIndices) {
        return badInput(fmt::format("the mesh has {} indices and {} vertices; 2^31 are possible", mesh.indices.size(),
                                    mesh.positions.size()));
    }
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
        if (mesh.indices[i] >= mesh.positions.size()) {
            return badInput(fmt::format("triangle {} names vertex {}, but the mesh has {}", i / 3, mesh.indices[i],
                                        mesh.positions.size()));
        }
    }
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        for (int axis = 0; axis < 3; ++axis) {
            const float value = mesh.positions[v][axis];
            if (!(std::abs(value) <= kLargestCoordinate)) {
                return badInput(
                    fmt::format("vertex {} has the coordinate {}, which is not finite or above 1e18", v, value));
            }
        }
    }
    return {};
}

// Fills positions; returns the position of each loaded vertex. Numbered as they first occur.
std::vector<std::uint32_t> weld(const Mesh& mesh, std::vector<glm::vec3>& positions) {
    const auto key = [&](std::uint32_t v) {
        const glm::vec3 p = mesh.positions[v] + 0.0f;  // -0 becomes 0
        return std::array{std::bit_cast<std::uint32_t>(p.x), std::bit_cast<std::uint32_t>(p.y),
                          std::bit_cast<std::uint32_t>(p.z)};
    };
    std::vector<std::uint32_t> order(mesh.positions.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
        const auto ka = key(a), kb = key(b);
        return ka != kb ? ka < kb : a < b;
    });
    std::vector<std::uint32_t> first(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        first[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];
    }
    std::vector<std::uint32_t> positionOf(order.size());
    for (std::uint32_t v = 0; v < positionOf.size(); ++v) {
        if (first[v] == v) {
            positionOf[v] = static_cast<std::uint32_t>(positions.size());
            positions.push_back(mesh.positions[v] + 0.0f);
        } else {
            positionOf[v] = positionOf[first[v]];
        }
    }
    return positionOf;
}

glm::dvec3 unit(const glm::dvec3& v) {
    const double length = glm::length(v);
    return length > 0.0 ? v / length : glm::dvec3(0.0);
}

}  // namespace

double coarseness(const Mesh& mesh) {
    if (mesh.positions.empty()) return 0.0;
    glm::dvec3 low(mesh.positions[0]), high(low);
    for (const glm::vec3& p : mesh.positions) {
        low = glm::min(low, glm::dvec3(p));
        high = glm::max(high, glm::dvec3(p));
    }
    const glm::dvec3 farthest = glm::max(glm::abs(low), glm::abs(high));
    const double step = std::numeric_limits<float>::epsilon() * std::max({farthest.x, farthest.y, farthest.z});
    const double diagonal = glm::length(high - low);
    return step > 0.0 ? step / diagonal : 0.0;
}

Result<BakeMesh> prepare(const Mesh& mesh) {
    if (const auto valid = validate(mesh); !valid) return valid.error();
    BakeMesh out;
    const std::vector<std::uint32_t> positionOf = weld(mesh, out.positions);

    // Triangles, and each loaded vertex's angle-weighted normal.
    struct Corners {
        glm::dvec3 first{0.0};  // the first one's normal, as it is weighted
        double weights = 0.0;
    };
    std::vector<glm::dvec3> vertexNormal(mesh.positions.size(), glm::dvec3(0.0));
    std::vector<Corners> vertexCorners(mesh.positions.size());
    std::vector<std::uint32_t> ownCount(out.positions.size() + 1, 0);
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
        const std::array<std::uint32_t, 3> v{mesh.indices[t], mesh.indices[t + 1], mesh.indices[t + 2]};
        const glm::uvec3 corner(positionOf[v[0]], positionOf[v[1]], positionOf[v[2]]);
        const std::array p{glm::dvec3(out.positions[corner.x]), glm::dvec3(out.positions[corner.y]),
                           glm::dvec3(out.positions[corner.z])};
        const glm::dvec3 normal = unit(glm::cross(p[1] - p[0], p[2] - p[0]));
        if (corner.x == corner.y || corner.y == corner.z || corner.z == corner.x || normal == glm::dvec3(0.0)) {
            ++out.degenerateTriangles;
            continue;
        }
        out.triangles.push_back(corner);
        for (int k = 0; k < 3; ++k) {
            const glm::dvec3 e0 = p[(k + 1) % 3] - p[k], e1 = p[(k + 2) % 3] - p[k];
            const double angle = std::atan2(glm::length(glm::cross(e0, e1)), glm::dot(e0, e1));
            Corners& corners = vertexCorners[v[k]];
            if (corners.weights == 0.0) corners.first = normal * angle;
            corners.weights += angle;
            vertexNormal[v[k]] += normal * angle;
            ++ownCount[corner[k] + 1];
        }
    }
    if (out.triangles.empty()) {
        return badInput(
            fmt::format("all {} triangles of the mesh are degenerate: corners are one point or lie on a line{}",
                        out.degenerateTriangles,
                        coarseness(mesh) > 0.1 ? ", since numbers as large as its coordinates are not exact "
                                                 "enough; move it to the origin"
                                               : ""));
    }
    std::partial_sum(ownCount.begin(), ownCount.end(), ownCount.begin());
    out.ownBegin = ownCount;
    out.own.resize(out.triangles.size() * 3);
    for (std::uint32_t t = 0; t < out.triangles.size(); ++t) {
        for (int k = 0; k < 3; ++k) out.own[ownCount[out.triangles[t][k]]++] = t;
    }

    // Rows: the vertices of a position, gathered by side.
    struct Side {
        std::uint32_t position;
        glm::dvec3 first;  // unit
        glm::dvec3 sum;
    };
    std::vector<Side> sides;
    std::vector<std::uint32_t> sideOf(mesh.positions.size(), kNoRow);
    std::vector<std::vector<std::uint32_t>> atPosition(out.positions.size());
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
        // Both faces of a sheet at one vertex cancel: it is on the side of the first.
        if (glm::length(vertexNormal[v]) <= kCancelled * vertexCorners[v].weights)
            vertexNormal[v] = vertexCorners[v].first;
        const glm::dvec3 normal = unit(vertexNormal[v]);
        if (normal == glm::dvec3(0.0)) {
            ++out.unlitVertices;
            continue;
        }
        auto& here = atPosition[positionOf[v]];
        const auto found = std::ranges::find_if(
            here, [&](std::uint32_t side) { return glm::dot(sides[side].first, normal) > kSameSide; });
        if (found != here.end()) {
            sideOf[v] = *found;
        } else {
            sideOf[v] = static_cast<std::uint32_t>(sides.size());
            here.push_back(sideOf[v]);
            sides.push_back({positionOf[v], normal, glm::dvec3(0.0)});
        }
        sides[sideOf[v]].sum += vertexNormal[v];
    }

    UMBRIEL_ASSERT(!sides.empty(), "the corners of a triangle with an area have a side");

    // Z-curve over the box.
    glm::dvec3 low(out.positions[0]), high(low);
    for (const glm::vec3& p : out.positions) {
        low = glm::min(low, glm::dvec3(p));
        high = glm::max(high, glm::dvec3(p));
    }
    out.diagonal = glm::length(high - low);
    const double extent = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
    const auto code = [&](std::uint32_t position) {
        const glm::dvec3 cell = (glm::dvec3(out.positions[position]) - low) / extent * 2097151.0;
        return spread(static_cast<std::uint64_t>(cell.x)) | spread(static_cast<std::uint64_t>(cell.y)) << 1 |
               spread(static_cast<std::uint64_t>(cell.z)) << 2;
    };
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
    order.reserve(sides.size());
    for (std::uint32_t side = 0; side < sides.size(); ++side) order.emplace_back(code(sides[side].position), side);
    std::ranges::sort(order);
    std::vector<std::uint32_t> rowOf(sides.size());
    for (const auto& [unused, side] : order) {
        rowOf[side] = static_cast<std::uint32_t>(out.rows.size());
        glm::dvec3 normal = unit(sides[side].sum);
        if (normal == glm::dvec3(0.0)) normal = sides[side].first;
        out.rows.push_back({sides[side].position, glm::vec3(normal)});
    }
    out.vertexRow.resize(mesh.positions.size());
    for (std::size_t v = 0; v < out.vertexRow.size(); ++v)
        out.vertexRow[v] = sideOf[v] == kNoRow ? kNoRow : rowOf[sideOf[v]];

    static_assert(sizeof(Row) == 16 && sizeof(glm::vec3) == 12);
    Hasher128 hasher;
    const std::array<std::uint64_t, 2> sizes{mesh.positions.size(), mesh.indices.size()};
    hasher.add(std::as_bytes(std::span(sizes)));
    hasher.add(bytesOf(mesh.positions));
    hasher.add(bytesOf(mesh.indices));
    hasher.add(bytesOf(out.rows));
    out.hash = hasher.finish();
    return out;
}

glm::mat3 vertexAxes(const glm::vec3& n) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

trace::Origin origin(const BakeMesh& mesh, std::uint32_t row, DirectionFrame frame) {
    UMBRIEL_ASSERT(row < mesh.rows.size(), "a row outside the mesh");
    const Row& r = mesh.rows[row];
    return {r.position, r.normal, frame == DirectionFrame::Vertex ? vertexAxes(r.normal) : glm::mat3(1.0f)};
}

trace::DirectionPackets directionPackets(const Mapping& mapping) {
    const std::vector<std::uint32_t> order = packetOrder(mapping);
    trace::DirectionPackets out;
    const auto add = [&](std::uint32_t pixel, const glm::vec3& d) {
        out.x.push_back(d.x);
        out.y.push_back(d.y);
        out.z.push_back(d.z);
        out.pixel.push_back(pixel);
    };
    const auto fill = [&] {
        while (out.lanes() % trace::kPacket != 0) add(trace::kNoPixel, {0.0f, 0.0f, 1.0f});
    };
    const bool ownSides = directionSide(mapping) == DirectionSide::Own;
    for (const std::uint32_t pixel : order) {
        const glm::vec3 d(direction(mapping, pixel));
        if (!ownSides || d.z > 0.0f) add(pixel, d);
    }
    fill();
    out.lowerBegin = out.lanes();
    for (const std::uint32_t pixel : order) {
        const glm::vec3 d(direction(mapping, pixel));
        if (ownSides && !(d.z > 0.0f)) add(pixel, d);
    }
    fill();
    return out;
}

Hash128 directionHash(const Mapping& mapping) {
    const trace::DirectionPackets set = directionPackets(mapping);
    Hasher128 hasher;
    hasher.add(bytesOf(set.pixel));
    hasher.add(bytesOf(set.x));
    hasher.add(bytesOf(set.y));
    hasher.add(bytesOf(set.z));
    return hasher.finish();
}

}  // namespace umbriel::visibility
