#include "server/draw/gpu_environments.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/math/rotation.h"
#include "server/draw/gpu_materials.h"

namespace umbriel {
namespace {

constexpr std::uint32_t kLargestFace = 4096;
constexpr GLint kRotationUniform = 12;  // as in shaders/snippet/environment.glsl
constexpr GLint kScaleUniform = 13;

std::uint32_t sideOf(std::size_t texels) {
    const auto side = static_cast<std::uint32_t>(std::lround(std::sqrt(static_cast<double>(texels))));
    return std::size_t{side} * side == texels ? side : 0;
}

bool isUsable(const EnvironmentMap& map) {
    const std::uint32_t size = map.faceSize;
    const std::uint32_t levels = map.levels;
    const std::uint32_t diffuse = map.diffuseSize;
    if (!std::has_single_bit(size) || size > kLargestFace || levels < 2 || levels > 13 || (size >> (levels - 1)) == 0 ||
        diffuse == 0 || diffuse > kLargestFace)
        return false;
    std::size_t texels = 0;
    for (std::uint32_t level = 0; level < levels; ++level) texels += std::size_t{6} * (size >> level) * (size >> level);
    return map.radiance.size() == texels && map.convolved.size() == std::size_t{6} * diffuse * diffuse &&
           sideOf(map.mirroredShares.size()) > 0;
}

// What is not finite becomes 0: one such texel would spread over every pixel that it is filtered into.
std::vector<float> finiteFloats(const MultiStorage& storage, std::size_t first, std::size_t count) {
    std::vector<float> values(count * storage.elementSize() / sizeof(float));
    storage.read(first, std::as_writable_bytes(std::span(values)));
    for (float& value : values)
        if (!std::isfinite(value)) value = 0.0f;
    return values;
}

gl::Name<gl::deleteTexture> cubeOf(const MultiStorage& texels, std::uint32_t size, std::uint32_t levels) {
    GLuint id = 0;
    glCreateTextures(GL_TEXTURE_CUBE_MAP, 1, &id);
    gl::Name<gl::deleteTexture> name(id);
    glTextureStorage2D(id, static_cast<GLsizei>(levels), GL_RGB32F, static_cast<GLsizei>(size),
                       static_cast<GLsizei>(size));
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    std::size_t first = 0;
    for (std::uint32_t level = 0; level < levels; ++level) {
        const auto side = static_cast<GLsizei>(size >> level);
        const std::size_t count = std::size_t{6} * static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
        const std::vector<float> values = finiteFloats(texels, first, count);
        glTextureSubImage3D(id, static_cast<GLint>(level), 0, 0, 0, side, side, 6, GL_RGB, GL_FLOAT, values.data());
        first += count;
    }
    return name;
}

}  // namespace

std::optional<EnvironmentUse> useOf(const Aspect& scene, const SceneTree& tree, ContainerId lightId,
                                    const std::optional<Placement>& placement) {
    const EnvironmentLight* light = scene.findAs<EnvironmentLight>(lightId);
    if (!light || !light->on.get()) return std::nullopt;
    const EnvironmentMap* map = scene.find(light->map.get());
    if (!map || !isUsable(*map)) return std::nullopt;
    EnvironmentUse use;
    use.map = map->id();
    const glm::vec3 scale = light->scale;
    for (int i = 0; i < 3; ++i) use.scale[i] = std::isfinite(scale[i]) ? std::max(scale[i], 0.0f) : 0.0f;
    std::optional<Placement> placed = placement;
    if (const ContainerId beacon = light->beacon.get().id) placed = tree.placementOf(scene, beacon);
    if (placed)
        if (const auto worldFromEnvironment = orthonormalised(placed->linear))
            use.environmentFromWorld = glm::mat3(glm::transpose(*worldFromEnvironment));
    return use;
}

std::vector<std::optional<EnvironmentUse>> environmentsBySet(const Aspect& scene, const SceneTree& tree,
                                                             const Viewport& viewport) {
    const auto chosen = [&](ContainerId node) {
        if (viewport.lightNodes.empty()) return true;
        for (std::size_t i = 0; i < viewport.lightNodes.size(); ++i)
            if (viewport.lightNodes[i].id == node) return true;
        return false;
    };
    std::vector<std::optional<EnvironmentUse>> ofLight;
    for (const SceneTree::Light& light : tree.lights())
        ofLight.push_back(chosen(light.node) ? useOf(scene, tree, light.light, tree.entries()[light.entry].world)
                                             : std::nullopt);
    std::vector<std::optional<EnvironmentUse>> result;
    for (const std::vector<std::uint32_t>& set : tree.lightSets()) {
        std::optional<EnvironmentUse> innermost;
        for (const std::uint32_t light : set)
            if (ofLight[light]) innermost = ofLight[light];
        result.push_back(innermost);
    }
    return result;
}

Result<GpuEnvironments::Entry> GpuEnvironments::upload(const EnvironmentMap& map) {
    if (!_cubes) {
        gl::SamplerOptions options;
        options.wrapS = options.wrapT = GL_CLAMP_TO_EDGE;
        _cubes = gl::Sampler(options);
        options.minFilter = GL_LINEAR;
        _table = gl::Sampler(options);
    }
    Entry entry;
    entry.levels = map.levels;
    entry.radiance = cubeOf(map.radiance.storage(), map.faceSize, map.levels);
    entry.convolved = cubeOf(map.convolved.storage(), map.diffuseSize, 1);
    const int side = static_cast<int>(sideOf(map.mirroredShares.size()));
    auto shares = gl::Texture2D::create(GL_RGB32F, {side, side});
    if (!shares) return shares.error();
    const std::vector<float> values = finiteFloats(map.mirroredShares.storage(), 0, map.mirroredShares.size());
    shares->upload(0, GL_RGB, GL_FLOAT, std::as_bytes(std::span(values)));
    entry.shares = std::move(*shares);
    if (auto checked = gl::checkError("an environment map"); !checked) return checked.error();
    return entry;
}

Result<void> GpuEnvironments::bind(const Aspect& scene, const EnvironmentUse& use, const gl::Program& program) {
    auto found = _entries.find(use.map);
    if (found == _entries.end()) {
        const EnvironmentMap* map = scene.findAs<EnvironmentMap>(use.map);
        UMBRIEL_ASSERT(map != nullptr, "an environment without its map is drawn");
        auto uploaded = upload(*map);
        if (!uploaded) return uploaded.error();
        found = _entries.emplace(use.map, std::move(*uploaded)).first;
    }
    const Entry& entry = found->second;
    const auto unit = static_cast<GLuint>(TextureUnit::Environment);
    // Lookups go over the edges of faces.
    glEnable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
    glBindTextureUnit(unit, entry.radiance.id());
    glBindTextureUnit(unit + 1, entry.convolved.id());
    _cubes.bind(unit);
    _cubes.bind(unit + 1);
    entry.shares.bind(unit + 2);
    _table.bind(unit + 2);
    program.set(kRotationUniform, use.environmentFromWorld);
    program.set(kScaleUniform, glm::vec4(use.scale, static_cast<float>(entry.levels - 1)));
    return {};
}

}  // namespace umbriel
