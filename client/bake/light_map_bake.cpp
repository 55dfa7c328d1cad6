#include "client/bake/light_map_bake.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "common/base/assert.h"
#include "common/math/disc_sampling.h"
#include "common/math/pixel_rect.h"
#include "common/scene/light_map.h"

namespace umbriel {
namespace {

using Ray = trace::OcclusionScene::Ray;

constexpr std::uint32_t kNone = 0xffffffffu;
// In texels: 24 bits of mantissa over 32768 texels, and weights of 8 bits.
constexpr double kLookupMargin = 1.0 / 256.0;
// Of texels: holds a surface, or what was filled in beside one; is to be filled in next.
constexpr std::uint8_t kCovered = 1, kOfRing = 2;
// Texel rows that are worked on as one piece.
constexpr std::uint32_t kBandRows = 8;

struct Placed {
    std::uint32_t surface = 0;
    Chart chart;
    ChartSpot spot;
};

struct Band {
    std::uint32_t chart = 0;
    std::uint32_t row = 0;  // of the chart's texels
    std::uint32_t rows = 0;
};

class LightMapBaker {
 public:
    LightMapBaker(std::span<const LightMapSurface> surfaces, std::span<const LightMapLight> lights,
                  const trace::OcclusionScene& rays, const LightMapOptions& options, LightMapDrawer* drawer)
        : _surfaces(surfaces), _lights(lights), _rays(rays), _options(options), _drawer(drawer) {}

    Result<BakedLightMap> bake() {
        for (std::uint32_t i = 0; i < _surfaces.size(); ++i)
            for (Chart& chart : chartsOf(_surfaces[i].mesh)) _charts.push_back({i, std::move(chart), {}});
        std::vector<glm::dvec2> extents;
        for (const Placed& placed : _charts) extents.push_back(placed.chart.extent);
        const auto spots = layOut(extents, _options.size);
        if (!spots) return spots.error();
        for (std::size_t i = 0; i < _charts.size(); ++i) _charts[i].spot = (*spots)[i];
        _baked.size = _options.size;
        _baked.chartCount = static_cast<std::uint32_t>(_charts.size());
        _baked.texels.assign(texelsOf() * _lights.size(), 255);
        _covered.assign(texelsOf(), 0);
        describe();
        if (!_drawer) {
            trace();
        } else if (const auto drawn = draw(); !drawn) {
            return drawn.error();
        }
        std::atomic<std::size_t> next = 0;
        inThreads([&](bool) {
            for (std::size_t i = next++; i < _charts.size(); i = next++) fillUncovered(_charts[i]);
        });
        return std::move(_baked);
    }

 private:
    std::size_t texelsOf() const { return std::size_t{_options.size} * _options.size; }
    std::size_t texel(std::uint32_t x, std::uint32_t y) const { return std::size_t{y} * _options.size + x; }

