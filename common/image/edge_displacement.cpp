#include "common/image/edge_displacement.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace umbriel {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Gradient {
    float x = 0.0F;
    float y = 0.0F;
    float squared() const { return x * x + y * y; }
};

std::vector<Gradient> sobel(const FloatImage& grey) {
    const int width = grey.width();
    const int height = grey.height();
    std::vector<Gradient> gradients;
    gradients.reserve(grey.pixelCount());
    for (int y = 0; y < height; ++y) {
        const int above = std::max(y - 1, 0);
        const int below = std::min(y + 1, height - 1);
        for (int x = 0; x < width; ++x) {
            const int left = std::max(x - 1, 0);
            const int right = std::min(x + 1, width - 1);
            const auto g = [&grey](int px, int py) { return grey.at(px, py, 0); };
            const float horizontal = (g(right, above) - g(left, above)) + 2.0F * (g(right, y) - g(left, y)) +
                                     (g(right, below) - g(left, below));
            const float vertical = (g(left, below) - g(left, above)) + 2.0F * (g(x, below) - g(x, above)) +
                                   (g(right, below) - g(right, above));
            gradients.push_back({horizontal / 8.0F, vertical / 8.0F});
        }
    }
    return gradients;
}

// The neighbour a gradient points to: one of eight.
std::pair<int, int> stepAlong(const Gradient& gradient) {
    constexpr float kTan22 = 0.41421356F;  // between an axis and a diagonal
    const float ax = std::abs(gradient.x);
    const float ay = std::abs(gradient.y);
    return {ax < kTan22 * ay ? 0 : gradient.x > 0.0F ? 1 : -1, ay < kTan22 * ax ? 0 : gradient.y > 0.0F ? 1 : -1};
}

// The lower envelope of the parabolas (q - i)^2 + values[i], in place.
void transformLine(std::vector<float>& values, std::vector<int>& roots, std::vector<double>& starts,
                   std::vector<float>& result) {
    const int size = static_cast<int>(values.size());
    roots.clear();
    starts.clear();
    for (int q = 0; q < size; ++q) {
        const double height = static_cast<double>(values[static_cast<std::size_t>(q)]);
        if (!std::isfinite(height)) {
            continue;
        }
        double start = -std::numeric_limits<double>::infinity();
        while (!roots.empty()) {
            const double root = roots.back();
            const double rootHeight = static_cast<double>(values[static_cast<std::size_t>(roots.back())]);
            start = ((height + static_cast<double>(q) * q) - (rootHeight + root * root)) / (2.0 * (q - root));
            if (start > starts.back()) {
                break;
            }
            roots.pop_back();
            starts.pop_back();
            start = -std::numeric_limits<double>::infinity();
        }
        roots.push_back(q);
        starts.push_back(start);
    }
    if (roots.empty()) {
        return;
    }
    std::size_t current = 0;
    for (int q = 0; q < size; ++q) {
        while (current + 1 < roots.size() && starts[current + 1] < q) {
            ++current;
        }
        const float offset = static_cast<float>(q - roots[current]);
        result[static_cast<std::size_t>(q)] = offset * offset + values[static_cast<std::size_t>(roots[current])];
    }
    values = result;
}

Spread distancesFrom(const std::vector<std::uint8_t>& edges, const std::vector<std::uint8_t>& others, int width,
                     int height) {
    const std::vector<float> squared = squaredDistances(others, width, height);
    std::vector<float> distances;
    for (std::size_t i = 0; i < edges.size(); ++i) {
        if (edges[i] != 0) {
            distances.push_back(std::sqrt(squared[i]));
        }
    }
    return spreadOf(std::move(distances));
}

}  // namespace

std::vector<std::uint8_t> edgePixels(const FloatImage& grey, const EdgeOptions& options) {
    UMBRIEL_ASSERT(grey.channelCount() == 1, "edges are found in one channel");
    const int width = grey.width();
    const int height = grey.height();
    const std::vector<Gradient> gradients = sobel(grey);
    const auto index = [width](int x, int y) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    };
    const auto strength = [&](int x, int y) {
        return x >= 0 && y >= 0 && x < width && y < height ? gradients[index(x, y)].squared() : 0.0F;
    };
    std::vector<std::uint8_t> edges(grey.pixelCount(), 0);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const Gradient& gradient = gradients[index(x, y)];
            const float own = gradient.squared();
            if (!(own >= options.threshold * options.threshold)) {
                continue;
            }
            const auto [dx, dy] = stepAlong(gradient);
            const bool isEdge = own >= strength(x + dx, y + dy) && own > strength(x - dx, y - dy);
            edges[index(x, y)] = isEdge ? 1 : 0;
        }
    }
    return edges;
}

std::vector<float> squaredDistances(const std::vector<std::uint8_t>& marked, int width, int height) {
    UMBRIEL_ASSERT(marked.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                   "marks do not fill the picture");
    std::vector<float> distances(marked.size());
    std::transform(marked.begin(), marked.end(), distances.begin(),
                   [](std::uint8_t mark) { return mark != 0 ? 0.0F : kInfinity; });
    std::vector<int> roots;
    std::vector<double> starts;
    const auto w = static_cast<std::size_t>(width);
    const auto h = static_cast<std::size_t>(height);
    std::vector<float> line(h);
    std::vector<float> result(h);
    for (std::size_t x = 0; x < w; ++x) {
        for (std::size_t y = 0; y < h; ++y) {
            line[y] = distances[y * w + x];
        }
        transformLine(line, roots, starts, result);
        for (std::size_t y = 0; y < h; ++y) {
            distances[y * w + x] = line[y];
        }
    }
    line.resize(w);
    result.resize(w);
    for (std::size_t y = 0; y < h; ++y) {
        const auto row = distances.begin() + static_cast<std::ptrdiff_t>(y * w);
        std::copy_n(row, w, line.begin());
        transformLine(line, roots, starts, result);
        std::copy_n(line.begin(), w, row);
    }
    return distances;
}

EdgeDisplacement edgeDisplacement(const FloatImage& greyA, const FloatImage& greyB, const EdgeOptions& options) {
    UMBRIEL_ASSERT(greyA.width() == greyB.width() && greyA.height() == greyB.height(), "pictures have unequal sizes");
    const std::vector<std::uint8_t> a = edgePixels(greyA, options);
    const std::vector<std::uint8_t> b = edgePixels(greyB, options);
    EdgeDisplacement result;
    result.edgesA = static_cast<std::uint64_t>(std::count(a.begin(), a.end(), 1));
    result.edgesB = static_cast<std::uint64_t>(std::count(b.begin(), b.end(), 1));
    result.fromA = distancesFrom(a, b, greyA.width(), greyA.height());
    result.fromB = distancesFrom(b, a, greyA.width(), greyA.height());
    return result;
}

}  // namespace umbriel
