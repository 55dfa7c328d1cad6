#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "client/import/procedural_demos.h"
#include "client/import/procedural_kit.h"
#include "client/import/procedural_random.h"

namespace umbriel {

namespace {

// The sun travels across the view of the camera "main", which looks along -z: the case where warped maps do best
// (Hempe 2005, 10.1.1); the other cameras turn towards it.
constexpr glm::vec3 kSunTravel{0.72f, -0.66f, 0.02f};

constexpr float kFloorHalfWidth = 45.0f;  // metres, x
constexpr float kFloorNear = 20.0f;       // z towards the viewer
constexpr float kFloorFar = -110.0f;
constexpr int kFronds = 9;     // of a palm
constexpr int kLeaflets = 13;  // on either side of a frond
constexpr int kTrianglesWithoutPalms = 1781;

// A tube through points with a radius at each; open at its ends, smooth.
void addTube(Mesh& mesh, const std::vector<glm::vec3>& points, const std::vector<float>& radii, int segments,
             const glm::vec4& colour) {
    const int rows = static_cast<int>(points.size()) - 1;
    mesh.addGrid(segments, rows, colour, [&](int column, int row) {
        const auto i = static_cast<std::size_t>(row);
        const glm::vec3 ahead = glm::normalize(points[std::min(i + 1, points.size() - 1)] - points[i > 0 ? i - 1 : 0]);
        const glm::vec3 helper = std::abs(ahead.z) < 0.9f ? glm::vec3(0, 0, 1) : glm::vec3(1, 0, 0);
        const glm::vec3 right = glm::normalize(glm::cross(ahead, helper));
        const glm::vec3 up = glm::cross(right, ahead);
        const float angle = 6.2831853f * static_cast<float>(column % segments) / static_cast<float>(segments);
        return points[i] + radii[i] * (std::cos(angle) * right - std::sin(angle) * up);
    });
}

// A drooping rib with narrow leaflets on both sides: what makes a palm's shadow hard for a map.
void addFrond(Mesh& leaves, Mesh& wood, const glm::vec3& crown, float turn, float lift, float length,
              ProceduralRandom& random) {
    constexpr int kRibs = 6;
    const glm::vec3 out(std::cos(turn), 0.0f, std::sin(turn));
    const glm::vec3 side(-out.z, 0.0f, out.x);
    const auto rib = [&](float t) {
        return crown + length * (t * out + (lift * t - (0.55f + 0.5f * lift) * t * t) * glm::vec3(0, 1, 0));
    };
    std::vector<glm::vec3> points;
    std::vector<float> radii;
    for (int i = 0; i <= kRibs; ++i) {
        const float t = static_cast<float>(i) / kRibs;
        points.push_back(rib(t));
        radii.push_back(0.035f * (1.0f - 0.85f * t));
    }
    addTube(wood, points, radii, 4, linearColour(0x6d7a35));
    for (int i = 0; i < kLeaflets; ++i) {
        const float t = 0.12f + 0.86f * (static_cast<float>(i) + 0.5f) / kLeaflets;
        const glm::vec3 root = rib(t);
        const glm::vec3 along = glm::normalize(rib(t + 0.01f) - root);
        const float reach = length * (0.33f * (1.0f - t * t) + 0.07f);
        for (const float hand : {-1.0f, 1.0f}) {
            const glm::vec3 tip = root + reach * (0.86f * hand * side + 0.45f * along) -
                                  glm::vec3(0, reach * random.between(0.18f, 0.36f), 0);
            const glm::vec3 half = 0.03f * along;
            const glm::vec3 middle = glm::mix(root, tip, 0.55f) + glm::vec3(0, 0.04f * reach, 0);
            const glm::vec4 tone = glm::mix(linearColour(0x3f6b2c), linearColour(0x86a04a), random.unit());
            leaves.addFlatTriangle(root - half, root + half, middle + half, tone);
            leaves.addFlatTriangle(root - half, middle + half, middle - half, tone);
            leaves.addFlatTriangle(middle - half, middle + half, tip, tone);
        }
    }
}

struct PalmMesh {
    Mesh wood, leaves;
    std::size_t triangles() const { return (wood.indices.size() + leaves.indices.size()) / 3; }
};

struct PalmShape {
    Ref<Geometry> trunk;
    Ref<Geometry> leaves;
};

PalmMesh palmMesh(int variant) {
    ProceduralRandom random(5100 + static_cast<std::uint64_t>(variant));
    const float height = random.between(5.2f, 7.4f);
    const float lean = random.between(0.5f, 1.5f);
    Mesh wood, leaves;
    std::vector<glm::vec3> points;
    std::vector<float> radii;
    constexpr int kRings = 7;
    for (int i = 0; i <= kRings; ++i) {
        const float t = static_cast<float>(i) / kRings;
        points.push_back({lean * t * t, height * t, 0.3f * lean * std::sin(2.2f * t)});
        radii.push_back(0.24f - 0.12f * t);
    }
    addTube(wood, points, radii, 8, linearColour(0x8b6f4e));
    for (int i = 0; i < kFronds; ++i) {
        const float turn = 6.2831853f * (static_cast<float>(i) + random.between(-0.25f, 0.25f)) / kFronds;
        addFrond(leaves, wood, points.back(), turn, i % 3 == 0 ? 0.85f : random.between(0.1f, 0.5f),
                 random.between(2.3f, 3.1f), random);
    }
    return {std::move(wood), std::move(leaves)};
}

Ref<Geometry> makeAeroplane(SceneKit& kit) {
    Mesh mesh;
    const glm::vec4 white = linearColour(0xe4e6ea), red = linearColour(0xb3262a);
    std::vector<glm::vec3> spine;
    std::vector<float> radii;
    constexpr std::array<float, 9> kGirth = {0.02f, 0.26f, 0.42f, 0.5f, 0.5f, 0.45f, 0.32f, 0.18f, 0.04f};
    for (std::size_t i = 0; i < kGirth.size(); ++i) {
        spine.push_back({-3.2f + 6.4f * static_cast<float>(i) / 8.0f, 0.0f, 0.0f});
        radii.push_back(kGirth[i]);
    }
    addTube(mesh, spine, radii, 14, white);
    mesh.addBox({-0.9f, -0.12f, -4.2f}, {0.35f, -0.02f, 4.2f}, red);
    mesh.addBox({2.4f, 0.0f, -1.4f}, {3.1f, 0.07f, 1.4f}, red);
    mesh.addBox({2.5f, 0.0f, -0.04f}, {3.15f, 1.1f, 0.04f}, red);
    mesh.addBox({-3.3f, -0.75f, -0.05f}, {-3.24f, 0.75f, 0.05f}, linearColour(0x303234));
    return kit.geometry("aeroplane", mesh, kit.material("paint", {.roughness = 0.35f, .doubleSided = true}));
}

Ref<Geometry> makeDinosaur(SceneKit& kit) {
    Mesh mesh;
    const glm::vec4 green = linearColour(0x5f7d4a);
    const auto limb = [&](std::vector<glm::vec3> points, std::vector<float> radii, int segments) {
        addTube(mesh, points, radii, segments, green);
    };
    // Tail, body, neck and head in one line.
    limb({{-2.6f, 0.35f, 0.4f},
          {-1.9f, 0.6f, 0.2f},
          {-1.2f, 0.9f, 0.0f},
          {-0.6f, 1.1f, 0.0f},
          {0.1f, 1.2f, 0.0f},
          {0.8f, 1.15f, 0.0f},
          {1.25f, 1.35f, 0.0f},
          {1.6f, 1.9f, 0.0f},
          {1.8f, 2.5f, 0.0f},
          {2.0f, 2.9f, 0.0f},
          {2.3f, 2.95f, 0.0f},
          {2.65f, 2.85f, 0.0f},
          {2.8f, 2.8f, 0.0f}},
         {0.02f, 0.12f, 0.28f, 0.55f, 0.7f, 0.55f, 0.34f, 0.22f, 0.17f, 0.17f, 0.2f, 0.13f, 0.02f}, 14);
    for (const float x : {-0.5f, 0.75f})
        for (const float z : {-0.38f, 0.38f})
            limb({{x, 1.0f, z}, {x + 0.06f, 0.55f, 1.12f * z}, {x, 0.12f, 1.15f * z}, {x + 0.05f, 0.0f, 1.15f * z}},
                 {0.26f, 0.19f, 0.14f, 0.17f}, 8);
    // Plates along the back, as thin as leaves.
    for (int i = 0; i < 9; ++i) {
        const float x = -1.5f + 0.3f * static_cast<float>(i);
        const float y = 1.05f + 0.72f * std::exp(-0.9f * (x - 0.1f) * (x - 0.1f));
        mesh.addFlatTriangle({x - 0.12f, y - 0.12f, 0.0f}, {x + 0.14f, y - 0.12f, 0.0f}, {x - 0.02f, y + 0.3f, 0.0f},
                             linearColour(0xa8683c));
    }
    return kit.geometry("dinosaur", mesh, kit.material("hide", {.roughness = 0.85f, .doubleSided = true}));
}

}  // namespace

Ref<LoadedScene> buildPalms(Aspect& aspect, int palms, int triangles) {
    SceneKit kit(aspect, "palms", kSunTravel, glm::vec3(3.2f, 3.05f, 2.75f), glm::vec3(0.26f, 0.3f, 0.36f));

    // Seen from below as well: shadows fall through to the other side.
    Mesh sand;
    sand.addGrid(18, 26, glm::vec4(1.0f), [](int column, int row) {
        const float x = glm::mix(-kFloorHalfWidth, kFloorHalfWidth, static_cast<float>(column) / 18.0f);
        const float z = glm::mix(kFloorNear, kFloorFar, static_cast<float>(row) / 26.0f);
        return glm::vec3(x, 0.0f, z);
    });
    const Ref<Texture> grain = kit.texture(kit.image(
        "sand", makeTexels(256, 256, [](int x, int row) {
            const float noise = tilingNoise(static_cast<float>(x) / 16.0f, static_cast<float>(row) / 16.0f, 16, 11);
            return glm::mix(srgb(0xcbb28a), srgb(0xe6d3ae), noise);
        })));
    aspect.edit(grain).set<&Texture::scale>(glm::vec2(12.0f, 18.0f));
    const Ref<Material> sandMaterial =
        kit.material("sand", {.roughness = 0.95f, .doubleSided = true, .colourTexture = grain});
    kit.node(kit.world(), "floor", Ref<Container>(kit.geometry("floor", sand, sandMaterial).id));

    const Ref<Material> bark = kit.material("bark", {.roughness = 0.9f, .doubleSided = true});
    const Ref<Material> leaf = kit.material("leaf", {.roughness = 0.7f, .doubleSided = true});
    const std::array<PalmMesh, 3> meshes = {palmMesh(0), palmMesh(1), palmMesh(2)};
    const auto shapeOf = [&](const std::string& name, const PalmMesh& mesh) {
        return PalmShape{kit.geometry(name + " wood", mesh.wood, bark), kit.geometry(name + " leaves", mesh.leaves, leaf)};
    };
    std::array<PalmShape, 3> shapes;
    for (std::size_t i = 0; i < 3; ++i) shapes[i] = shapeOf(fmt::format("palm {}", i), meshes[i]);
    const auto plant = [&](int index, double x, double z, float turn, float size, const PalmShape& shape) {
        const Ref<Node> palm =
            kit.place(kit.world(), fmt::format("palm {}", index), {x, 0.0, z}, size * turned(turn, {0, 1, 0}));
        kit.node(palm, "trunk", Ref<Container>(shape.trunk.id));
        kit.node(palm, "leaves", Ref<Container>(shape.leaves.id));
    };
    // At three distances from the camera "main", as in the thesis: near, in the middle, at the end of the scene.
    constexpr std::array<glm::dvec2, 9> kPlaces = {
        glm::dvec2(-6.0, 3.0),    glm::dvec2(4.2, -1.0),   glm::dvec2(-3.5, -9.0),
        glm::dvec2(-11.0, -24.0), glm::dvec2(1.5, -27.0),  glm::dvec2(11.0, -31.0),
        glm::dvec2(-19.0, -70.0), glm::dvec2(-1.0, -76.0), glm::dvec2(17.0, -82.0)};
    ProceduralRandom random(69);
    std::size_t left = triangles > kTrianglesWithoutPalms ? static_cast<std::size_t>(triangles - kTrianglesWithoutPalms) : 0;
    for (int i = 0; triangles > 0 ? left > 0 : i < palms; ++i) {
        const float turn = random.between(0.0f, 6.2831853f);
        const float size = random.between(0.85f, 1.15f);
        const auto at = static_cast<std::size_t>(i);
        const double x = random.between(-0.9f * kFloorHalfWidth, 0.9f * kFloorHalfWidth);
        const double z = random.between(kFloorFar + 8.0f, -36.0f);
        PalmShape shape = shapes[at % 3];
        if (triangles > 0 && left < meshes[at % 3].triangles()) {
            // The last one has as many leaflets as are left, then as much of its wood.
            PalmMesh rest = meshes[at % 3];
            const std::size_t leaves = std::min(3 * left, rest.leaves.indices.size());
            rest.leaves.indices.resize(leaves);
            rest.wood.indices.resize(3 * left - leaves);
            shape = shapeOf("last palm", rest);
            left = 0;
        } else if (triangles > 0) {
            left -= meshes[at % 3].triangles();
        }
        if (at < kPlaces.size())
            plant(i, kPlaces[at].x, kPlaces[at].y, turn, size, shape);
        else
            plant(i, x, z, turn, size, shape);
    }
    kit.placeShape(kit.world(), "aeroplane", makeAeroplane(kit), {-1.8, 4.4, 2.5},
                   turned(0.5f, {0, 1, 0}) * turned(-0.12f, {1, 0, 0}));
    kit.placeShape(kit.world(), "dinosaur", makeDinosaur(kit), {1.2, 0.0, 4.5}, turned(2.4f, {0, 1, 0}));
    // Right before the eye of "near" and of "main's" right edge: what the perspective map spends its texels on.
    Mesh post;
    post.addBox({-0.05f, 0.0f, -0.05f}, {0.05f, 1.15f, 0.05f}, linearColour(0x7a4b2a));
    post.addBox({-0.32f, 1.0f, -0.03f}, {0.32f, 1.06f, 0.03f}, linearColour(0x7a4b2a));
    post.addBox({-0.32f, 0.74f, -0.03f}, {0.32f, 0.8f, 0.03f}, linearColour(0x7a4b2a));
    kit.placeShape(kit.world(), "post", kit.geometry("post", post, kit.material("wood", {.roughness = 0.8f})),
                   {-2.6, 0.0, 12.6}, turned(0.6f, {0, 1, 0}));

    const glm::dvec3 travel = glm::normalize(glm::dvec3(kSunTravel));
    const glm::dvec3 middle(0.0, 0.0, -8.0);
    kit.camera("main", {0.0, 4.8, 16.0}, {0.0, 0.9, -8.0}, 50.0);
    kit.camera("near", {-2.5, 1.35, 13.9}, {-1.6, 0.4, 2.0}, 50.0);
    kit.camera("oblique", middle - 22.0 * glm::normalize(0.62 * travel + glm::dvec3(0.0, -0.18, -0.75)), middle, 50.0);
    kit.camera("along", middle - 30.0 * travel, middle, 50.0);
    kit.camera("against", middle + 26.0 * travel, middle, 50.0);
    kit.camera("far", {0.0, 11.0, 19.0}, {0.0, 0.0, -40.0}, 50.0);
    return kit.scene();
}

}  // namespace umbriel
