#include "common/image/shadow_error.h"

#include <algorithm>
#include <cmath>

#include "common/base/assert.h"
#include "common/image/colour_difference.h"
#include "common/image/display.h"
#include "common/image/edge_displacement.h"
#include "common/image/image.h"

namespace umbriel {
namespace {

void check(const ShadowFactors& factors) {
    const auto pixels = static_cast<std::size_t>(factors.width) * static_cast<std::size_t>(factors.height);
    UMBRIEL_ASSERT(factors.width >= 0 && factors.height >= 0 && factors.truth.size() == pixels &&
                       factors.result.size() == pixels && factors.judged.size() == pixels,
                   "factors are of one picture");
}

bool isLit(float factor) {
    return factor >= 0.5F;
}

// The borders between pixels on a grid of twice the resolution: pixel (x, y) is at (2x, 2y).
struct Borders {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> marked;
    std::uint64_t count = 0;
};

Borders bordersOf(const ShadowFactors& factors, std::span<const float> values, std::span<const std::uint8_t> judged) {
    Borders borders{std::max(0, 2 * factors.width - 1), std::max(0, 2 * factors.height - 1), {}, 0};
    borders.marked.assign(static_cast<std::size_t>(borders.width) * static_cast<std::size_t>(borders.height), 0);
    const auto at = [&](int x, int y) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(factors.width) + static_cast<std::size_t>(x);
    };
    const auto mark = [&](int x, int y, int dx, int dy) {
        const std::size_t a = at(x, y), b = at(x + dx, y + dy);
        if (!judged.empty() && (judged[a] == 0 || judged[b] == 0)) return;
        if (isLit(values[a]) == isLit(values[b])) return;
        borders.marked[static_cast<std::size_t>(2 * y + dy) * static_cast<std::size_t>(borders.width) +
                       static_cast<std::size_t>(2 * x + dx)] = 1;
        ++borders.count;
    };
    for (int y = 0; y < factors.height; ++y)
        for (int x = 0; x < factors.width; ++x) {
            if (x + 1 < factors.width) mark(x, y, 1, 0);
            if (y + 1 < factors.height) mark(x, y, 0, 1);
        }
    return borders;
}

}  // namespace

ShadowError shadowError(const ShadowFactors& factors, const ShadowErrorOptions& options) {
    check(factors);
    // True edges wherever they are: one that runs through pixels that are not judged excuses its neighbours too.
    const Borders edges = bordersOf(factors, factors.truth, {});
    const std::vector<float> distances = squaredDistances(edges.marked, edges.width, edges.height);
    ShadowError error;
    double leak = 0.0, acne = 0.0, leakAway = 0.0, acneAway = 0.0, squares = 0.0;
    std::uint64_t wrong = 0;
    for (int y = 0; y < factors.height; ++y)
        for (int x = 0; x < factors.width; ++x) {
            const std::size_t i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(factors.width) + static_cast<std::size_t>(x);
            if (factors.judged[i] == 0) continue;
            ++error.judged;
            const double difference = static_cast<double>(factors.result[i]) - static_cast<double>(factors.truth[i]);
            (difference > 0.0 ? leak : acne) += std::abs(difference);
            squares += difference * difference;
            wrong += isLit(factors.result[i]) != isLit(factors.truth[i]) ? 1U : 0U;
            const float square = distances[static_cast<std::size_t>(2 * y) * static_cast<std::size_t>(edges.width) +
                                           static_cast<std::size_t>(2 * x)];
            if (std::sqrt(static_cast<double>(square)) <= 2.0 * options.awayPixels) continue;
            ++error.judgedAway;
            (difference > 0.0 ? leakAway : acneAway) += std::abs(difference);
        }
    if (error.judged > 0) {
        const auto count = static_cast<double>(error.judged);
        error.leak = leak / count;
        error.acne = acne / count;
        error.rmse = std::sqrt(squares / count);
        error.wrongSide = static_cast<double>(wrong) / count;
    }
    if (error.judgedAway > 0) {
        error.leakAway = leakAway / static_cast<double>(error.judgedAway);
        error.acneAway = acneAway / static_cast<double>(error.judgedAway);
    }
    return error;
}

ShadowEdges shadowEdges(const ShadowFactors& factors) {
    check(factors);
    const Borders truth = bordersOf(factors, factors.truth, factors.judged);
    const Borders result = bordersOf(factors, factors.result, factors.judged);
    ShadowEdges edges;
    edges.inTruth = truth.count;
    edges.inResult = result.count;
    if (truth.count == 0 && result.count == 0) return edges;
    if (truth.count == 0 || result.count == 0) {
        constexpr double kInfinity = std::numeric_limits<double>::infinity();
        edges.distance = {kInfinity, kInfinity, kInfinity, kInfinity};
        return edges;
    }
    std::vector<float> distances;
    distances.reserve(static_cast<std::size_t>(truth.count + result.count));
    const auto collect = [&](const Borders& from, const Borders& to) {
        const std::vector<float> squares = squaredDistances(to.marked, to.width, to.height);
        for (std::size_t i = 0; i < squares.size(); ++i)
            if (from.marked[i] != 0) distances.push_back(0.5F * std::sqrt(squares[i]));
    };
    collect(truth, result);
    collect(result, truth);
    edges.distance = spreadOf(std::move(distances));
    return edges;
}

