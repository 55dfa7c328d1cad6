#include "common/visibility/face_piercings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/visibility/box_grid.h"

namespace umbriel::visibility {
namespace {

// Boxes that the grid may look at for each triangle: 30 to 500 in scenes and cloth, 1.6 million in a fan of 5000.
// Dividing space costs as much as about a thousand.
constexpr std::uint64_t kMostVisits = 1000;
constexpr std::uint64_t kFew = 1024;  // pairs of an edge and a triangle that are tested rather than divided further
constexpr int kDeepest = 96;          // halvings: 32 along each axis are below the steps of single precision
constexpr std::size_t kMostHeld = std::size_t{1} << 24;  // pairs found and not yet counted: 128 MiB
// A division that leaves more of the pairs than this saves little: it may only have cut off empty space, but so many in
// a row are the last. One that leaves more than there were is none; another axis is tried.
constexpr double kWorthwhile = 0.9;
constexpr double kAcceptable = 1.02;
constexpr int kPatience = 8;
// Not in the middle: there is the vertex of a symmetric fan, and both parts would have all of its triangles.
constexpr double kDivideAt = 0.47;

// Six times the volume of the tetrahedron.
double volume(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
    return glm::dot(b - a, glm::cross(c - a, d - a));
}

// The open segment p q goes through the inside of the triangle. Touching does not count.
bool crosses(const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const double sp = volume(a, b, c, p), sq = volume(a, b, c, q);
    if (!(sp * sq < 0.0)) return false;
    const double u = volume(p, q, a, b), v = volume(p, q, b, c), w = volume(p, q, c, a);
    return (u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0);
}

bool hasCorner(const glm::uvec3& triangle, std::uint32_t corner) {
    return corner == triangle.x || corner == triangle.y || corner == triangle.z;
}

// Edge k of triangle s.
bool edgePierces(const std::vector<glm::vec3>& positions, const MeshTopology& topology, std::uint32_t s, int k,
                 std::uint32_t t) {
    const glm::uvec3& a = topology.triangles[s];
    const glm::uvec3& b = topology.triangles[t];
    const std::uint32_t from = a[k], to = a[(k + 1) % 3];
    return !hasCorner(b, from) && !hasCorner(b, to) &&
           crosses(glm::dvec3(positions[from]), glm::dvec3(positions[to]), glm::dvec3(positions[b.x]),
                   glm::dvec3(positions[b.y]), glm::dvec3(positions[b.z]));
}

struct Halves {
    glm::dvec3 middle, half;
};

// The projections of a convex body's corners, relative to the box's middle, and of the box onto an axis are apart.
template <std::size_t N>
bool apart(const glm::dvec3& axis, const std::array<glm::dvec3, N>& corners, const glm::dvec3& half) {
    double low = glm::dot(axis, corners[0]), high = low;
    for (std::size_t i = 1; i < N; ++i) {
        const double d = glm::dot(axis, corners[i]);
        low = std::min(low, d);
        high = std::max(high, d);
    }
    const double reach = glm::dot(glm::abs(axis), half);
    return low > reach || high < -reach;
}

// A segment or a triangle and a box, by separating axes (Akenine-Moeller 2001).
template <std::size_t N>
bool touches(std::array<glm::dvec3, N> corners, const Halves& box) {
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (glm::dvec3& c : corners) {
        c -= box.middle;
        low = glm::min(low, c);
        high = glm::max(high, c);
    }
    for (int i = 0; i < 3; ++i) {
        if (low[i] > box.half[i] || high[i] < -box.half[i]) return false;
    }
    for (std::size_t i = 0; i < (N == 2 ? 1 : N); ++i) {
        const glm::dvec3 e = corners[(i + 1) % N] - corners[i];
        if (apart(glm::dvec3(0.0, -e.z, e.y), corners, box.half) ||
            apart(glm::dvec3(e.z, 0.0, -e.x), corners, box.half) ||
            apart(glm::dvec3(-e.y, e.x, 0.0), corners, box.half)) {
            return false;
        }
    }
    if constexpr (N == 3) {
        return !apart(glm::cross(corners[1] - corners[0], corners[2] - corners[0]), corners, box.half);
    }
    return true;
}

// Divides space until few edges meet few triangles. The boxes of slivers around one vertex, a fan, all overlap, so
// neither boxes of triangles nor a uniform grid tell them apart; the slivers themselves are told apart by small boxes
// except around the vertex, and there every edge shares that vertex with every triangle and nothing is to be tested.
class Finder {
 public:
    Finder(const std::vector<glm::vec3>& positions, const MeshTopology& topology, std::size_t examples)
        : _positions(positions), _topology(topology), _examples(examples) {
        std::vector<std::uint32_t> degree(positions.size(), 0);
        double farthest = 0.0;
        glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
        for (std::uint32_t t = 0; t < topology.triangles.size(); ++t) {
            if (topology.degenerate[t]) continue;
            for (int k = 0; k < 3; ++k) {
                const std::uint32_t v = topology.triangles[t][k];
                ++degree[v];
                for (int i = 0; i < 3; ++i) farthest = std::max(farthest, std::abs(at(v)[i]));
                low = glm::min(low, at(v));
                high = glm::max(high, at(v));
            }
        }
        // Beyond the rounding of the tests against boxes, below the steps of the coordinates.
        _pad = 1e-9 * glm::length(high - low) + 1e-12 * farthest;
        _all = {low, high};
        const auto busier = [&](std::uint32_t a, std::uint32_t b) {
            return degree[a] != degree[b] ? degree[a] > degree[b] : a < b;
        };
        for (std::uint32_t t = 0; t < topology.triangles.size(); ++t) {
            if (topology.degenerate[t]) continue;
            const glm::uvec3& c = topology.triangles[t];
            _triangles.push_back({std::min({c.x, c.y, c.z}, busier), t});
            for (int k = 0; k < 3; ++k) _edges.push_back({std::min(c[k], c[(k + 1) % 3], busier), t * 3ull + k});
        }
        std::ranges::sort(_triangles, {}, [](const Item& i) { return std::pair(i.hub, i.id); });
    }

