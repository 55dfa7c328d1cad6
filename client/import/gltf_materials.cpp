#include <tiny_gltf.h>

#include "client/import/gltf_builder.h"
#include "client/import/image_decode.h"
#include "client/import/import_error.h"

namespace umbriel {
namespace {

const tinygltf::Value* extensionOf(const tinygltf::ExtensionMap& extensions, const char* name) {
    const auto found = extensions.find(name);
    return found == extensions.end() || !found->second.IsObject() ? nullptr : &found->second;
}

double numberOf(const tinygltf::Value& object, const char* name, double otherwise) {
    return object.Has(name) && object.Get(name).IsNumber() ? object.Get(name).GetNumberAsDouble() : otherwise;
}

WrapMode wrapModeOf(int wrap) {
    if (wrap == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return WrapMode::ClampToEdge;
    return wrap == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? WrapMode::MirroredRepeat : WrapMode::Repeat;
}

void applySampler(const tinygltf::Sampler& sampler, Edit<Texture>& edit) {
    edit.set<&Texture::wrapS>(wrapModeOf(sampler.wrapS));
    edit.set<&Texture::wrapT>(wrapModeOf(sampler.wrapT));
    if (sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST) edit.set<&Texture::magFilter>(FilterMode::Nearest);
    switch (sampler.minFilter) {
        case TINYGLTF_TEXTURE_FILTER_NEAREST:
        case TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_NEAREST:
        case TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_LINEAR:
            edit.set<&Texture::minFilter>(FilterMode::Nearest);
            break;
        default:
            break;
    }
    switch (sampler.minFilter) {
        case TINYGLTF_TEXTURE_FILTER_NEAREST:
        case TINYGLTF_TEXTURE_FILTER_LINEAR:
            edit.set<&Texture::mipMode>(MipMode::None);
            break;
        case TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_NEAREST:
        case TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_NEAREST:
            edit.set<&Texture::mipMode>(MipMode::Nearest);
            break;
        default:
            break;
    }
}

}  // namespace

Ref<Material> GltfMaterials::material(int index) {
    const auto known = _materials.find(index);
    if (known != _materials.end()) return known->second;
    Ref<Material> made;
    if (index < 0) {
        made = _context.scene.create<Material>("default");
    } else {
        const tinygltf::Material& source = _context.model().materials[static_cast<std::size_t>(index)];
        made = _context.scene.create<Material>(source.name);
        build(source, gltfPlace("materials", static_cast<std::size_t>(index)), made);
    }
    return _materials[index] = made;
}

void GltfMaterials::build(const tinygltf::Material& source, const std::string& place, Ref<Material> target) {
    const auto& pbr = source.pbrMetallicRoughness;
    const std::string pbrPlace = place + ".pbrMetallicRoughness";
    glm::vec4 baseColour(1.0f);
    for (int i = 0; i < 4; ++i)
        baseColour[i] =
            clamped(pbr.baseColorFactor[static_cast<std::size_t>(i)], 0.0, 1.0, pbrPlace + ".baseColorFactor");
    double strength = 1.0;
    if (const auto* extension = extensionOf(source.extensions, "KHR_materials_emissive_strength"))
        strength = numberOf(*extension, "emissiveStrength", 1.0);
    glm::vec3 emission(0.0f);
    for (int i = 0; i < 3; ++i)
        emission[i] = clamped(source.emissiveFactor[static_cast<std::size_t>(i)] * strength, 0.0, 1e30,
                              place + ".emissiveFactor");
    const Ref<Texture> baseColourTexture = texture(pbr.baseColorTexture, pbrPlace + ".baseColorTexture");
    const Ref<Texture> metallicRoughness =
        texture(pbr.metallicRoughnessTexture, pbrPlace + ".metallicRoughnessTexture");
    const Ref<Texture> normal = texture(source.normalTexture, place + ".normalTexture");
    const Ref<Texture> occlusion = texture(source.occlusionTexture, place + ".occlusionTexture");
    const Ref<Texture> emissionTexture = texture(source.emissiveTexture, place + ".emissiveTexture");

    auto edit = _context.scene.edit(target);
    if (source.extensions.count("KHR_materials_unlit") != 0) edit.set<&Material::model>(ReflectionModel::Unlit);
    edit.set<&Material::baseColour>(baseColour);
    edit.set<&Material::baseColourTexture>(baseColourTexture);
    edit.set<&Material::metallic>(clamped(pbr.metallicFactor, 0.0, 1.0, pbrPlace + ".metallicFactor"));
    edit.set<&Material::roughness>(clamped(pbr.roughnessFactor, 0.0, 1.0, pbrPlace + ".roughnessFactor"));
    edit.set<&Material::metallicRoughnessTexture>(metallicRoughness);
    edit.set<&Material::normalTexture>(normal);
    edit.set<&Material::normalScale>(static_cast<float>(source.normalTexture.scale));
    edit.set<&Material::occlusionTexture>(occlusion);
    edit.set<&Material::occlusionStrength>(
        clamped(source.occlusionTexture.strength, 0.0, 1.0, place + ".occlusionTexture.strength"));
    edit.set<&Material::emission>(emission);
    edit.set<&Material::emissionTexture>(emissionTexture);
    if (source.alphaMode == "MASK") edit.set<&Material::alphaMode>(AlphaMode::Mask);
    if (source.alphaMode == "BLEND") edit.set<&Material::alphaMode>(AlphaMode::Blend);
    edit.set<&Material::alphaCutoff>(clamped(source.alphaCutoff, 0.0, 1e30, place + ".alphaCutoff"));
    edit.set<&Material::doubleSided>(source.doubleSided);
}

float GltfMaterials::clamped(double value, double low, double high, const std::string& place) {
    if (value >= low && value <= high) return static_cast<float>(value);
    const double nearest = value < low ? low : high;
    _context.warnings.add(place + ": " + std::to_string(value) + " is out of range and taken as " +
                          std::to_string(nearest));
    return static_cast<float>(nearest);
}

template <class TextureInfo>
Ref<Texture> GltfMaterials::texture(const TextureInfo& info, const std::string& place) {
    if (info.index < 0) return {};
    TextureUse use;
    use.texture = info.index;
    use.texCoord = info.texCoord;
    if (const auto* transform = extensionOf(info.extensions, "KHR_texture_transform")) {
        use.texCoord = static_cast<int>(numberOf(*transform, "texCoord", use.texCoord));
        use.rotation = static_cast<float>(numberOf(*transform, "rotation", 0.0));
        for (int i = 0; i < 2; ++i) {
            if (transform->Has("offset"))
                use.offset[i] = static_cast<float>(transform->Get("offset").Get(i).GetNumberAsDouble());
            if (transform->Has("scale"))
                use.scale[i] = static_cast<float>(transform->Get("scale").Get(i).GetNumberAsDouble());
        }
    }
    if (use.texCoord > 1) {
        _context.warnings.add(place + ": texture coordinates " + std::to_string(use.texCoord) +
                              " are not supported, the texture is left out");
        return {};
    }
    return texture(use, place);
}

Ref<Texture> GltfMaterials::texture(const TextureUse& use, const std::string& place) {
    const TextureKey key(use.texture, use.texCoord, use.offset.x, use.offset.y, use.rotation, use.scale.x, use.scale.y);
    const auto known = _textures.find(key);
    if (known != _textures.end()) return known->second;
    const tinygltf::Texture& source = _context.model().textures[static_cast<std::size_t>(use.texture)];
    if (source.source < 0) _context.warnings.add(place + ": texture " + std::to_string(use.texture) + " has no image");
    const Ref<Image> picture = source.source < 0 ? Ref<Image>() : image(source.source);
    if (!picture) return _textures[key] = {};
    const Ref<Texture> made = _context.scene.create<Texture>(source.name);
    auto edit = _context.scene.edit(made);
    edit.set<&Texture::image>(picture);
    edit.set<&Texture::texCoordSet>(static_cast<std::uint32_t>(use.texCoord));
    edit.set<&Texture::offset>(use.offset);
    edit.set<&Texture::rotation>(use.rotation);
    edit.set<&Texture::scale>(use.scale);
    if (source.sampler >= 0) applySampler(_context.model().samplers[static_cast<std::size_t>(source.sampler)], edit);
    return _textures[key] = made;
}

// A scene without one of its pictures is still worth seeing, so what is wrong with a picture is a warning.
Ref<Image> GltfMaterials::image(int index) {
    const auto known = _images.find(index);
    if (known != _images.end()) return known->second;
    Ref<Image> made;
    try {
        const auto encoded = _context.file.imageBytes(index);
        const std::string place = gltfPlace("images", static_cast<std::size_t>(index));
        const DecodedImage decoded = decodeImage(encoded, _context.limits.imageSide, _context.sceneBytes, place);
        made = createImage(_context.scene, decoded, _context.model().images[static_cast<std::size_t>(index)].name);
    } catch (const ImportRefused& reason) {
        _context.warnings.add(std::string(reason.what()) + "; the image is left out");
    }
    return _images[index] = made;
}

}  // namespace umbriel
