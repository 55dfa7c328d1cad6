#include "client/trade/surface_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace umbriel {
namespace {

// A pixel's own extent, and half of the neighbour's, before two points count as two surfaces.
constexpr double kPixels = 1.5;

// How far apart two neighbouring pixels lie at the first one's depth, metres.
double footprint(const SurfacePoints& points, std::size_t a, std::size_t b) {
    const glm::dvec3 p(points.relative[a]), q(points.relative[b]);
    if (points.isOrthographic) {
        const glm::dvec3 apart = q - p;
        return glm::length(apart - points.forwardWorld * glm::dot(apart, points.forwardWorld));
    }
    const double depthA = points.depths[a], depthB = points.depths[b];
    if (!(depthA > 0.0 && depthB > 0.0)) return 0.0;
    return glm::length(q * (depthA / depthB) - p);
}

}  // namespace

Result<SurfacePoints> surfacePoints(const LayeredImage& picture, const View& view) {
    const FloatImage* depth = picture.floatLayer("depth");
    const FloatImage* position = picture.floatLayer("position");
    const FloatImage* normal = picture.floatLayer("normal");
    const UintImage* ids = picture.uintLayer("ids");
    if (!depth || !position || !normal || !ids)
        return failure("the servers sent no layers depth, position, normal and ids");
    SurfacePoints points;
    points.width = picture.width();
    points.height = picture.height();
    points.eyeWorld = view.eyeWorld;
    points.forwardWorld = -glm::transpose(view.viewFromWorld)[2];
    points.isOrthographic = view.orthographic;
    const std::size_t pixels = depth->pixelCount();
    points.relative.reserve(pixels);
    for (int y = 0; y < points.height; ++y)
        for (int x = 0; x < points.width; ++x) {
            const float* p = position->pixel(x, y);
            const float* n = normal->pixel(x, y);
            const std::uint32_t* id = ids->pixel(x, y);
            points.relative.emplace_back(p[0], p[1], p[2]);
            points.normals.emplace_back(n[0], n[1], n[2]);
            points.depths.push_back(depth->at(x, y, 0));
            points.nodes.push_back(id[0]);
            points.primitives.push_back(id[1]);
        }
    return points;
}

std::vector<std::uint8_t> silhouettes(const SurfacePoints& points) {
    std::vector<std::uint8_t> marked(points.size(), 0);
    for (int y = 0; y < points.height; ++y)
        for (int x = 0; x < points.width; ++x) {
            const std::size_t i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(points.width) + static_cast<std::size_t>(x);
            if (!points.covered(i)) continue;
            const glm::dvec3 p(points.relative[i]), n(points.normals[i]);
            for (int dy = -1; dy <= 1 && !marked[i]; ++dy)
                for (int dx = -1; dx <= 1; ++dx) {
                    if (dx == 0 && dy == 0) continue;
                    const int column = x + dx, row = y + dy;
                    if (column < 0 || row < 0 || column >= points.width || row >= points.height) {
                        marked[i] = 1;
                        break;
                    }
                    const std::size_t j = static_cast<std::size_t>(row) * static_cast<std::size_t>(points.width) +
                                          static_cast<std::size_t>(column);
                    if (!points.covered(j)) {
                        marked[i] = 1;
                        break;
                    }
                    const glm::dvec3 q(points.relative[j]), m(points.normals[j]);
                    const double apart = std::min(std::abs(glm::dot(n, q - p)), std::abs(glm::dot(m, p - q)));
                    if (apart > kPixels * footprint(points, i, j)) {
                        marked[i] = 1;
                        break;
                    }
                }
        }
    return marked;
}

std::vector<std::uint8_t> depthZones(const SurfacePoints& points, const std::vector<std::uint8_t>& marked) {
    float nearest = std::numeric_limits<float>::infinity(), farthest = 0.0f;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!marked[i]) continue;
        nearest = std::min(nearest, points.depths[i]);
        farthest = std::max(farthest, points.depths[i]);
    }
    std::vector<std::uint8_t> zones(points.size(), 255);
    // Perspective makes things smaller by the ratio of depths.
    const bool byRatio = !points.isOrthographic && nearest > 0.0f;
    const auto scaled = [&](float depth) {
        return byRatio ? std::log(static_cast<double>(depth)) : static_cast<double>(depth);
    };
    const double from = scaled(nearest), third = (scaled(farthest) - from) / 3.0;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (marked[i])
            zones[i] = static_cast<std::uint8_t>(
                third > 0.0 ? std::clamp(static_cast<int>((scaled(points.depths[i]) - from) / third), 0, 2) : 0);
    return zones;
}

