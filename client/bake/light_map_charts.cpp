#include "client/bake/light_map_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>
#include <numeric>
#include <tuple>
#include <unordered_map>

namespace umbriel {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

double cross(const glm::dvec2& a, const glm::dvec2& b) {
    return a.x * b.y - a.y * b.x;
}

// Counter-clockwise.
using Flat = std::array<glm::dvec2, 3>;

double areaOf(const Flat& t) {
    return 0.5 * cross(t[1] - t[0], t[2] - t[0]);
}

// Triangles in a plane, to be asked whether another one would lie over them. Touching along edges does not count.
class Cover {
 public:
    // cell: about the size of a triangle.
    explicit Cover(double cell) : _cell(cell > 0.0 ? cell : 1.0) {}

    bool overlaps(const Flat& t) const {
        bool found = false;
        const auto test = [&](std::uint32_t other) {
            found = found || overlap(_triangles[other], t);
            return !found;
        };
        for (const std::uint32_t other : _large)
            if (!test(other)) return true;
        const Cells cells = cellsOf(t);
        if (cells.isLarge) {
            for (std::uint32_t other = 0; other < _triangles.size() && !found; ++other) test(other);
            return found;
        }
        for (std::int64_t y = cells.y0; y <= cells.y1 && !found; ++y)
            for (std::int64_t x = cells.x0; x <= cells.x1 && !found; ++x)
                if (const auto at = _cells.find(key(x, y)); at != _cells.end())
                    for (const std::uint32_t other : at->second)
                        if (!test(other)) break;
        return found;
    }
    void add(const Flat& t) {
        const auto number = static_cast<std::uint32_t>(_triangles.size());
        _triangles.push_back(t);
        const Cells cells = cellsOf(t);
        if (cells.isLarge) {
            _large.push_back(number);
            return;
        }
        for (std::int64_t y = cells.y0; y <= cells.y1; ++y)
            for (std::int64_t x = cells.x0; x <= cells.x1; ++x) _cells[key(x, y)].push_back(number);
    }

 private:
    struct Cells {
        std::int64_t x0, y0, x1, y1;
        bool isLarge;
    };
    Cells cellsOf(const Flat& t) const {
        const glm::dvec2 low = glm::min(t[0], glm::min(t[1], t[2])) / _cell;
        const glm::dvec2 high = glm::max(t[0], glm::max(t[1], t[2])) / _cell;
        constexpr double kMostCells = 64.0;
        if ((high.x - low.x + 1.0) * (high.y - low.y + 1.0) > kMostCells ||
            std::max(glm::length(low), glm::length(high)) > 1e9)
            return {0, 0, -1, -1, true};
        return {static_cast<std::int64_t>(std::floor(low.x)), static_cast<std::int64_t>(std::floor(low.y)),
                static_cast<std::int64_t>(std::floor(high.x)), static_cast<std::int64_t>(std::floor(high.y)), false};
    }
    static std::uint64_t key(std::int64_t x, std::int64_t y) {
        return (static_cast<std::uint64_t>(x) << 32) ^ (static_cast<std::uint64_t>(y) & 0xffffffffu);
    }
    // By the separating axes of two triangles. What is thinner than a ten-millionth of them may lie over the other:
    // corners are rounded.
    static bool overlap(const Flat& a, const Flat& b) {
        const auto isSeparate = [](const Flat& from, const Flat& other) {
            for (std::size_t i = 0; i < 3; ++i) {
                const glm::dvec2 edge = from[(i + 1) % 3] - from[i];
                const double length = glm::length(edge);
                if (!(length > 0.0)) continue;
                double inmost = -1e300;
                for (const glm::dvec2& corner : other)
                    inmost = std::max(inmost, cross(edge, corner - from[i]) / length);
                if (inmost <= 1e-7 * length) return true;
            }
            return false;
        };
        return !isSeparate(a, b) && !isSeparate(b, a);
    }

