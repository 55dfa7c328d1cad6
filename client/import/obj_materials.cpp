#include "client/import/obj_materials.h"

#include <tiny_obj_loader.h>

#include <algorithm>
#include <cmath>

#include "client/import/image_decode.h"
#include "client/import/import_error.h"

namespace umbriel {

Ref<Material> ObjMaterials::material(const std::vector<tinyobj::material_t>& sources, int index) {
    if (index < 0 || static_cast<std::size_t>(index) >= sources.size()) index = -1;
    const auto known = _materials.find(index);
    if (known != _materials.end()) return known->second;
    const std::string name = index < 0 ? "default" : sources[static_cast<std::size_t>(index)].name;
    const Ref<Material> made = _scene.create<Material>(name);
    {
        auto edit = _scene.edit(made);
        edit.set<&Material::model>(ReflectionModel::BlinnPhong);
        edit.set<&Material::doubleSided>(true);
        edit.set<&Material::baseColour>(glm::vec4(0.8f, 0.8f, 0.8f, 1.0f));
    }
    if (index >= 0) build(sources[static_cast<std::size_t>(index)], made);
    return _materials[index] = made;
}

void ObjMaterials::build(const tinyobj::material_t& source, Ref<Material> target) {
    const std::string place = "material '" + source.name + "'";
    const glm::vec3 diffuse = colour(source.diffuse, 1.0f, place + " Kd");
    float alpha = source.dissolve;
    if (!(alpha >= 0.0f && alpha <= 1.0f)) {
        _warnings.add(place + " d: out of range and taken as 1");
        alpha = 1.0f;
    }
    const Ref<Texture> diffuseMap = texture(source.diffuse_texname, source.diffuse_texopt, place + " map_Kd");
    const Ref<Texture> specularMap = texture(source.specular_texname, source.specular_texopt, place + " map_Ks");
    const Ref<Texture> emissionMap = texture(source.emissive_texname, source.emissive_texopt, place + " map_Ke");
    Ref<Texture> normalMap = texture(source.normal_texname, source.normal_texopt, place + " norm", true);
    if (!normalMap) normalMap = texture(source.bump_texname, source.bump_texopt, place + " map_Bump", true);
    if (!source.alpha_texname.empty()) _warnings.add(place + " map_d: is ignored; put alpha into map_Kd");

    auto edit = _scene.edit(target);
    edit.set<&Material::baseColour>(glm::vec4(diffuse, alpha));
    edit.set<&Material::baseColourTexture>(diffuseMap);
    edit.set<&Material::specular>(colour(source.specular, 1.0f, place + " Ks"));
    edit.set<&Material::specularTexture>(specularMap);
    edit.set<&Material::ambient>(colour(source.ambient, 1.0f, place + " Ka"));
    edit.set<&Material::emission>(colour(source.emission, 1e30f, place + " Ke"));
    edit.set<&Material::emissionTexture>(emissionMap);
    edit.set<&Material::normalTexture>(normalMap);
    // Ns 0 is what exporters write for materials without a highlight; the exponent starts at 1 here.
    if (std::isfinite(source.shininess)) edit.set<&Material::shininess>(std::clamp(source.shininess, 1.0f, 1e4f));
    if (!(source.shininess >= 0.0f && source.shininess <= 1e4f))
        _warnings.add(place + " Ns: " + std::to_string(source.shininess) + " is out of range (0 to 10000) and clamped");
    if (alpha < 1.0f) edit.set<&Material::alphaMode>(AlphaMode::Blend);
}

glm::vec3 ObjMaterials::colour(const float (&rgb)[3], float high, const std::string& place) {
    glm::vec3 result;
    for (int i = 0; i < 3; ++i) {
        const bool valid = rgb[i] >= 0.0f && rgb[i] <= high;
        result[i] = valid ? rgb[i] : rgb[i] > high ? high : 0.0f;
        if (!valid) _warnings.add(place + ": " + std::to_string(rgb[i]) + " is out of range and clamped");
    }
    return result;
}

Ref<Texture> ObjMaterials::texture(std::string name, const tinyobj::texture_option_t& options, const std::string& place,
                                   bool isNormalMap) {
    if (name.empty()) return {};
    std::replace(name.begin(), name.end(), '\\', '/');
    const KnownImage& known = image(name, place);
    if (!known.image) return {};
    if (isNormalMap && known.isGrey) {
        _warnings.add(place + ": '" + name + "' is a height map, not a normal map, and is ignored");
        return {};
    }
    const Ref<Texture> made = _scene.create<Texture>(name);
    auto edit = _scene.edit(made);
    edit.set<&Texture::image>(known.image);
    // MTL: t = scale * v + offset with the origin at the lower left. Geometry holds 1 - v, so the offset turns over,
    // too.
    const glm::vec2 scale(options.scale[0], options.scale[1]);
    const glm::vec2 offset(options.origin_offset[0], 1.0f - scale.y - options.origin_offset[1]);
    if (std::isfinite(scale.x + scale.y + offset.x + offset.y)) {
        edit.set<&Texture::scale>(scale);
        edit.set<&Texture::offset>(offset);
    }
    if (options.clamp) {
        edit.set<&Texture::wrapS>(WrapMode::ClampToEdge);
        edit.set<&Texture::wrapT>(WrapMode::ClampToEdge);
    }
    return made;
}

const ObjMaterials::KnownImage& ObjMaterials::image(const std::string& name, const std::string& place) {
    const auto known = _images.find(name);
    if (known != _images.end()) return known->second;
    KnownImage made;
    try {
        const DecodedImage decoded =
            decodeImage(_folder.read(name, place, false), _limits.imageSide, _sceneBytes, place);
        made = {createImage(_scene, decoded, name), decoded.isGrey};
    } catch (const ImportRefused& reason) {
        _warnings.add(std::string(reason.what()) + "; the texture is left out");
    }
    return _images[name] = made;
}

}  // namespace umbriel
