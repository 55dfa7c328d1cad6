#pragma once

#include "common/scene/container.h"
#include "common/scene/type_descriptor.h"

namespace umbriel {

// docs/illumination.md has the formula of each.
enum class ReflectionModel : std::uint32_t {
    MetallicRoughness, BlinnPhong, Unlit, Lambert, Phong, PhongGated, Schlick, NormalisedPhong, PhongBrdf,
    TorranceSparrow, Lafortune, PhongOriginal, GeneralSum, OpenGlSum
};
enum class AlphaMode : std::uint32_t { Opaque, Mask, Blend };
enum class WrapMode : std::uint32_t { Repeat, MirroredRepeat, ClampToEdge };
enum class FilterMode : std::uint32_t { Nearest, Linear };
enum class MipMode : std::uint32_t { None, Nearest, Linear };
enum class TexelFormat : std::uint32_t { R8, RG8, RGB8, RGBA8 };

template <> inline constexpr std::uint32_t kEnumCount<ReflectionModel> = 14;
template <> inline constexpr std::uint32_t kEnumCount<AlphaMode> = 3;
template <> inline constexpr std::uint32_t kEnumCount<WrapMode> = 3;
template <> inline constexpr std::uint32_t kEnumCount<FilterMode> = 2;
template <> inline constexpr std::uint32_t kEnumCount<MipMode> = 3;
template <> inline constexpr std::uint32_t kEnumCount<TexelFormat> = 4;

// The texels of a picture, first row first, tightly packed.
struct Image : Container {
    static constexpr std::string_view kTypeName = "Image";
    Single<std::uint32_t> width{0u};
    Single<std::uint32_t> height{0u};
    Single<TexelFormat> format{TexelFormat::RGBA8};
    Multi<std::uint8_t> texels;  // width x height x channels bytes; otherwise the image counts as absent

    static void declare(TypeBuilder<Image>& type) {
        type.field<&Image::width>("width");
        type.field<&Image::height>("height");
        type.field<&Image::format>("format");
        type.field<&Image::texels>("texels");
    }
};

// How an image is sampled: which texture coordinates, how they are transformed (KHR_texture_transform:
// uv' = translate * rotate * scale * uv), wrapped and filtered.
struct Texture : Container {
    static constexpr std::string_view kTypeName = "Texture";
    Single<Ref<Image>> image;
    Single<std::uint32_t> texCoordSet{0u};  // 0 or 1
    Single<glm::vec2> offset;
    Single<float> rotation;  // radians, counter-clockwise in texture space
    Single<glm::vec2> scale{glm::vec2(1.0f)};
    Single<WrapMode> wrapS{WrapMode::Repeat};
    Single<WrapMode> wrapT{WrapMode::Repeat};
    Single<FilterMode> magFilter{FilterMode::Linear};
    Single<FilterMode> minFilter{FilterMode::Linear};
    Single<MipMode> mipMode{MipMode::Linear};

    static void declare(TypeBuilder<Texture>& type) {
        type.field<&Texture::image>("image");
        type.field<&Texture::texCoordSet>("texCoordSet");
        type.field<&Texture::offset>("offset");
        type.field<&Texture::rotation>("rotation");
        type.field<&Texture::scale>("scale");
        type.field<&Texture::wrapS>("wrapS");
        type.field<&Texture::wrapT>("wrapT");
        type.field<&Texture::magFilter>("magFilter");
        type.field<&Texture::minFilter>("minFilter");
        type.field<&Texture::mipMode>("mipMode");
    }
};

inline constexpr std::size_t kMaxLobes = 4;

// What a surface does with light. Colours are linear RGB; colour textures (base colour, emission, specular) are decoded
// from sRGB when sampled, the others are linear. MetallicRoughness (that of glTF 2.0) and TorranceSparrow use metallic and
// roughness; Lafortune the lobes; the others baseColour as diffuse, specular, shininess and, the textbook's ones, ambient.
// Values outside of their domain are repaired where scenes are made (material_values.h).
struct Material : Container {
    static constexpr std::string_view kTypeName = "Material";
    Single<ReflectionModel> model{ReflectionModel::MetallicRoughness};
    Single<glm::vec4> baseColour{glm::vec4(1.0f)};
    Single<Ref<Texture>> baseColourTexture;
    Single<float> metallic{1.0f};
    Single<float> roughness{1.0f};              // perceptual; alpha = roughness squared
    Single<Ref<Texture>> metallicRoughnessTexture;  // metallic in B, roughness in G
    Single<glm::vec3> specular{glm::vec3(0.0f)};
    Single<Ref<Texture>> specularTexture;
    Single<float> shininess{32.0f};             // exponent, [0, 1e6]
    Single<glm::vec3> ambient{glm::vec3(0.0f)};  // reflectance of ambient light
    Single<float> ambientShare{0.0f};           // PhongOriginal: the share of the colour that needs no light, [0, 1]
    Multi<glm::vec3> lobeAlbedos;               // Lafortune: up to kMaxLobes, 1/sr; the three fields are equally long
    Multi<glm::vec3> lobeAxes;                  // C, components in [-2, 2]; x and y along the tangents
    Multi<float> lobeExponents;                 // [0, 1e4]
    Single<Ref<Texture>> normalTexture;         // tangent space, x right, y up
    Single<float> normalScale{1.0f};
    Single<Ref<Texture>> occlusionTexture;      // in R; dims ambient light only
    Single<float> occlusionStrength{1.0f};
    Single<glm::vec3> emission;                 // radiance, W/(m^2 sr)
    Single<Ref<Texture>> emissionTexture;
    Single<AlphaMode> alphaMode{AlphaMode::Opaque};
    Single<float> alphaCutoff{0.5f};            // Mask: visible where alpha >= cutoff
    Single<bool> doubleSided{false};            // true: back faces are drawn, with the normal turned round

    static void declare(TypeBuilder<Material>& type) {
        type.field<&Material::model>("model");
        type.field<&Material::baseColour>("baseColour");
        type.field<&Material::baseColourTexture>("baseColourTexture");
        type.field<&Material::metallic>("metallic");
        type.field<&Material::roughness>("roughness");
        type.field<&Material::metallicRoughnessTexture>("metallicRoughnessTexture");
        type.field<&Material::specular>("specular");
        type.field<&Material::specularTexture>("specularTexture");
        type.field<&Material::shininess>("shininess");
        type.field<&Material::ambient>("ambient");
        type.field<&Material::ambientShare>("ambientShare");
        type.field<&Material::lobeAlbedos>("lobeAlbedos");
        type.field<&Material::lobeAxes>("lobeAxes");
        type.field<&Material::lobeExponents>("lobeExponents");
        type.field<&Material::normalTexture>("normalTexture");
        type.field<&Material::normalScale>("normalScale");
        type.field<&Material::occlusionTexture>("occlusionTexture");
        type.field<&Material::occlusionStrength>("occlusionStrength");
        type.field<&Material::emission>("emission");
        type.field<&Material::emissionTexture>("emissionTexture");
        type.field<&Material::alphaMode>("alphaMode");
        type.field<&Material::alphaCutoff>("alphaCutoff");
        type.field<&Material::doubleSided>("doubleSided");
    }
};

}  // namespace umbriel
