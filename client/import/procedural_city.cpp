#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "client/import/procedural_buildings.h"
#include "client/import/procedural_demos.h"
#include "client/import/procedural_random.h"

namespace umbriel {

namespace {

// A cell of the street grid: a block with its pavement, and half a street on each side. Metres.
constexpr double kCell = 72.0;
constexpr float kHalfBlock = 28.0f;
constexpr float kKerb = 0.15f;

struct Cell {
    int column;
    int row;
    int squaredDistance() const { return column * column + row * row; }
};

// Cells by distance from the middle, so that any number of buildings makes a round city.
std::vector<Cell> cellsWithin(int radius) {
    std::vector<Cell> cells;
    for (int row = -radius; row <= radius; ++row)
        for (int column = -radius; column <= radius; ++column)
            if (column * column + row * row <= radius * radius) cells.push_back({column, row});
    std::stable_sort(cells.begin(), cells.end(),
                     [](const Cell& a, const Cell& b) { return a.squaredDistance() < b.squaredDistance(); });
    return cells;
}

// Asphalt with a dashed line where two cells meet, kerb lines and crossings; half a street around a block.
TexelGrid streetTexels() {
    constexpr int kTexels = 512;
    return makeTexels(kTexels, kTexels, [](int x, int row) {
        constexpr float kMetres = static_cast<float>(kCell) / kTexels;
        const float fromLeft = (static_cast<float>(x) + 0.5f) * kMetres;
        const float fromTop = (static_cast<float>(row) + 0.5f) * kMetres;
        const float side = static_cast<float>(kCell);
        const float edgeX = std::min(fromLeft, side - fromLeft);
        const float edgeY = std::min(fromTop, side - fromTop);
        const float grain = tilingNoise(static_cast<float>(x) / 4.0f, static_cast<float>(row) / 4.0f, 128, 31);
        const glm::vec3 asphalt = srgb(0x4b4c4f) * (0.82f + 0.36f * grain);
        const glm::vec3 paint = srgb(0xd9d8d0) * (0.85f + 0.2f * grain);
        constexpr float kStreet = 8.0f;
        const bool crossing = edgeX < kStreet && edgeY < kStreet;
        const float across = std::min(edgeX, edgeY);
        const float lengthwise = edgeX < edgeY ? fromTop : fromLeft;
        const float toCorner = std::max(edgeX, edgeY) - kStreet;
        if (across > kStreet || crossing) return asphalt;
        if (toCorner < 4.2f && toCorner > 0.8f) return std::fmod(across, 1.2f) < 0.6f ? paint : asphalt;
        if (toCorner > 5.0f && across < 0.15f && std::fmod(lengthwise, 6.0f) < 3.0f) return paint;
        if (toCorner > 5.0f && across > 5.2f && across < 5.4f) return paint;  // parking lane
        return asphalt;
    });
}

struct GroundKit {
    Ref<Geometry> street;
    Ref<Geometry> pavement;
    Ref<Geometry> lawn;
    std::vector<Ref<Geometry>> fields;
};

Mesh square(int cells, float half, float y, const glm::vec4& colour) {
    Mesh mesh;
    mesh.addGrid(cells, cells, colour, [=](int column, int row) {
        const float step = 2.0f * half / static_cast<float>(cells);
        return glm::vec3(-half + step * static_cast<float>(column), y, half - step * static_cast<float>(row));
    });
    return mesh;
}

GroundKit makeGround(SceneKit& kit) {
    GroundKit ground;
    const Ref<Texture> asphalt = kit.texture(kit.image("street", streetTexels()));
    constexpr auto kHalfCell = static_cast<float>(0.5 * kCell);
    ground.street = kit.geometry("street", square(4, kHalfCell, 0.0f, glm::vec4(1.0f)),
                                 kit.material("asphalt", {.roughness = 0.9f, .colourTexture = asphalt}));
    const Ref<Material> plain = kit.material("ground", {.roughness = 0.95f});
    Mesh pavement;
    pavement.addBox({-kHalfBlock, 0.0f, -kHalfBlock}, {kHalfBlock, kKerb, kHalfBlock}, linearColour(0xb3afa7), false);
    Mesh yard = square(2, kHalfBlock - 3.5f, kKerb + 0.02f, linearColour(0x8f8c80));
    pavement.append(yard);
    pavement.texCoords.assign(pavement.positions.size(), glm::vec2(0.0f));
    ground.pavement = kit.geometry("pavement", pavement, plain);
    Mesh lawn;
    lawn.addBox({-kHalfBlock, 0.0f, -kHalfBlock}, {kHalfBlock, kKerb, kHalfBlock}, linearColour(0xb3afa7), false);
    Mesh grass = square(6, kHalfBlock - 3.0f, kKerb + 0.05f, linearColour(0x6d8a45));
    lawn.append(grass);
    const glm::vec4 gravel = linearColour(0xcdbf9f);
    lawn.addBox({-kHalfBlock, 0.0f, -1.6f}, {kHalfBlock, kKerb + 0.1f, 1.6f}, gravel, false);
    lawn.addBox({-1.6f, 0.0f, -kHalfBlock}, {1.6f, kKerb + 0.12f, kHalfBlock}, gravel, false);
    // A pond in the middle.
    Mesh pond;
    pond.addLathe(std::array{glm::vec2(7.6f, 0.0f), glm::vec2(7.6f, 0.6f), glm::vec2(7.6f, 0.6f), glm::vec2(7.0f, 0.6f),
                             glm::vec2(7.0f, 0.6f), glm::vec2(7.0f, 0.45f)},
                  32, linearColour(0xbdb8ae));
    pond.addLathe(std::array{glm::vec2(7.0f, 0.45f), glm::vec2(0.0f, 0.45f)}, 32, linearColour(0x3f6d80));
    lawn.append(pond);
    lawn.texCoords.assign(lawn.positions.size(), glm::vec2(0.0f));
    ground.lawn = kit.geometry("park", lawn, plain);
    for (const std::uint32_t tone : {0x8b9a52u, 0x9aa05au, 0x7d9150u, 0xb3a468u}) {
        Mesh field = square(1, kHalfCell, 0.0f, linearColour(tone));
        field.texCoords.assign(field.positions.size(), glm::vec2(0.0f));
        ground.fields.push_back(kit.geometry("field", field, plain));
    }
    return ground;
}

class CityBuilder {
 public:
    CityBuilder(SceneKit& kit, int buildings)
        : _kit(kit), _left(buildings), _catalogue(makeBuildings(kit)), _ground(makeGround(kit)) {}

