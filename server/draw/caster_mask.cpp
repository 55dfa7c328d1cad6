#include "server/draw/caster_mask.h"

#include "server/shadow/map_module.h"

#include <algorithm>
#include <cmath>

namespace umbriel {
namespace {

constexpr float kUnmarked = 2.0f;
// Depths come from float matrices on the GPU.
constexpr double kDepthMargin = 1e-5;

double crossOf(const glm::dvec2& o, const glm::dvec2& a, const glm::dvec2& b) {
    return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

// Andrew's monotone chain; counter-clockwise. Sorts the points.
void convexHull(std::vector<glm::dvec2>& points, std::vector<glm::dvec2>& hull) {
    std::sort(points.begin(), points.end(),
              [](const glm::dvec2& a, const glm::dvec2& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
    if (points.size() < 3) {
        hull = points;
        return;
    }
    hull.resize(points.size() * 2);
    std::size_t size = 0;
    for (const glm::dvec2& point : points) {
        while (size >= 2 && crossOf(hull[size - 2], hull[size - 1], point) <= 0.0) --size;
        hull[size++] = point;
    }
    const std::size_t lower = size + 1;
    for (std::size_t i = points.size() - 1; i-- > 0;) {
        while (size >= lower && crossOf(hull[size - 2], hull[size - 1], points[i]) <= 0.0) --size;
        hull[size++] = points[i];
    }
    hull.resize(size > 1 ? size - 1 : size);
}

std::array<glm::dvec3, 8> cornersRelative(const Box& box, const glm::dmat4& relativeFromObject) {
    std::array<glm::dvec3, 8> corners = box.corners();
    for (glm::dvec3& corner : corners) corner = glm::dvec3(relativeFromObject * glm::dvec4(corner, 1.0));
    return corners;
}

// The x range of a convex polygon between two heights; empty when first > second.
std::pair<double, double> rangeInBand(std::span<const glm::dvec2> hull, double bottom, double top) {
    std::pair<double, double> range{1e300, -1e300};
    const auto add = [&](double x) {
        range.first = std::min(range.first, x);
        range.second = std::max(range.second, x);
    };
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const glm::dvec2& a = hull[i];
        const glm::dvec2& b = hull[(i + 1) % hull.size()];
        if (a.y >= bottom && a.y <= top) add(a.x);
        for (const double y : {bottom, top})
            if ((a.y < y) != (b.y < y)) add(a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)));
    }
    return range;
}

}  // namespace

CasterMask::CasterMask(const ShadowFit& fit, const glm::dvec3& eyeWorld)
    : _clipFromRelative(fit.clipFromWorld * glm::translate(glm::dmat4(1.0), eyeWorld)),
      _mapSize(fit.mapSize),
      _casters(fit.casters),
      _isAnyDepth(fit.filter.maxTexels > 0.0f),
      _dilation(fit.mapSize > 0 ? lookupReach(fit) * kCells / fit.mapSize : 0.0),
      _farthest(fit.mapSize > 0 ? static_cast<std::size_t>(kCells) * kCells : 0, kUnmarked) {
    if (_mapSize == 0) return;
    _isAround = fit.shape == ShadowShape::Hemisphere;
    const glm::dmat3 acrossFromMap = umbriel::acrossFromMap(fit, fit.perspective ? fit.positionWorld : eyeWorld);
    _unwarp = {acrossFromMap[0][2], acrossFromMap[1][2], acrossFromMap[2][2]};
}

CasterMask::Footprint& CasterMask::footprintOf(std::span<const glm::dvec3> pointsRelative) const {
    Footprint& footprint = _footprint;
    footprint.points.clear();
    std::size_t behind = 0;
    footprint.nearest = -1e300;
    footprint.farthest = 1e300;
    footprint.points.reserve(pointsRelative.size());
    for (const glm::dvec3& point : pointsRelative) {
        const glm::dvec4 clip = _clipFromRelative * glm::dvec4(point, 1.0);
        if (!(clip.w > 1e-9)) {
            ++behind;
            continue;
        }
        const glm::dvec2 place = glm::dvec2(clip) / clip.w;
        const double depth = clip.z / clip.w / glm::dot(_unwarp, glm::dvec3(place, 1.0));
        footprint.nearest = std::max(footprint.nearest, depth);
        footprint.farthest = std::min(footprint.farthest, depth);
        footprint.points.push_back((place * 0.5 + 0.5) * double{kCells});
    }
    using Kind = Footprint::Kind;
    footprint.kind = behind == 0 ? Kind::Projected : behind == pointsRelative.size() ? Kind::Nothing : Kind::Everything;
    if (pointsRelative.empty()) footprint.kind = Kind::Nothing;
    return footprint;
}

// visit(y, from, to): cells of a row, both ends included; returns false to stop.
template <class Visit>
void CasterMask::visitRows(Footprint& footprint, double dilation, Visit&& visit) const {
    glm::dvec2 minimum(0.0);
    glm::dvec2 maximum(double{kCells});
    const bool everything = footprint.kind == Footprint::Kind::Everything;
    if (!everything) {
        minimum = glm::dvec2(1e300);
        maximum = glm::dvec2(-1e300);
        for (const glm::dvec2& point : footprint.points) {
            minimum = glm::min(minimum, point);
            maximum = glm::max(maximum, point);
        }
    }
    const auto cell = [](double place) {
        return static_cast<int>(std::clamp(std::floor(place), -1.0, double{kCells}));
    };
    const int left = std::max(cell(minimum.x - dilation), 0);
    const int right = std::min(cell(maximum.x + dilation), kCells - 1);
    const int bottom = std::max(cell(minimum.y - dilation), 0);
    const int top = std::min(cell(maximum.y + dilation), kCells - 1);
    // Of a few cells the hull leaves out less than finding it costs.
    const bool precise = !everything && right - left > 4 && top - bottom > 4;
    if (precise) convexHull(footprint.points, footprint.hull);
    for (int y = bottom; y <= top; ++y) {
        int from = left;
        int to = right;
        if (precise) {
            const auto [first, last] = rangeInBand(footprint.hull, y - dilation, y + 1 + dilation);
            if (first > last) continue;
            from = std::max(cell(first - dilation), left);
            to = std::min(cell(last + dilation), right);
        }
        if (from <= to && !visit(y, from, to)) return;
    }
}

void CasterMask::markEverything() {
    _isEverything = true;
    _marked = {0, 0, kCells, kCells};
    _farthest.clear();
    _farthest.shrink_to_fit();
}

bool CasterMask::covers(const CasterMask& other) const {
    if (_isEverything) return true;
    if (other._isEverything) return false;
    for (std::size_t i = 0; i < _farthest.size(); ++i)
        if (other._farthest[i] < kUnmarked && !(_farthest[i] <= other._farthest[i])) return false;
    return true;
}

void CasterMask::addReceiver(const Box& box, const glm::dmat4& relativeFromObject, const Frustum& frustum,
                             bool isInside) {
    if (box.empty() || _isEverything || _mapSize == 0) return;
    if (_isAround) return markEverything();
    Footprint& footprint = isInside ? footprintOf(cornersRelative(box, relativeFromObject))
                                    : footprintOf(hullOfIntersection(box, relativeFromObject, frustum));
    if (footprint.kind == Footprint::Kind::Nothing) return;
    const double farthest = footprint.kind == Footprint::Kind::Everything ? 0.0 : footprint.farthest;
    const auto depth = _isAnyDepth ? -1.0f : static_cast<float>(std::clamp(farthest - kDepthMargin, -1.0, 1.0));
    visitRows(footprint, _dilation, [&](int y, int from, int to) {
        float* row = _farthest.data() + static_cast<std::size_t>(y) * kCells;
        for (int x = from; x <= to; ++x) row[x] = std::min(row[x], depth);
        if (_marked.empty()) _marked = {from, y, 1, 1};
        const int right = std::max(_marked.x + _marked.width, to + 1);
        const int top = std::max(_marked.y + _marked.height, y + 1);
        _marked.x = std::min(_marked.x, from);
        _marked.y = std::min(_marked.y, y);
        _marked.width = right - _marked.x;
        _marked.height = top - _marked.y;
        return true;
    });
}

bool CasterMask::casts(const Box& box, const glm::dmat4& relativeFromObject) const {
    if (box.empty() || empty()) return false;
    if (_isEverything) return true;
    Footprint& footprint = footprintOf(cornersRelative(box, relativeFromObject));
    if (footprint.kind == Footprint::Kind::Nothing) return false;
    const double nearest = footprint.kind == Footprint::Kind::Everything ? 1.0 : footprint.nearest + kDepthMargin;
    bool found = false;
    visitRows(footprint, 0.0, [&](int y, int from, int to) {
        // Unmarked cells hold 2, but a caster before the near plane may have any depth.
        const float* row = _farthest.data() + static_cast<std::size_t>(y) * kCells;
        for (int x = from; x <= to && !found; ++x) found = row[x] < kUnmarked && static_cast<double>(row[x]) <= nearest;
        return !found;
    });
    return found;
}

PixelRect CasterMask::texels() const {
    if (empty()) return {};
    const auto low = [&](int cell) { return static_cast<std::int32_t>(std::int64_t{cell} * _mapSize / kCells); };
    const auto high = [&](int cell) {
        return static_cast<std::int32_t>((std::int64_t{cell} * _mapSize + kCells - 1) / kCells);
    };
    const std::int32_t x = low(_marked.x);
    const std::int32_t y = low(_marked.y);
    return {x, y, high(_marked.x + _marked.width) - x, high(_marked.y + _marked.height) - y};
}

}  // namespace umbriel