namespace {

// Where a pixel's point lies in another picture, in pixels from the upper left corner; nothing where it is outside.
std::optional<glm::dvec2> placeIn(const SurfacePoints& to, const View& toView, const glm::dvec3& relative) {
    const glm::dvec4 clip = toView.clipFromView * glm::dvec4(toView.viewFromWorld * relative, 1.0);
    if (!(clip.w > 0.0)) return std::nullopt;
    const glm::dvec2 place((clip.x / clip.w * 0.5 + 0.5) * to.width, (0.5 - clip.y / clip.w * 0.5) * to.height);
    if (!(place.x >= 0.0 && place.y >= 0.0 && place.x < to.width && place.y < to.height)) return std::nullopt;
    return place;
}

// Whether pixel j shows the surface that the point lies on.
bool shows(const SurfacePoints& to, std::size_t j, std::uint32_t node, const glm::dvec3& relative) {
    if (to.nodes[j] != node) return false;
    const auto width = static_cast<std::size_t>(to.width);
    const std::size_t column = j % width;
    const std::size_t beside = column + 1 < width ? j + 1 : j - (column > 0 ? 1 : 0);
    if (!to.covered(beside)) return false;
    const double off = std::abs(glm::dot(glm::dvec3(to.normals[j]), relative - glm::dvec3(to.relative[j])));
    return off <= kPixels * footprint(to, j, beside);
}

}  // namespace

std::vector<std::uint32_t> matchSurfaces(const SurfacePoints& from, const SurfacePoints& to, const View& toView) {
    std::vector<std::uint32_t> matches(from.size(), kNoMatch);
    const glm::dvec3 apart = from.eyeWorld - to.eyeWorld;
    for (std::size_t i = 0; i < from.size(); ++i) {
        if (!from.covered(i)) continue;
        const glm::dvec3 relative = apart + glm::dvec3(from.relative[i]);
        const auto place = placeIn(to, toView, relative);
        if (!place) continue;
        const std::size_t j = static_cast<std::size_t>(place->y) * static_cast<std::size_t>(to.width) +
                              static_cast<std::size_t>(place->x);
        if (shows(to, j, from.nodes[i], relative)) matches[i] = static_cast<std::uint32_t>(j);
    }
    return matches;
}

std::vector<std::array<std::uint32_t, 4>> surfacesAround(const SurfacePoints& from, const SurfacePoints& to,
                                                         const View& toView) {
    std::vector<std::array<std::uint32_t, 4>> around(from.size(), {kNoMatch, kNoMatch, kNoMatch, kNoMatch});
    const glm::dvec3 apart = from.eyeWorld - to.eyeWorld;
    for (std::size_t i = 0; i < from.size(); ++i) {
        if (!from.covered(i)) continue;
        const glm::dvec3 relative = apart + glm::dvec3(from.relative[i]);
        const auto place = placeIn(to, toView, relative);
        if (!place) continue;
        const int column = static_cast<int>(place->x), row = static_cast<int>(place->y);
        // The neighbour on the side of the pixel that the place is on.
        const int beside = place->x - column < 0.5 ? -1 : 1, above = place->y - row < 0.5 ? -1 : 1;
        for (std::size_t k = 0; k < 4; ++k) {
            const int x = column + (k % 2 == 1 ? beside : 0), y = row + (k / 2 == 1 ? above : 0);
            if (x < 0 || y < 0 || x >= to.width || y >= to.height) continue;
            const auto j =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(to.width) + static_cast<std::size_t>(x);
            if (shows(to, j, from.nodes[i], relative)) around[i][k] = static_cast<std::uint32_t>(j);
            if (k == 0 && around[i][0] == kNoMatch) break;
        }
    }
    return around;
}

}  // namespace umbriel
