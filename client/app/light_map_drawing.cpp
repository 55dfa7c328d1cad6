#include "client/app/light_map_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "client/app/arguments.h"
#include "client/session/views.h"
#include "common/base/assert.h"
#include "common/base/log.h"
#include "common/scene/materials.h"
#include "common/scene/traversal.h"

namespace umbriel {
namespace {

// An attribute of every corner of every triangle; empty when it is not one of the vertices.
template <class T>
std::vector<T> ofCorners(const std::vector<T>& ofVertices, std::size_t vertices,
                         const std::vector<std::uint32_t>& indices) {
    std::vector<T> corners;
    if (ofVertices.size() != vertices || vertices == 0) return corners;
    for (const std::uint32_t index : indices) corners.push_back(ofVertices[index]);
    return corners;
}

// Of what is drawn at a node: of the innermost group, else the geometry's own.
const Material* materialAt(const Aspect& scene, const Hierarchy& hierarchy, Ref<Node> node, const Geometry& geometry) {
    for (Ref<Node> above = hierarchy.parentOf(node); above; above = hierarchy.parentOf(above)) {
        const auto* group = scene.findAs<MaterialGroup>(scene.get(above).core.get().id);
        if (!group) continue;
        if (group->material.get().id) return scene.findAs<Material>(group->material.get().id);
        break;
    }
    return scene.findAs<Material>(geometry.material.get().id);
}

}  // namespace

Result<ShadowMode> parseBakedMode(std::string_view text) {
    constexpr std::string_view kModes = "rays, std, pcf, ppcf, cube or dual-paraboloid";
    const auto mode = parseShadowMode(text);
    if (!mode) return badInput(fmt::format("'{}': expected {}", text, kModes));
    switch (*mode) {
        case ShadowMode::Standard:
        case ShadowMode::PercentageCloser:
        case ShadowMode::PercentageCloserSoft:
        case ShadowMode::Cube:
        case ShadowMode::DualParaboloid:
            return *mode;
        case ShadowMode::Perspective:
        case ShadowMode::LightSpacePerspective:
        case ShadowMode::Trapezoid:
            return badInput(
                fmt::format("{}: its map is warped for where the eye is, and a light map is looked at from "
                            "everywhere; without a view it is the map of std. Expected {}",
                            text, kModes));
        case ShadowMode::Planar:
        case ShadowMode::PlanarStencil:
        case ShadowMode::VolumeZPass:
        case ShadowMode::VolumeZFail:
        case ShadowMode::Blob:
            return badInput(
                fmt::format("{}: its shadows are made in the picture of a view, and a light map has none. "
                            "Expected {}",
                            text, kModes));
        default:
            return badInput(fmt::format("{}: there are no shadows to bake in it. Expected {}", text, kModes));
    }
}

void LightMapDrawing::describe(std::vector<Ref<Node>> surfaces, std::vector<Ref<Node>> moving,
                               std::vector<std::size_t> lights) {
    _surfaces = std::move(surfaces);
    _moving = std::move(moving);
    _lights = std::move(lights);
}

std::int32_t LightMapDrawing::wallSide(std::uint32_t size, int samples) {
    const auto points = static_cast<std::uint32_t>(samples);
    return static_cast<std::int32_t>(std::min(size, kDrawnPoints / points) * points);
}

Result<void> LightMapDrawing::unwrap(std::vector<std::vector<glm::dvec2>> corners, std::uint32_t size) {
    UMBRIEL_ASSERT(corners.size() == _surfaces.size(), "the surfaces that were described");
    _size = size;
    const Hierarchy hierarchy(_scene, _scene.get(_viewport).root);
    for (const Ref<Node>& node : _moving) _scene.edit(node).set<&Node::core>(Ref<Container>());
    // Materials that are cut out find their holes by coordinates of set 0, since set 1 is needed.
    for (std::size_t i = 0; i < _surfaces.size(); ++i) unwrapSurface(hierarchy, _surfaces[i], corners[i]);
    for (const ContainerId id : _scene.ids())
        if (const auto* texture = _scene.findAs<Texture>(id); texture && texture->texCoordSet.get() == 1)
            _scene.edit(Ref<Texture>(id)).set<&Texture::texCoordSet>(0u);
    return {};
}

void LightMapDrawing::unwrapSurface(const Hierarchy& hierarchy, Ref<Node> node,
                                    const std::vector<glm::dvec2>& corners) {
    const Geometry& old = _scene.get(Ref<Geometry>(_scene.get(node).core.get().id));
    const Material* material = materialAt(_scene, hierarchy, node, old);
    const bool isBlended = material && material->alphaMode.get() == AlphaMode::Blend;
    const std::vector<glm::vec3> positions = old.positions.toVector();
    std::vector<std::uint32_t> indices = old.indices.toVector();
    indices.resize(indices.size() / 3 * 3);
    // As servers draw it: a triangle with a corner that is not there is a point.
    for (std::size_t i = 0; i < indices.size(); i += 3)
        if (std::any_of(&indices[i], &indices[i] + 3, [&](std::uint32_t index) { return index >= positions.size(); }))
            std::fill(&indices[i], &indices[i] + 3, 0u);
    const Texture* holes = material ? _scene.find(material->baseColourTexture.get()) : nullptr;
    const bool bySecondSet = holes && holes->texCoordSet.get() == 1;
    std::vector<glm::vec2> places;
    for (const glm::dvec2& corner : corners) places.emplace_back(corner / double(_size));
    std::vector<std::uint32_t> inOrder(indices.size());
    for (std::size_t i = 0; i < inOrder.size(); ++i) inOrder[i] = static_cast<std::uint32_t>(i);
    const Ref<Geometry> made = _scene.create<Geometry>();
    _scene.edit(made)
        .assign<&Geometry::positions>(ofCorners(positions, positions.size(), indices))
        .assign<&Geometry::colours>(ofCorners(old.colours.toVector(), positions.size(), indices))
        .assign<&Geometry::texCoords0>(
            ofCorners((bySecondSet ? old.texCoords1 : old.texCoords0).toVector(), positions.size(), indices))
        .assign<&Geometry::texCoords1>(places)
        .assign<&Geometry::indices>(inOrder)
        .set<&Geometry::material>(old.material.get());
    if (!isBlended) {
        _scene.edit(node).set<&Node::core>(Ref<Container>(made.id));
        return;
    }
    // Factors are those of opaque surfaces; what is blended casts nothing.
    const Ref<Node> inner = _scene.create<Node>();
    const Ref<MaterialGroup> group = _scene.create<MaterialGroup>();
    _scene.edit(group).set<&MaterialGroup::material>(Ref<Container>(_scene.create<Material>().id));
    _scene.edit(inner).set<&Node::core>(Ref<Container>(made.id));
    _scene.edit(node).set<&Node::core>(Ref<Container>(group.id)).append<&Node::children>(inner);
    _scene.edit(_viewport).append<&Viewport::excludeNodes>(inner);
}

Result<void> LightMapDrawing::prepareView(std::int32_t wall) {
    _scene.edit(_viewport)
        .set<&Viewport::lowerLeft>(glm::vec2(0.0f))
        .set<&Viewport::upperRight>(glm::vec2(1.0f))
        .set<&Viewport::shadowOn>(true)
        .set<&Viewport::shadowFit>(ShadowFitMode::Scene)
        .set<&Viewport::show>(ShadowShow::Picture)
        .set<&Viewport::screenSpace>(false)
        .set<&Viewport::gauss>(0.0f);
    auto resolved = resolveViews(_scene, _window, {wall, wall});
    if (!resolved) return resolved.error();
    for (const std::string& warning : resolved->warnings) log::warning(warning);
    _views = std::move(resolved->views);
    if (_views.views.size() != 1) return failure("a light map is drawn through one viewport");
    _views.tiles = TileMode::Offset;
    _views.samples = 1;
    _views.layers = static_cast<std::uint32_t>(Layer::Ids) | static_cast<std::uint32_t>(Layer::LightFactors);
    View& view = _views.views.front();
    // Places are relative to it, in floats.
    const Box3d bounds = worldBounds(_scene, _scene.get(_viewport).root);
    if (!bounds.empty()) view.eyeWorld = bounds.centre();
    view.viewFromWorld = glm::dmat3(1.0);
    view.orthographic = false;
    view.unwrapped = true;
    return {};
}

Result<std::vector<std::vector<float>>> LightMapDrawing::lookUp(std::uint32_t x, std::uint32_t y, std::uint32_t side,
                                                                int samples) {
    const auto wall = static_cast<std::int32_t>(side) * samples;
    if (_views.views.empty())
        if (const auto prepared = prepareView(wall); !prepared) return prepared.error();
    // Texels [x, x + side) fill clip space; all depths are the same.
    glm::dmat4 clipFromUv(0.0);
    clipFromUv[0][0] = clipFromUv[1][1] = 2.0 * _size / side;
    clipFromUv[3] = {-2.0 * x / side - 1.0, -2.0 * y / side - 1.0, 0.5, 1.0};
    _views.views.front().clipFromView = clipFromUv;
    const auto tiles = _drawFrame(_scene, _views);
    if (!tiles) return tiles.error();
    return factorsOf(*tiles, wall);
}

Result<std::vector<std::vector<float>>> LightMapDrawing::factorsOf(std::span<const TilePixels> tiles,
                                                                   std::int32_t wall) const {
    const auto side = static_cast<std::size_t>(wall);
    std::vector<std::vector<float>> factors(_lights.size(), std::vector<float>(side * side, -1.0f));
    for (const TilePixels& tile : tiles) {
        const TileLayer* ids = nullptr;
        std::vector<const TileLayer*> lights;
        for (const TileLayer& layer : tile.layers) {
            if (layer.layer == Layer::Ids) ids = &layer;
            if (layer.layer == Layer::LightFactors) lights.push_back(&layer);
        }
        const PixelRect& at = tile.tile.pixels;
        const auto pixels = static_cast<std::size_t>(at.area());
        for (std::size_t i = 0; i < _lights.size(); ++i) {
            if (!ids || ids->pixels.size() != pixels * 8 || _lights[i] >= lights.size() ||
                lights[_lights[i]]->pixels.size() != pixels * 4)
                return failure(fmt::format("the servers sent no factors of light {}", _lights[i]));
            for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
                std::uint32_t node = 0;
                std::memcpy(&node, ids->pixels.data() + pixel * 8, 4);
                if (node == 0xffffffffu) continue;
                const auto width = static_cast<std::size_t>(at.width);
                const std::size_t row = static_cast<std::size_t>(at.y) + pixel / width;
                float& factor = factors[i][row * side + static_cast<std::size_t>(at.x) + pixel % width];
                std::memcpy(&factor, lights[_lights[i]]->pixels.data() + pixel * 4, 4);
            }
        }
    }
    return factors;
}

}  // namespace umbriel