    // Where surfaces lie in the atlas, for those who look up.
    void describe() {
        std::vector<std::vector<std::uint32_t>> places;
        for (const LightMapSurface& surface : _surfaces) {
            _baked.triangles.push_back(static_cast<std::uint32_t>(surface.mesh.triangles.size()));
            places.emplace_back(surface.mesh.triangles.size(), LightMap::kNoChart);
        }
        double largest = -1.0;
        for (const Placed& placed : _charts) {
            const ChartSpot& spot = placed.spot;
            if (const double area = placed.chart.extent.x * placed.chart.extent.y; area > largest) {
                largest = area;
                const double densest = std::max(spot.scale.x, spot.scale.y);
                _baked.texelMetres = densest > 0.0 ? 1.0 / densest : 0.0;
            }
            // Between the middles of the outermost texels, where those of other charts have no weight: what lies nearer
            // to the border takes the border's texel, as if that were repeated beyond it. The margin covers rounding of
            // texture coordinates.
            const auto margin = [](std::uint32_t texels) { return texels > 1 ? 0.5 + kLookupMargin : 0.5; };
            const double dx = margin(spot.width), dy = margin(spot.height);
            const glm::dvec4 range(spot.x + dx, spot.y + dy, spot.x + spot.width - dx, spot.y + spot.height - dy);
            const auto add = [&](const glm::dvec4& u, const glm::dvec4& v) {
                const auto number = static_cast<std::uint32_t>(_baked.charts.size() / 3);
                for (const glm::dvec4& row : {u, v, range}) _baked.charts.push_back(glm::vec4(row));
                return number;
            };
            if (placed.chart.projection) {
                const std::uint32_t number = addProjection(placed, add);
                for (const std::uint32_t triangle : placed.chart.triangles) places[placed.surface][triangle] = number;
                continue;
            }
            for (std::size_t i = 0; i < placed.chart.triangles.size(); ++i)
                places[placed.surface][placed.chart.triangles[i]] = addTriangle(placed, i, add);
        }
        for (const std::vector<std::uint32_t>& of : places)
            _baked.places.insert(_baked.places.end(), of.begin(), of.end());
    }
    // texel = at + scale * ((axis . worldFromObject p) - origin)
    template <class Add>
    std::uint32_t addProjection(const Placed& placed, const Add& add) const {
        const Chart::Projection& projection = *placed.chart.projection;
        const Affine& world = _surfaces[placed.surface].worldFromObject;
        const auto row = [&](const glm::dvec3& axis, int k) {
            const glm::dvec3 gradient = glm::transpose(world.linear) * axis;
            const double offset = glm::dot(axis, world.translation) - projection.origin[k];
            return placed.spot.at[k] * glm::dvec4(0, 0, 0, 1) + placed.spot.scale[k] * glm::dvec4(gradient, offset);
        };
        return add(row(projection.u, 0), row(projection.v, 1));
    }
    // The affine function that takes the corners where they lie, and does not change across the triangle.
    template <class Add>
    std::uint32_t addTriangle(const Placed& placed, std::size_t i, const Add& add) const {
        const LightMapSurface& surface = _surfaces[placed.surface];
        const glm::uvec3 t = surface.mesh.triangles[placed.chart.triangles[i]];
        const glm::dvec3 a = surface.objectPositions[t.x];
        const glm::dvec3 e1 = surface.objectPositions[t.y] - a, e2 = surface.objectPositions[t.z] - a;
        const glm::dvec3 n = glm::cross(e1, e2);
        const double square = glm::dot(n, n);
        const auto row = [&](int k) {
            const double at = placed.spot.at[k] + placed.spot.scale[k] * placed.chart.corners[3 * i][k];
            const double d1 =
                placed.spot.scale[k] * (placed.chart.corners[3 * i + 1][k] - placed.chart.corners[3 * i][k]);
            const double d2 =
                placed.spot.scale[k] * (placed.chart.corners[3 * i + 2][k] - placed.chart.corners[3 * i][k]);
            const glm::dvec3 gradient =
                square > 0.0 ? (d1 * glm::cross(e2, n) + d2 * glm::cross(n, e1)) / square : glm::dvec3(0.0);
            return glm::dvec4(gradient, at - glm::dot(gradient, a));
        };
        return add(row(0), row(1));
    }

    void trace() {
        std::vector<Band> bands;
        for (std::uint32_t i = 0; i < _charts.size(); ++i)
            for (std::uint32_t row = 0; row < _charts[i].spot.height; row += kBandRows)
                bands.push_back({i, row, std::min(kBandRows, _charts[i].spot.height - row)});
        const std::uint64_t all = bands.size();
        std::atomic<std::size_t> next = 0;
        std::atomic<std::uint64_t> done = 0, rays = 0, covered = 0;
        const auto work = [&](bool reports) {
            for (std::size_t i = next++; i < bands.size(); i = next++) {
                Counts counts;
                traceBand(bands[i], counts);
                rays += counts.rays;
                covered += counts.covered;
                ++done;
                if (reports && _options.progress) _options.progress(done, all);
            }
        };
        inThreads(work);
        _baked.rays = rays;
        _baked.covered = covered;
        if (_options.progress) _options.progress(all, all);
    }

