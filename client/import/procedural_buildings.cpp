#include "client/import/procedural_buildings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/import/procedural_random.h"

namespace umbriel {

namespace {

// A facade picture shows 8 x 8 windows of 32 x 32 texels; the corner of each is plain wall.
constexpr int kCells = 8;
constexpr int kCellTexels = 32;
constexpr int kFacadeTexels = kCells * kCellTexels;
constexpr glm::vec2 kPlainWall{1.5f / kFacadeTexels, 1.5f / kFacadeTexels};
constexpr float kStorey = 3.2f;  // metres, also the width of a window's bay

enum class FacadeStyle { Plaster, Brick, Ribbon, Curtain };

// What one texel of a facade is: where in its bay, and which bay.
struct FacadeTexel {
    int x;    // 0..31 within the bay
    int row;  // 0..31, from the top
    std::uint32_t bay;
};

FacadeTexel facadeTexel(int x, int row) {
    return {x % kCellTexels, row % kCellTexels,
            static_cast<std::uint32_t>((row / kCellTexels) * kCells + x / kCellTexels)};
}

// Panes differ: some have blinds, some curtains, some are open to a dark room.
glm::vec3 paneColour(const FacadeTexel& texel, int top, int bottom, std::uint32_t seed) {
    ProceduralRandom random(texel.bay + 977u * seed);
    const float kind = random.unit();
    const float blind = random.between(0.15f, 0.8f);
    const float down = static_cast<float>(texel.row - top) / static_cast<float>(bottom - top);
    const glm::vec3 sky = glm::mix(srgb(0x7f97ab), srgb(0x2c3a46), std::min(1.0f, 0.25f + down + 0.3f * random.unit()));
    if (kind < 0.3f && down < blind) return srgb(0xd9d4c6) * (texel.row % 3 == 0 ? 0.82f : 0.95f);
    if (kind > 0.86f) return glm::mix(sky, srgb(0xe8d9a8), 0.35f);
    return sky;
}

glm::vec3 facadeColour(FacadeStyle style, int x, int row) {
    const FacadeTexel t = facadeTexel(x, row);
    const float grain = 0.93f + 0.07f * tilingNoise(x / 8.0f, row / 8.0f, kFacadeTexels / 8, 17);
    switch (style) {
        case FacadeStyle::Plaster:
        case FacadeStyle::Brick: {
            const bool inFrame = t.x >= 8 && t.x < 24 && t.row >= 7 && t.row < 26;
            const bool inPane =
                t.x >= 10 && t.x < 22 && t.row >= 9 && t.row < 24 && t.x != 16 && t.x != 15 && t.row != 14;
            if (inPane) return paneColour(t, 9, 24, style == FacadeStyle::Brick ? 3u : 1u);
            if (inFrame) return srgb(0xf4f1ea);
            if (t.x >= 6 && t.x < 26 && t.row >= 26 && t.row < 28) return srgb(0xc9c4ba);  // sill
            if (style == FacadeStyle::Plaster) return srgb(0xffffff) * grain;
            const int course = t.row / 4;
            const bool joint = t.row % 4 == 3 || (t.x + (course % 2) * 4) % 8 == 7;
            ProceduralRandom random(static_cast<std::uint64_t>((row / 4) * 64 + (x + (course % 2) * 4) / 8) + 40503u);
            return joint ? srgb(0xcfc8bc) * grain : srgb(0xffffff) * (0.78f + 0.22f * random.unit());
        }
        case FacadeStyle::Ribbon: {
            const bool glass = t.row >= 8 && t.row < 24 && !(t.x < 4 && t.row < 4);
            if (!glass) return srgb(0xffffff) * grain * (t.row == 24 || t.row == 7 ? 0.6f : 1.0f);
            if (t.x % 16 == 0) return srgb(0x4a4f54);
            return paneColour(t, 8, 24, 5u);
        }
        case FacadeStyle::Curtain: {
            if (t.x < 4 && t.row < 4) return srgb(0xdfe3e6);
            if (t.x % 16 < 1 || t.row < 1) return srgb(0xa9b1b7);
            if (t.row >= 24) return srgb(0x51626f) * grain;
            ProceduralRandom random(t.bay * 2 + static_cast<std::uint32_t>(t.x / 16) + 71u);
            return glm::mix(srgb(0x8fb0c8), srgb(0x54748c),
                            random.unit() * 0.6f + 0.4f * static_cast<float>(t.row) / 24.0f);
        }
    }
    return glm::vec3(1.0f);
}

float brickHeight(int x, int row) {
    const FacadeTexel t = facadeTexel(x, row);
    if (t.x >= 6 && t.x < 26 && t.row >= 26 && t.row < 28) return 2.5f;
    if (t.x >= 8 && t.x < 24 && t.row >= 7 && t.row < 26) return -2.0f;
    const bool joint = t.row % 4 == 3 || (t.x + ((t.row / 4) % 2) * 4) % 8 == 7;
    return joint ? 0.0f : 0.8f;
}

// Walls with whole bays and storeys; u and v begin at a bay of the picture chosen by shift.
void addWalls(Mesh& mesh, const glm::vec3& lower, const glm::vec3& upper, const glm::vec4& colour, int shift) {
    const float v0 = static_cast<float>(shift % kCells) / kCells;
    const float storeys = std::max(1.0f, std::round((upper.y - lower.y) / kStorey));
    const auto wall = [&](const glm::vec3& left, const glm::vec3& right, int side) {
        const float bays = std::max(1.0f, std::round(glm::length(right - left) / kStorey));
        const float u0 = static_cast<float>((shift * 3 + side * 5) % kCells) / kCells;
        const glm::vec3 up(0.0f, upper.y - lower.y, 0.0f);
        mesh.addQuad(left, right, right + up, left + up, colour, {u0, v0 + storeys / kCells}, {u0 + bays / kCells, v0});
    };
    wall({lower.x, lower.y, upper.z}, {upper.x, lower.y, upper.z}, 0);
    wall({upper.x, lower.y, upper.z}, {upper.x, lower.y, lower.z}, 1);
    wall({upper.x, lower.y, lower.z}, {lower.x, lower.y, lower.z}, 2);
    wall({lower.x, lower.y, lower.z}, {lower.x, lower.y, upper.z}, 3);
}

// Everything that is not a facade shows the picture's plain wall texel, so one material does for the building.
void addPlainBox(Mesh& mesh, const glm::vec3& lower, const glm::vec3& upper, const glm::vec4& colour) {
    Mesh box;
    box.addBox(lower, upper, colour, false);
    box.texCoords.assign(box.positions.size(), kPlainWall);
    mesh.append(box);
}

// A roof with a rim around it: rim top, inner walls, and the roof's surface below the rim.
void addFlatRoof(Mesh& mesh, const glm::vec3& lower, const glm::vec3& upper, float y, const glm::vec4& rim,
                 const glm::vec4& roof) {
    constexpr float kWidth = 0.35f;
    constexpr float kHeight = 0.9f;
    Mesh parts;
    const glm::vec3 a(lower.x, y, upper.z), b(upper.x, y, upper.z), c(upper.x, y, lower.z), d(lower.x, y, lower.z);
    const glm::vec3 up(0, kHeight, 0);
    const glm::vec3 ia = a + glm::vec3(kWidth, 0, -kWidth), ib = b + glm::vec3(-kWidth, 0, -kWidth);
    const glm::vec3 ic = c + glm::vec3(-kWidth, 0, kWidth), id = d + glm::vec3(kWidth, 0, kWidth);
    const std::array outer = {a, b, c, d};
    const std::array inner = {ia, ib, ic, id};
    for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t next = (i + 1) % 4;
        parts.addQuad(outer[i], outer[next], outer[next] + up, outer[i] + up, rim);
        parts.addQuad(outer[i] + up, outer[next] + up, inner[next] + up, inner[i] + up, rim);
        parts.addQuad(inner[next], inner[i], inner[i] + up, inner[next] + up, rim);
    }
    parts.addQuad(ia, ib, ic, id, roof);
    parts.texCoords.assign(parts.positions.size(), kPlainWall);
    mesh.append(parts);
}

// Ridge along x; eaves stand out over the walls.
void addGableRoof(Mesh& mesh, const glm::vec3& lower, const glm::vec3& upper, float rise, const glm::vec4& wall,
                  const glm::vec4& tiles) {
    constexpr float kEaves = 0.45f;
    const float y = upper.y;
    const float middle = 0.5f * (lower.z + upper.z);
    const float slope = rise / (upper.z - middle);
    Mesh roof;
    for (const float x : {upper.x, lower.x}) {
        const glm::vec3 front(x, y, upper.z), back(x, y, lower.z), top(x, y + rise, middle);
        if (x == upper.x)
            roof.addFlatTriangle(front, back, top, wall);
        else
            roof.addFlatTriangle(back, front, top, wall);
    }
    const float left = lower.x - kEaves, right = upper.x + kEaves;
    const float low = y - kEaves * slope;
    const glm::vec3 thick(0, 0.22f, 0);
    const glm::vec3 fl(left, low, upper.z + kEaves), fr(right, low, upper.z + kEaves);
    const glm::vec3 bl(left, low, lower.z - kEaves), br(right, low, lower.z - kEaves);
    const glm::vec3 tl(left, y + rise, middle), tr(right, y + rise, middle);
    roof.addQuad(fl + thick, fr + thick, tr + thick, tl + thick, tiles);
    roof.addQuad(br + thick, bl + thick, tl + thick, tr + thick, tiles);
    const glm::vec4 board = 0.7f * wall;
    roof.addQuad(fl, fr, fr + thick, fl + thick, board);
    roof.addQuad(br, bl, bl + thick, br + thick, board);
    roof.addQuad(fr, tr, tr + thick, fr + thick, board);
    roof.addQuad(tr, br, br + thick, tr + thick, board);
    roof.addQuad(tl, fl, fl + thick, tl + thick, board);
    roof.addQuad(bl, tl, tl + thick, bl + thick, board);
    roof.addQuad(fr, fl, tl, tr, board);  // seen from below
    roof.addQuad(bl, br, tr, tl, board);
    roof.texCoords.assign(roof.positions.size(), kPlainWall);
    mesh.append(roof);
}

void addRoofMachines(Mesh& mesh, float halfWidth, float halfDepth, float y, ProceduralRandom& random) {
    const glm::vec4 metal = linearColour(0x9aa0a4);
    addPlainBox(mesh, {-0.35f * halfWidth, y, -0.3f * halfDepth}, {0.15f * halfWidth, y + 2.6f, 0.25f * halfDepth},
                linearColour(0xb5b0a6));
    for (int i = 0; i < 2; ++i) {
        const float x = random.between(0.3f, 0.62f) * halfWidth;
        const float z = random.between(-0.65f, 0.5f) * halfDepth;
        addPlainBox(mesh, {x, y, z}, {x + 1.9f, y + 1.2f, z + 1.3f}, metal);
    }
}

struct Palette {
    Ref<Material> plaster;
    Ref<Material> brick;
    Ref<Material> ribbon;
    Ref<Material> curtain;
};

Palette makePalette(SceneKit& kit) {
    const auto facade = [&](const char* name, FacadeStyle style) {
        return kit.texture(kit.image(name, makeTexels(kFacadeTexels, kFacadeTexels, [style](int x, int row) {
                                         return facadeColour(style, x, row);
                                     })));
    };
    Palette palette;
    palette.plaster =
        kit.material("plaster facade", {.roughness = 0.9f, .colourTexture = facade("plaster", FacadeStyle::Plaster)});
    palette.brick =
        kit.material("brick facade", {.roughness = 0.85f,
                                      .colourTexture = facade("brick", FacadeStyle::Brick),
                                      .normalTexture = kit.texture(kit.image(
                                          "brick relief", normalMapOf(kFacadeTexels, kFacadeTexels, brickHeight)))});
    palette.ribbon =
        kit.material("office facade", {.roughness = 0.55f, .colourTexture = facade("ribbon", FacadeStyle::Ribbon)});
    palette.curtain =
        kit.material("glass facade",
                     {.metallic = 0.2f, .roughness = 0.22f, .colourTexture = facade("curtain", FacadeStyle::Curtain)});
    return palette;
}

constexpr std::array<std::uint32_t, 8> kPlasterTones = {0xe8ddc8, 0xd9b98c, 0xcfd3cc, 0xc98f74,
                                                        0xb9c4cc, 0xefe7da, 0xd6c2a4, 0xa9b59c};
constexpr std::array<std::uint32_t, 4> kBrickTones = {0x9c5440, 0x8a4a3c, 0xb0704f, 0x7d5a4b};
constexpr std::array<std::uint32_t, 4> kTileTones = {0x9c4a35, 0x7f3b2e, 0x5b5553, 0xa65c3e};

Mesh house(ProceduralRandom& random, int variant) {
    const glm::vec4 wall = linearColour(kPlasterTones[static_cast<std::size_t>(variant) % kPlasterTones.size()]);
    const glm::vec4 tiles = linearColour(kTileTones[random.below(4)]);
    const float halfWidth = random.between(4.6f, 5.6f);
    const float halfDepth = random.between(3.9f, 4.6f);
    const float height = kStorey * static_cast<float>(1 + random.below(2)) + 0.4f;
    const glm::vec3 lower(-halfWidth, 0.0f, -halfDepth), upper(halfWidth, height, halfDepth);
    Mesh mesh;
    addWalls(mesh, lower, upper, wall, variant);
    const float rise = random.between(2.4f, 3.4f);
    addGableRoof(mesh, lower, upper, rise, wall, tiles);
    const float chimney = random.between(-0.6f, 0.5f) * halfWidth;
    addPlainBox(mesh, {chimney, height + 0.4f * rise, -1.5f}, {chimney + 0.7f, height + rise + 0.7f, -0.8f},
                linearColour(0x8a5a48));
    addPlainBox(mesh, {-0.9f, 0.0f, halfDepth}, {0.9f, 0.25f, halfDepth + 1.1f}, linearColour(0xa9a49b));
    return mesh;
}

Mesh cornerHouse(ProceduralRandom& random, int variant) {
    const glm::vec4 wall = linearColour(kPlasterTones[static_cast<std::size_t>(variant + 3) % kPlasterTones.size()]);
    const glm::vec4 tiles = linearColour(kTileTones[random.below(4)]);
    const float height = kStorey * 2.0f + 0.3f;
    Mesh mesh;
    addWalls(mesh, {-6.2f, 0, 0.0f}, {6.2f, height, 5.8f}, wall, variant);
    addGableRoof(mesh, {-6.2f, 0, 0.0f}, {6.2f, height, 5.8f}, 2.6f, wall, tiles);
    Mesh wing;
    addWalls(wing, {-5.0f, 0, -2.7f}, {5.0f, height - 0.6f, 2.7f}, wall, variant + 2);
    addGableRoof(wing, {-5.0f, 0, -2.7f}, {5.0f, height - 0.6f, 2.7f}, 2.3f, wall, tiles);
    mesh.append(wing, glm::translate(glm::mat4(1.0f), {-3.3f, 0, -1.2f}) * glm::mat4(turned(1.57079633f, {0, 1, 0})));
    return mesh;
}

Mesh warehouse(ProceduralRandom& random, int variant) {
    const glm::vec4 wall = linearColour(kBrickTones[static_cast<std::size_t>(variant) % kBrickTones.size()]);
    Mesh mesh;
    const float height = 2.0f * kStorey;
    addWalls(mesh, {-7.0f, 0, -7.0f}, {7.0f, height, 7.0f}, wall, variant);
    // Sawteeth: steep glazed faces towards -z.
    Mesh roof;
    const glm::vec4 sheet = linearColour(0x8d979c), glass = linearColour(0x5c7382);
    for (int tooth = 0; tooth < 4; ++tooth) {
        const float back = -7.0f + 3.5f * static_cast<float>(tooth), front = back + 3.5f;
        const glm::vec3 bl(-7, height, back), br(7, height, back), fl(-7, height, front), fr(7, height, front);
        const glm::vec3 tl(-7, height + 1.9f, back + 0.5f), tr(7, height + 1.9f, back + 0.5f);
        roof.addQuad(fl, fr, tr, tl, sheet);
        roof.addQuad(br, bl, tl, tr, glass);
        roof.addFlatTriangle(fr, br, tr, wall);
        roof.addFlatTriangle(bl, fl, tl, wall);
    }
    roof.texCoords.assign(roof.positions.size(), kPlainWall);
    mesh.append(roof);
    const float x = random.between(-4.0f, 2.0f);
    addPlainBox(mesh, {x, 0, 7.0f}, {x + 3.2f, 3.4f, 7.12f}, linearColour(0x4d5a50));
    return mesh;
}

Mesh slab(ProceduralRandom& random, const glm::vec4& wall, const glm::vec2& halfSize, int storeys, int variant) {
    const float height = kStorey * static_cast<float>(storeys);
    const glm::vec3 lower(-halfSize.x, 0.5f, -halfSize.y), upper(halfSize.x, 0.5f + height, halfSize.y);
    Mesh mesh;
    addPlainBox(mesh, {-halfSize.x - 0.12f, 0, -halfSize.y - 0.12f}, {halfSize.x + 0.12f, 0.5f, halfSize.y + 0.12f},
                linearColour(0x8d8880));
    addWalls(mesh, lower, upper, wall, variant);
    addFlatRoof(mesh, lower, upper, upper.y, 0.92f * wall, linearColour(0x75716b));
    addRoofMachines(mesh, halfSize.x, halfSize.y, upper.y, random);
    return mesh;
}

Mesh office(ProceduralRandom& random, int variant) {
    constexpr std::array<std::uint32_t, 4> kTones = {0xd7d4cd, 0xbfc6c9, 0xe2ded4, 0xb8aea0};
    const glm::vec4 wall = linearColour(kTones[static_cast<std::size_t>(variant) % 4]);
    Mesh mesh = slab(random, wall, {10.4f, 10.4f}, 3, variant);
    const int storeys = 7 + 3 * variant;
    Mesh upper = slab(random, wall, {8.0f, 6.4f}, storeys, variant + 1);
    mesh.append(upper, glm::translate(glm::mat4(1.0f), {0.0f, 3.0f * kStorey + 0.5f, -1.2f}));
    return mesh;
}

Mesh roundTower(ProceduralRandom& random, int variant) {
    const int storeys = 14 + 7 * variant;
    const float radius = 9.6f - 0.8f * static_cast<float>(variant);
    const float height = kStorey * static_cast<float>(storeys);
    constexpr int kSegments = 28;
    Mesh mesh;
    mesh.addLathe(std::array{glm::vec2(radius, 0.0f), glm::vec2(radius, height)}, kSegments, glm::vec4(1.0f));
    for (glm::vec2& uv : mesh.texCoords) uv = {uv.x * 18.0f / kCells, uv.y * static_cast<float>(storeys) / kCells};
    Mesh crown;
    const glm::vec4 metal = linearColour(0xb9c0c4);
    crown.addLathe(std::array{glm::vec2(radius, height), glm::vec2(radius + 0.3f, height),
                              glm::vec2(radius + 0.3f, height), glm::vec2(radius + 0.3f, height + 1.2f),
                              glm::vec2(radius + 0.3f, height + 1.2f), glm::vec2(radius - 0.3f, height + 1.2f),
                              glm::vec2(radius - 0.3f, height + 1.2f), glm::vec2(radius - 0.3f, height + 0.2f),
                              glm::vec2(radius - 0.3f, height + 0.2f), glm::vec2(0.0f, height + 0.2f)},
                   kSegments, metal);
    crown.addLathe(std::array{glm::vec2(0.35f * radius, height), glm::vec2(0.35f * radius, height + 4.5f),
                              glm::vec2(0.35f * radius, height + 4.5f), glm::vec2(0.0f, height + 5.4f)},
                   16, metal);
    crown.texCoords.assign(crown.positions.size(), kPlainWall);
    mesh.append(crown);
    addPlainBox(mesh, {-0.12f, height + 5.0f, -0.12f}, {0.12f, height + 5.0f + random.between(6.0f, 12.0f), 0.12f},
                metal);
    return mesh;
}

Mesh glassTower(ProceduralRandom& random, int variant) {
    constexpr std::array<std::uint32_t, 4> kTints = {0xffffff, 0xd8ecf2, 0xe9e2d0, 0xcfe2d4};
    const glm::vec4 tint = linearColour(kTints[static_cast<std::size_t>(variant) % 4]);
    Mesh mesh;
    float y = 0.0f;
    float half = 11.2f;
    for (int part = 0; part < 3; ++part) {
        const int storeys = 8 + variant * 3 + static_cast<int>(random.below(5));
        const glm::vec3 lower(-half, y, -half + static_cast<float>(part) * 0.8f);
        const glm::vec3 upper(half, y + kStorey * static_cast<float>(storeys), half - static_cast<float>(part) * 0.8f);
        addWalls(mesh, lower, upper, tint, variant + part);
        addFlatRoof(mesh, lower, upper, upper.y, linearColour(0xa4adb3), linearColour(0x6d7276));
        y = upper.y;
        half -= 1.6f;
    }
    addRoofMachines(mesh, half, half, y, random);
    addPlainBox(mesh, {-0.2f, y, -0.2f}, {0.2f, y + random.between(10.0f, 22.0f), 0.2f}, linearColour(0xc8ccd0));
    return mesh;
}

Mesh steppedTower(ProceduralRandom& random, int variant) {
    constexpr std::array<std::uint32_t, 3> kTones = {0xd8c7a6, 0xc4b49c, 0xb7a7a0};
    const glm::vec4 wall = linearColour(kTones[static_cast<std::size_t>(variant) % 3]);
    Mesh mesh;
    float y = 0.0f;
    float half = 11.2f;
    for (int part = 0; part < 5; ++part) {
        const int storeys = part == 0 ? 8 + 3 * variant : 3 + static_cast<int>(random.below(4)) + variant;
        const glm::vec3 lower(-half, y, -half), upper(half, y + kStorey * static_cast<float>(storeys), half);
        addWalls(mesh, lower, upper, wall, variant + part);
        if (part < 4) addFlatRoof(mesh, lower, upper, upper.y, wall, linearColour(0x8a857c));
        y = upper.y;
        half *= 0.78f;
    }
    const float base = half / 0.78f;
    Mesh spire;
    const glm::vec4 copper = linearColour(0x6f9a86);
    const glm::vec3 top(0, y + 2.2f * base, 0);
    const std::array ring = {glm::vec3(-base, y, base), glm::vec3(base, y, base), glm::vec3(base, y, -base),
                             glm::vec3(-base, y, -base)};
    for (std::size_t i = 0; i < 4; ++i) spire.addFlatTriangle(ring[i], ring[(i + 1) % 4], top, copper);
    spire.texCoords.assign(spire.positions.size(), kPlainWall);
    mesh.append(spire);
    return mesh;
}

// A trunk and a crown: a ball with lumps, flat shaded parts kept smooth.
Mesh tree(std::uint64_t seed, float height, std::uint32_t green) {
    ProceduralRandom random(seed);
    Mesh mesh;
    const glm::vec4 bark = linearColour(0x5b4634);
    mesh.addLathe(std::array{glm::vec2(0.22f, 0.0f), glm::vec2(0.14f, 0.5f * height)}, 5, bark);
    Mesh crown;
    constexpr std::size_t kSegments = 7, kRings = 4;
    crown.addSphere({0, 0, 0}, 1.0f, kSegments, kRings, linearColour(green));
    std::array<float, kSegments*(kRings + 1)> lumps{};
    for (float& lump : lumps) lump = random.between(0.82f, 1.18f);
    for (std::size_t i = 0; i < crown.positions.size(); ++i) {
        // The seam's two columns, and all vertices of a pole, move together.
        const std::size_t ring = i % (kRings + 1);
        const std::size_t segment = ring == 0 || ring == kRings ? 0 : (i / (kRings + 1)) % kSegments;
        const glm::vec3 unitBall = crown.positions[i];
        crown.positions[i] = unitBall * lumps[ring * kSegments + segment] * glm::vec3(0.34f, 0.36f, 0.34f) * height +
                             glm::vec3(0, 0.66f * height, 0);
        crown.normals[i] = glm::normalize(unitBall * glm::vec3(1.0f, 0.94f, 1.0f));
        crown.colours[i] *= 0.72f + 0.36f * (0.5f + 0.5f * unitBall.y);
        crown.colours[i].w = 1.0f;
    }
    mesh.append(crown);
    mesh.texCoords.assign(mesh.positions.size(), glm::vec2(0.0f));
    return mesh;
}

}  // namespace

