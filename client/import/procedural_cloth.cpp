#include <algorithm>
#include <array>
#include <cmath>

#include "client/import/procedural_demos.h"
#include "client/import/procedural_kit.h"
#include "client/import/procedural_random.h"

namespace umbriel {

namespace {

constexpr float kSide = 2.3f;  // of the cloth, metres
constexpr float kBallRadius = 0.46f;
constexpr glm::vec3 kBallCentre{0.0f, 0.78f, 0.0f};
constexpr float kThickness = 0.012f;  // keeps the cloth off what it lies on
constexpr int kCells = 50;            // of the simulated grid, along a side
constexpr int kRefined = 2;           // drawn cells per simulated one
constexpr int kPoints = kCells + 1;

// Position-based dynamics (Mueller et al. 2007): deterministic, for it uses only +, -, *, / and sqrt in a fixed order.
class ClothSimulation {
 public:
    ClothSimulation() : _positions(kPoints * kPoints), _previous(kPoints * kPoints) {
        // Tiny bumps decide where folds begin; the cloth starts turned against the view.
        ProceduralRandom random(20);
        for (int row = 0; row < kPoints; ++row)
            for (int column = 0; column < kPoints; ++column) {
                const float x = kSide * (static_cast<float>(column) / kCells - 0.5f);
                const float z = kSide * (0.5f - static_cast<float>(row) / kCells);
                edited(column, row) =
                    glm::vec3(0.96f * x - 0.28f * z, kBallCentre.y + kBallRadius + 0.03f + random.between(0.0f, 0.01f),
                              0.28f * x + 0.96f * z);
            }
        _previous = _positions;
        const float spacing = kSide / kCells;
        for (int row = 0; row < kPoints; ++row)
            for (int column = 0; column < kPoints; ++column) {
                connect(column, row, 1, 0, spacing, 1.0f);
                connect(column, row, 0, 1, spacing, 1.0f);
                connect(column, row, 1, 1, spacing * 1.41421356f, 0.35f);
                connect(column, row, -1, 1, spacing * 1.41421356f, 0.35f);
                connect(column, row, 2, 0, spacing * 2.0f, 0.05f);
                connect(column, row, 0, 2, spacing * 2.0f, 0.05f);
            }
    }

    void run(int steps) {
        constexpr float kTimeStep = 1.0f / 90.0f;
        for (int step = 0; step < steps; ++step) {
            for (std::size_t i = 0; i < _positions.size(); ++i) {
                const glm::vec3 velocity = (_positions[i] - _previous[i]) * 0.985f;
                _previous[i] = _positions[i];
                _positions[i] += velocity + glm::vec3(0.0f, -9.81f * kTimeStep * kTimeStep, 0.0f);
            }
            for (int iteration = 0; iteration < 10; ++iteration) {
                // Forwards and backwards in turn, so that no side of the cloth is favoured.
                for (std::size_t i = 0; i < _links.size(); ++i)
                    relax(_links[iteration % 2 == 0 ? i : _links.size() - 1 - i]);
                for (std::size_t i = 0; i < _positions.size(); ++i) collide(i);
            }
        }
    }

    const glm::vec3& at(int column, int row) const {
        return _positions[static_cast<std::size_t>(std::clamp(row, 0, kCells) * kPoints +
                                                   std::clamp(column, 0, kCells))];
    }

 private:
    struct Link {
        std::uint32_t a;
        std::uint32_t b;
        float length;
        float stiffness;
    };

    glm::vec3& edited(int column, int row) { return _positions[static_cast<std::size_t>(row * kPoints + column)]; }

    void connect(int column, int row, int columns, int rows, float length, float stiffness) {
        const int otherColumn = column + columns;
        const int otherRow = row + rows;
        if (otherColumn < 0 || otherColumn > kCells || otherRow > kCells) return;
        _links.push_back({static_cast<std::uint32_t>(row * kPoints + column),
                          static_cast<std::uint32_t>(otherRow * kPoints + otherColumn), length, stiffness});
    }