    Result<void> draw() {
        std::vector<std::vector<glm::dvec2>> corners;
        for (const LightMapSurface& surface : _surfaces)
            corners.emplace_back(3 * surface.mesh.triangles.size(), glm::dvec2(0.0));
        for (const Placed& placed : _charts)
            for (std::size_t i = 0; i < placed.chart.triangles.size(); ++i)
                for (std::size_t k = 0; k < 3; ++k)
                    corners[placed.surface][3 * placed.chart.triangles[i] + k] =
                        placed.spot.at + placed.spot.scale * placed.chart.corners[3 * i + k];
        if (auto unwrapped = _drawer->unwrap(std::move(corners), _options.size); !unwrapped) return unwrapped;
        const auto samples = static_cast<std::uint32_t>(_options.samples);
        const std::uint32_t side = std::min(_options.size, kDrawnPoints / samples);
        const std::uint32_t columns = (_options.size + side - 1) / side;
        const std::uint64_t all = std::uint64_t{columns} * columns;
        for (std::uint64_t done = 0; done < all; ++done) {
            const auto x = static_cast<std::uint32_t>(done % columns) * side;
            const auto y = static_cast<std::uint32_t>(done / columns) * side;
            if (std::any_of(_charts.begin(), _charts.end(),
                            [&](const Placed& placed) { return !within(placed.spot, x, y, side).empty(); })) {
                const auto factors = _drawer->lookUp(x, y, side, _options.samples);
                if (!factors) return factors.error();
                UMBRIEL_ASSERT(factors->size() == _lights.size(), "factors of every light");
                for (const Placed& placed : _charts) take(placed, *factors, x, y, side);
            }
            if (_options.progress) _options.progress(done + 1, all);
        }
        return {};
    }
    // What of a chart lies in a square of the atlas.
    static PixelRect within(const ChartSpot& spot, std::uint32_t x, std::uint32_t y, std::uint32_t side) {
        const auto rect = [](std::uint32_t left, std::uint32_t bottom, std::uint32_t width, std::uint32_t height) {
            return PixelRect{static_cast<std::int32_t>(left), static_cast<std::int32_t>(bottom),
                             static_cast<std::int32_t>(width), static_cast<std::int32_t>(height)};
        };
        return intersect(rect(spot.x, spot.y, spot.width, spot.height), rect(x, y, side, side));
    }
    // The means of a chart's texels in a square that was drawn.
    void take(const Placed& placed, const std::vector<std::vector<float>>& factors, std::uint32_t left,
              std::uint32_t bottom, std::uint32_t side) {
        const auto samples = static_cast<std::size_t>(_options.samples);
        const std::size_t width = side * samples;
        const PixelRect part = within(placed.spot, left, bottom, side);
        for (auto y = static_cast<std::uint32_t>(part.y); y < static_cast<std::uint32_t>(part.y + part.height); ++y)
            for (auto x = static_cast<std::uint32_t>(part.x); x < static_cast<std::uint32_t>(part.x + part.width); ++x)
                for (std::size_t light = 0; light < _lights.size(); ++light) {
                    double sum = 0.0;
                    int points = 0;
                    for (std::size_t k = 0; k < samples * samples; ++k) {
                        const float factor = factors[light][((y - bottom) * samples + k / samples) * width +
                                                            (x - left) * samples + k % samples];
                        if (!(factor >= 0.0f)) continue;
                        sum += static_cast<double>(factor);
                        ++points;
                    }
                    if (points == 0) break;  // of every light
                    const bool isLit = _surfaces[placed.surface].lit[light] != 0;
                    _baked.texels[light * texelsOf() + texel(x, y)] =
                        isLit ? toByte(std::min(sum / points, 1.0)) : std::uint8_t{255};
                    if (light > 0) continue;
                    _covered[texel(x, y)] = kCovered;
                    ++_baked.covered;
                    _baked.lookups += static_cast<std::uint64_t>(points);
                }
    }
    template <class Work>
    void inThreads(const Work& work) const {
        const int count = _options.threads > 0 ? _options.threads
                                               : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
        std::vector<std::thread> others;
        for (int i = 1; i < count; ++i) others.emplace_back(work, false);
        work(true);
        for (std::thread& other : others) other.join();
    }

