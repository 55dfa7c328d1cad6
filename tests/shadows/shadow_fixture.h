#pragma once

#include <algorithm>
#include <cstdio>
#include <vector>

#include "client/session/camera.h"
#include "client/session/views.h"
#include "tests/golden/draw_fixture.h"

namespace umbriel {

// The modules that draw maps for each frame.
inline constexpr ShadowMode kMapModes[] = {ShadowMode::Standard,
                                           ShadowMode::Perspective,
                                           ShadowMode::LightSpacePerspective,
                                           ShadowMode::Trapezoid,
                                           ShadowMode::PercentageCloser,
                                           ShadowMode::PercentageCloserSoft,
                                           ShadowMode::DualParaboloid,
                                           ShadowMode::Cube};

// Axis-aligned boxes on a floor, whose shadows are known: a ray meets a box or not.
class ModuleTest : public DrawTest {
 protected:
    struct Block {
        glm::dvec3 lower, upper;
    };
    struct Errors {
        double error = 0.0, leak = 0.0, acne = 0.0;  // shares of the judged pixels
        double inner = 0.0;  // of these, what is wrong more than edgeMetres from a shadow's edge
        double rmse = 0.0;
        double mean = 0.0;  // of the absolute error of the factor
        std::size_t judged = 0;
        std::size_t dark = 0;  // in truth
    };
    enum class LightPlace { Directional, Spot, Point };

    // From the blocks' frame, in which they are parallel to the axes, to the world: turned, so that no edge lies along
    // the rows of a map, which is parallel to the world's axes.
    glm::dvec3 toWorld(const glm::dvec3& local) const { return worldFromLocal * (local * scale) + offset; }