BuildingCatalogue makeBuildings(SceneKit& kit) {
    const Palette palette = makePalette(kit);
    BuildingCatalogue catalogue;
    const auto add = [&](BuildingKind kind, const char* name, int count, Ref<Material> material, const auto& build) {
        for (int variant = 0; variant < count; ++variant) {
            ProceduralRandom random(static_cast<std::uint64_t>(variant), static_cast<std::uint64_t>(kind) + 100);
            Mesh mesh = build(random, variant);
            if (material == palette.brick) mesh.computeTangents();
            catalogue.variants[static_cast<std::size_t>(kind)].push_back(
                kit.geometry(fmt::format("{} {}", name, variant), mesh, material));
        }
    };
    add(BuildingKind::House, "house", 8, palette.plaster, house);
    add(BuildingKind::CornerHouse, "corner house", 4, palette.plaster, cornerHouse);
    add(BuildingKind::Warehouse, "warehouse", 2, palette.brick, warehouse);
    add(BuildingKind::Apartments, "apartments", 8, palette.plaster, [](ProceduralRandom& random, int variant) {
        return slab(random, linearColour(kPlasterTones[static_cast<std::size_t>(variant)]),
                    {7.2f, random.between(5.6f, 7.2f)}, 3 + static_cast<int>(random.below(5)), variant);
    });
    add(BuildingKind::Brick, "brick house", 6, palette.brick, [](ProceduralRandom& random, int variant) {
        return slab(random, linearColour(kBrickTones[static_cast<std::size_t>(variant) % 4]),
                    {random.between(6.0f, 7.4f), 7.2f}, 4 + static_cast<int>(random.below(4)), variant);
    });
    add(BuildingKind::Office, "office", 4, palette.ribbon, office);
    add(BuildingKind::RoundTower, "round tower", 3, palette.curtain, roundTower);
    add(BuildingKind::GlassTower, "glass tower", 4, palette.curtain, glassTower);
    add(BuildingKind::SteppedTower, "stepped tower", 3, palette.plaster, steppedTower);

    const Ref<Material> leaves = kit.material("tree", {.roughness = 0.95f});
    catalogue.trees = {kit.geometry("maple", tree(1, 7.5f, 0x567a34), leaves),
                       kit.geometry("lime tree", tree(2, 9.0f, 0x4a6f38), leaves),
                       kit.geometry("young tree", tree(3, 5.0f, 0x7c9442), leaves)};
    return catalogue;
}

}  // namespace umbriel