    struct Counts {
        std::uint64_t rays = 0, covered = 0;
    };
    // Which of the chart's triangles lies at each sample of the band, in texels relative to the chart; the first one.
    std::vector<std::uint32_t> ownersOf(const Placed& placed, const Band& band) const {
        const int s = _options.samples;
        const std::int64_t columns = std::int64_t{placed.spot.width} * s, rows = std::int64_t{band.rows} * s;
        std::vector<std::uint32_t> owners(static_cast<std::size_t>(columns * rows), kNone);
        for (std::uint32_t i = 0; i < placed.chart.triangles.size(); ++i) {
            glm::dvec2 c[3];
            for (int k = 0; k < 3; ++k)
                c[k] = (cornerAt(placed, i, k) - glm::dvec2(0.0, band.row)) * double(s) - 0.5;  // in samples
            const glm::dvec2 low = glm::min(c[0], glm::min(c[1], c[2])), high = glm::max(c[0], glm::max(c[1], c[2]));
            const auto from = [](double v) {
                return std::max<std::int64_t>(0, static_cast<std::int64_t>(std::ceil(v - 1e-9)));
            };
            const std::int64_t x1 = std::min(columns - 1, static_cast<std::int64_t>(std::floor(high.x + 1e-9)));
            const std::int64_t y1 = std::min(rows - 1, static_cast<std::int64_t>(std::floor(high.y + 1e-9)));
            for (std::int64_t y = from(low.y); y <= y1; ++y)
                for (std::int64_t x = from(low.x); x <= x1; ++x) {
                    std::uint32_t& owner = owners[static_cast<std::size_t>(y * columns + x)];
                    if (owner == kNone && isInside(c, glm::dvec2(x, y))) owner = i;
                }
        }
        return owners;
    }
    static bool isInside(const glm::dvec2 (&c)[3], const glm::dvec2& p) {
        int negative = 0, positive = 0;
        for (int k = 0; k < 3; ++k) {
            const glm::dvec2 edge = c[(k + 1) % 3] - c[k], to = p - c[k];
            const double side = edge.x * to.y - edge.y * to.x;
            negative += side < 0.0 ? 1 : 0;
            positive += side > 0.0 ? 1 : 0;
        }
        return negative == 0 || positive == 0;
    }
    // In texels relative to the chart's own.
    static glm::dvec2 cornerAt(const Placed& placed, std::size_t i, int k) {
        return placed.spot.at - glm::dvec2(placed.spot.x, placed.spot.y) +
               placed.spot.scale * placed.chart.corners[3 * i + static_cast<std::size_t>(k)];
    }
    // The point of a triangle that lies at a place of the chart.
    glm::dvec3 worldAt(const Placed& placed, std::uint32_t i, const glm::dvec2& place) const {
        const ChartMesh& mesh = _surfaces[placed.surface].mesh;
        const glm::uvec3 t = mesh.triangles[placed.chart.triangles[i]];
        const glm::dvec2 a = cornerAt(placed, i, 0);
        const glm::dvec2 e1 = cornerAt(placed, i, 1) - a, e2 = cornerAt(placed, i, 2) - a, p = place - a;
        const double area = e1.x * e2.y - e1.y * e2.x;
        // Within the triangle, where rounding left it.
        double u = area != 0.0 ? std::clamp((p.x * e2.y - p.y * e2.x) / area, 0.0, 1.0) : 1.0 / 3.0;
        double v = area != 0.0 ? std::clamp((e1.x * p.y - e1.y * p.x) / area, 0.0, 1.0) : 1.0 / 3.0;
        if (u + v > 1.0) {
            const double sum = u + v;
            u /= sum;
            v /= sum;
        }
        return mesh.positions[t.x] + u * (mesh.positions[t.y] - mesh.positions[t.x]) +
               v * (mesh.positions[t.z] - mesh.positions[t.x]);
    }