    void SetUp() override {
        DrawTest::SetUp();
        blocks.clear();
        if (HasFatalFailure()) return;
        window = scene->create<Window>();
        scene->edit(window).append<&Window::viewports>(viewport);
    }
    void block(const glm::dvec3& lower, const glm::dvec3& upper) { blocks.push_back({lower, upper}); }
    // Houses of all sizes on a floor of 2 * half metres, always the same; scaled and moved as a whole.
    void buildTown(double half = 60.0, int count = 400) {
        block({-half, -1.0, -half}, {half, 0.0, half});
        std::uint32_t state = 12345;
        const auto next = [&] {
            state = state * 1664525u + 1013904223u;
            return (state >> 8) / 16777216.0;
        };
        for (int i = 0; i < count; ++i) {
            const glm::dvec3 at((2 * next() - 1) * half * 0.9, 0.0, (2 * next() - 1) * half * 0.9);
            const double size = 0.3 + 2.5 * next() * next();
            block(at - glm::dvec3(size, 0, size * (0.3 + next())),
                  at + glm::dvec3(size, 0.5 + 7.0 * next() * next(), size * (0.3 + next())));
        }
    }
    // Puts the blocks into the scene, below the light.
    void finishScene(LightPlace place, const glm::dvec3& position, const glm::dvec3& direction, float cone = 0.7f,
                     float radius = 0.0f) {
        lightPlace = place;
        lightPosition = toWorld(position);
        lightDirection = worldFromLocal * glm::normalize(direction);
        const Ref<Node> beacon = placed(root, lightPosition, lookingAlong(glm::vec3(lightDirection)));
        Ref<Node> below;
        if (place == LightPlace::Directional) {
            const auto light = scene->create<DirectionalLight>("light");
            scene->edit(light).set<&DirectionalLight::beacon>(beacon).set<&DirectionalLight::angularRadius>(radius);
            below = node(root, light);
        } else if (place == LightPlace::Spot) {
            const auto light = scene->create<SpotLight>("light");
            scene->edit(light)
                .set<&SpotLight::beacon>(beacon)
                .set<&SpotLight::outerAngle>(cone)
                .set<&SpotLight::radius>(radius);
            below = node(root, light);
        } else {
            const auto light = scene->create<PointLight>("light");
            scene->edit(light).set<&PointLight::beacon>(beacon).set<&PointLight::radius>(radius);
            below = node(root, light);
        }
        lightNode = below;
        spotCone = cone;
        const auto white = material({1, 1, 1, 1});
        if (isOneGeometry) {
            Mesh all;
            for (const Block& each : blocks) {
                Mesh box = boxMesh(glm::vec3(0.5 * scale * (each.upper - each.lower)));
                const auto first = static_cast<std::uint32_t>(all.positions.size());
                for (const std::uint32_t index : box.indices) all.indices.push_back(first + index);
                for (const glm::vec3& position : box.positions)
                    all.positions.push_back(position + glm::vec3(0.5 * scale * (each.lower + each.upper)));
                all.normals.insert(all.normals.end(), box.normals.begin(), box.normals.end());
                all.texCoords.insert(all.texCoords.end(), box.texCoords.begin(), box.texCoords.end());
            }
            node(placed(below, offset, glm::mat3(worldFromLocal)), geometry(all, white));
            return;
        }
        for (const Block& each : blocks)
            node(placed(below, toWorld(0.5 * (each.lower + each.upper)), glm::mat3(worldFromLocal)),
                 geometry(boxMesh(glm::vec3(0.5 * scale * (each.upper - each.lower))), white));
    }
    void look(const glm::dvec3& eye, const glm::dvec3& target, double fovY = 0.87) {
        LookAt pose;
        pose.eyeWorld = toWorld(eye);
        pose.targetWorld = toWorld(target);
        pose.upWorld = worldFromLocal * glm::dvec3(0, 1, 0);
        pose.fovY = fovY;
        const auto camera = addCamera(*scene, "camera", pose);
        ASSERT_TRUE(camera);
        scene->edit(viewport).set<&Viewport::camera>(Ref<Container>(camera->id));
    }
    WallViews resolved(PixelSize wall, TileMode mode = TileMode::Exact) {
        auto views = resolveViews(*scene, window, wall);
        EXPECT_TRUE(views) << (views ? "" : views.error().message);
        if (!views) return {};
        warnings = views->warnings;
        views->views.tiles = mode;
        views->views.layers = static_cast<std::uint32_t>(Layer::Colour) | static_cast<std::uint32_t>(Layer::Position) |
                              static_cast<std::uint32_t>(Layer::Normal) |
                              static_cast<std::uint32_t>(Layer::LightFactors);
        return views->views;
    }
    // Whether a ray meets a block before its end; all in the world. A block that it meets at its end alone is one that
    // the lamp touches, and rounding must not decide about that.
    bool isDark(const glm::dvec3& fromWorld, const glm::dvec3& directionWorld, double reachWorld) const {
        const glm::dvec3 from = (fromWorld - offset) * worldFromLocal / scale;
        const glm::dvec3 direction = directionWorld * worldFromLocal;
        const double reach = reachWorld / scale * (1.0 - 1e-12);
        for (const Block& each : blocks) {
            double enter = 0.0, leave = reach;
            for (int i = 0; i < 3; ++i) {
                const double inverse = 1.0 / direction[i];
                const double a = (each.lower[i] - from[i]) * inverse, b = (each.upper[i] - from[i]) * inverse;
                enter = std::max(enter, std::min(a, b));
                leave = std::min(leave, std::max(a, b));
            }
            if (enter < leave) return true;
        }
        return false;
    }
    Errors measure(PixelSize wall = {480, 300}) { return errorsOf(drawWall(resolved(wall)), wall); }
    // Of what drawWall() gave: each shaded point against a ray from it.
    Errors errorsOf(const std::vector<WallImage>& images, PixelSize wall) {
        Errors result;
        if (images.size() < 4) {
            ADD_FAILURE() << "layers are missing";
            return result;
        }
        const glm::dvec3 eye = resolved(wall).views[0].eyeWorld;
        std::size_t leaks = 0, acne = 0, inner = 0;
        double squares = 0.0, absolute = 0.0;
        for (int y = 0; y < wall.height; ++y)
            for (int x = 0; x < wall.width; ++x) {
                const float* n = images[2].at(x, y);
                const glm::dvec3 normal(n[0], n[1], n[2]);
                if (glm::dot(normal, normal) < 0.5) continue;
                const float* p = images[1].at(x, y);
                glm::dvec3 point = eye + glm::dvec3(p[0], p[1], p[2]);
                glm::dvec3 toLight = -lightDirection;
                double reach = 1e30;
                if (lightPlace != LightPlace::Directional) {
                    reach = glm::distance(lightPosition, point);
                    toLight = (lightPosition - point) / reach;
                    if (lightPlace == LightPlace::Spot &&
                        -glm::dot(toLight, lightDirection) < std::cos(spotCone) + 1e-3)
                        continue;
                }
                if (glm::dot(normal, toLight) < 0.1) continue;
                // The point of the picture is a float; its surface is a block's face.
                point += normal * (1e-5 * scale + 4e-7 * glm::distance(point, eye));
                const bool dark = isDark(point, toLight, reach);
                const double factor = images[3].at(x, y)[0];
                ++result.judged;
                result.dark += dark;
                const bool wrong = dark != (factor < 0.5);
                const double within = edgeMetres + (edgeAngle > 0.0 ? edgeAngle * reach : 0.0);
                if (wrong && within > 0.0) {
                    const glm::dvec3 across =
                        glm::normalize(glm::cross(toLight, normal + 0.3 * glm::dvec3(toLight.z, toLight.x, toLight.y)));
                    const glm::dvec3 along = glm::cross(toLight, across);
                    bool isEdge = false;
                    for (const glm::dvec3& step : {across, -across, along, -along}) {
                        // On the surface, where the map's texel lies.
                        const glm::dvec3 moved = step - toLight * (glm::dot(step, normal) / glm::dot(toLight, normal));
                        isEdge = isEdge || isDark(point + within * moved, toLight, reach) != dark;
                    }
                    inner += !isEdge;
                }
                leaks += dark && factor > 0.5;
                acne += !dark && factor < 0.5;
                absolute += std::abs(factor - (dark ? 0.0 : 1.0));
                squares += (factor - (dark ? 0.0 : 1.0)) * (factor - (dark ? 0.0 : 1.0));
            }
        const double judged = static_cast<double>(std::max<std::size_t>(result.judged, 1));
        result.leak = static_cast<double>(leaks) / judged;
        result.acne = static_cast<double>(acne) / judged;
        result.error = result.leak + result.acne;
        result.inner = static_cast<double>(inner) / judged;
        result.rmse = std::sqrt(squares / judged);
        result.mean = absolute / judged;
        return result;
    }

    Ref<Window> window;
    Ref<Node> lightNode;
    std::vector<Block> blocks;
    std::vector<std::string> warnings;
    LightPlace lightPlace = LightPlace::Directional;
    glm::dvec3 lightPosition{0.0}, lightDirection{0.0, -1.0, 0.0};
    double spotCone = 0.7;
    bool isOneGeometry = false;  // all blocks, instead of one each
    double scale = 1.0;
    double edgeMetres = 0.0;
    double edgeAngle = 0.0;  // for lamps: and so much more for each metre from the light
    // A turn by 16 degrees, in float as nodes keep it: a rotation to 1e-8.
    glm::dmat3 worldFromLocal{glm::dmat3(glm::mat3(0.96f, 0.0f, -0.28f, 0.0f, 1.0f, 0.0f, 0.28f, 0.0f, 0.96f))};
    glm::dvec3 offset{0.0};
};

}  // namespace umbriel
