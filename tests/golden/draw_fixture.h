#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/aspect.h"
#include "common/scene/core_types.h"
#include "common/scene/lights.h"
#include "common/scene/windows.h"
#include "server/draw/renderer.h"
#include "server/gl/context.h"

namespace umbriel {

// A layer of the whole wall, put together from tiles.
struct WallImage {
    PixelSize size;
    std::uint32_t channels = 0;
    std::vector<float> values;  // bits, for integer layers
    const float* at(int x, int y) const {
        return values.data() +
               (static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) + static_cast<std::size_t>(x)) *
                   channels;
    }
    std::uint32_t bits(int x, int y, int channel) const {
        std::uint32_t value;
        std::memcpy(&value, at(x, y) + channel, 4);
        return value;
    }
};

// How many pixels differ in any bit.
inline std::size_t differingPixels(const WallImage& a, const WallImage& b) {
    std::size_t count = 0;
    const std::size_t pixels = a.values.size() / a.channels;
    for (std::size_t i = 0; i < pixels; ++i)
        count += std::memcmp(&a.values[i * a.channels], &b.values[i * b.channels], a.channels * 4) != 0;
    return count;
}

// How many differ by more than a few roundings of floats around 1 do.
inline std::size_t pixelsBeyondRounding(const WallImage& a, const WallImage& b) {
    std::size_t count = 0;
    const std::size_t pixels = a.values.size() / a.channels;
    for (std::size_t i = 0; i < pixels; ++i) {
        float most = 0.0f;
        for (std::size_t c = 0; c < a.channels; ++c)
            most = std::max(most, std::abs(a.values[i * a.channels + c] - b.values[i * a.channels + c]));
        count += !(most <= 0x1p-20f);
    }
    return count;
}

// 8-bit sRGB, as pictures are compared.
inline int encoded(float linear) {
    const double x = std::clamp(static_cast<double>(linear), 0.0, 1.0);
    return static_cast<int>(std::lround(255.0 * (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055)));
}

struct Mesh {
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::vec4> colours;
    std::vector<glm::vec2> texCoords;
    std::vector<std::uint32_t> indices;
};

// In the plane z = 0, from -half to half, facing +z, cells x cells quads.
inline Mesh gridMesh(float half, int cells = 1) {
    Mesh mesh;
    for (int y = 0; y <= cells; ++y)
        for (int x = 0; x <= cells; ++x) {
            const glm::vec2 uv(float(x) / float(cells), float(y) / float(cells));
            mesh.positions.push_back({(uv.x * 2 - 1) * half, (uv.y * 2 - 1) * half, 0.0f});
            mesh.normals.push_back({0, 0, 1});
            mesh.texCoords.push_back(uv);
        }
    const auto row = static_cast<std::uint32_t>(cells + 1);
    for (std::uint32_t y = 0; y + 1 < row; ++y)
        for (std::uint32_t x = 0; x + 1 < row; ++x) {
            const std::uint32_t a = y * row + x;
            for (const std::uint32_t index : {a, a + 1, a + row + 1, a, a + row + 1, a + row})
                mesh.indices.push_back(index);
        }
    return mesh;
}

inline Mesh boxMesh(glm::vec3 half) {
    Mesh mesh;
    for (int axis = 0; axis < 3; ++axis)
        for (const float side : {-1.0f, 1.0f}) {
            glm::vec3 normal(0.0f), u(0.0f), v(0.0f);
            normal[axis] = side;
            u[(axis + 1) % 3] = 1.0f;
            v[(axis + 2) % 3] = side;
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            for (const glm::vec2 corner : {glm::vec2(-1, -1), glm::vec2(1, -1), glm::vec2(1, 1), glm::vec2(-1, 1)}) {
                mesh.positions.push_back((normal + u * corner.x + v * corner.y) * half);
                mesh.normals.push_back(normal);
                mesh.texCoords.push_back(corner * 0.5f + 0.5f);
            }
            for (const std::uint32_t index : {0u, 1u, 2u, 0u, 2u, 3u}) mesh.indices.push_back(first + index);
        }
    return mesh;
}

