#include "server/draw/gpu_materials.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "server/draw/reflection_models.h"

namespace umbriel {
namespace {

// Uniform block bindings, as in shaders/stage.
constexpr GLuint kMaterialBinding = 1;

constexpr Feature kTextureFeatures[kMaterialTextures] = {Feature::BaseColourTexture, Feature::MetallicRoughnessTexture,
                                                         Feature::NormalTexture,     Feature::OcclusionTexture,
                                                         Feature::EmissionTexture,   Feature::SpecularTexture};

// Colours are stored in sRGB, data as it is.
bool isColour(std::size_t unit) {
    const auto which = static_cast<TextureUnit>(unit);
    return which == TextureUnit::BaseColour || which == TextureUnit::Emission || which == TextureUnit::Specular;
}

// True when a lobe tells one tangent from the other.
bool fillLobes(const Material& source, glm::vec4* lobes) {
    if (source.model.get() != ReflectionModel::Lafortune) return false;
    bool hasGrain = false;
    const std::size_t count =
        std::min({kMaxLobes, source.lobeAlbedos.size(), source.lobeAxes.size(), source.lobeExponents.size()});
    for (std::size_t i = 0; i < count; ++i) {
        const glm::vec3 axes = source.lobeAxes[i];
        lobes[2 * i] = glm::vec4(glm::vec3(source.lobeAlbedos[i]), source.lobeExponents[i]);
        lobes[2 * i + 1] = glm::vec4(axes, 1.0f);
        hasGrain |= axes.x != axes.y;
    }
    return hasGrain;
}

}  // namespace

bool GpuMaterial::usesTexCoords(std::uint32_t set) const {
    for (std::size_t i = 0; i < kMaterialTextures; ++i)
        if (textures[i] && texCoordSets[i] == set) return true;
    return false;
}

GpuMaterials::GpuMaterials() {
    GLint alignment = 256;
    glGetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
    const auto step = static_cast<std::size_t>(alignment);
    _stride = (sizeof(Block) + step - 1) / step * step;
}

void GpuMaterials::changed(ContainerId id) {
    if (const auto found = _entries.find(id); found != _entries.end()) found->second.isStale = true;
    if (const auto users = _usersOfTexture.find(id); users != _usersOfTexture.end()) {
        for (const ContainerId user : users->second)
            if (const auto found = _entries.find(user); found != _entries.end()) found->second.isStale = true;
        _usersOfTexture.erase(users);
    }
}

const GpuMaterial& GpuMaterials::find(const Aspect& scene, const GpuTextures& images, ContainerId id) {
    if (id && !scene.findAs<Material>(id)) id = {};
    const auto [found, isNew] = _entries.try_emplace(id);
    Entry& entry = found->second;
    if (isNew) entry.material.slot = static_cast<std::uint32_t>(_entries.size() - 1);
    if (entry.isStale) fill(scene, images, id, entry);
    return entry.material;
}

void GpuMaterials::fill(const Aspect& scene, const GpuTextures& images, ContainerId id, Entry& entry) {
    entry.isStale = false;
    GpuMaterial& material = entry.material;
    material.features = 0;
    material.textures = {};
    material.wantsTangents = false;
    Block block{};
    const Material* source = scene.findAs<Material>(id);
    if (!source) {
        material.features = bit(Feature::MetallicRoughness);
        block.baseColour = glm::vec4(0.8f, 0.8f, 0.8f, 1.0f);
        block.metallicRoughness = glm::vec4(0.0f, 1.0f, 1.0f, 1.0f);
    } else {
        const ReflectionModel model = source->model;
        material.features |= featureOf(model);
        if (source->alphaMode.get() == AlphaMode::Mask) material.features |= bit(Feature::AlphaMask);
        if (source->alphaMode.get() == AlphaMode::Blend) material.features |= bit(Feature::AlphaBlend);
        if (source->doubleSided.get()) material.features |= bit(Feature::DoubleSided);
        block.baseColour = source->baseColour;
        block.metallicRoughness =
            glm::vec4(glm::clamp(source->metallic.get(), 0.0f, 1.0f), glm::clamp(source->roughness.get(), 0.0f, 1.0f),
                      source->normalScale.get(), source->occlusionStrength.get());
        block.emission = glm::vec4(source->emission.get(), source->alphaCutoff.get());
        if (source->emission.get() != glm::vec3(0.0f)) material.features |= bit(Feature::Emission);
        block.specular = glm::vec4(source->specular.get(), source->shininess.get());
        if (hasClassicHighlight(model) && source->specular.get() == glm::vec3(0.0f)) material.features |= bit(Feature::Matt);
        block.ambient = glm::vec4(source->ambient.get(), source->ambientShare.get());
        material.wantsTangents = fillLobes(*source, block.lobes);
        const Ref<Texture> textures[kMaterialTextures] = {source->baseColourTexture, source->metallicRoughnessTexture,
                                                          source->normalTexture,     source->occlusionTexture,
                                                          source->emissionTexture,   source->specularTexture};
        for (std::size_t i = 0; i < kMaterialTextures; ++i) {
            // What the model ignores costs nothing.
            const bool read = readsTexture(model, kTextureFeatures[i]) &&
                              (kTextureFeatures[i] != Feature::EmissionTexture || has(material.features, Feature::Emission));
            if (!textures[i]) continue;
            // Also of textures that cannot be used now: their image may come later.
            _usersOfTexture[textures[i]].push_back(id);
            if (const Texture* texture = scene.find(textures[i])) _usersOfTexture[texture->image.get()].push_back(id);
            if (!read ||
                !images.isUsable(scene, scene.find(textures[i]) ? scene.get(textures[i]).image.get() : Ref<Image>()))
                continue;
            const Texture& texture = scene.get(textures[i]);
            material.textures[i] = textures[i];
            material.texCoordSets[i] = texture.texCoordSet.get() == 0 ? 0u : 1u;
            material.features |= bit(kTextureFeatures[i]);
            // uv' = translate * rotate * scale * uv, with u' = cos u + sin v (KHR_texture_transform).
            const float c = std::cos(texture.rotation.get());
            const float s = std::sin(texture.rotation.get());
            const glm::vec2 scale = texture.scale;
            const glm::vec2 offset = texture.offset;
            block.uvFromTexCoord[2 * i] =
                glm::vec4(c * scale.x, s * scale.y, offset.x, float(material.texCoordSets[i]));
            block.uvFromTexCoord[2 * i + 1] = glm::vec4(-s * scale.x, c * scale.y, offset.y, 0.0f);
        }
    }
    if (_content.size() < _entries.size() * _stride) _content.resize(_entries.size() * _stride);
    std::memcpy(_content.data() + material.slot * _stride, &block, sizeof(block));
    _dirtySlots.push_back(material.slot);
}

Result<void> GpuMaterials::upload() {
    if (_content.size() > _buffer.size()) {
        // Room to grow, so that a scene that is being built does not upload everything each time.
        _content.resize(std::max(_content.size(), _buffer.size() * 2));
        auto buffer = gl::Buffer::create(std::span<const std::byte>(_content), GL_DYNAMIC_STORAGE_BIT);
        if (!buffer) return buffer.error();
        _buffer = std::move(*buffer);
    } else {
        for (const std::uint32_t slot : _dirtySlots)
            _buffer.write(slot * _stride, std::span<const std::byte>(_content).subspan(slot * _stride, sizeof(Block)));
    }
    _dirtySlots.clear();
    return {};
}

Result<void> GpuMaterials::bind(const Aspect& scene, const GpuMaterial& material, GpuTextures& textures) const {
    _buffer.bindRange(GL_UNIFORM_BUFFER, kMaterialBinding, material.slot * _stride, sizeof(Block));
    for (std::size_t i = 0; i < kMaterialTextures; ++i) {
        const Texture* texture = scene.findAs<Texture>(material.textures[i]);
        if (!texture) continue;
        auto image = textures.find(scene, texture->image.get(), isColour(i), texture->mipMode.get() != MipMode::None);
        if (!image) return image.error();
        if (!*image) continue;
        (*image)->bind(static_cast<GLuint>(i));
        textures.samplerFor(*texture).bind(static_cast<GLuint>(i));
    }
    return {};
}

}  // namespace umbriel
