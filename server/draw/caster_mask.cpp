#include "server/draw/caster_mask.h"

#include "server/shadow/map_module.h"

#include <algorithm>
#include <cmath>

namespace umbriel {
namespace {

constexpr float kUnmarked = 2.0f;
// Depths come from float matrices on the GPU.
constexpr double kDepthMargin = 1e-5;

// -1 and kCells: off the map.
int cellOf(double place) {
    return static_cast<int>(std::floor(std::clamp(place, -1.0, double{CasterMask::kCells})));
}

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

// Adds to the x ranges of rows what of an edge lies in each: row y is from y - dilation to y + 1 + dilation; ranges
// begins with row `bottom`.
void addEdge(std::span<std::pair<double, double>> ranges, int bottom, const glm::dvec2& a, const glm::dvec2& b,
             double dilation) {
    const glm::dvec2& low = a.y < b.y ? a : b;
    const glm::dvec2& high = a.y < b.y ? b : a;
    const double slope = high.y > low.y ? (high.x - low.x) / (high.y - low.y) : 0.0;
    const auto rows = static_cast<double>(ranges.size());
    const auto first = static_cast<std::size_t>(std::clamp(std::ceil(low.y - dilation - bottom - 1.0), 0.0, rows));
    const auto end = static_cast<std::size_t>(std::clamp(std::floor(high.y + dilation - bottom) + 1.0, 0.0, rows));
    for (std::size_t i = first; i < end; ++i) {
        const double from = bottom + static_cast<double>(i) - dilation;
        const double to = from + 1.0 + 2.0 * dilation;
        const double x0 = low.y >= from ? low.x : low.x + slope * (from - low.y);
        const double x1 = high.y <= to ? high.x : low.x + slope * (to - low.y);
        ranges[i].first = std::min({ranges[i].first, x0, x1});
        ranges[i].second = std::max({ranges[i].second, x0, x1});
    }
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
    _isParallel = fit.shape == ShadowShape::Single && !fit.perspective && !isWarped(fit);
}

CasterMask::Placed CasterMask::place(const glm::dmat4& relativeFromObject) const {
    Placed placed{relativeFromObject, glm::dmat4(1.0)};
    if (!_isParallel) return placed;
    const double w = _clipFromRelative[3][3];
    const double half = 0.5 * kCells;
    // Rows: cells across, cells up, depth.
    glm::dmat4 mapFromClip(0.0);
    mapFromClip[0][0] = mapFromClip[1][1] = half / w;
    mapFromClip[2][2] = 1.0 / (w * _unwarp.z);
    mapFromClip[3] = {half / w, half / w, 0.0, 1.0 / w};
    // Without the rounding of a constant w.
    glm::dmat4 clipFromRelative = _clipFromRelative;
    for (int i = 0; i < 3; ++i) clipFromRelative[i][3] = 0.0;
    placed.mapFromObject = mapFromClip * clipFromRelative * relativeFromObject;
    return placed;
}

CasterMask::Range CasterMask::rangeBetween(const glm::dvec2& minimum, const glm::dvec2& maximum) {
    const int left = cellOf(minimum.x);
    const int right = cellOf(maximum.x);
    const int bottom = cellOf(minimum.y);
    const int top = cellOf(maximum.y);
    return {.left = std::max(left, 0),
            .right = std::min(right, kCells - 1),
            .bottom = std::max(bottom, 0),
            .top = std::min(top, kCells - 1),
            .nearest = 1.0,
            .farthest = -1.0,
            .isWhole = left >= 0 && bottom >= 0 && right < kCells && top < kCells};
}

CasterMask::Range CasterMask::rangeOf(const Footprint& footprint, double dilation) {
    glm::dvec2 minimum(1e300);
    glm::dvec2 maximum(-1e300);
    for (const glm::dvec2& point : footprint.points) {
        minimum = glm::min(minimum, point);
        maximum = glm::max(maximum, point);
    }
    Range range = rangeBetween(minimum - dilation, maximum + dilation);
    range.nearest = footprint.nearest;
    range.farthest = footprint.farthest;
    return range;
}

CasterMask::Range CasterMask::rangeOf(const Box& box, const Placed& placed, double dilation) const {
    const glm::dmat4& map = placed.mapFromObject;
    const glm::dvec3 middle = box.centre();
    const glm::dvec3 half = glm::dvec3(box.maximum) - middle;
    const glm::dvec3 at(map * glm::dvec4(middle, 1.0));
    const glm::dvec3 around = glm::abs(glm::dvec3(map[0])) * half.x + glm::abs(glm::dvec3(map[1])) * half.y +
                              glm::abs(glm::dvec3(map[2])) * half.z;
    const glm::dvec2 reach = glm::dvec2(around) + dilation;
    Range range = rangeBetween(glm::dvec2(at) - reach, glm::dvec2(at) + reach);
    range.nearest = at.z + around.z;
    range.farthest = at.z - around.z;
    return range;
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
    const bool everything = footprint.kind == Footprint::Kind::Everything;
    const Range range =
        everything ? rangeBetween(glm::dvec2(0.0), glm::dvec2(double{kCells})) : rangeOf(footprint, dilation);
    const bool precise = !everything && !range.isFew();
    if (precise) {
        convexHull(footprint.points, footprint.hull);
        footprint.ranges.assign(static_cast<std::size_t>(range.top - range.bottom + 1), {1e300, -1e300});
        for (std::size_t i = 0; i < footprint.hull.size(); ++i)
            addEdge(footprint.ranges, range.bottom, footprint.hull[i], footprint.hull[(i + 1) % footprint.hull.size()],
                    dilation);
    }
    for (int y = range.bottom; y <= range.top; ++y) {
        int from = range.left;
        int to = range.right;
        if (precise) {
            const auto [first, last] = footprint.ranges[static_cast<std::size_t>(y - range.bottom)];
            if (first > last) continue;
            from = std::max(cellOf(first - dilation), range.left);
            to = std::min(cellOf(last + dilation), range.right);
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

void CasterMask::mark(int y, int from, int to, float depth) {
    float* row = _farthest.data() + static_cast<std::size_t>(y) * kCells;
    for (int x = from; x <= to; ++x) row[x] = std::min(row[x], depth);
    if (_marked.empty()) _marked = {from, y, 1, 1};
    const int right = std::max(_marked.x + _marked.width, to + 1);
    const int top = std::max(_marked.y + _marked.height, y + 1);
    _marked.x = std::min(_marked.x, from);
    _marked.y = std::min(_marked.y, y);
    _marked.width = right - _marked.x;
    _marked.height = top - _marked.y;
}

void CasterMask::addFootprint(Footprint& footprint) {
    if (footprint.kind == Footprint::Kind::Nothing) return;
    const double farthest = footprint.kind == Footprint::Kind::Everything ? 0.0 : footprint.farthest;
    const float depth = depthBehind(farthest);
    visitRows(footprint, _dilation, [&](int y, int from, int to) {
        mark(y, from, to, depth);
        return true;
    });
}

float CasterMask::depthBehind(double farthest) const {
    return _isAnyDepth ? -1.0f : static_cast<float>(std::clamp(farthest - kDepthMargin, -1.0, 1.0));
}

void CasterMask::addReceiver(const Box& box, const Placed& placed) {
    if (box.empty() || _isEverything || _mapSize == 0) return;
    if (_isAround) return markEverything();
    if (_isParallel) {
        const Range range = rangeOf(box, placed, _dilation);
        if (range.isFew()) {
            const float depth = depthBehind(range.farthest);
            for (int y = range.bottom; y <= range.top && range.left <= range.right; ++y)
                mark(y, range.left, range.right, depth);
            return;
        }
    }
    addFootprint(footprintOf(cornersRelative(box, placed.relativeFromObject)));
}

void CasterMask::addReceiver(std::span<const glm::dvec3> pointsRelative) {
    if (_isEverything || _mapSize == 0) return;
    if (_isAround) return markEverything();
    addFootprint(footprintOf(pointsRelative));
}

void CasterMask::addReceiver(const Box& box, const glm::dmat4& relativeFromObject, const Frustum& frustum,
                             bool isInside) {
    if (box.empty()) return;
    if (isInside) return addReceiver(box, place(relativeFromObject));
    std::vector<glm::dvec3> points;
    hullOfIntersection(box, relativeFromObject, frustum, points);
    addReceiver(points);
}

CasterMask::Casting CasterMask::castingWithin(const Box& box, const Placed& placed) const {
    if (box.empty() || empty()) return Casting::False;
    if (_isEverything) return Casting::True;
    if (!_isParallel && footprintOf(cornersRelative(box, placed.relativeFromObject)).kind != Footprint::Kind::Projected)
        return _footprint.kind == Footprint::Kind::Nothing ? Casting::False : Casting::Unknown;
    const Range range = _isParallel ? rangeOf(box, placed, 0.0) : rangeOf(_footprint, 0.0);
    bool anyMet = false;
    bool allMet = range.isWhole;
    for (int y = range.bottom; y <= range.top; ++y) {
        const float* row = _farthest.data() + static_cast<std::size_t>(y) * kCells;
        for (int x = range.left; x <= range.right; ++x) {
            const bool isMarked = row[x] < kUnmarked;
            const auto depth = static_cast<double>(row[x]);
            anyMet |= isMarked && depth <= range.nearest + kDepthMargin;
            allMet &= isMarked && depth <= range.farthest + kDepthMargin;
            if (anyMet && !allMet) return Casting::Unknown;
        }
    }
    return anyMet ? Casting::True : Casting::False;
}

bool CasterMask::casts(const Box& box, const Placed& placed) const {
    if (box.empty() || empty()) return false;
    if (_isEverything) return true;
    // Unmarked cells hold 2, but a caster before the near plane may have any depth.
    const auto isMet = [&](int y, int from, int to, double nearest) {
        const float* row = _farthest.data() + static_cast<std::size_t>(y) * kCells;
        for (int x = from; x <= to; ++x)
            if (row[x] < kUnmarked && static_cast<double>(row[x]) <= nearest) return true;
        return false;
    };
    if (_isParallel) {
        const Range range = rangeOf(box, placed, 0.0);
        bool isFound = false;
        for (int y = range.bottom; y <= range.top && !isFound; ++y)
            isFound = isMet(y, range.left, range.right, range.nearest + kDepthMargin);
        if (!isFound || range.isFew()) return isFound;
    }
    Footprint& footprint = footprintOf(cornersRelative(box, placed.relativeFromObject));
    if (footprint.kind == Footprint::Kind::Nothing) return false;
    const double nearest = footprint.kind == Footprint::Kind::Everything ? 1.0 : footprint.nearest + kDepthMargin;
    // Mostly a corner says it, and no hull is needed.
    bool found = std::any_of(footprint.points.begin(), footprint.points.end(), [&](const glm::dvec2& corner) {
        const int x = cellOf(corner.x);
        const int y = cellOf(corner.y);
        return footprint.kind == Footprint::Kind::Projected && x >= 0 && y >= 0 && x < kCells && y < kCells &&
               isMet(y, x, x, nearest);
    });
    if (found) return true;
    visitRows(footprint, 0.0, [&](int y, int from, int to) {
        found = isMet(y, from, to, nearest);
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