    double _cell;
    std::vector<Flat> _triangles;
    std::vector<std::uint32_t> _large;
    std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> _cells;  // looked up only
};

// What of a mesh is needed again and again.
class Surface {
 public:
    explicit Surface(const ChartMesh& mesh) : _mesh(mesh) {
        const std::size_t count = mesh.triangles.size();
        normals.assign(count, glm::dvec3(0.0));
        areas.assign(count, 0.0);
        for (std::size_t i = 0; i < count; ++i) {
            const glm::uvec3 t = mesh.triangles[i];
            if (std::max({t.x, t.y, t.z}) >= mesh.positions.size()) continue;
            const glm::dvec3 e1 = corner(i, 1) - corner(i, 0), e2 = corner(i, 2) - corner(i, 0);
            const glm::dvec3 n = glm::cross(e1, e2);
            const double area = 0.5 * glm::length(n);
            const double longest = std::max(glm::dot(e1, e1), glm::dot(e2, e2));
            // Thinner than the last digits of float coordinates: no pixel of it is drawn.
            if (!(area > 1e-9 * longest) || !std::isfinite(area)) continue;
            normals[i] = n / (2.0 * area);
            areas[i] = area;
        }
    }
    glm::dvec3 corner(std::size_t triangle, int k) const { return _mesh.positions[_mesh.triangles[triangle][k]]; }
    bool counts(std::size_t triangle) const { return areas[triangle] > 0.0; }

    // Numbers of vertices, equal ones for those that are the same place (and the same texture coordinate).
    std::vector<std::uint32_t> places(bool withTexCoords) const {
        const std::size_t count = _mesh.positions.size();
        std::vector<std::uint32_t> order(count);
        std::iota(order.begin(), order.end(), 0u);
        const auto keyOf = [&](std::uint32_t v) {
            const glm::dvec3& p = _mesh.positions[v];
            const glm::dvec2 t = withTexCoords ? _mesh.texCoords[v] : glm::dvec2(0.0);
            return std::tuple(p.x, p.y, p.z, t.x, t.y);
        };
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            return std::tuple_cat(keyOf(a), std::tuple(a)) < std::tuple_cat(keyOf(b), std::tuple(b));
        });
        std::vector<std::uint32_t> place(count);
        for (std::size_t i = 0; i < count; ++i)
            place[order[i]] = i > 0 && keyOf(order[i]) == keyOf(order[i - 1]) ? place[order[i - 1]] : order[i];
        return place;
    }

    std::vector<glm::dvec3> normals;  // unit; 0 where there is no area
    std::vector<double> areas;

 private:
    const ChartMesh& _mesh;
};

// Which triangles share an edge.
class Neighbours {
 public:
    Neighbours(const ChartMesh& mesh, const Surface& surface, const std::vector<std::uint32_t>& places)
        : _edgesOf(mesh.triangles.size(), {kNone, kNone, kNone}) {
        struct Use {
            std::uint32_t from, to, triangle, side;
        };
        std::vector<Use> uses;
        for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
            if (!surface.counts(i)) continue;
            for (int k = 0; k < 3; ++k) {
                const std::uint32_t a = places[mesh.triangles[i][k]], b = places[mesh.triangles[i][(k + 1) % 3]];
                uses.push_back({std::min(a, b), std::max(a, b), i, static_cast<std::uint32_t>(k)});
            }
        }
        std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) {
            return std::tie(a.from, a.to, a.triangle, a.side) < std::tie(b.from, b.to, b.triangle, b.side);
        });
        for (std::size_t i = 0; i < uses.size(); ++i) {
            if (i == 0 || uses[i].from != uses[i - 1].from || uses[i].to != uses[i - 1].to)
                _first.push_back(static_cast<std::uint32_t>(_triangles.size()));
            _edgesOf[uses[i].triangle][uses[i].side] = static_cast<std::uint32_t>(_first.size() - 1);
            _triangles.push_back(uses[i].triangle);
        }
        _first.push_back(static_cast<std::uint32_t>(_triangles.size()));
    }
    // visit(other triangle), ascending for each of the three sides.
    template <class Visit>
    void visit(std::uint32_t triangle, const Visit& visit) const {
        for (std::size_t side = 0; side < 3; ++side) visitSide(triangle, side, visit);
    }
    template <class Visit>
    void visitSide(std::uint32_t triangle, std::size_t side, const Visit& visit) const {
        const std::uint32_t edge = _edgesOf[triangle][side];
        if (edge == kNone) return;
        for (std::uint32_t i = _first[edge]; i < _first[edge + 1]; ++i)
            if (_triangles[i] != triangle) visit(_triangles[i]);
    }

 private:
    std::vector<std::array<std::uint32_t, 3>> _edgesOf;
    std::vector<std::uint32_t> _first, _triangles;
};