// A scene, a renderer, and a wall to look at it.
class DrawTest : public ::testing::Test {
 protected:
    // Also called by tests to start over with an empty scene.
    void SetUp() override {
        scene.reset();
        renderer.reset();
        context.reset();
        auto created = gl::HeadlessContext::create();
        ASSERT_TRUE(created) << created.error().message;
        context.emplace(std::move(*created));
        auto made = Renderer::create(*context, rendererOptions);
        ASSERT_TRUE(made) << made.error().message;
        renderer = std::move(*made);
        types = std::make_unique<TypeRegistry>();
        registerCoreTypes(*types);
        scene = std::make_unique<Aspect>(*types, ids);
        root = scene->create<Node>("root");
        viewport = scene->create<Viewport>("main");
        scene->edit(viewport)
            .set<&Viewport::root>(root)
            .set<&Viewport::shadowMode>(ShadowMode::Standard)
            .set<&Viewport::reuseMaps>(false);  // tiles are drawn one after the other as by servers of their own
    }
    void TearDown() override {
        renderer.reset();  // before its context
    }

    template <class T>
    Ref<Node> node(Ref<Node> parent, Ref<T> core) {
        const Ref<Node> made = scene->create<Node>();
        scene->edit(made).template set<&Node::core>(Ref<Container>(core.id));
        scene->edit(parent).template append<&Node::children>(made);
        return made;
    }
    Ref<Node> placed(Ref<Node> parent, glm::dvec3 translation, glm::mat3 linear = glm::mat3(1.0f)) {
        const Ref<Transform> transform = scene->create<Transform>();
        scene->edit(transform).set<&Transform::translation>(translation).set<&Transform::linear>(linear);
        return node(parent, transform);
    }
    Ref<Geometry> geometry(const Mesh& mesh, Ref<Material> material = {}) {
        const Ref<Geometry> made = scene->create<Geometry>();
        auto edit = scene->edit(made);
        edit.assign<&Geometry::positions>(mesh.positions);
        edit.assign<&Geometry::normals>(mesh.normals);
        edit.assign<&Geometry::texCoords0>(mesh.texCoords);
        edit.assign<&Geometry::colours>(mesh.colours);
        edit.assign<&Geometry::indices>(mesh.indices);
        edit.set<&Geometry::material>(Ref<Container>(material.id));
        return made;
    }
    Ref<Material> material(glm::vec4 colour, ReflectionModel model = ReflectionModel::BlinnPhong) {
        const Ref<Material> made = scene->create<Material>();
        scene->edit(made).set<&Material::baseColour>(colour).set<&Material::model>(model).set<&Material::metallic>(
            0.0f);
        return made;
    }
    // The node that light shines from: everything below it is lit.
    Ref<Node> lit(Ref<Node> parent, Ref<DirectionalLight> light, glm::vec3 travels,
                  glm::vec3 irradiance = glm::vec3(1.0f)) {
        const Ref<Node> beacon = placed(root, {0, 0, 0}, lookingAlong(travels));
        scene->edit(light).set<&DirectionalLight::irradiance>(irradiance).set<&DirectionalLight::beacon>(beacon);
        return node(parent, light);
    }
    // A rotation whose -z is the direction.
    static glm::mat3 lookingAlong(glm::vec3 direction) {
        const glm::vec3 z = -glm::normalize(direction);
        const glm::vec3 helper = std::abs(z.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
        const glm::vec3 x = glm::normalize(glm::cross(helper, z));
        return {x, glm::cross(z, x), z};
    }
    Ref<Texture> checkerTexture(std::uint32_t side, std::vector<std::uint8_t> rgba = {}) {
        const Ref<Image> image = scene->create<Image>();
        if (rgba.empty())
            for (std::uint32_t y = 0; y < side; ++y)
                for (std::uint32_t x = 0; x < side; ++x) {
                    const std::uint8_t value = (x / 4 + y / 4) % 2 ? 230 : 40;
                    rgba.insert(rgba.end(), {value, std::uint8_t(x * 255 / side), std::uint8_t(y * 255 / side), 255});
                }
        scene->edit(image).set<&Image::width>(side).set<&Image::height>(side).assign<&Image::texels>(rgba);
        const Ref<Texture> texture = scene->create<Texture>();
        scene->edit(texture).set<&Texture::image>(image);
        return texture;
    }

    // The whole wall through one viewport.
    View lookAt(glm::dvec3 eye, glm::dvec3 target, double fovY, PixelSize wall, glm::dvec3 up = {0, 1, 0}) const {
        View view;
        view.viewport = viewport.id;
        view.region = {0, 0, wall.width, wall.height};
        view.eyeWorld = eye;
        view.viewFromWorld = glm::dmat3(glm::lookAt(glm::dvec3(0), target - eye, up));
        const double near = view.nearDistance;
        const double f = 1.0 / std::tan(fovY / 2);
        view.clipFromView = glm::dmat4(0.0);
        view.clipFromView[0][0] = f * wall.height / wall.width;
        view.clipFromView[1][1] = f;
        view.clipFromView[2][3] = -1.0;
        view.clipFromView[3][2] = near;  // reversed, infinite
        return view;
    }
    // Straight down -z onto the plane z = 0, width metres wide, orthographic: analytic tests.
    View flatView(double width, PixelSize wall) const {
        View view;
        view.viewport = viewport.id;
        view.region = {0, 0, wall.width, wall.height};
        view.eyeWorld = {0, 0, 10};
        view.orthographic = true;
        const double height = width * wall.height / wall.width;
        view.clipFromView = glm::dmat4(1.0);
        view.clipFromView[0][0] = 2 / width;
        view.clipFromView[1][1] = 2 / height;
        view.clipFromView[2][2] = 1.0 / 100;  // z = -0.1 -> 1 - ..., z = -100 -> 0
        view.clipFromView[3][2] = 1.0;
        return view;
    }
    // A map over a sphere.
    ShadowFit fitSphere(ContainerId light, glm::dvec3 travels, glm::dvec3 middle, double radius,
                        std::uint32_t mapSize) const {
        ShadowFit fit;
        fit.light = light;
        fit.mode = ShadowMode::Standard;
        fit.mapSize = mapSize;
        const glm::dmat3 worldFromLight(lookingAlong(glm::vec3(travels)));
        fit.worldFromLight = worldFromLight;
        glm::dmat4 lightFromWorld(glm::transpose(worldFromLight));
        lightFromWorld = lightFromWorld * glm::translate(glm::dmat4(1.0), -middle);
        glm::dmat4 clipFromLight(1.0);
        clipFromLight[0][0] = clipFromLight[1][1] = 1 / radius;
        clipFromLight[2][2] = 0.5 / radius;  // z = +radius (nearest) -> 1, -radius -> 0
        clipFromLight[3][2] = 0.5;
        fit.clipFromWorld = clipFromLight * lightFromWorld;
        fit.texelSize = 2 * radius / mapSize;
        fit.depthRange = 2 * radius;
        fit.normalOffset = 0.5f;
        return fit;
    }

    WallViews wallViews(const View& view, TileMode mode = TileMode::Exact, std::uint32_t samples = 1,
                        std::uint32_t layers = static_cast<std::uint32_t>(Layer::Colour)) const {
        WallViews views;
        views.wall = {view.region.width, view.region.height};
        views.tiles = mode;
        views.samples = samples;
        views.layers = layers;
        views.views = {view};
        return views;
    }
    static std::vector<TileAssignment> grid(PixelSize wall, int columns, int rows) {
        std::vector<TileAssignment> tiles;
        for (int row = 0; row < rows; ++row)
            for (int column = 0; column < columns; ++column) {
                TileAssignment tile;
                tile.tile = static_cast<std::uint32_t>(tiles.size());
                const int left = column * wall.width / columns;
                const int bottom = row * wall.height / rows;
                tile.pixels = {left, bottom, (column + 1) * wall.width / columns - left,
                               (row + 1) * wall.height / rows - bottom};
                tiles.push_back(tile);
            }
        return tiles;
    }
    void sync() { renderer->sceneChanged(scene->commit(), *scene); }

    // Draws every tile as a server of its own would, one draw a tile, and puts the layers together.
    std::vector<WallImage> drawWall(const WallViews& views, int columns = 1, int rows = 1, bool together = false) {
        sync();
        const std::vector<TileAssignment> tiles = grid(views.wall, columns, rows);
        std::vector<WallImage> images;
        names.clear();
        statistics = {};
        const auto draw = [&](std::span<const TileAssignment> part) {
            auto drawn = renderer->draw(*scene, views, part, 0.0);
            ASSERT_TRUE(drawn) << drawn.error().message;
            statistics.triangles += drawn->triangles;
            statistics.shadowTriangles += drawn->shadowTriangles;
            statistics.shadowMapBytes = std::max(statistics.shadowMapBytes, drawn->shadowMapBytes);
            auto read = renderer->readTiles();
            ASSERT_TRUE(read) << read.error().message;
            for (const TilePixels& tile : *read) {
                images.resize(tile.layers.size());
                names.resize(tile.layers.size());
                for (std::size_t i = 0; i < tile.layers.size(); ++i) {
                    WallImage& image = images[i];
                    const TileLayer& layer = tile.layers[i];
                    names[i] = layer.name;
                    image.size = views.wall;
                    image.channels = layer.channels;
                    image.values.resize(static_cast<std::size_t>(views.wall.width) *
                                        static_cast<std::size_t>(views.wall.height) * layer.channels);
                    const PixelRect& at = tile.tile.pixels;
                    const std::size_t rowBytes =
                        static_cast<std::size_t>(at.width) * layer.channels * bytesOf(layer.components);
                    for (int y = 0; y < at.height; ++y) {
                        float* const to = const_cast<float*>(image.at(at.x, at.y + y));
                        const auto row =
                            std::span(layer.pixels).subspan(static_cast<std::size_t>(y) * rowBytes, rowBytes);
                        if (layer.components == ComponentType::Uint)  // as the bits of floats
                            std::memcpy(to, row.data(), rowBytes);
                        else
                            convertToFloats(layer.components, row,
                                            {to, static_cast<std::size_t>(at.width) * layer.channels});
                    }
                }
            }
        };
        if (together)
            draw(tiles);
        else
            for (const TileAssignment& tile : tiles) draw({&tile, 1});
        return images;
    }
    // In every layer, grids of tiles are the wall as one server draws it.
    void expectEqualTiles(const WallViews& views, const std::vector<WallImage>& whole,
                          std::initializer_list<std::pair<int, int>> grids) {
        for (const auto& [columns, rows] : grids) {
            const auto tiled = drawWall(views, columns, rows);
            ASSERT_EQ(tiled.size(), whole.size());
            for (std::size_t i = 0; i < whole.size(); ++i)
                EXPECT_EQ(differingPixels(whole[i], tiled[i]), 0u) << names[i] << ", " << columns << "x" << rows;
        }
    }
    WallImage drawColour(const WallViews& views, int columns = 1, int rows = 1) {
        std::vector<WallImage> images = drawWall(views, columns, rows);
        if (images.empty()) return {};
        return images.front();
    }

    std::optional<gl::HeadlessContext> context;
    Renderer::Options rendererOptions;  // of the next SetUp()
    std::unique_ptr<Renderer> renderer;
    std::unique_ptr<TypeRegistry> types;
    IdSource ids;
    std::unique_ptr<Aspect> scene;
    Ref<Node> root;
    Ref<Viewport> viewport;
    DrawStatistics statistics;
    std::vector<std::string> names;
};

}  // namespace umbriel