    // Returns the radius of the built-up part in metres.
    double build() {
        const int wanted = _left;
        _cityRadius = std::max(1.0, std::sqrt(static_cast<double>(wanted) / 7.0 / 3.14159265));
        const int outer = static_cast<int>(std::ceil(_cityRadius * 1.25)) + 7;
        double builtRadius = 1.0;
        for (const Cell& cell : cellsWithin(outer)) {
            const Ref<Node> block = _kit.place(_kit.world(), fmt::format("block {},{}", cell.column, cell.row),
                                               {kCell * cell.column, 0.0, kCell * cell.row});
            if (_left > 0) {
                fillBlock(block, cell);
                builtRadius = std::sqrt(static_cast<double>(cell.squaredDistance())) + 0.7;
            } else {
                fillField(block);
            }
        }
        return builtRadius * kCell;
    }

 private:
    void put(Ref<Node> block, const char* name, Ref<Geometry> geometry, double x, double y, double z, float turn,
             float size = 1.0f) {
        _kit.placeShape(block, name, geometry, {x, y, z}, size * turned(turn, {0, 1, 0}));
    }

    void fillField(Ref<Node> block) {
        _kit.node(block, "field", Ref<Container>(_ground.fields[_random.below(4)].id));
        if (_random.unit() < 0.3f) putTree(block, _random.between(-34.0f, 34.0f), 0.0, _random.between(-34.0f, 34.0f));
    }

    void putTree(Ref<Node> block, double x, double y, double z) {
        put(block, "tree", _catalogue.trees[_random.below(3)], x, y, z, _random.between(0.0f, 6.28f),
            _random.between(0.8f, 1.25f));
    }

    void putBuilding(Ref<Node> block, BuildingKind kind, double x, double z) {
        const auto& variants = _catalogue.variants[static_cast<std::size_t>(kind)];
        put(block, "building", variants[_random.below(static_cast<std::uint32_t>(variants.size()))], x, kKerb, z,
            1.57079633f * static_cast<float>(_random.below(4)));
        --_left;
    }

