#include <algorithm>
#include <array>
#include <cmath>

#include "client/import/procedural_demos.h"
#include "client/import/procedural_kit.h"

namespace umbriel {

namespace {

// The car's own frame: +x forward, +y up, +z to its right; the origin on the ground below its middle. Metres.
constexpr float kHalfLength = 2.1f;
constexpr float kWheelRadius = 0.33f;
constexpr float kAxleFront = 1.3f;
constexpr float kAxleRear = -1.28f;
constexpr float kTrack = 0.77f;        // from the middle to a wheel's middle
constexpr double kCircleRadius = 7.5;  // of its way
constexpr double kPeriod = 6.0;        // seconds around

// Piecewise smooth through (x, value), ascending in x.
float along(std::span<const glm::vec2> curve, float x) {
    if (x <= curve.front().x) return curve.front().y;
    for (std::size_t i = 1; i < curve.size(); ++i)
        if (x <= curve[i].x) {
            const float t = (x - curve[i - 1].x) / (curve[i].x - curve[i - 1].x);
            return glm::mix(curve[i - 1].y, curve[i].y, t * t * (3.0f - 2.0f * t));
        }
    return curve.back().y;
}

float signedPower(float value, float exponent) {
    return value < 0.0f ? -std::pow(-value, exponent) : std::pow(value, exponent);
}

struct CarMeshes {
    Mesh paint;
    Mesh glass;
    Mesh trim;
    Mesh headlights;
    Mesh tailLights;
};

// A shell around the x axis: superellipses of varying width between a lower and an upper line, closed at both ends.
void addLowerBody(CarMeshes& car) {
    constexpr std::array kUpper = {glm::vec2(-2.1f, 0.78f), glm::vec2(-1.85f, 0.93f), glm::vec2(-0.6f, 0.96f),
                                   glm::vec2(0.75f, 0.93f), glm::vec2(1.7f, 0.80f),   glm::vec2(2.1f, 0.64f)};
    constexpr std::array kLower = {glm::vec2(-2.1f, 0.38f), glm::vec2(-1.7f, 0.24f), glm::vec2(1.7f, 0.22f),
                                   glm::vec2(2.1f, 0.30f)};
    constexpr std::array kHalfWidth = {glm::vec2(-2.1f, 0.74f), glm::vec2(-1.2f, 0.84f), glm::vec2(1.1f, 0.85f),
                                       glm::vec2(2.1f, 0.70f)};
    constexpr int kStations = 96;
    constexpr int kAround = 56;
    const auto first = static_cast<std::uint32_t>(car.paint.positions.size());
    for (int station = 0; station <= kStations; ++station) {
        const float x = -kHalfLength * std::cos(3.14159265f * static_cast<float>(station) / kStations);
        const float toEnd = std::clamp((kHalfLength - std::abs(x)) / 0.2f, 0.0f, 1.0f);
        const float closing = std::sqrt(std::max(0.0f, 1.0f - (1.0f - toEnd) * (1.0f - toEnd)));
        const float middle = 0.5f * (along(kUpper, x) + along(kLower, x));
        const float halfHeight =
            0.5f * (along(kUpper, x) - along(kLower, x)) * (0.35f + 0.65f * closing) * (closing > 0 ? 1 : 0);
        const float halfWidth = along(kHalfWidth, x) * (0.55f + 0.45f * closing) * (closing > 0 ? 1 : 0);
        for (int i = 0; i < kAround; ++i) {
            const float angle = 6.2831853f * static_cast<float>(i) / kAround;
            glm::vec3 position(x, middle + halfHeight * signedPower(std::sin(angle), 0.55f),
                               halfWidth * signedPower(std::cos(angle), 0.5f));
            // Room for the wheels; the flares cover its edge.
            for (const float axle : {kAxleFront, kAxleRear}) {
                const float away = glm::distance(glm::vec2(x, position.y), glm::vec2(axle, kWheelRadius + 0.02f));
                const float room = 0.62f + 0.3f * glm::smoothstep(0.31f, 0.41f, away);
                if (away < 0.41f) position.z = std::clamp(position.z, -room, room);
            }
            car.paint.addVertex(position, {0, 0, 0}, glm::vec4(1.0f));
        }
    }
    for (int station = 0; station < kStations; ++station)
        for (int i = 0; i < kAround; ++i) {
            const std::uint32_t a = first + static_cast<std::uint32_t>(station * kAround + i);
            const std::uint32_t b = first + static_cast<std::uint32_t>(station * kAround + (i + 1) % kAround);
            if (station > 0) car.paint.addTriangle(a, b + kAround, b);
            if (station > 0 && station < kStations - 1) car.paint.addTriangle(a, a + kAround, b + kAround);
            if (station == 0) car.paint.addTriangle(a, a + kAround, b + kAround);
        }
    car.paint.smoothNormals(first);
}

// Half a shell on top; panes and pillars are cells of one grid, so their edges are clean.
void addCabin(CarMeshes& car) {
    constexpr std::array kRoof = {glm::vec2(-1.62f, 0.86f), glm::vec2(-1.45f, 0.98f), glm::vec2(-0.78f, 1.38f),
                                  glm::vec2(-0.2f, 1.44f),  glm::vec2(0.22f, 1.38f),  glm::vec2(1.02f, 0.88f)};
    constexpr float kSill = 0.86f;
    constexpr int kStations = 66;
    constexpr int kAcross = 36;
    const auto position = [&](int station, int i) {
        const float x = glm::mix(-1.62f, 1.02f, static_cast<float>(station) / kStations);
        const float height = std::max(0.0f, along(kRoof, x) - kSill);
        const float angle = 3.14159265f * static_cast<float>(i) / kAcross;
        const float lean = 0.76f - 0.03f * height;
        return glm::vec3(x, kSill + height * std::pow(std::max(0.0f, std::sin(angle)), 0.62f),
                         lean * signedPower(std::cos(angle), 0.42f));
    };
    Mesh shell;
    for (int station = 0; station <= kStations; ++station)
        for (int i = 0; i <= kAcross; ++i) shell.addVertex(position(station, i), {0, 0, 0}, glm::vec4(1.0f));
    const auto isGlass = [&](int station, int i) {
        const float x = glm::mix(-1.62f, 1.02f, (static_cast<float>(station) + 0.5f) / kStations);
        const bool side = i < 8 || i >= kAcross - 8;
        const bool onSide = (i >= 1 && i < 8) || (i >= kAcross - 8 && i < kAcross - 1);
        if (onSide) return (x > -0.22f && x < 0.42f) || (x > -1.02f && x < -0.30f);
        const bool onEnd = !side && i >= 9 && i < kAcross - 9;
        return onEnd && ((x > 0.28f && x < 0.94f) || (x > -1.36f && x < -0.86f));
    };
    std::vector<std::uint32_t> paintIndices;
    std::vector<std::uint32_t> glassIndices;
    for (int station = 0; station < kStations; ++station)
        for (int i = 0; i < kAcross; ++i) {
            const auto a = static_cast<std::uint32_t>(station * (kAcross + 1) + i);
            const std::uint32_t b = a + kAcross + 1;
            std::vector<std::uint32_t>& target = isGlass(station, i) ? glassIndices : paintIndices;
            target.insert(target.end(), {a, b, b + 1, a, b + 1, a + 1});
        }
    shell.indices = paintIndices;
    shell.indices.insert(shell.indices.end(), glassIndices.begin(), glassIndices.end());
    shell.smoothNormals();
    shell.indices = paintIndices;
    car.paint.append(shell);
    shell.indices = glassIndices;
    car.glass.append(shell);
}

// Flares, dark wheel houses, bumpers, lamps, mirrors, plates.
void addDetails(CarMeshes& car) {
    const glm::vec4 white(1.0f);
    for (const float axle : {kAxleFront, kAxleRear})
        for (const float side : {-1.0f, 1.0f}) {
            Mesh house;
            house.addLathe(std::array{glm::vec2(0.40f, -0.06f), glm::vec2(0.40f, 0.045f), glm::vec2(0.40f, 0.045f),
                                      glm::vec2(0.0f, 0.045f)},
                           40, white);
            const glm::mat4 toSide = glm::rotate(glm::mat4(1.0f), side * 1.57079633f, glm::vec3(1, 0, 0));
            car.trim.append(house,
                            glm::translate(glm::mat4(1.0f), {axle, kWheelRadius + 0.02f, side * 0.62f}) * toSide);

            constexpr int kArc = 28;
            constexpr int kTube = 10;
            const auto first = static_cast<std::uint32_t>(car.paint.positions.size());
            for (int i = 0; i <= kArc; ++i)
                for (int j = 0; j < kTube; ++j) {
                    const float angle = glm::mix(-0.28f, 3.4216f, static_cast<float>(i) / kArc);
                    const float tube = 6.2831853f * static_cast<float>(j) / kTube;
                    const float radius = 0.415f + 0.035f * std::cos(tube);
                    car.paint.addVertex(
                        {axle + radius * std::cos(angle), kWheelRadius + 0.02f + radius * std::sin(angle),
                         side * 0.82f + 0.075f * std::sin(tube)},
                        {0, 0, 0}, white);
                }
            for (int i = 0; i < kArc; ++i)
                for (int j = 0; j < kTube; ++j) {
                    const std::uint32_t a = first + static_cast<std::uint32_t>(i * kTube + j);
                    const std::uint32_t b = first + static_cast<std::uint32_t>(i * kTube + (j + 1) % kTube);
                    car.paint.addTriangle(a, b + kTube, b);
                    car.paint.addTriangle(a, a + kTube, b + kTube);
                }
            car.paint.smoothNormals(first);

            Mesh mirror;
            mirror.addSphere({0, 0, 0}, 1.0f, 20, 10, white);
            Mesh scaled = mirror;
            for (std::size_t i = 0; i < scaled.positions.size(); ++i) {
                const glm::vec3 radii(0.07f, 0.055f, 0.1f);
                scaled.normals[i] = glm::normalize(scaled.positions[i] / radii);
                scaled.positions[i] = scaled.positions[i] * radii + glm::vec3(0.52f, 1.0f, side * 0.86f);
            }
            if (axle == kAxleFront) car.paint.append(scaled);
        }
    for (const float side : {-1.0f, 1.0f}) {
        const auto lamp = [&](Mesh& target, const glm::vec3& centre, const glm::vec3& radii) {
            Mesh bulb;
            bulb.addSphere({0, 0, 0}, 1.0f, 24, 12, white);
            for (std::size_t i = 0; i < bulb.positions.size(); ++i) {
                bulb.normals[i] = glm::normalize(bulb.positions[i] / radii);
                bulb.positions[i] = bulb.positions[i] * radii + centre;
            }
            target.append(bulb);
        };
        lamp(car.headlights, {1.93f, 0.62f, side * 0.54f}, {0.13f, 0.075f, 0.13f});
        lamp(car.tailLights, {-1.98f, 0.74f, side * 0.56f}, {0.10f, 0.06f, 0.13f});
        car.trim.addBox({-0.05f, 0.815f, side * 0.858f - 0.012f}, {0.12f, 0.845f, side * 0.858f + 0.012f}, white);
    }
    car.trim.addBox({1.90f, 0.34f, -0.62f}, {2.13f, 0.45f, 0.62f}, white);
    car.trim.addBox({-2.13f, 0.38f, -0.64f}, {-1.92f, 0.50f, 0.64f}, white);
    car.trim.addBox({2.02f, 0.50f, -0.30f}, {2.095f, 0.60f, 0.30f}, white);
    car.trim.addBox({-1.7f, 0.2f, -0.6f}, {1.75f, 0.3f, 0.6f}, white);
    car.headlights.addBox({-2.145f, 0.53f, -0.26f}, {-2.08f, 0.64f, 0.26f}, white);
}

// About z, its outer face towards +z.
Mesh wheelMesh() {
    const glm::vec4 rubber = linearColour(0x1b1b1d);
    const glm::vec4 alloy = linearColour(0xc4c8cc);
    const glm::vec4 shade = linearColour(0x3a3d40);
    Mesh wheel;
    // Running up along y from the inner to the outer face; y becomes z.
    constexpr std::array kTyre = {glm::vec2(0.215f, -0.10f), glm::vec2(0.30f, -0.105f), glm::vec2(0.322f, -0.085f),
                                  glm::vec2(0.33f, -0.06f),  glm::vec2(0.33f, 0.06f),   glm::vec2(0.322f, 0.085f),
                                  glm::vec2(0.30f, 0.105f),  glm::vec2(0.225f, 0.10f)};
    wheel.addLathe(kTyre, 48, rubber);
    constexpr std::array kRim = {glm::vec2(0.228f, 0.10f), glm::vec2(0.222f, 0.108f), glm::vec2(0.205f, 0.104f),
                                 glm::vec2(0.205f, 0.104f), glm::vec2(0.20f, 0.02f)};
    wheel.addLathe(kRim, 48, alloy);
    constexpr std::array kDish = {glm::vec2(0.20f, 0.02f), glm::vec2(0.0f, 0.02f)};
    wheel.addLathe(kDish, 48, shade);
    constexpr std::array kBack = {glm::vec2(0.0f, -0.08f), glm::vec2(0.215f, -0.10f)};
    wheel.addLathe(kBack, 48, shade);
    constexpr std::array kHub = {glm::vec2(0.055f, 0.02f), glm::vec2(0.05f, 0.095f), glm::vec2(0.05f, 0.095f),
                                 glm::vec2(0.03f, 0.105f), glm::vec2(0.0f, 0.107f)};
    wheel.addLathe(kHub, 32, alloy);
    // Five double spokes, wider at the hub.
    for (int spoke = 0; spoke < 5; ++spoke)
        for (const float lean : {-0.13f, 0.13f}) {
            Mesh bar;
            bar.addBox({0.035f, 0.045f, -0.017f}, {0.208f, 0.09f, 0.017f}, alloy, false);
            wheel.append(bar, glm::rotate(glm::mat4(1.0f), 1.25663706f * static_cast<float>(spoke) + lean, {0, 1, 0}));
        }
    wheel.transform(glm::rotate(glm::mat4(1.0f), 1.57079633f, {1, 0, 0}));
    return wheel;
}

// The unit quaternion (x y z w) of a turn about an axis.
std::array<float, 4> quaternion(double angle, const glm::dvec3& axis) {
    const double sine = std::sin(0.5 * angle);
    return {static_cast<float>(axis.x * sine), static_cast<float>(axis.y * sine), static_cast<float>(axis.z * sine),
            static_cast<float>(std::cos(0.5 * angle))};
}

// Whole turns within the period, keys a third of a turn apart, so that it loops without a jump.
Ref<AnimationChannel> spin(SceneKit& kit, Ref<Node> placed, const glm::dvec3& axis, int turns) {
    const int keys = 3 * std::abs(turns);
    std::vector<float> times;
    std::vector<float> values;
    for (int key = 0; key <= keys; ++key) {
        times.push_back(static_cast<float>(kPeriod * key / keys));
        const auto rotation = quaternion((turns < 0 ? -1.0 : 1.0) * 2.0943951023931957 * key, axis);
        values.insert(values.end(), rotation.begin(), rotation.end());
    }
    return kit.channel(kit.pose(placed), AnimationPath::Rotation, times, values);
}

void addGround(SceneKit& kit) {
    constexpr int kTexels = 512;
    constexpr int kStones = 8;  // along a side of the picture, every other row shifted
    struct Stone {
        float edge;  // texels to the nearest joint
        int column;
        int row;
    };
    const auto stoneAt = [](int x, int row) -> Stone {
        constexpr int kStone = kTexels / kStones;
        const int stoneRow = row / (kStone / 2);
        const int shifted = (x + (stoneRow % 2) * (kStone / 2)) % kTexels;
        const int inX = shifted % kStone;
        const int inRow = row % (kStone / 2);
        return {static_cast<float>(std::min(std::min(inX, kStone - 1 - inX), std::min(inRow, kStone / 2 - 1 - inRow))),
                shifted / kStone, stoneRow};
    };
    const Ref<Texture> colours =
        kit.texture(kit.image("paving", makeTexels(kTexels, kTexels, [&](int x, int row) {
                                  const Stone stone = stoneAt(x, row);
                                  const float tone = tilingNoise(static_cast<float>(stone.column * 3),
                                                                 static_cast<float>(stone.row * 5), 64, 11);
                                  const float grain = tilingNoise(x / 4.0f, row / 4.0f, 128, 3);
                                  const glm::vec3 colour = glm::mix(srgb(0x85807a), srgb(0xa8a198), tone);
                                  return (stone.edge < 1.5f ? srgb(0x4c4843) : colour) * (0.86f + 0.2f * grain);
                              })));
    const Ref<Texture> relief =
        kit.texture(kit.image("paving relief", normalMapOf(kTexels, kTexels, [&](int x, int row) {
                                  return 2.4f * std::min(stoneAt(x, row).edge / 4.0f, 1.0f) +
                                         0.9f * tilingNoise(x / 6.0f, row / 6.0f, 256, 9);
                              })));
    const Ref<Material> paving = kit.material(
        "paving", {.roughness = 0.85f, .colourTexture = colours, .normalTexture = relief, .normalScale = 0.8f});
    // One patch of 6 m for all: separate nodes, so that a tile draws only what it sees.
    Mesh patch;
    patch.addGrid(6, 6, glm::vec4(1.0f), [](int column, int row) {
        return glm::vec3(static_cast<float>(column) - 3.0f, 0.0f, 3.0f - static_cast<float>(row));
    });
    for (glm::vec2& uv : patch.texCoords) uv *= 4.0f;
    patch.computeTangents();
    const Ref<Geometry> geometry = kit.geometry("paving", patch, paving);
    for (int row = -3; row <= 3; ++row)
        for (int column = -3; column <= 3; ++column)
            kit.placeShape(kit.world(), "ground", geometry, {6.0 * column, 0.0, 6.0 * row});
}

void addCones(SceneKit& kit) {
    Mesh cone;
    const glm::vec4 orange = linearColour(0xe8611a);
    const glm::vec4 band = linearColour(0xf3f1ec);
    cone.addBox({-0.19f, 0.0f, -0.19f}, {0.19f, 0.035f, 0.19f}, linearColour(0x2a2a2a), false);
    cone.addLathe(std::array{glm::vec2(0.145f, 0.035f), glm::vec2(0.105f, 0.22f)}, 28, orange);
    cone.addLathe(std::array{glm::vec2(0.105f, 0.22f), glm::vec2(0.075f, 0.36f)}, 28, band);
    cone.addLathe(std::array{glm::vec2(0.075f, 0.36f), glm::vec2(0.042f, 0.51f)}, 28, orange);
    cone.addLathe(std::array{glm::vec2(0.042f, 0.51f), glm::vec2(0.03f, 0.53f), glm::vec2(0.0f, 0.532f)}, 28, orange);
    const Ref<Geometry> geometry = kit.geometry("cone", cone, kit.material("plastic", {.roughness = 0.5f}));
    for (int i = 0; i < 24; ++i) {
        const double angle = 6.283185307179586 * (i + 0.5) / 24.0;
        const double radius = i % 2 == 0 ? kCircleRadius + 1.9 : kCircleRadius - 1.9;
        kit.placeShape(kit.world(), "cone", geometry, {radius * std::cos(angle), 0.0, radius * std::sin(angle)},
                       turned(0.7f * static_cast<float>(i), {0, 1, 0}));
    }
}

}  // namespace

Ref<LoadedScene> buildCar(Aspect& aspect) {
    SceneKit kit(aspect, "car", {-0.55f, -0.75f, -0.37f}, glm::vec3(3.2f, 3.0f, 2.7f), glm::vec3(0.26f, 0.3f, 0.36f));
    addGround(kit);
    addCones(kit);

    // The pivot turns about the middle of the circle; the car stands on it, its nose along the circle. Seen from above
    // it drives counter-clockwise: to its left.
    const Ref<Node> pivot = kit.place(kit.world(), "pivot", {0, 0, 0});
    const Ref<Node> car = kit.place(pivot, "car", {0.0, 0.0, kCircleRadius});
    CarMeshes meshes;
    addLowerBody(meshes);
    addCabin(meshes);
    addDetails(meshes);
    const auto part = [&](const char* name, const Mesh& mesh, const SurfaceSpec& spec) {
        kit.node(car, name, Ref<Container>(kit.geometry(name, mesh, kit.material(name, spec)).id));
    };
    part("paint", meshes.paint, {.colour = linearColour(0xb0161a), .metallic = 0.0f, .roughness = 0.28f});
    part("glass", meshes.glass, {.colour = linearColour(0x20282e), .metallic = 0.0f, .roughness = 0.08f});
    part("trim", meshes.trim, {.colour = linearColour(0x1c1d1f), .roughness = 0.6f});
    part("headlights", meshes.headlights,
         {.colour = linearColour(0xe9edf0), .roughness = 0.15f, .emission = glm::vec3(0.12f)});
    part("tail lights", meshes.tailLights,
         {.colour = linearColour(0x8c0d0d), .roughness = 0.2f, .emission = glm::vec3(0.15f, 0.0f, 0.0f)});

    const Ref<Geometry> wheel = kit.geometry("wheel", wheelMesh(), kit.material("wheel", {.roughness = 0.45f}));
    std::vector<Ref<AnimationChannel>> channels = {spin(kit, pivot, {0, 1, 0}, 1)};
    struct Mount {
        const char* name;
        float axle;
        float side;
    };
    for (const Mount& mount : {Mount{"front left", kAxleFront, -1.0f}, Mount{"front right", kAxleFront, 1.0f},
                               Mount{"rear left", kAxleRear, -1.0f}, Mount{"rear right", kAxleRear, 1.0f}}) {
        // The front wheels are turned into the bend; a left wheel is a right one turned round.
        const float steer = mount.axle == kAxleFront ? 0.22f : 0.0f;
        const Ref<Node> hub =
            kit.place(car, std::string(mount.name) + " hub", {mount.axle, kWheelRadius, mount.side * (kTrack + 0.02)},
                      turned(steer + (mount.side < 0.0f ? 3.14159265f : 0.0f), {0, 1, 0}));
        const Ref<Node> spinning = kit.placeShape(hub, mount.name, wheel, {0, 0, 0});
        const double radius = kCircleRadius + mount.side * kTrack;
        const int turns = static_cast<int>(std::lround(radius / kWheelRadius));
        channels.push_back(spin(kit, spinning, {0, 0, 1}, mount.side > 0.0f ? -turns : turns));
    }
    kit.animation("drive", channels, kPeriod);
    kit.camera("main", {4.6, 2.3, 13.4}, {0.0, 0.55, 7.0}, 32.0);
    return kit.scene();
}

}  // namespace umbriel
