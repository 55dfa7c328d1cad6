#include "client/import/intensity_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace umbriel {
namespace {

constexpr std::size_t kMaxColumns = 1440;
constexpr std::size_t kMaxRows = 1441;

// How many of the smallest step fill `whole`.
std::size_t stepsOf(const std::vector<double>& angles, double whole, std::size_t limit) {
    double smallest = whole;
    for (std::size_t i = 0; i + 1 < angles.size(); ++i) smallest = std::min(smallest, angles[i + 1] - angles[i]);
    const double steps = std::round(whole / std::max(smallest, whole / static_cast<double>(limit)));
    return std::clamp<std::size_t>(static_cast<std::size_t>(steps), 1, limit);
}

bool isSymmetric(const PhotometricWeb& web) {
    for (std::size_t plane = 1; plane < web.horizontal.size(); ++plane)
        for (std::size_t angle = 0; angle < web.vertical.size(); ++angle)
            if (web.at(plane, angle) != web.at(0, angle)) return false;
    return true;
}

}  // namespace

Ref<IntensityTable> createIntensityTable(Aspect& scene, const PhotometricImport& luminaire) {
    const PhotometricWeb& web = luminaire.web;
    const std::size_t columns = isSymmetric(web) ? 1 : stepsOf(web.horizontal, 2.0 * std::numbers::pi, kMaxColumns);
    const std::size_t rows = stepsOf(web.vertical, std::numbers::pi, kMaxRows - 1) + 1;
    std::vector<float> shares = web.resampled(columns, rows);
    const double brightest = web.maxIntensity();
    for (float& share : shares)
        share = brightest > 0.0 ? static_cast<float>(static_cast<double>(share) / brightest) : 0.0f;
    const Ref<IntensityTable> table = scene.create<IntensityTable>(luminaire.name);
    scene.edit(table)
        .set<&IntensityTable::columns>(static_cast<std::uint32_t>(columns))
        .set<&IntensityTable::rows>(static_cast<std::uint32_t>(rows))
        .assign<&IntensityTable::shares>(shares);
    return table;
}

}  // namespace umbriel