SeamJump seamJump(const ShadowFactors& factors, int columns, int rows) {
    check(factors);
    UMBRIEL_ASSERT(columns > 0 && rows > 0, "a grid has tiles");
    SeamJump seams;
    const auto compare = [&](std::size_t a, std::size_t b) {
        if (factors.judged[a] == 0 || factors.judged[b] == 0 || factors.truth[a] != factors.truth[b]) return;
        ++seams.pairs;
        if (std::abs(factors.result[a] - factors.result[b]) > 0.5F) ++seams.jumps;
    };
    const auto width = static_cast<std::size_t>(factors.width);
    for (int column = 1; column < columns; ++column) {
        const auto x = static_cast<std::size_t>(std::int64_t{column} * factors.width / columns);
        if (x == 0 || x >= width) continue;
        for (std::size_t y = 0; y < static_cast<std::size_t>(factors.height); ++y)
            compare(y * width + x - 1, y * width + x);
    }
    for (int row = 1; row < rows; ++row) {
        const auto fromBelow = std::int64_t{row} * factors.height / rows;
        const std::int64_t y = factors.height - fromBelow;  // the first row below the border, from the top
        if (y <= 0 || y >= factors.height) continue;
        for (std::size_t x = 0; x < width; ++x)
            compare(static_cast<std::size_t>(y - 1) * width + x, static_cast<std::size_t>(y) * width + x);
    }
    return seams;
}

SurfaceChange surfaceChange(std::span<const float> first, std::span<const float> second,
                            std::span<const std::uint32_t> matches, std::span<const std::uint8_t> judgedFirst,
                            std::span<const std::uint8_t> judgedSecond) {
    UMBRIEL_ASSERT(
        matches.size() == first.size() && judgedFirst.size() == first.size() && judgedSecond.size() == second.size(),
        "a match for each pixel");
    SurfaceChange change;
    double sum = 0.0;
    std::uint64_t changed = 0;
    for (std::size_t i = 0; i < first.size(); ++i) {
        const std::uint32_t j = matches[i];
        if (j == kUnmatched || judgedFirst[i] == 0 || judgedSecond[j] == 0) continue;
        ++change.pairs;
        const double difference = std::abs(static_cast<double>(first[i]) - static_cast<double>(second[j]));
        sum += difference;
        changed += difference > 0.5 ? 1U : 0U;
    }
    if (change.pairs > 0) {
        change.mean = sum / static_cast<double>(change.pairs);
        change.changed = static_cast<double>(changed) / static_cast<double>(change.pairs);
    }
    return change;
}

SurfaceRivalry surfaceRivalry(std::span<const float> first, std::span<const float> second,
                              std::span<const std::array<std::uint32_t, 4>> around,
                              std::span<const std::uint8_t> judgedFirst, std::span<const std::uint8_t> judgedSecond) {
    UMBRIEL_ASSERT(
        around.size() == first.size() && judgedFirst.size() == first.size() && judgedSecond.size() == second.size(),
        "a place for each pixel");
    SurfaceRivalry result;
    for (std::size_t i = 0; i < first.size(); ++i) {
        if (around[i][0] == kUnmatched || judgedFirst[i] == 0) continue;
        bool isJudged = true, isAlone = true;
        for (const std::uint32_t j : around[i]) {
            if (j == kUnmatched) continue;
            isJudged = isJudged && judgedSecond[j] != 0;
            isAlone = isAlone && (first[i] > 0.5f) != (second[j] > 0.5f);
        }
        if (!isJudged) continue;
        ++result.points;
        result.rivals += isAlone ? 1U : 0U;
    }
    return result;
}

MachBandDifference shadowMachBands(const ShadowFactors& factors) {
    check(factors);
    FloatImage truth(factors.width, factors.height, {"Y"}), result(factors.width, factors.height, {"Y"});
    for (std::size_t i = 0; i < factors.truth.size(); ++i) {
        const auto shown = [](float factor) {
            return static_cast<float>(srgbFromLinear(std::clamp(static_cast<double>(factor), 0.0, 1.0)));
        };
        truth.samples()[i] = shown(factors.truth[i]);
        result.samples()[i] = factors.judged[i] != 0 ? shown(factors.result[i]) : truth.samples()[i];
    }
    return machBandDifference(truth, result);
}

Spread shadowDeltaE(const ShadowFactors& factors) {
    check(factors);
    std::vector<float> differences;
    for (std::size_t i = 0; i < factors.truth.size(); ++i) {
        if (factors.judged[i] == 0) continue;
        const auto lab = [](float factor) {
            const double grey = std::clamp(static_cast<double>(factor), 0.0, 1.0);
            return labFromLinear(grey, grey, grey);
        };
        differences.push_back(factors.truth[i] == factors.result[i]
                                  ? 0.0F
                                  : static_cast<float>(deltaE(lab(factors.truth[i]), lab(factors.result[i]))));
    }
    return spreadOf(std::move(differences));
}

}  // namespace umbriel