    FacePiercings run() {
        count(0, static_cast<std::uint32_t>(_topology.triangles.size()));
        return std::move(_result);
    }

 private:
    // An edge (3 * triangle + which) or a triangle, and the one of its corners that most triangles share.
    struct Item {
        std::uint32_t hub;
        std::uint64_t id;
    };
    using Items = std::vector<Item>;
    using Pair = std::pair<std::uint32_t, std::uint32_t>;

    const std::vector<glm::vec3>& _positions;
    const MeshTopology& _topology;
    std::size_t _examples;
    double _pad = 0.0;
    Box _all;
    Items _edges, _triangles;
    std::vector<Pair> _found;  // (s, t): s pierces t; one may be found in several boxes
    bool _mayStop = true;
    bool _full = false;
    FacePiercings _result;

    glm::dvec3 at(std::uint32_t vertex) const { return glm::dvec3(_positions[vertex]); }
    std::array<glm::dvec3, 2> edge(const Item& item) const {
        const glm::uvec3& c = _topology.triangles[item.id / 3];
        return {at(c[item.id % 3]), at(c[(item.id + 1) % 3])};
    }
    std::array<glm::dvec3, 3> triangle(const Item& item) const {
        const glm::uvec3& c = _topology.triangles[item.id];
        return {at(c.x), at(c.y), at(c.z)};
    }

    // The pairs of which the piercing triangle is in this range: halves of it where they are too many to be held.
    void count(std::uint32_t begin, std::uint32_t end) {
        Items edges;
        for (const Item& e : _edges) {
            if (e.id / 3 >= begin && e.id / 3 < end) edges.push_back(e);
        }
        std::ranges::sort(edges, {}, [](const Item& i) { return std::pair(i.hub, i.id); });
        _found.clear();
        _full = false;
        _mayStop = end - begin > 1;
        divide(_all, std::move(edges), _triangles, 0, kPatience);
        if (_full) {
            const std::uint32_t middle = begin + (end - begin) / 2;
            count(begin, middle);
            count(middle, end);
            return;
        }
        dropDoubles();
        for (const auto& [s, t] : _found) {
            // Where each pierces the other, the lower one counts.
            if (s > t && pierces(_positions, _topology, t, s)) continue;
            ++_result.count;
            const Pair pair = std::minmax(s, t);
            auto& first = _result.examples;
            if (first.size() == _examples && (first.empty() || first.back() < pair)) continue;
            first.insert(std::ranges::upper_bound(first, pair), pair);
            if (first.size() > _examples) first.pop_back();
        }
    }

    void dropDoubles() {
        std::ranges::sort(_found);
        _found.erase(std::unique(_found.begin(), _found.end()), _found.end());
    }

    // Pairs that may have to be tested: those that share a hub need not.
    static std::uint64_t work(const Items& edges, const Items& triangles) {
        std::uint64_t shared = 0;
        for (std::size_t e = 0, t = 0; e < edges.size() && t < triangles.size();) {
            const std::uint32_t hub = std::min(edges[e].hub, triangles[t].hub);
            std::uint64_t es = 0, ts = 0;
            for (; e < edges.size() && edges[e].hub == hub; ++e) ++es;
            for (; t < triangles.size() && triangles[t].hub == hub; ++t) ++ts;
            shared += es * ts;
        }
        return static_cast<std::uint64_t>(edges.size()) * triangles.size() - shared;
    }

    // What both reach of the box.
    Box common(const Box& box, const Items& edges, const Items& triangles) const {
        Box e{glm::dvec3(std::numeric_limits<double>::infinity()),
              glm::dvec3(-std::numeric_limits<double>::infinity())};
        Box t = e;
        const auto grow = [](Box& b, const auto& corners) {
            for (const glm::dvec3& c : corners) {
                b.low = glm::min(b.low, c);
                b.high = glm::max(b.high, c);
            }
        };
        for (const Item& item : edges) grow(e, edge(item));
        for (const Item& item : triangles) grow(t, triangle(item));
        return {glm::max(box.low, glm::max(e.low, t.low)), glm::min(box.high, glm::min(e.high, t.high))};
    }

