#include "client/app/picture_truth.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "common/light/shading_truth.h"

namespace umbriel {
namespace {

constexpr std::uint32_t kNothing = 0xffffffffu;

// A geometry where a node draws it.
struct Shape {
    bool isJudged = false;
    const Material* material = nullptr;
    std::vector<glm::dvec3> positions;  // world
    std::vector<glm::dvec3> normals;    // world, any length
    std::vector<glm::vec4> colours;
    std::vector<std::uint32_t> indices;
    std::vector<LightInEffect> lights;  // that reach it
};

bool hasTextures(const Material& material) {
    return material.baseColourTexture.get() || material.metallicRoughnessTexture.get() ||
           material.specularTexture.get() || material.normalTexture.get() || material.occlusionTexture.get() ||
           material.emissionTexture.get();
}

Shape shapeOf(const Aspect& scene, const VisitedNode& visited, const Hierarchy& hierarchy,
              const std::vector<LightInEffect>& lights) {
    Shape shape;
    const auto& geometry = static_cast<const Geometry&>(*visited.core);
    ContainerId material = geometry.material.get().id;
    bool isReplaced = false;  // the innermost group wins
    for (Ref<Node> at = visited.ref; scene.find(at); at = hierarchy.parentOf(at)) {
        for (const LightInEffect& light : lights)
            if (light.node == at) shape.lights.push_back(light);
        const auto* group = scene.findAs<MaterialGroup>(scene.get(at).core.get());
        if (!group || isReplaced || !group->material.get()) continue;
        material = group->material.get().id;
        isReplaced = true;
    }
    shape.material = scene.findAs<Material>(material);
    shape.isJudged = shape.material && !hasTextures(*shape.material) &&
                     shape.material->alphaMode.get() == AlphaMode::Opaque &&
                     geometry.normals.size() == geometry.positions.size();
    if (!shape.isJudged) return shape;
    const glm::dmat3 worldFromNormal = glm::transpose(glm::inverse(visited.worldFromNode.linear));
    for (const glm::vec3& position : geometry.positions.toVector())
        shape.positions.push_back(visited.worldFromNode.linear * glm::dvec3(position) +
                                  visited.worldFromNode.translation);
    for (const glm::vec3& normal : geometry.normals.toVector())
        shape.normals.push_back(worldFromNormal * glm::dvec3(normal));
    if (geometry.colours.size() == geometry.positions.size()) shape.colours = geometry.colours.toVector();
    shape.indices = geometry.indices.toVector();
    return shape;
}

struct Ray {
    glm::dvec3 origin;
    glm::dvec3 direction;  // unit
};

// Through the centre of a pixel of the view; y counts from the bottom.
Ray rayThrough(const View& view, int x, int y) {
    const glm::dmat3 worldFromView = glm::transpose(view.viewFromWorld);
    const glm::dvec2 place((x + 0.5) / view.region.width * 2.0 - 1.0, (y + 0.5) / view.region.height * 2.0 - 1.0);
    const glm::dmat4& clip = view.clipFromView;
    if (view.orthographic) {
        const glm::dvec3 start((place.x - clip[3][0]) / clip[0][0], (place.y - clip[3][1]) / clip[1][1], 0.0);
        return {view.eyeWorld + worldFromView * start, worldFromView * glm::dvec3(0, 0, -1)};
    }
    // At z = -1, where w is 1.
    const glm::dvec3 along((place.x + clip[2][0]) / clip[0][0], (place.y + clip[2][1]) / clip[1][1], -1.0);
    return {view.eyeWorld, glm::normalize(worldFromView * along)};
}

bool shade(const Aspect& scene, const Shape& shape, std::uint32_t triangle, const Ray& ray, float* into) {
    if (std::size_t{triangle} * 3 + 2 >= shape.indices.size()) return false;
    const std::uint32_t* corners = &shape.indices[std::size_t{triangle} * 3];
    const glm::dvec3 a = shape.positions[corners[0]];
    const glm::dvec3 ab = shape.positions[corners[1]] - a;
    const glm::dvec3 ac = shape.positions[corners[2]] - a;
    const glm::dvec3 face = glm::cross(ab, ac);
    const double towards = glm::dot(face, ray.direction);
    if (towards == 0.0) return false;
    ShadedPoint point;
    point.positionWorld = ray.origin + ray.direction * (glm::dot(face, a - ray.origin) / towards);
    const glm::dvec3 from = point.positionWorld - a;
    const double area = glm::dot(face, face);
    const double v = glm::dot(glm::cross(from, ac), face) / area;
    const double w = glm::dot(glm::cross(ab, from), face) / area;
    const double weights[3] = {1.0 - v - w, v, w};
    glm::dvec3 normal(0.0);
    glm::dvec3 base(glm::vec3(shape.material->baseColour.get()));
    glm::dvec3 colour(shape.colours.empty() ? 1.0 : 0.0);
    for (int i = 0; i < 3; ++i) {
        normal += shape.normals[corners[i]] * weights[i];
        if (!shape.colours.empty()) colour += glm::dvec3(glm::vec3(shape.colours[corners[i]])) * weights[i];
    }
    if (!(glm::dot(normal, normal) > 0.0)) return false;
    point.normalWorld = glm::normalize(normal) * (towards > 0.0 ? -1.0 : 1.0);
    point.toEyeWorld = -ray.direction;
    point.baseColour = base * colour;
    const glm::dvec3 helper = std::abs(point.normalWorld.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
    point.tangentWorld = glm::normalize(glm::cross(helper, point.normalWorld));
    const glm::dvec3 radiance = radianceTruth(scene, *shape.material, point, shape.lights);
    for (int i = 0; i < 3; ++i) into[i] = static_cast<float>(radiance[i]);
    return true;
}

}  // namespace

PictureTruth truthOf(const Aspect& scene, Ref<Node> root, const View& view, const LayeredImage& picture) {
    PictureTruth truth{picture.rgba, std::vector<std::uint8_t>(picture.rgba.pixelCount(), 0), 0.0};
    const UintImage* ids = picture.uintLayer("ids");
    if (!ids) return truth;
    const Hierarchy hierarchy(scene, root);
    const std::vector<LightInEffect> lights = lightsInEffect(scene, root, hierarchy);
    std::unordered_map<std::uint32_t, Shape> shapes;  // by the low bits of the node's id, as in the layer
    traverse(scene, root, view.eyeWorld, [&](const VisitedNode& visited) {
        if (visited.core && isA<Geometry>(*visited.core))
            shapes.emplace(static_cast<std::uint32_t>(visited.ref.id.value),
                           shapeOf(scene, visited, hierarchy, lights));
        return Descend::Yes;
    });
    std::size_t shown = 0;
    std::size_t judged = 0;
    for (int row = 0; row < picture.height(); ++row)
        for (int x = 0; x < picture.width(); ++x) {
            const std::uint32_t node = ids->at(x, row, 0);
            if (node == kNothing) continue;
            ++shown;
            const auto shape = shapes.find(node);
            if (shape == shapes.end() || !shape->second.isJudged) continue;
            const Ray ray = rayThrough(view, x, picture.height() - 1 - row);
            if (!shade(scene, shape->second, ids->at(x, row, 1), ray, truth.rgba.pixel(x, row))) continue;
            ++judged;
            truth.judged[static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width()) +
                         static_cast<std::size_t>(x)] = 1;
        }
    truth.judgedShare = shown == 0 ? 0.0 : static_cast<double>(judged) / static_cast<double>(shown);
    return truth;
}

}  // namespace umbriel
