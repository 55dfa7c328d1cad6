#include "common/image/measures.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <tuple>

#include "common/image/display.h"

namespace umbriel {
namespace {

constexpr int kChannels = 4;
constexpr int kManyCodes = 8;

bool isNan(float value) {
    return std::isnan(value);
}
bool isNan(std::uint32_t) {
    return false;
}
std::uint32_t bitsOf(float value) {
    return std::bit_cast<std::uint32_t>(value);
}
std::uint32_t bitsOf(std::uint32_t value) {
    return value;
}

template <class T>
bool bitsDiffer(const T* a, const T* b, int channels) {
    for (int c = 0; c < channels; ++c) {
        if (bitsOf(a[c]) != bitsOf(b[c]) || isNan(a[c])) {
            return true;
        }
    }
    return false;
}

bool anyNan(const float* pixel) {
    return std::any_of(pixel, pixel + kChannels, [](float v) { return std::isnan(v); });
}

bool allFinite(const float* pixel) {
    return std::all_of(pixel, pixel + kChannels, [](float v) { return std::isfinite(v); });
}

// Largest difference of the four 8-bit channels.
int byteDifference(const float* a, const float* b, double scale) {
    int largest = std::abs(int{alphaByte(a[3])} - int{alphaByte(b[3])});
    for (int c = 0; c < 3; ++c) {
        if (bitsOf(a[c]) != bitsOf(b[c])) {
            largest = std::max(largest, std::abs(int{displayByte(a[c], scale)} - int{displayByte(b[c], scale)}));
        }
    }
    return largest;
}

double linearDifference(const float* a, const float* b) {
    double largest = 0.0;
    for (int c = 0; c < kChannels; ++c) {
        if (std::isfinite(a[c]) && std::isfinite(b[c])) {
            largest = std::max(largest, std::abs(static_cast<double>(a[c]) - static_cast<double>(b[c])));
        }
    }
    return largest;
}

void assertInside(const FloatImage& a, const FloatImage& b, const PixelRect& r) {
    UMBRIEL_ASSERT(a.channelCount() == kChannels && b.channelCount() == kChannels, "pictures are compared as RGBA");
    UMBRIEL_ASSERT(r.x >= 0 && r.y >= 0 && r.width >= 0 && r.height >= 0 && r.width <= a.width() - r.x &&
                       r.height <= a.height() - r.y && r.width <= b.width() - r.x && r.height <= b.height() - r.y,
                   "a compared region reaches outside a picture");
}

template <class T>
std::uint64_t bitDifferingPixels(const BasicImage<T>& a, const BasicImage<T>& b) {
    const int channels = a.channelCount();
    const T* fromA = a.samples().data();
    const T* fromB = b.samples().data();
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < a.pixelCount(); ++i, fromA += channels, fromB += channels) {
        count += bitsDiffer(fromA, fromB, channels) ? 1 : 0;
    }
    return count;
}

const ImageLayer* findLayer(const LayeredImage& image, const std::string& name, bool isUint) {
    const auto found = std::find_if(image.layers.begin(), image.layers.end(), [&](const ImageLayer& layer) {
        return layer.name == name && layer.isUint() == isUint;
    });
    return found == image.layers.end() ? nullptr : &*found;
}

LayerComparison compareLayer(const ImageLayer& a, const ImageLayer* b) {
    using Presence = LayerComparison::Presence;
    LayerComparison result{a.name, a.isUint(), Presence::Both, 0};
    if (b == nullptr) {
        result.presence = Presence::OnlyA;
    } else if (a.channels() != b->channels() || a.width() != b->width() || a.height() != b->height()) {
        result.presence = Presence::OtherChannels;
    } else if (a.isUint()) {
        result.bitDiffering = bitDifferingPixels(std::get<UintImage>(a.image), std::get<UintImage>(b->image));
    } else {
        result.bitDiffering = bitDifferingPixels(std::get<FloatImage>(a.image), std::get<FloatImage>(b->image));
    }
    return result;
}

std::vector<LayerComparison> compareLayers(const LayeredImage& a, const LayeredImage& b) {
    std::vector<LayerComparison> layers;
    for (const ImageLayer& layer : a.layers) {
        layers.push_back(compareLayer(layer, findLayer(b, layer.name, layer.isUint())));
    }
    for (const ImageLayer& layer : b.layers) {
        if (findLayer(a, layer.name, layer.isUint()) == nullptr) {
            layers.push_back({layer.name, layer.isUint(), LayerComparison::Presence::OnlyB, 0});
        }
    }
    std::sort(layers.begin(), layers.end(), [](const LayerComparison& x, const LayerComparison& y) {
        return std::tie(x.name, x.isUint) < std::tie(y.name, y.isUint);
    });
    return layers;
}

}  // namespace