    struct Part {
        Box box;
        Items edges, triangles;
        std::uint64_t work = 0;
    };
    Part part(const Box& box, const Items& edges, const Items& triangles) const {
        Part out{box, {}, {}, 0};
        const Halves halves{0.5 * (box.low + box.high), 0.5 * (box.high - box.low) + _pad};
        for (const Item& item : edges) {
            if (touches(edge(item), halves)) out.edges.push_back(item);
        }
        if (out.edges.empty()) return out;
        for (const Item& item : triangles) {
            if (touches(triangle(item), halves)) out.triangles.push_back(item);
        }
        out.work = work(out.edges, out.triangles);
        return out;
    }

    void divide(const Box& whole, Items edges, Items triangles, int depth, int patience) {
        const std::uint64_t now = work(edges, triangles);
        if (now == 0 || _full) return;
        const Box box = common(whole, edges, triangles);
        const glm::dvec3 extent = box.high - box.low;
        if (extent.x < -_pad || extent.y < -_pad || extent.z < -_pad) return;
        if (now > kFew && depth < kDeepest && patience > 0) {
            std::array axes{0, 1, 2};
            std::ranges::sort(axes,
                              [&](int a, int b) { return extent[a] != extent[b] ? extent[a] > extent[b] : a < b; });
            for (const int axis : axes) {
                if (extent[axis] < 8.0 * _pad) break;
                Box low = box, high = box;
                low.high[axis] = high.low[axis] = box.low[axis] + kDivideAt * extent[axis];
                Part a = part(low, edges, triangles), b = part(high, edges, triangles);
                const double left = static_cast<double>(a.work + b.work) / static_cast<double>(now);
                if (left > kAcceptable) continue;
                const int then = left > kWorthwhile ? patience - 1 : kPatience;
                edges = Items();
                triangles = Items();
                divide(a.box, std::move(a.edges), std::move(a.triangles), depth + 1, then);
                a = Part();
                divide(b.box, std::move(b.edges), std::move(b.triangles), depth + 1, then);
                return;
            }
        }
        test(edges, triangles);
    }

    void test(const Items& edges, const Items& triangles) {
        for (const Item& e : edges) {
            const auto [p, q] = edge(e);
            const glm::dvec3 low = glm::min(p, q), high = glm::max(p, q);
            const auto s = static_cast<std::uint32_t>(e.id / 3);
            for (std::size_t i = 0; i < triangles.size(); ++i) {
                if (triangles[i].hub == e.hub) {
                    // The others of this hub are behind one another.
                    i = std::ranges::upper_bound(triangles, e.hub, {}, &Item::hub) - triangles.begin() - 1;
                    continue;
                }
                const auto [a, b, c] = triangle(triangles[i]);
                if (glm::any(glm::lessThan(glm::max(glm::max(a, b), c), low)) ||
                    glm::any(glm::lessThan(high, glm::min(glm::min(a, b), c)))) {
                    continue;
                }
                const auto t = static_cast<std::uint32_t>(triangles[i].id);
                if (!edgePierces(_positions, _topology, s, static_cast<int>(e.id % 3), t)) continue;
                if (_found.size() >= kMostHeld && _mayStop) {
                    dropDoubles();
                    _full = _found.size() > kMostHeld / 2;
                    if (_full) return;
                }
                _found.emplace_back(s, t);
            }
        }
    }
};

}  // namespace

bool pierces(const std::vector<glm::vec3>& positions, const MeshTopology& topology, std::uint32_t s, std::uint32_t t) {
    for (int k = 0; k < 3; ++k) {
        if (edgePierces(positions, topology, s, k, t)) return true;
    }
    return false;
}

FacePiercings facePiercings(const std::vector<glm::vec3>& positions, const MeshTopology& topology,
                            std::size_t examples) {
    std::vector<Box> boxes;
    std::vector<std::uint32_t> triangle;
    for (std::uint32_t t = 0; t < topology.triangles.size(); ++t) {
        if (topology.degenerate[t]) continue;
        const glm::uvec3& c = topology.triangles[t];
        const glm::dvec3 x(positions[c.x]), y(positions[c.y]), z(positions[c.z]);
        boxes.push_back({glm::min(glm::min(x, y), z), glm::max(glm::max(x, y), z)});
        triangle.push_back(t);
    }
    const BoxGrid grid(boxes);
    if (grid.visits() > kMostVisits * triangle.size()) return Finder(positions, topology, examples).run();
    FacePiercings found;
    std::vector<std::uint32_t> candidates;
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        candidates.clear();
        grid.eachOverlap(boxes[i], [&](std::uint32_t j) {
            if (j > i) candidates.push_back(j);
        });
        std::ranges::sort(candidates);  // the examples are the first
        for (const std::uint32_t j : candidates) {
            const std::uint32_t s = triangle[i], t = triangle[j];
            if (!pierces(positions, topology, s, t) && !pierces(positions, topology, t, s)) continue;
            if (found.count++ < examples) found.examples.emplace_back(s, t);
        }
    }
    return found;
}

}  // namespace umbriel::visibility