    void traceBand(const Band& band, Counts& counts) {
        const Placed& placed = _charts[band.chart];
        const LightMapSurface& surface = _surfaces[placed.surface];
        const int s = _options.samples;
        const std::vector<std::uint32_t> owners = ownersOf(placed, band);
        std::vector<double> sums(_lights.size());
        for (std::uint32_t y = 0; y < band.rows; ++y)
            for (std::uint32_t x = 0; x < placed.spot.width; ++x) {
                std::fill(sums.begin(), sums.end(), 0.0);
                const std::size_t at = texel(placed.spot.x + x, placed.spot.y + band.row + y);
                int points = 0;
                for (int k = 0; k < s * s; ++k) {
                    const std::size_t column =
                        std::size_t{x} * static_cast<std::size_t>(s) + static_cast<std::size_t>(k % s);
                    const std::size_t row =
                        std::size_t{y} * static_cast<std::size_t>(s) + static_cast<std::size_t>(k / s);
                    const std::uint32_t owner = owners[row * placed.spot.width * static_cast<std::size_t>(s) + column];
                    if (owner == kNone) continue;
                    ++points;
                    const glm::dvec2 place((static_cast<double>(column) + 0.5) / s,
                                           band.row + (static_cast<double>(row) + 0.5) / s);
                    addPoint(surface, placed.chart.triangles[owner], worldAt(placed, owner, place), at,
                             static_cast<std::uint64_t>(k), sums, counts);
                }
                if (points == 0) continue;
                _covered[at] = kCovered;
                ++counts.covered;
                for (std::size_t light = 0; light < _lights.size(); ++light)
                    _baked.texels[light * texelsOf() + at] = toByte(sums[light] / points);
            }
    }
    static std::uint8_t toByte(double share) { return static_cast<std::uint8_t>(share * 255.0 + 0.5); }

    // Adds the share of each light that arrives at a point.
    void addPoint(const LightMapSurface& surface, std::uint32_t triangle, const glm::dvec3& point, std::uint64_t texel,
                  std::uint64_t sample, std::vector<double>& sums, Counts& counts) const {
        const std::uint32_t own = surface.rayTriangles[triangle];
        for (std::size_t i = 0; i < _lights.size(); ++i) {
            const LightMapLight& light = _lights[i];
            const Ray middle = light.isDirectional ? Ray{-light.directionWorld} : Ray{light.positionWorld - point, 1.0};
            if (!surface.lit[i] || !(glm::length(middle.direction) > 0.0)) {
                sums[i] += 1.0;
                continue;
            }
            if (!(light.radius > 0.0)) {
                sums[i] += _rays.blocked(point, own, middle) ? 0.0 : 1.0;
                ++counts.rays;
                continue;
            }
            const int side = _options.lightSamples;
            const AxesAcross axes = axesAcross(middle.direction);
            const double radius = light.isDirectional ? std::tan(light.radius) : light.radius;
            const auto strata = static_cast<std::size_t>(side * side);
            std::vector<Ray> rays(strata);
            std::vector<std::uint8_t> blocked(strata);
            for (std::size_t k = 0; k < strata; ++k) {
                const std::uint64_t number = (sample * strata + k) * 2;
                const double u = (static_cast<double>(k) - side * std::floor(static_cast<double>(k) / side) +
                                  hashedUnit(texel, number)) /
                                 side;
                const double v = (std::floor(static_cast<double>(k) / side) + hashedUnit(texel, number + 1)) / side;
                const glm::dvec2 at = radius * discFromSquare(u, v);
                rays[k] = {middle.direction + axes.u * at.x + axes.v * at.y, middle.farDistance};
            }
            _rays.blocked(point, own, rays, blocked);
            counts.rays += strata;
            sums[i] +=
                1.0 - static_cast<double>(std::count(blocked.begin(), blocked.end(), 1)) / static_cast<double>(strata);
        }
    }

