// What a setting's picture is worth: TradeBench::measure() and what it needs.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/app/trade_bench.h"
#include "client/session/shadow_fit.h"
#include "client/session/views.h"
#include "client/trade/map_texels.h"

namespace umbriel {
namespace {

// A surface lies on a plane within this share of its distance: float positions, as in shaders/stage/planar.frag.glsl.
constexpr double kOnPlane = 1e-4;

// Several pictures as one, with a row between them that is not judged.
struct Stacked {
    int width = 0, height = 0;
    std::vector<float> truth, result;
    std::vector<std::uint8_t> judged;

    void add(int w, int h, std::span<const float> t, std::span<const float> r, std::span<const std::uint8_t> j) {
        if (height > 0) {
            ++height;
            truth.resize(truth.size() + static_cast<std::size_t>(width), 1.0f);
            result.resize(truth.size(), 1.0f);
            judged.resize(truth.size(), 0);
        }
        width = w;
        height += h;
        truth.insert(truth.end(), t.begin(), t.end());
        result.insert(result.end(), r.begin(), r.end());
        judged.insert(judged.end(), j.begin(), j.end());
    }
    ShadowFactors factors() const { return {width, height, truth, result, judged}; }
    // Of the dark pixels the share that is lit.
    std::optional<double> missing() const {
        std::size_t dark = 0, lit = 0;
        for (std::size_t i = 0; i < truth.size(); ++i) {
            if (!judged[i] || truth[i] >= 0.5f) continue;
            ++dark;
            lit += result[i] >= 0.5f ? 1 : 0;
        }
        if (dark == 0) return std::nullopt;
        return static_cast<double>(lit) / static_cast<double>(dark);
    }
};

// Of the sizes that are there.
std::optional<double> medianSize(std::vector<float> sizes) {
    std::erase(sizes, 0.0f);
    if (sizes.empty()) return std::nullopt;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return static_cast<double>(*middle);
}

std::span<const ShadowFit> fitsOf(const std::vector<View>& views, Eye eye, ContainerId light) {
    const auto view = std::find_if(views.begin(), views.end(), [&](const View& v) { return v.eye == eye; });
    if (view == views.end()) return {};
    const auto isOfLight = [&](const ShadowFit& fit) { return fit.light == light; };
    const auto first = std::find_if(view->fits.begin(), view->fits.end(), isOfLight);
    return {first, std::find_if_not(first, view->fits.end(), isOfLight)};
}

std::int64_t distinct(std::vector<std::int32_t> values) {
    std::sort(values.begin(), values.end());
    return std::unique(values.begin(), values.end()) - values.begin();
}

void addTo(SeamJump& sum, const SeamJump& one) {
    sum.pairs += one.pairs;
    sum.jumps += one.jumps;
}

}  // namespace

FloatImage TradeBench::factorImage(const SurfacePoints& points, const std::vector<float>& factors) {
    FloatImage image(points.width, points.height, {"factor"});
    for (std::size_t k = 0; k < points.size(); ++k) image.samples()[k] = points.covered(k) ? factors[k] : 1.0f;
    return image;
}

std::vector<std::uint8_t> TradeBench::judgedBy(const Look& look, std::size_t light,
                                               std::span<const ShadowFit> fits) const {
    std::vector<std::uint8_t> judged = look.judged[light];
    if (fits.empty() || !isPlanar(fits.front().mode)) return judged;
    const glm::dvec3 normal(fits.front().planeWorld);
    const double eyeAbove = glm::dot(normal, look.points.eyeWorld) + fits.front().planeWorld.w;
    for (std::size_t i = 0; i < judged.size(); ++i) {
        const glm::dvec3 relative(look.points.relative[i]);
        if (std::abs(glm::dot(normal, relative) + eyeAbove) > kOnPlane * glm::length(relative)) judged[i] = 0;
    }
    return judged;
}

Result<void> TradeBench::measure(TradeRow& row) {
    UMBRIEL_ASSERT(!_looks.empty(), "look() comes before measure()");
    if (const auto set = apply(row.setting); !set) return set.error();
    const auto factors = factorsNow();
    if (!factors) return factors.error();
    const auto resolved = resolveViews(scene(), stage().window, _setup.wall, &_bounds);
    if (!resolved) return resolved.error();
    std::vector<std::int32_t> columns, rows;
    for (const TileAssignment& tile : _setup.tiles) {
        columns.push_back(tile.pixels.x);
        rows.push_back(tile.pixels.y);
    }

    Stacked all;
    Stacked everywhere;  // where only some of it is judged
    std::array<Stacked, 3> zones;
    std::array<std::vector<float>, 3> texelPixels;
    std::vector<float> texelMetres;
    std::vector<std::vector<std::vector<std::uint8_t>>> judgedIn(_looks.size());  // by eye and light
    SeamJump seams;
    BeyondTexel beyond;
    bool known = true;
    for (std::size_t i = 0; i < _looks.size(); ++i) {
        const Look& look = _looks[i];
        for (std::size_t light = 0; light < look.truth.size(); ++light) {
            const std::vector<float>& result = (*factors)[i][light];
            const auto fits = fitsOf(resolved->views.views, look.eye, _shadowScene->lights()[light].node);
            judgedIn[i].push_back(judgedBy(look, light, fits));
            const auto& judged = judgedIn[i].back();
            const int w = look.points.width, h = look.points.height;
            all.add(w, h, look.truth[light], result, judged);
            if (!fits.empty() && isPlanar(fits.front().mode))
                everywhere.add(w, h, look.truth[light], result, look.judged[light]);
            const TexelSizes texels = texelSizes(look.points, look.view, fits, judged);
            const auto zone = depthZones(look.points, judged);
            for (std::uint8_t z = 0; z < 3; ++z) {
                std::vector<std::uint8_t> inZone(zone.size());
                for (std::size_t k = 0; k < zone.size(); ++k) {
                    inZone[k] = zone[k] == z ? 1 : 0;
                    if (inZone[k]) texelPixels[z].push_back(texels.pixels[k]);
                }
                zones[z].add(w, h, look.truth[light], result, inZone);
            }
            texelMetres.insert(texelMetres.end(), texels.metres.begin(), texels.metres.end());
            addTo(seams, seamJump({w, h, look.truth[light], result, judged}, static_cast<int>(distinct(columns)),
                                  static_cast<int>(distinct(rows))));

            if (fits.empty() || fits.front().mapSize == 0 || _shadowScene->lights()[light].radius > 0.0) {
                known = known && std::count(judged.begin(), judged.end(), 1) == 0;
                continue;
            }
            const ShadowFilter& filter = fits.front().filter;
            const double reach = 1.0 + (fits.front().mode == ShadowMode::PercentageCloser && filter.widthMetres <= 0.0f
                                            ? 0.5 * static_cast<double>(filter.widthTexels)
                                            : 0.0);
            const BeyondTexel one =
                beyondTexel(*_shadowScene, look.points, light, fits, look.truth[light], result, judged, reach);
            beyond.leaks += one.leaks;
            beyond.acne += one.acne;
        }
    }
    TradeErrors& errors = row.errors;
    errors.error = shadowError(all.factors());
    errors.edges = shadowEdges(all.factors());
    if (!everywhere.truth.empty()) errors.errorEverywhere = shadowError(everywhere.factors()).error();
    errors.machBand = shadowMachBands(all.factors()).response.mean;
    errors.deltaE = shadowDeltaE(all.factors()).mean;
    errors.seamJump = seams.share();
    if (known && errors.error.judged > 0) {
        errors.leakBeyondTexel = static_cast<double>(beyond.leaks) / static_cast<double>(errors.error.judged);
        errors.acneBeyondTexel = static_cast<double>(beyond.acne) / static_cast<double>(errors.error.judged);
    }
    errors.texelMetres = medianSize(std::move(texelMetres));
    for (std::size_t z = 0; z < 3; ++z) {
        errors.zoneErrors[z] = shadowError(zones[z].factors()).error();
        errors.zoneMissing[z] = zones[z].missing();
        errors.zoneTexels[z] = medianSize(std::move(texelPixels[z]));
        const ShadowEdges edges = shadowEdges(zones[z].factors());
        if (edges.inTruth > 0 && edges.inResult > 0) errors.zoneEdges[z] = edges.distance.mean;
    }
    const Viewport& viewport = scene().get(stage().viewport);
    const ShadowMode mode = viewport.shadowMode.get();
    if (takesFilter(mode)) row.filterWidth = static_cast<double>(viewport.filterWidth.get());
    if (takesSamples(mode))
        row.filterSamples = static_cast<int>(mode == ShadowMode::PercentageCloserSoft ? viewport.filterSamples.get()
                                                                                      : viewport.samplesPerRow.get());
    if (!factors->empty() && !factors->front().empty()) {
        row.factors = factorImage(_looks[0].points, factors->front().front());
        if (judgedIn[0][0] != _looks[0].judged[0]) row.judged = judgedIn[0][0];
    }
    if (_looks.size() == 2) {
        const auto around = surfacesAround(_looks[0].points, _looks[1].points, _looks[1].view);
        double sum = 0.0;
        for (std::size_t light = 0; light < _looks[0].truth.size(); ++light)
            sum += surfaceRivalry((*factors)[0][light], (*factors)[1][light], around, judgedIn[0][light],
                                  judgedIn[1][light])
                       .share();
        errors.eyeMismatch = sum / static_cast<double>(std::max<std::size_t>(1, _looks[0].truth.size())) - _eyesTruth;
    }
    if (_path.empty()) return {};
    const auto flicker = flickerNow();
    if (!flicker) return flicker.error();
    errors.flicker = *flicker;
    return {};
}

Result<double> TradeBench::flickerNow() {
    const Ref<Container> camera = scene().get(stage().viewport).camera;
    std::vector<std::vector<std::vector<float>>> byFrame;
    std::vector<std::vector<std::vector<std::uint8_t>>> judged;
    for (std::size_t frame = 0; frame < _path.size(); ++frame) {
        if (const auto moved = movePath(static_cast<int>(frame)); !moved) return moved.error();
        auto now = factorsNow();
        if (!now) return now.error();
        byFrame.push_back(std::move(now->front()));
        const auto resolved = resolveViews(scene(), stage().window, _setup.wall, &_bounds);
        if (!resolved) return resolved.error();
        const Look& look = _path[frame].front();
        judged.emplace_back();
        for (std::size_t light = 0; light < look.truth.size(); ++light)
            judged.back().push_back(
                judgedBy(look, light, fitsOf(resolved->views.views, look.eye, _shadowScene->lights()[light].node)));
    }
    scene().edit(stage().viewport).set<&Viewport::camera>(camera);
    double flicker = 0.0;
    int pairs = 0;
    for (std::size_t frame = 0; frame + 1 < _path.size(); ++frame) {
        const Look& from = _path[frame].front();
        const Look& to = _path[frame + 1].front();
        const auto matches = matchSurfaces(from.points, to.points, to.view);
        for (std::size_t light = 0; light < from.truth.size(); ++light) {
            const auto change = [&](const std::vector<float>& a, const std::vector<float>& b) {
                return surfaceChange(a, b, matches, judged[frame][light], judged[frame + 1][light]).mean;
            };
            flicker +=
                change(byFrame[frame][light], byFrame[frame + 1][light]) - change(from.truth[light], to.truth[light]);
            ++pairs;
        }
    }
    return pairs > 0 ? flicker / pairs : 0.0;
}

}  // namespace umbriel