Flat texCoordsOf(const ChartMesh& mesh, std::size_t triangle) {
    const glm::uvec3 t = mesh.triangles[triangle];
    Flat flat{mesh.texCoords[t.x], mesh.texCoords[t.y], mesh.texCoords[t.z]};
    if (areaOf(flat) < 0.0) std::swap(flat[1], flat[2]);
    return flat;
}

// Moves the corners so that they begin at 0; the least corner that was.
glm::dvec2 moveToOrigin(Chart& chart) {
    glm::dvec2 low(1e300), high(-1e300);
    for (const glm::dvec2& corner : chart.corners) {
        low = glm::min(low, corner);
        high = glm::max(high, corner);
    }
    for (glm::dvec2& corner : chart.corners) corner -= low;
    chart.extent = high - low;
    return low;
}

// Turned so that the box around it is small, and wider than high.
void turn(Chart& chart, const std::vector<glm::dvec2>& longestSide) {
    constexpr int kSteps = 8;  // in a right angle
    std::vector<double> angles;
    for (const glm::dvec2& side : longestSide) angles.push_back(std::atan2(side.y, side.x));
    for (int i = 0; i < kSteps; ++i) angles.push_back(0.5 * std::numbers::pi * i / kSteps);
    double best = 1e300, chosen = 0.0;
    for (const double angle : angles) {
        const glm::dvec2 x(std::cos(angle), std::sin(angle)), y(-x.y, x.x);
        glm::dvec2 low(1e300), high(-1e300);
        for (const glm::dvec2& corner : chart.corners) {
            const glm::dvec2 turned(glm::dot(x, corner), glm::dot(y, corner));
            low = glm::min(low, turned);
            high = glm::max(high, turned);
        }
        const glm::dvec2 extent = high - low;
        const double area = extent.x * extent.y;
        // Only what is clearly smaller: the first, along an edge, keeps edges on texels.
        if (area < best * (1.0 - 1e-6)) {
            best = area;
            chosen = extent.x >= extent.y ? angle : angle + 0.5 * std::numbers::pi;
        }
    }
    const glm::dvec2 x(std::cos(chosen), std::sin(chosen)), y(-x.y, x.x);
    for (glm::dvec2& corner : chart.corners) corner = {glm::dot(x, corner), glm::dot(y, corner)};
    Chart::Projection& p = *chart.projection;
    const glm::dvec3 u = p.u * x.x + p.v * x.y, v = p.u * y.x + p.v * y.y;
    p.u = u;
    p.v = v;
}

std::vector<Chart> islandsOf(const ChartMesh& mesh, const Surface& surface) {
    const Neighbours neighbours(mesh, surface, surface.places(true));
    std::vector<std::uint8_t> taken(mesh.triangles.size(), 0);
    std::vector<Chart> charts;
    for (std::uint32_t seed = 0; seed < mesh.triangles.size(); ++seed) {
        if (taken[seed] || !surface.counts(seed)) continue;
        Chart chart;
        std::deque<std::uint32_t> open{seed};
        taken[seed] = 1;
        double area = 0.0, flatArea = 0.0;
        while (!open.empty()) {
            const std::uint32_t triangle = open.front();
            open.pop_front();
            chart.triangles.push_back(triangle);
            for (int k = 0; k < 3; ++k) chart.corners.push_back(mesh.texCoords[mesh.triangles[triangle][k]]);
            area += surface.areas[triangle];
            flatArea += areaOf(texCoordsOf(mesh, triangle));
            neighbours.visit(triangle, [&](std::uint32_t other) {
                if (!taken[other]) open.push_back(other);
                taken[other] = 1;
            });
        }
        const double scale = std::sqrt(area / flatArea);
        for (glm::dvec2& corner : chart.corners) corner *= scale;
        moveToOrigin(chart);
        charts.push_back(std::move(chart));
    }
    return charts;
}

