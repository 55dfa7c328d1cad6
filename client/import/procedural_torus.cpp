#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/import/procedural_demos.h"
#include "client/import/procedural_kit.h"

namespace umbriel {

// A torus lying on nothing, of n segments around and half as many across: coarse or fine, for what interpolation does.
Ref<LoadedScene> buildTorus(Aspect& aspect, int segments) {
    SceneKit kit(aspect, "torus", {-0.35f, -0.7f, -0.6f}, glm::vec3(2.6f), glm::vec3(0.12f));
    constexpr float kTau = 2.0f * std::numbers::pi_v<float>;
    constexpr float kRing = 1.0f;  // metres
    constexpr float kTube = 0.42f;
    segments = std::max(segments, 3);
    const int across = std::max(segments / 2, 3);
    Mesh mesh;
    for (int column = 0; column <= segments; ++column)
        for (int row = 0; row <= across; ++row) {
            const float u = static_cast<float>(column) / static_cast<float>(segments);
            const float v = static_cast<float>(row) / static_cast<float>(across);
            const glm::vec3 outwards(std::cos(kTau * u), 0.0f, -std::sin(kTau * u));
            const glm::vec3 normal = outwards * std::cos(kTau * v) + glm::vec3(0, std::sin(kTau * v), 0);
            mesh.addVertex(outwards * kRing + normal * kTube, normal, glm::vec4(1.0f), {u, v});
        }
    const auto stride = static_cast<std::uint32_t>(across + 1);
    for (std::uint32_t column = 0; column < static_cast<std::uint32_t>(segments); ++column)
        for (std::uint32_t row = 0; row + 1 < stride; ++row) {
            const std::uint32_t a = column * stride + row;
            mesh.addTriangle(a, a + stride, a + stride + 1);
            mesh.addTriangle(a, a + stride + 1, a + 1);
        }
    const Ref<Material> material =
        kit.material("enamel", {.colour = linearColour(0x2f6fb0), .metallic = 0.0f, .roughness = 0.35f});
    kit.placeShape(kit.world(), "torus", kit.geometry("torus", mesh, material), {0, 0, 0}, turned(0.6f, {1, 0, 0}));
    kit.pointLight("lamp", {-1.6, 1.4, 2.2}, glm::vec3(5.0f, 4.6f, 4.0f));
    kit.camera("main", {0.0, 0.9, 4.4}, {0.0, 0.0, 0.0}, 38.0);
    return kit.scene();
}

}  // namespace umbriel
