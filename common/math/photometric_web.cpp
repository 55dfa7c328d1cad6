#include "common/math/photometric_web.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/assert.h"

namespace umbriel {
namespace {

constexpr double kPi = std::numbers::pi;

struct Place {
    std::size_t lower = 0;
    std::size_t upper = 0;
    double fraction = 0.0;
};

// Where `angle` lies among rising angles that enclose it.
Place placeOf(const std::vector<double>& angles, double angle) {
    const auto above = std::upper_bound(angles.begin(), angles.end(), angle);
    const auto upper =
        std::clamp<std::ptrdiff_t>(above - angles.begin(), 1, static_cast<std::ptrdiff_t>(angles.size()) - 1);
    const auto i = static_cast<std::size_t>(upper);
    return {i - 1, i, std::clamp((angle - angles[i - 1]) / (angles[i] - angles[i - 1]), 0.0, 1.0)};
}

}  // namespace

double PhotometricWeb::intensity(double gamma, double c) const {
    if (vertical.empty() || !(gamma >= vertical.front() && gamma <= vertical.back()) || !std::isfinite(c)) {
        return 0.0;
    }
    const double wrapped = c - 2.0 * kPi * std::floor(c / (2.0 * kPi));
    const Place across = placeOf(horizontal, wrapped);
    const Place down = vertical.size() == 1 ? Place{} : placeOf(vertical, gamma);
    const auto alongPlane = [&](std::size_t plane) {
        return std::lerp(static_cast<double>(at(plane, down.lower)), static_cast<double>(at(plane, down.upper)),
                         down.fraction);
    };
    return std::lerp(alongPlane(across.lower), alongPlane(across.upper), across.fraction);
}

double PhotometricWeb::intensityTowards(const glm::dvec3& directionLight) const {
    const double around = std::hypot(directionLight.x, directionLight.y);
    if (!(around > 0.0) && directionLight.z == 0.0) {
        return 0.0;
    }
    return intensity(std::atan2(around, -directionLight.z), std::atan2(directionLight.y, directionLight.x));
}

double PhotometricWeb::maxIntensity() const {
    return candela.empty() ? 0.0 : static_cast<double>(*std::max_element(candela.begin(), candela.end()));
}

double PhotometricWeb::luminousFlux() const {
    // Each plane stands for the part of [0, 2 pi] nearer to it than to the others: the trapezoid rule, cut at the ends.
    double flux = 0.0;
    for (std::size_t i = 0; i + 1 < horizontal.size(); ++i) {
        const double first = std::clamp(horizontal[i], 0.0, 2.0 * kPi);
        const double last = std::clamp(horizontal[i + 1], 0.0, 2.0 * kPi);
        const double step = horizontal[i + 1] - horizontal[i];
        // The mean of a line over [first, last].
        const double middle = (0.5 * (first + last) - horizontal[i]) / step;
        for (std::size_t j = 0; j + 1 < vertical.size(); ++j) {
            const auto mean = [&](std::size_t plane) {
                return 0.5 * (static_cast<double>(at(plane, j)) + static_cast<double>(at(plane, j + 1)));
            };
            const double solid = std::cos(vertical[j]) - std::cos(vertical[j + 1]);
            flux += std::lerp(mean(i), mean(i + 1), middle) * solid * (last - first);
        }
    }
    return flux;
}

std::vector<float> PhotometricWeb::resampled(std::size_t columns, std::size_t rows) const {
    UMBRIEL_ASSERT(columns >= 1 && rows >= 2, "a grid of intensities needs one column and two rows");
    std::vector<float> grid;
    grid.reserve(columns * rows);
    for (std::size_t j = 0; j < rows; ++j) {
        const double gamma = j + 1 == rows ? kPi : kPi * static_cast<double>(j) / static_cast<double>(rows - 1);
        for (std::size_t i = 0; i < columns; ++i) {
            grid.push_back(static_cast<float>(
                intensity(gamma, 2.0 * kPi * static_cast<double>(i) / static_cast<double>(columns))));
        }
    }
    return grid;
}

}  // namespace umbriel