std::vector<Chart> grownCharts(const ChartMesh& mesh, const Surface& surface) {
    const Neighbours neighbours(mesh, surface, surface.places(false));
    double sum = 0.0;
    std::size_t counted = 0;
    for (const double area : surface.areas) {
        sum += area;
        counted += area > 0.0 ? 1 : 0;
    }
    const double cell = counted > 0 ? 2.0 * std::sqrt(sum / static_cast<double>(counted)) : 1.0;
    std::vector<std::uint32_t> chartOf(mesh.triangles.size(), kNone);
    std::vector<Chart> charts;
    for (std::uint32_t seed = 0; seed < mesh.triangles.size(); ++seed) {
        if (chartOf[seed] != kNone || !surface.counts(seed)) continue;
        const auto number = static_cast<std::uint32_t>(charts.size());
        const glm::dvec3 normal = surface.normals[seed];
        Chart chart;
        const glm::dvec3 helper = std::abs(normal.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
        const glm::dvec3 u = glm::normalize(glm::cross(helper, normal));
        chart.projection = Chart::Projection{u, glm::cross(normal, u), glm::dvec2(0.0)};
        // Near the surface, so that far from the world's origin nothing cancels.
        const glm::dvec3 origin = surface.corner(seed, 0);
        const auto flatOf = [&](std::uint32_t triangle) {
            Flat flat;
            for (int k = 0; k < 3; ++k) {
                const glm::dvec3 p = surface.corner(triangle, k) - origin;
                flat[static_cast<std::size_t>(k)] = {glm::dot(chart.projection->u, p),
                                                     glm::dot(chart.projection->v, p)};
            }
            return flat;
        };
        Cover cover(cell);
        std::deque<std::uint32_t> open{seed};
        while (!open.empty()) {
            const std::uint32_t triangle = open.front();
            open.pop_front();
            if (chartOf[triangle] != kNone || glm::dot(surface.normals[triangle], normal) < kChartCosine) continue;
            const Flat flat = flatOf(triangle);
            if (cover.overlaps(flat)) continue;
            cover.add(flat);
            chartOf[triangle] = number;
            chart.triangles.push_back(triangle);
            chart.corners.insert(chart.corners.end(), flat.begin(), flat.end());
            neighbours.visit(triangle, [&](std::uint32_t other) {
                if (chartOf[other] == kNone) open.push_back(other);
            });
        }
        std::vector<glm::dvec2> longest;
        for (std::size_t i = 0; i < chart.triangles.size(); ++i)
            for (std::size_t side = 0; side < 3; ++side) {
                bool isBorder = true;
                neighbours.visitSide(chart.triangles[i], side,
                                     [&](std::uint32_t other) { isBorder = isBorder && chartOf[other] != number; });
                const glm::dvec2 edge = chart.corners[3 * i + (side + 1) % 3] - chart.corners[3 * i + side];
                if (isBorder && (longest.empty() || glm::dot(edge, edge) > glm::dot(longest[0], longest[0])))
                    longest = {edge};
            }
        turn(chart, longest);
        const glm::dvec2 low = moveToOrigin(chart);
        Chart::Projection& p = *chart.projection;
        p.origin = low + glm::dvec2(glm::dot(p.u, origin), glm::dot(p.v, origin));
        charts.push_back(std::move(chart));
    }
    return charts;
}

}  // namespace

bool areUnique(const ChartMesh& mesh) {
    if (mesh.texCoords.empty() || mesh.texCoords.size() != mesh.positions.size()) return false;
    const Surface surface(mesh);
    constexpr double kBeyond = 1e-4;  // exporters round
    double sum = 0.0;
    std::size_t counted = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (!surface.counts(i)) continue;
        const Flat flat = texCoordsOf(mesh, i);
        for (const glm::dvec2& corner : flat)
            if (!(corner.x >= -kBeyond && corner.x <= 1.0 + kBeyond && corner.y >= -kBeyond &&
                  corner.y <= 1.0 + kBeyond))
                return false;
        // Without an area all of the triangle would share a line of the atlas.
        if (!(areaOf(flat) > 1e-12)) return false;
        sum += areaOf(flat);
        ++counted;
    }
    if (counted == 0 || sum > 1.0 + 4.0 * kBeyond) return false;
    Cover cover(2.0 * std::sqrt(sum / static_cast<double>(counted)));
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (!surface.counts(i)) continue;
        const Flat flat = texCoordsOf(mesh, i);
        if (cover.overlaps(flat)) return false;
        cover.add(flat);
    }
    return true;
}

std::vector<Chart> chartsOf(const ChartMesh& mesh) {
    const Surface surface(mesh);
    return areUnique(mesh) ? islandsOf(mesh, surface) : grownCharts(mesh, surface);
}

}  // namespace umbriel