Result<ImageComparison> compareImages(const LayeredImage& a, const LayeredImage& b, const ComparisonOptions& options) {
    if (a.width() != b.width() || a.height() != b.height()) {
        return badInput(fmt::format("the pictures have unequal sizes: {} x {} and {} x {} pixels", a.width(),
                                    a.height(), b.width(), b.height()));
    }
    if (a.width() == 0 || a.height() == 0) {
        return badInput("the pictures are empty");
    }
    ImageComparison result = compareRegion(a.rgba, b.rgba, {0, 0, a.width(), a.height()}, options);
    result.layers = compareLayers(a, b);
    return result;
}

ImageComparison compareRegion(const FloatImage& a, const FloatImage& b, const PixelRect& region,
                              const ComparisonOptions& options) {
    assertInside(a, b, region);
    const double scale = exposureScale(options.exposure);
    ImageComparison result;
    double sum = 0.0;
    double sumOfSquares = 0.0;
    for (int y = region.y; y < region.y + region.height; ++y) {
        for (int x = region.x; x < region.x + region.width; ++x) {
            const float* pixelA = a.pixel(x, y);
            const float* pixelB = b.pixel(x, y);
            const bool nan = anyNan(pixelA) || anyNan(pixelB);
            const bool finite = allFinite(pixelA) && allFinite(pixelB);
            ++result.pixels;
            result.nonFinite += finite ? 0 : 1;
            if (!bitsDiffer(pixelA, pixelB, kChannels)) {
                continue;
            }
            ++result.bitDiffering;
            const int bytes = byteDifference(pixelA, pixelB, scale);
            result.differing += (bytes > 0 || nan) ? 1 : 0;
            result.over8 += bytes > kManyCodes ? 1 : 0;
            result.holes += (pixelA[3] == 0.0F) != (pixelB[3] == 0.0F) ? 1 : 0;
            if (!finite) {
                continue;
            }
            for (int c = 0; c < 3; ++c) {
                const double difference = std::abs(static_cast<double>(pixelA[c]) - static_cast<double>(pixelB[c]));
                result.max = std::max(result.max, difference);
                sum += difference;
                sumOfSquares += difference * difference;
            }
        }
    }
    if (const std::uint64_t finitePixels = result.pixels - result.nonFinite; finitePixels > 0) {
        const double samples = 3.0 * static_cast<double>(finitePixels);
        result.mae = sum / samples;
        result.rmse = std::sqrt(sumOfSquares / samples);
    }
    return result;
}

std::vector<PixelDifference> worstPixels(const FloatImage& a, const FloatImage& b, const PixelRect& region,
                                         std::size_t count, const ComparisonOptions& options) {
    assertInside(a, b, region);
    const double scale = exposureScale(options.exposure);
    // A total order, so the answer does not depend on how it is searched.
    const auto worse = [](const PixelDifference& p, const PixelDifference& q) {
        return std::tuple(!p.hasNan, -p.bytes, -p.linear, p.y, p.x) <
               std::tuple(!q.hasNan, -q.bytes, -q.linear, q.y, q.x);
    };
    std::vector<PixelDifference> worst;  // a heap whose front is the least bad
    for (int y = region.y; y < region.y + region.height && count > 0; ++y) {
        for (int x = region.x; x < region.x + region.width; ++x) {
            const float* pixelA = a.pixel(x, y);
            const float* pixelB = b.pixel(x, y);
            if (!bitsDiffer(pixelA, pixelB, kChannels)) {
                continue;
            }
            PixelDifference difference{x,
                                       y,
                                       {},
                                       {},
                                       anyNan(pixelA) || anyNan(pixelB),
                                       byteDifference(pixelA, pixelB, scale),
                                       linearDifference(pixelA, pixelB)};
            std::copy_n(pixelA, kChannels, difference.a.begin());
            std::copy_n(pixelB, kChannels, difference.b.begin());
            if (worst.size() == count) {
                if (!worse(difference, worst.front())) {
                    continue;
                }
                std::pop_heap(worst.begin(), worst.end(), worse);
                worst.pop_back();
            }
            worst.push_back(difference);
            std::push_heap(worst.begin(), worst.end(), worse);
        }
    }
    std::sort_heap(worst.begin(), worst.end(), worse);
    return worst;
}

}  // namespace umbriel