    void relax(const Link& link) {
        const glm::vec3 apart = _positions[link.b] - _positions[link.a];
        const float distance = std::sqrt(glm::dot(apart, apart));
        if (distance < 1e-9f) return;
        const glm::vec3 correction = apart * (0.5f * link.stiffness * (distance - link.length) / distance);
        _positions[link.a] += correction;
        _positions[link.b] -= correction;
    }

    // Out of the ball and the floor; the previous position follows halfway, which is friction.
    void collide(std::size_t i) {
        glm::vec3& position = _positions[i];
        const glm::vec3 fromCentre = position - kBallCentre;
        const float square = glm::dot(fromCentre, fromCentre);
        constexpr float kReach = kBallRadius + kThickness;
        if (square < kReach * kReach && square > 0.0f) {
            position = kBallCentre + fromCentre * (kReach / std::sqrt(square));
            _previous[i] += 0.25f * (position - _previous[i]);
        }
        if (position.y < kThickness) {
            position.y = kThickness;
            _previous[i] += 0.5f * (position - _previous[i]);
        }
    }

    std::vector<glm::vec3> _positions;
    std::vector<glm::vec3> _previous;
    std::vector<Link> _links;
};

// Catmull-Rom between the simulated points; t in [0,1] between b and c.
glm::vec3 spline(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d, float t) {
    return b + 0.5f * t * ((c - a) + t * ((2.0f * a - 5.0f * b + 4.0f * c - d) + t * (3.0f * (b - c) + d - a)));
}

Mesh clothMesh() {
    ClothSimulation cloth;
    cloth.run(480);
    Mesh mesh;
    mesh.addGrid(kCells * kRefined, kCells * kRefined, glm::vec4(1.0f), [&](int column, int row) {
        const int baseColumn = std::min(column / kRefined, kCells - 1);
        const int baseRow = std::min(row / kRefined, kCells - 1);
        const float across = static_cast<float>(column - baseColumn * kRefined) / kRefined;
        const float up = static_cast<float>(row - baseRow * kRefined) / kRefined;
        std::array<glm::vec3, 4> lines;
        for (int i = 0; i < 4; ++i)
            lines[static_cast<std::size_t>(i)] =
                spline(cloth.at(baseColumn - 1, baseRow - 1 + i), cloth.at(baseColumn, baseRow - 1 + i),
                       cloth.at(baseColumn + 1, baseRow - 1 + i), cloth.at(baseColumn + 2, baseRow - 1 + i), across);
        glm::vec3 position = spline(lines[0], lines[1], lines[2], lines[3], up);
        const glm::vec3 fromCentre = position - kBallCentre;
        const float distance = std::sqrt(glm::dot(fromCentre, fromCentre));
        constexpr float kReach = kBallRadius + 0.5f * kThickness;
        if (distance < kReach) position = kBallCentre + fromCentre * (kReach / distance);
        position.y = std::max(position.y, 0.5f * kThickness);
        return position;
    });
    return mesh;
}

// A checked cloth: bands of colour crossing each other, as a weaver mixes them.
TexelGrid checks() {
    return makeTexels(512, 512, [](int x, int row) {
        const auto band = [](int position) {
            const int inRepeat = position % 128;
            return inRepeat < 44 ? 1.0f : (inRepeat >= 82 && inRepeat < 90) ? 0.75f : 0.0f;
        };
        const float across = band(x);
        const float down = band(row);
        const glm::vec3 ground = srgb(0xe9e1d0);
        const glm::vec3 colour = srgb(0x1f5f6b);
        const bool warpOnTop = ((x / 2) + (row / 2)) % 2 == 0;
        const float thread = 0.5f * (across + down) + 0.25f * (warpOnTop ? across - down : down - across);
        return glm::mix(ground, colour, thread) * (0.95f + 0.05f * tilingNoise(x / 8.0f, row / 8.0f, 64, 5));
    });
}

}  // namespace

Ref<LoadedScene> buildCloth(Aspect& aspect) {
    SceneKit kit(aspect, "cloth", {-0.62f, -0.78f, -0.42f}, glm::vec3(3.1f, 2.95f, 2.7f),
                 glm::vec3(0.24f, 0.27f, 0.32f));

    Mesh cloth = clothMesh();
    cloth.computeTangents();
    const Ref<Texture> pattern = kit.texture(kit.image("checks", checks()));
    const Ref<Texture> weave = kit.texture(
        kit.image("weave", normalMapOf(64, 64, [](int x, int row) {
                      const float warp = std::abs(std::sin(3.14159265f * (static_cast<float>(x) + 0.5f) / 8.0f));
                      const float weft = std::abs(std::sin(3.14159265f * (static_cast<float>(row) + 0.5f) / 8.0f));
                      return ((x / 8 + row / 8) % 2 == 0 ? warp : weft) * 1.6f;
                  })));
    aspect.edit(pattern).set<&Texture::scale>(glm::vec2(3.0f));
    aspect.edit(weave).set<&Texture::scale>(glm::vec2(60.0f));
    const Ref<Material> fabric = kit.material("fabric", {.roughness = 0.95f,
                                                         .doubleSided = true,
                                                         .colourTexture = pattern,
                                                         .normalTexture = weave,
                                                         .normalScale = 0.6f});
    kit.node(kit.world(), "cloth", Ref<Container>(kit.geometry("cloth", cloth, fabric).id));

    Mesh ball;
    ball.addSphere(kBallCentre, kBallRadius, 64, 32, glm::vec4(1.0f));
    kit.node(
        kit.world(), "ball",
        Ref<Container>(
            kit.geometry("ball", ball,
                         kit.material("brass", {.colour = linearColour(0xd8b061), .metallic = 1.0f, .roughness = 0.3f}))
                .id));
    Mesh stand;
    const std::array<glm::vec2, 8> profile = {
        glm::vec2(0.30f, 0.0f),  glm::vec2(0.30f, 0.03f), glm::vec2(0.30f, 0.03f),  glm::vec2(0.06f, 0.06f),
        glm::vec2(0.045f, 0.2f), glm::vec2(0.05f, 0.3f),  glm::vec2(0.11f, 0.335f), glm::vec2(0.11f, 0.36f)};
    stand.addLathe(profile, 40, glm::vec4(1.0f));
    kit.node(kit.world(), "stand",
             Ref<Container>(kit.geometry("stand", stand,
                                         kit.material("wood", {.colour = linearColour(0x5a3d28), .roughness = 0.5f}))
                                .id));

    // Floor boards, each with its own shade.
    const Ref<Material> boardMaterial = kit.material("boards", {.roughness = 0.55f});
    ProceduralRandom random(7);
    for (int part = 0; part < 6; ++part) {
        Mesh boards;
        for (int board = 0; board < 4; ++board) {
            const float left = -3.0f + static_cast<float>(part * 4 + board) * 0.25f;
            float start = -3.0f - random.between(0.0f, 1.4f);
            while (start < 3.0f) {
                const float end = start + 1.8f;
                const float from = std::max(start, -3.0f);
                const float to = std::min(end, 3.0f);
                const glm::vec4 tone = glm::mix(linearColour(0x8a6a4c), linearColour(0xa98762), random.unit());
                if (to > from)
                    boards.addQuad({left + 0.002f, 0, to - 0.002f}, {left + 0.248f, 0, to - 0.002f},
                                   {left + 0.248f, 0, from + 0.002f}, {left + 0.002f, 0, from + 0.002f}, tone);
                start = end;
            }
        }
        kit.node(kit.world(), "boards", Ref<Container>(kit.geometry("boards", boards, boardMaterial).id));
    }
    Mesh under;
    under.addQuad({-3, -0.004f, 3}, {3, -0.004f, 3}, {3, -0.004f, -3}, {-3, -0.004f, -3}, linearColour(0x1d1712));
    kit.node(kit.world(), "gaps", Ref<Container>(kit.geometry("gaps", under, boardMaterial).id));

    kit.camera("main", {1.75, 1.55, 2.35}, {0.0, 0.55, 0.0}, 38.0);
    return kit.scene();
}

}  // namespace umbriel
