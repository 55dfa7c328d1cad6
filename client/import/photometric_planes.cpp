#include "client/import/photometric_planes.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/assert.h"

namespace umbriel {
namespace {

constexpr double kSameAngle = 1e-6;  // degrees: writers round to two or three digits

struct Plane {
    double angle = 0.0;      // degrees, [0, 360)
    std::size_t source = 0;  // which plane of the table
};

double wrapped(double degrees) {
    const double turned = degrees - 360.0 * std::floor(degrees / 360.0);
    return turned > 360.0 - kSameAngle ? 0.0 : turned;
}

double radians(double degrees) {
    return degrees / 180.0 * std::numbers::pi;  // 90 and 180 come out exactly
}

// All planes of the circle, rising, each angle once; a plane of the file wins over a mirrored one.
std::vector<Plane> spreadPlanes(const PhotometricTable& table) {
    std::vector<Plane> planes;
    const auto add = [&](auto angleOf) {
        for (std::size_t i = 0; i < table.horizontal.size(); ++i) {
            planes.push_back({wrapped(angleOf(table.horizontal[i])), i});
        }
    };
    add([](double c) { return c; });
    const bool quadrant = table.symmetry == PhotometricSymmetry::Quadrant;
    if (quadrant || table.symmetry == PhotometricSymmetry::AcrossC0) {
        add([](double c) { return 360.0 - c; });
    }
    if (quadrant || table.symmetry == PhotometricSymmetry::AcrossC90) {
        add([](double c) { return 180.0 - c; });
    }
    if (quadrant) {
        add([](double c) { return 180.0 + c; });
    }
    std::stable_sort(planes.begin(), planes.end(), [](const Plane& a, const Plane& b) { return a.angle < b.angle; });
    const auto last = std::unique(planes.begin(), planes.end(),
                                  [](const Plane& a, const Plane& b) { return b.angle - a.angle < kSameAngle; });
    planes.erase(last, planes.end());
    return planes;
}

}  // namespace

Result<void> expectRising(const std::vector<double>& angles, std::string_view what) {
    for (std::size_t i = 1; i < angles.size(); ++i) {
        if (!(angles[i] > angles[i - 1])) {
            return badInput(fmt::format("{} angle {} ({}) does not rise above the one before ({})", what, i + 1,
                                        angles[i], angles[i - 1]));
        }
    }
    return {};
}

std::optional<double> numberIn(std::string_view word) {
    if (word.starts_with('+')) {
        word.remove_prefix(1);
    }
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size() && std::isfinite(value) ? std::optional(value)
                                                                                            : std::nullopt;
}

Result<std::size_t> countIn(double number, std::string_view what, std::size_t limit) {
    if (!(number >= 1.0) || number != std::floor(number)) {
        return badInput(fmt::format("{} {} make no sense", number, what));
    }
    if (number > static_cast<double>(limit)) {
        return badInput(fmt::format("{} {} are more than the limit of {}", number, what, limit));
    }
    return static_cast<std::size_t>(number);
}

Result<PhotometricWeb> webOf(const PhotometricTable& table, std::vector<std::string>& repairs) {
    UMBRIEL_ASSERT(!table.vertical.empty() && !table.horizontal.empty() &&
                       table.values.size() == table.vertical.size() * table.horizontal.size(),
                   "a photometric table is not full");
    if (const Result<void> rising = expectRising(table.vertical, "vertical"); !rising) {
        return rising.error();
    }
    if (table.vertical.front() < 0.0 || table.vertical.back() > 180.0) {
        return badInput(fmt::format("vertical angles from {} to {} leave 0 to 180 degrees", table.vertical.front(),
                                    table.vertical.back()));
    }
    PhotometricWeb web;
    for (const double angle : table.vertical) {
        web.vertical.push_back(radians(angle));
    }
    std::vector<Plane> planes = spreadPlanes(table);
    if (table.symmetry == PhotometricSymmetry::Rotational) {
        planes = {{0.0, 0}};
    }
    // Close the circle at both ends.
    std::vector<Plane> closed = planes;
    if (planes.front().angle > 0.0) {
        closed.insert(closed.begin(), {planes.back().angle - 360.0, planes.back().source});
    }
    closed.push_back({planes.front().angle + 360.0, planes.front().source});

    std::vector<float> candela(table.values.size());
    std::size_t negative = 0;
    for (std::size_t i = 0; i < candela.size(); ++i) {
        const double value = table.values[i] * table.candelaPerValue;
        negative += value < 0.0 ? 1 : 0;
        if (!(value <= static_cast<double>(std::numeric_limits<float>::max()))) {
            return badInput(fmt::format("value {} is {} cd, more than a number here can hold", i + 1, value));
        }
        candela[i] = static_cast<float>(std::max(value, 0.0));
    }
    if (negative > 0) {
        repairs.push_back(fmt::format("{} negative intensities became 0", negative));
    }
    for (const Plane& plane : closed) {
        web.horizontal.push_back(radians(plane.angle));
        const auto from = candela.begin() + static_cast<std::ptrdiff_t>(plane.source * table.vertical.size());
        web.candela.insert(web.candela.end(), from, from + static_cast<std::ptrdiff_t>(table.vertical.size()));
    }
    return web;
}

}  // namespace umbriel
