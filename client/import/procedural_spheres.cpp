#include <fmt/format.h>

#include <cmath>

#include "client/import/procedural_demos.h"
#include "client/import/procedural_kit.h"

namespace umbriel {

namespace {

// A floor in separate squares of two tones, so that parts of it can be culled.
void addFloor(SceneKit& kit, double side, int squares) {
    const Ref<Material> material = kit.material("floor", {.roughness = 0.9f});
    for (int tone = 0; tone < 2; ++tone) {
        Mesh mesh;
        const auto half = static_cast<float>(0.5 * side / squares);
        mesh.addQuad({-half, 0, half}, {half, 0, half}, {half, 0, -half}, {-half, 0, -half},
                     linearColour(tone == 0 ? 0xb9bcc0 : 0xa4a8ad));
        const Ref<Geometry> square = kit.geometry(tone == 0 ? "light square" : "dark square", mesh, material);
        for (int row = 0; row < squares; ++row)
            for (int column = 0; column < squares; ++column)
                if ((row + column) % 2 == tone)
                    kit.placeShape(kit.world(), fmt::format("floor {},{}", column, row), square,
                                   {(column + 0.5 - 0.5 * squares) * side / squares, 0.0,
                                    (row + 0.5 - 0.5 * squares) * side / squares});
    }
}

}  // namespace

Ref<LoadedScene> buildSpheres(Aspect& aspect, int count) {
    const int perSide = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
    SceneKit kit(aspect, "spheres", {-0.45f, -0.9f, -0.5f}, glm::vec3(2.9f, 2.8f, 2.6f),
                 glm::vec3(0.28f, 0.32f, 0.38f));
    constexpr double kRadius = 0.4;
    const double extent = perSide;

    Mesh ball;
    ball.addSphere({0, 0, 0}, static_cast<float>(kRadius), 40, 20, glm::vec4(1.0f));
    const Ref<Geometry> sphere = kit.geometry("sphere", ball, kit.material("white", {}));
    // One geometry for all: the material of each sphere is in a group above it.
    for (int row = 0; row < perSide; ++row)
        for (int column = 0; column < perSide && row * perSide + column < count; ++column) {
            const float across = perSide > 1 ? static_cast<float>(column) / static_cast<float>(perSide - 1) : 0.3f;
            const float back = perSide > 1 ? static_cast<float>(row) / static_cast<float>(perSide - 1) : 0.0f;
            const std::string name = fmt::format("roughness {:.2f} metallic {:.2f}", across, back);
            // From a ceramic red to gold: a metal's colour is that of its reflections.
            const Ref<Material> material =
                kit.material(name, {.colour = glm::mix(linearColour(0xb3352b), linearColour(0xf2c462), back),
                                    .metallic = back,
                                    .roughness = 0.05f + 0.95f * across});
            const auto group = aspect.create<MaterialGroup>(name);
            aspect.edit(group).set<&MaterialGroup::material>(Ref<Container>(material.id));
            const Ref<Node> placed =
                kit.place(kit.world(), name, {column - 0.5 * (perSide - 1), kRadius, 0.5 * (perSide - 1) - row});
            const Ref<Node> grouped = kit.node(placed, name, Ref<Container>(group.id));
            kit.node(grouped, name, Ref<Container>(sphere.id));
        }
    addFloor(kit, extent + 4.0, perSide + 4);
    // Highlights from three sides; they cast no shadows.
    const auto strength = static_cast<float>(1.2 + 0.25 * extent * extent);
    kit.pointLight("left lamp", {-0.8 * extent - 1.0, 0.6 * extent + 1.5, 0.5 * extent},
                   strength * glm::vec3(1.0f, 0.7f, 0.5f));
    kit.pointLight("right lamp", {0.8 * extent + 1.0, 0.6 * extent + 1.5, 0.2 * extent},
                   strength * glm::vec3(0.5f, 0.7f, 1.0f));
    kit.camera("main", {0.0, 0.85 * extent + 0.9, 1.15 * extent + 1.6}, {0.0, 0.1, 0.08 * extent}, 32.0);
    return kit.scene();
}

}  // namespace umbriel