    void fillBlock(Ref<Node> block, const Cell& cell) {
        _kit.node(block, "street", Ref<Container>(_ground.street.id));
        const bool first = cell.squaredDistance() == 0;
        if (!first && _random.unit() < 0.07f) return fillPark(block);
        _kit.node(block, "pavement", Ref<Container>(_ground.pavement.id));
        const double centrality = std::sqrt(static_cast<double>(cell.squaredDistance())) / _cityRadius;
        const float blur = _random.between(-0.12f, 0.12f);
        if (centrality + blur < 0.36)
            fillDowntown(block);
        else
            fillPerimeter(block, centrality + blur > 0.74);
        for (int i = 0; i < 2; ++i) {
            // Along the kerb of one of the four sides.
            const float at = -24.0f + 12.0f * static_cast<float>(_random.below(5));
            const float edge = kHalfBlock - 1.4f;
            switch (_random.below(4)) {
                case 0:
                    putTree(block, at, kKerb, edge);
                    break;
                case 1:
                    putTree(block, at, kKerb, -edge);
                    break;
                case 2:
                    putTree(block, edge, kKerb, at);
                    break;
                default:
                    putTree(block, -edge, kKerb, at);
                    break;
            }
        }
    }

    void fillPark(Ref<Node> block) {
        _kit.node(block, "park", Ref<Container>(_ground.lawn.id));
        for (int i = 0; i < 14; ++i) {
            const float angle = 6.2831853f * (static_cast<float>(i) + _random.between(-0.3f, 0.3f)) / 14.0f;
            const float radius = _random.between(11.0f, 23.0f);
            putTree(block, radius * std::cos(angle), kKerb, radius * std::sin(angle));
        }
    }

    void fillDowntown(Ref<Node> block) {
        for (int lot = 0; lot < 4 && _left > 0; ++lot) {
            const double x = (lot % 2 == 0 ? -12.6 : 12.6);
            const double z = (lot / 2 == 0 ? -12.6 : 12.6);
            const float choice = _random.unit();
            putBuilding(block,
                        choice < 0.34f   ? BuildingKind::GlassTower
                        : choice < 0.58f ? BuildingKind::SteppedTower
                        : choice < 0.74f ? BuildingKind::RoundTower
                                         : BuildingKind::Office,
                        x, z);
        }
    }

    // Eight lots around a courtyard.
    void fillPerimeter(Ref<Node> block, bool suburb) {
        for (int lot = 0; lot < 9 && _left > 0; ++lot) {
            const double x = 16.4 * (lot % 3 - 1);
            const double z = 16.4 * (lot / 3 - 1);
            if (lot == 4) {
                putTree(block, x + 2.0, kKerb, z - 1.0);
                continue;
            }
            const float choice = _random.unit();
            if (suburb)
                putBuilding(block,
                            choice < 0.62f   ? BuildingKind::House
                            : choice < 0.82f ? BuildingKind::CornerHouse
                            : choice < 0.9f  ? BuildingKind::Warehouse
                                             : BuildingKind::Apartments,
                            x, z);
            else
                putBuilding(block,
                            choice < 0.5f   ? BuildingKind::Apartments
                            : choice < 0.9f ? BuildingKind::Brick
                                            : BuildingKind::CornerHouse,
                            x, z);
        }
    }

    SceneKit& _kit;
    int _left;
    double _cityRadius = 1.0;
    ProceduralRandom _random{2005};
    BuildingCatalogue _catalogue;
    GroundKit _ground;
};

}  // namespace

Ref<LoadedScene> buildCity(Aspect& aspect, int buildings) {
    SceneKit kit(aspect, "city", {-0.74f, -0.60f, -0.30f}, glm::vec3(3.3f, 3.0f, 2.6f), glm::vec3(0.27f, 0.32f, 0.4f));
    const double radius = CityBuilder(kit, buildings).build();
    kit.camera("main", {0.42 * radius, 0.24 * radius + 30.0, 0.66 * radius + 20.0},
               {-0.02 * radius, 0.02 * radius + 12.0, 0.0}, 42.0);
    return kit.scene();
}

}  // namespace umbriel
