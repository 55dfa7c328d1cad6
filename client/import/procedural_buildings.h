#pragma once

#include <array>
#include <vector>

#include "client/import/procedural_kit.h"

namespace umbriel {

// What stands on a lot of the city.
enum class BuildingKind {
    House,
    CornerHouse,
    Warehouse,
    Apartments,
    Brick,
    Office,
    RoundTower,
    GlassTower,
    SteppedTower
};
inline constexpr std::size_t kBuildingKinds = 9;

// The geometries that a city's buildings share: a few variants of each kind, standing on y = 0 around the origin.
// Houses fill a lot of 16 m, towers one of 25 m.
struct BuildingCatalogue {
    std::array<std::vector<Ref<Geometry>>, kBuildingKinds> variants;
    std::vector<Ref<Geometry>> trees;
};
BuildingCatalogue makeBuildings(SceneKit& kit);

}  // namespace umbriel