    // Texels without a surface, outwards from those with one.
    void fillUncovered(const Placed& placed) {
        const ChartSpot& spot = placed.spot;
        const auto visit = [&](std::size_t at, const auto& each) {
            const std::size_t x = at % _options.size, y = at / _options.size;
            for (std::size_t j = std::max<std::size_t>(y, spot.y + 1) - 1; j <= y + 1 && j < spot.y + spot.height; ++j)
                for (std::size_t i = std::max<std::size_t>(x, spot.x + 1) - 1; i <= x + 1 && i < spot.x + spot.width;
                     ++i)
                    each(j * _options.size + i);
        };
        // Texels without one beside those with one: the others' neighbours need not be remembered, which are many.
        std::vector<std::size_t> ring;
        bool isCovered = false;
        for (std::uint32_t y = 0; y < spot.height; ++y)
            for (std::uint32_t x = 0; x < spot.width; ++x) {
                const std::size_t at = texel(spot.x + x, spot.y + y);
                if (_covered[at] == kCovered) {
                    isCovered = true;
                    continue;
                }
                bool isBeside = false;
                visit(at, [&](std::size_t other) { isBeside = isBeside || _covered[other] == kCovered; });
                if (!isBeside) continue;
                _covered[at] = kOfRing;
                ring.push_back(at);
            }
        if (!isCovered) return fillFromCentres(placed);
        while (!ring.empty()) {
            for (const std::size_t at : ring)
                for (std::size_t light = 0; light < _lights.size(); ++light) {
                    int sum = 0, count = 0;
                    visit(at, [&](std::size_t other) {
                        if (_covered[other] != kCovered) return;
                        sum += _baked.texels[light * texelsOf() + other];
                        ++count;
                    });
                    _baked.texels[light * texelsOf() + at] = static_cast<std::uint8_t>((sum + count / 2) / count);
                }
            std::vector<std::size_t> next;
            for (const std::size_t at : ring) _covered[at] = kCovered;
            for (const std::size_t at : ring)
                visit(at, [&](std::size_t other) {
                    if (_covered[other]) return;
                    _covered[other] = kOfRing;
                    next.push_back(other);
                });
            ring = std::move(next);
        }
    }
    // A chart so thin that no sample lies on it has one factor: that of its triangles' middles.
    void fillFromCentres(const Placed& placed) {
        constexpr std::size_t kMostPoints = 64;
        const std::size_t count = placed.chart.triangles.size();
        const std::size_t step = std::max<std::size_t>(1, count / kMostPoints);
        std::vector<double> sums(_lights.size(), 0.0);
        Counts counts;
        double points = 0.0;
        for (std::size_t i = 0; i < count; i += step) {
            const ChartMesh& mesh = _surfaces[placed.surface].mesh;
            const glm::uvec3 t = mesh.triangles[placed.chart.triangles[i]];
            const glm::dvec3 middle = (mesh.positions[t.x] + mesh.positions[t.y] + mesh.positions[t.z]) / 3.0;
            addPoint(_surfaces[placed.surface], placed.chart.triangles[i], middle, texel(placed.spot.x, placed.spot.y),
                     i, sums, counts);
            points += 1.0;
        }
        for (std::size_t light = 0; light < _lights.size(); ++light)
            for (std::uint32_t y = 0; y < placed.spot.height; ++y)
                for (std::uint32_t x = 0; x < placed.spot.width; ++x)
                    _baked.texels[light * texelsOf() + texel(placed.spot.x + x, placed.spot.y + y)] =
                        toByte(sums[light] / points);
    }

    std::span<const LightMapSurface> _surfaces;
    std::span<const LightMapLight> _lights;
    const trace::OcclusionScene& _rays;
    LightMapOptions _options;
    LightMapDrawer* _drawer;  // null: rays
    std::vector<Placed> _charts;
    std::vector<std::uint8_t> _covered;  // 0: no surface, and none beside it was found yet; kCovered, kOfRing
    BakedLightMap _baked;
};

}  // namespace

Result<BakedLightMap> bakeLightMap(std::span<const LightMapSurface> surfaces, std::span<const LightMapLight> lights,
                                   const trace::OcclusionScene& rays, const LightMapOptions& options,
                                   LightMapDrawer* drawer) {
    UMBRIEL_ASSERT(
        options.samples >= 1 && options.samples <= 16 && options.lightSamples >= 1 && options.lightSamples <= 16,
        "samples of a light map");
    return LightMapBaker(surfaces, lights, rays, options, drawer).bake();
}

}  // namespace umbriel
