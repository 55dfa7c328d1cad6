#include "tests/unit/visibility/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace umbriel::visibility::test {
namespace {

using Real = long double;
struct Vector {
    Real x, y, z;
};
Vector of(const glm::vec3& v) {
    return {v.x, v.y, v.z};
}
Vector operator-(const Vector& a, const Vector& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Real dot(const Vector& a, const Vector& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Vector cross(const Vector& a, const Vector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

Reference::Reference(const BakeMesh& mesh) : _mesh(mesh), _order(mesh.triangles.size()) {
    std::iota(_order.begin(), _order.end(), 0u);
    _nodes.emplace_back();
    build(0, 0, static_cast<std::uint32_t>(_order.size()));
}

void Reference::build(std::uint32_t node, std::uint32_t begin, std::uint32_t end) {
    glm::dvec3 low(kInfinity), high(-kInfinity);
    for (std::uint32_t i = begin; i < end; ++i) {
        for (int k = 0; k < 3; ++k) {
            const glm::dvec3 p(_mesh.positions[_mesh.triangles[_order[i]][k]]);
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
    }
    const glm::dvec3 pad = glm::dvec3(1e-9 * _mesh.diagonal) + glm::abs(high) * 1e-12;
    _nodes[node] = {low - pad, high + pad, begin, end - begin};
    if (end - begin <= 4) return;
    const glm::dvec3 extent = high - low;
    const int axis = extent.x > extent.y && extent.x > extent.z ? 0 : extent.y > extent.z ? 1 : 2;
    const auto centre = [&](std::uint32_t t) {
        const glm::uvec3& c = _mesh.triangles[t];
        return _mesh.positions[c.x][axis] + _mesh.positions[c.y][axis] + _mesh.positions[c.z][axis];
    };
    const std::uint32_t middle = (begin + end) / 2;
    std::nth_element(_order.begin() + begin, _order.begin() + middle, _order.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) { return centre(a) < centre(b); });
    const auto children = static_cast<std::uint32_t>(_nodes.size());
    _nodes.resize(_nodes.size() + 2);
    _nodes[node].first = children;
    _nodes[node].count = 0;
    build(children, begin, middle);
    build(children + 1, middle, end);
}

bool Reference::own(std::uint32_t triangle, std::uint32_t position) const {
    const glm::uvec3& t = _mesh.triangles[triangle];
    return t.x == position || t.y == position || t.z == position;
}

bool Reference::fan(const trace::Origin& origin, const glm::vec3& direction, bool lower) const {
    const Vector p = of(_mesh.positions[origin.position]), d = of(direction);
    const Vector n = of(lower ? -origin.normal : origin.normal);
    for (const std::uint32_t triangle : _mesh.ownTriangles(origin.position)) {
        const glm::uvec3& t = _mesh.triangles[triangle];
        const int apex = t.x == origin.position ? 0 : t.y == origin.position ? 1 : 2;
        const Vector e0 = of(_mesh.positions[t[(apex + 1) % 3]]) - p, e1 = of(_mesh.positions[t[(apex + 2) % 3]]) - p;
        const Vector q = cross(e0, e1);
        const Real slope = dot(q, d);
        if (slope == 0) continue;
        const Real distance = -dot(q, n) / slope;
        if (!(distance > 0)) continue;
        const Vector at{n.x + distance * d.x, n.y + distance * d.y, n.z + distance * d.z};
        if (dot(cross(at, e1), q) >= 0 && dot(cross(e0, at), q) >= 0) return true;
    }
    return false;
}

double Reference::hit(std::uint32_t triangle, const glm::vec3& origin, const glm::vec3& direction) const {
    const glm::uvec3& t = _mesh.triangles[triangle];
    const Vector a = of(_mesh.positions[t.x]), d = of(direction);
    const Vector e1 = of(_mesh.positions[t.y]) - a, e2 = of(_mesh.positions[t.z]) - a;
    const Vector p = cross(d, e2);
    const Real determinant = dot(e1, p);
    if (determinant == 0) return kInfinity;
    const Vector s = of(origin) - a;
    const Real u = dot(s, p) / determinant;
    if (u < 0 || u > 1) return kInfinity;
    const Vector q = cross(s, e1);
    const Real v = dot(d, q) / determinant;
    if (v < 0 || u + v > 1) return kInfinity;
    const Real distance = dot(e2, q) / determinant;
    return distance > 0 ? static_cast<double>(distance) : kInfinity;
}

double Reference::distance(const trace::Origin& origin, const glm::vec3& direction) const {
    const glm::vec3& from = _mesh.positions[origin.position];
    const glm::dvec3 inverse = 1.0 / glm::dvec3(direction);
    std::array<std::uint32_t, 128> stack{};
    std::size_t depth = 1;
    double nearest = kInfinity;
    while (depth > 0) {
        const Node& node = _nodes[stack[--depth]];
        double enter = 0.0, leave = nearest;
        for (int k = 0; k < 3; ++k) {
            double t0 = (node.low[k] - from[k]) * inverse[k], t1 = (node.high[k] - from[k]) * inverse[k];
            if (t0 > t1) std::swap(t0, t1);
            // Widened beyond any rounding; a NaN (0 times infinity) leaves the interval as it was.
            enter = std::max(enter, t0 - 1e-9 * std::abs(t0));
            leave = std::min(leave, t1 + 1e-9 * std::abs(t1));
        }
        if (enter > leave) continue;
        if (node.count == 0) {
            stack[depth++] = node.first;
            stack[depth++] = node.first + 1;
            continue;
        }
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            if (!own(_order[i], origin.position)) nearest = std::min(nearest, hit(_order[i], from, direction));
        }
    }
    return nearest;
}

bool Reference::blocked(const trace::Origin& origin, const glm::vec3& direction, bool lower, double farDistance) const {
    return fan(origin, direction, lower) || distance(origin, direction) <= std::min(farDistance, 1e300);
}

bool Reference::blockedBruteForce(const trace::Origin& origin, const glm::vec3& direction, bool lower,
                                  double farDistance) const {
    if (fan(origin, direction, lower)) return true;
    for (std::uint32_t t = 0; t < _mesh.triangles.size(); ++t) {
        if (!own(t, origin.position) &&
            hit(t, _mesh.positions[origin.position], direction) <= std::min(farDistance, 1e300)) {
            return true;
        }
    }
    return false;
}

}  // namespace umbriel::visibility::test
