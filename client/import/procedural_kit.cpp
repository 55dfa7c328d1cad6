#include "client/import/procedural_kit.h"

#include <algorithm>

#include "common/base/assert.h"
#include "common/math/rotation.h"

namespace umbriel {

glm::mat3 turned(float angle, const glm::vec3& axis) {
    return glm::mat3(glm::rotate(glm::mat4(1.0f), angle, axis));
}

SceneKit::SceneKit(Aspect& aspect, const std::string& name, const glm::vec3& sunTravel, const glm::vec3& sunIrradiance,
                   const glm::vec3& ambientRadiance)
    : _aspect(aspect) {
    const auto sun = aspect.create<DirectionalLight>("sun");
    _root = node({}, name, Ref<Container>(sun.id));
    const auto turn = rotationLookingAlong(glm::dvec3(sunTravel), {0, 1, 0});
    UMBRIEL_ASSERT(turn.has_value(), "a sun shines somewhere");
    const Ref<Node> beacon = place(_root, "sun beacon", {0, 0, 0}, glm::mat3(*turn));
    aspect.edit(sun).set<&DirectionalLight::beacon>(beacon).set<&DirectionalLight::irradiance>(sunIrradiance);
    const auto sky = aspect.create<AmbientLight>("sky");
    aspect.edit(sky).set<&AmbientLight::radiance>(ambientRadiance);
    _world = node(_root, "world", Ref<Container>(sky.id));
    _scene = aspect.create<LoadedScene>(name);
    aspect.edit(_scene).set<&LoadedScene::root>(_root);
}

Ref<Image> SceneKit::image(const std::string& name, const TexelGrid& texels) {
    const auto image = _aspect.create<Image>(name);
    _aspect.edit(image)
        .set<&Image::width>(static_cast<std::uint32_t>(texels.width))
        .set<&Image::height>(static_cast<std::uint32_t>(texels.height))
        .set<&Image::format>(TexelFormat::RGB8)
        .assign<&Image::texels>(texels.rgb);
    return image;
}

Ref<Texture> SceneKit::texture(Ref<Image> image, WrapMode wrap) {
    const auto texture = _aspect.create<Texture>();
    _aspect.edit(texture).set<&Texture::image>(image).set<&Texture::wrapS>(wrap).set<&Texture::wrapT>(wrap);
    return texture;
}

Ref<Material> SceneKit::material(const std::string& name, const SurfaceSpec& spec) {
    const auto material = _aspect.create<Material>(name);
    _aspect.edit(material)
        .set<&Material::baseColour>(spec.colour)
        .set<&Material::metallic>(spec.metallic)
        .set<&Material::roughness>(spec.roughness)
        .set<&Material::emission>(spec.emission)
        .set<&Material::doubleSided>(spec.doubleSided)
        .set<&Material::baseColourTexture>(spec.colourTexture)
        .set<&Material::metallicRoughnessTexture>(spec.metallicRoughnessTexture)
        .set<&Material::normalTexture>(spec.normalTexture)
        .set<&Material::normalScale>(spec.normalScale);
    return material;
}

Ref<Geometry> SceneKit::geometry(const std::string& name, const Mesh& mesh, Ref<Material> material) {
    const auto geometry = _aspect.create<Geometry>(name);
    auto edit = _aspect.edit(geometry);
    edit.assign<&Geometry::positions>(mesh.positions);
    edit.assign<&Geometry::normals>(mesh.normals);
    if (!mesh.tangents.empty()) edit.assign<&Geometry::tangents>(mesh.tangents);
    if (std::any_of(mesh.colours.begin(), mesh.colours.end(), [](const auto& c) { return c != glm::vec4(1.0f); }))
        edit.assign<&Geometry::colours>(mesh.colours);
    if (std::any_of(mesh.texCoords.begin(), mesh.texCoords.end(),
                    [&](const auto& uv) { return uv != mesh.texCoords.front(); }))
        edit.assign<&Geometry::texCoords0>(mesh.texCoords);
    edit.assign<&Geometry::indices>(mesh.indices);
    edit.set<&Geometry::material>(Ref<Container>(material.id));
    return geometry;
}

Ref<Node> SceneKit::node(Ref<Node> parent, const std::string& name, Ref<Container> core) {
    const auto node = _aspect.create<Node>(name);
    if (core) _aspect.edit(node).set<&Node::core>(core);
    if (parent) _aspect.edit(parent).append<&Node::children>(node);
    return node;
}

Ref<Node> SceneKit::place(Ref<Node> parent, const std::string& name, const glm::dvec3& translation,
                          const glm::mat3& linear) {
    const auto transform = _aspect.create<Transform>();
    _aspect.edit(transform).set<&Transform::linear>(linear).set<&Transform::translation>(translation);
    return node(parent, name, Ref<Container>(transform.id));
}

Ref<Node> SceneKit::placeShape(Ref<Node> parent, const std::string& name, Ref<Geometry> geometry,
                               const glm::dvec3& translation, const glm::mat3& linear) {
    const Ref<Node> placed = place(parent, name, translation, linear);
    node(placed, name, Ref<Container>(geometry.id));
    return placed;
}

void SceneKit::pointLight(const std::string& name, const glm::dvec3& position, const glm::vec3& intensity) {
    // Above the world in the graph, for a light acts on what is below its node.
    const auto light = _aspect.create<PointLight>(name);
    const Ref<Node> beacon = place(_root, name + " beacon", position);
    _aspect.edit(light)
        .set<&PointLight::beacon>(beacon)
        .set<&PointLight::intensity>(intensity)
        .set<&PointLight::castsShadow>(false);
    const auto lit = _aspect.create<Node>(name);
    const std::size_t last = _aspect.get(_root).children.size();
    for (std::size_t i = 0; i < last; ++i) {
        // The node that leads to the world: the world itself or the previous light.
        const Ref<Node> child = _aspect.get(_root).children[i];
        const Ref<Container> core = _aspect.get(child).core;
        if (child != _world && !_aspect.findAs<PointLight>(core)) continue;
        _aspect.edit(lit).set<&Node::core>(Ref<Container>(light.id)).append<&Node::children>(child);
        _aspect.edit(_root).setElement<&Node::children>(i, lit);
        return;
    }
}

void SceneKit::camera(const std::string& name, const glm::dvec3& eye, const glm::dvec3& target, double fovYDegrees) {
    const auto turn = rotationLookingAlong(target - eye, {0, 1, 0});
    UMBRIEL_ASSERT(turn.has_value(), "a camera looks somewhere");
    const Ref<Node> beacon = place(_root, name + " beacon", eye, glm::mat3(*turn));
    const auto camera = _aspect.create<PerspectiveCamera>(name);
    _aspect.edit(camera).set<&PerspectiveCamera::beacon>(beacon).set<&PerspectiveCamera::fovY>(
        glm::radians(fovYDegrees));
    _aspect.edit(_scene).append<&LoadedScene::cameras>(Ref<Container>(camera.id));
}

Ref<AnimatedPose> SceneKit::pose(Ref<Node> placed, const glm::vec4& rotation) {
    const Ref<Transform> transform(_aspect.get(placed).core.get().id);
    const auto pose = _aspect.create<AnimatedPose>(_aspect.get(placed).name.get());
    _aspect.edit(pose)
        .set<&AnimatedPose::target>(transform)
        .set<&AnimatedPose::translation>(_aspect.get(transform).translation.get())
        .set<&AnimatedPose::rotation>(rotation);
    return pose;
}

Ref<AnimationChannel> SceneKit::channel(Ref<AnimatedPose> pose, AnimationPath path, const std::vector<float>& times,
                                        const std::vector<float>& values) {
    const auto channel = _aspect.create<AnimationChannel>();
    _aspect.edit(channel)
        .set<&AnimationChannel::pose>(pose)
        .set<&AnimationChannel::path>(path)
        .assign<&AnimationChannel::times>(times)
        .assign<&AnimationChannel::values>(values);
    return channel;
}

void SceneKit::animation(const std::string& name, const std::vector<Ref<AnimationChannel>>& channels, double duration) {
    const auto animation = _aspect.create<Animation>(name);
    _aspect.edit(animation).assign<&Animation::channels>(channels).set<&Animation::duration>(duration);
    _aspect.edit(_scene).append<&LoadedScene::animations>(animation);
}

}  // namespace umbriel
