#include "common/math/brdf_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

namespace umbriel {
namespace {

struct Place {
    std::size_t lower = 0;
    double fraction = 0.0;
};

Place placeOf(const std::vector<double>& axis, double value) {
    const auto above = std::upper_bound(axis.begin(), axis.end(), value) - axis.begin();
    const auto upper =
        static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(above, 1, static_cast<std::ptrdiff_t>(axis.size()) - 1));
    const double fraction = (value - axis[upper - 1]) / (axis[upper] - axis[upper - 1]);
    return {upper - 1, std::clamp(fraction, 0.0, 1.0)};
}

double azimuthBetween(const glm::dvec3& a, const glm::dvec3& b) {
    // atan2 of sine and cosine: exact at 0 and pi, where acos is not.
    return std::atan2(std::abs(a.x * b.y - a.y * b.x), a.x * b.x + a.y * b.y);
}

Result<void> checkAxis(const std::vector<double>& axis, double last, std::string_view name) {
    if (axis.size() < 2) {
        return badInput(fmt::format("a BRDF table needs two values of {} or more", name));
    }
    for (std::size_t i = 0; i < axis.size(); ++i) {
        // Written so that NaN is refused; measured tables write pi / 2 with few digits.
        constexpr double kRounding = 1e-3;
        if (!(axis[i] >= 0.0 && axis[i] <= last + kRounding) || (i > 0 && !(axis[i] > axis[i - 1]))) {
            return badInput(
                fmt::format("{} value {} ({}) does not rise or leaves 0 to {:.4f}", name, i + 1, axis[i], last));
        }
    }
    return {};
}

}  // namespace

glm::dvec3 BrdfTable::value(const glm::dvec3& inLocal, const glm::dvec3& outLocal) const {
    if (!(inLocal.z > 0.0) || !(outLocal.z > 0.0)) {
        return glm::dvec3(0.0);
    }
    const Place in = placeOf(thetaIn, std::atan2(std::hypot(inLocal.x, inLocal.y), inLocal.z));
    const Place out = placeOf(thetaOut, std::atan2(std::hypot(outLocal.x, outLocal.y), outLocal.z));
    const Place across = placeOf(phi, azimuthBetween(inLocal, outLocal));
    const auto overPhi = [&](std::size_t i, std::size_t j) {
        return glm::mix(at(i, j, across.lower), at(i, j, across.lower + 1), across.fraction);
    };
    const auto overOut = [&](std::size_t i) {
        return glm::mix(overPhi(i, out.lower), overPhi(i, out.lower + 1), out.fraction);
    };
    return glm::mix(overOut(in.lower), overOut(in.lower + 1), in.fraction);
}

Result<void> checkBrdfTable(const BrdfTable& table) {
    constexpr double kPi = std::numbers::pi;
    if (const auto checked = checkAxis(table.thetaIn, kPi / 2.0, "theta_in"); !checked) {
        return checked;
    }
    if (const auto checked = checkAxis(table.thetaOut, kPi / 2.0, "theta_out"); !checked) {
        return checked;
    }
    if (const auto checked = checkAxis(table.phi, kPi, "phi"); !checked) {
        return checked;
    }
    const std::size_t expected = table.thetaIn.size() * table.thetaOut.size() * table.phi.size();
    if (table.values.size() != expected) {
        return badInput(fmt::format("the BRDF table has {} values for a grid of {}", table.values.size(), expected));
    }
    for (std::size_t i = 0; i < table.values.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
            if (!(table.values[i][c] >= 0.0) || !std::isfinite(table.values[i][c])) {
                return badInput(
                    fmt::format("BRDF value {} is {}: expected finite values, 0 or more", i + 1, table.values[i][c]));
            }
        }
    }
    return {};
}

}  // namespace umbriel
