#include "client/import/image_decode.h"

#include <stb_image.h>

#include <climits>
#include <cstring>
#include <memory>

namespace umbriel {
namespace {

// stb_image knows formats that glTF and MTL do not need; the fewer decoders a hostile file reaches, the better.
bool isPngOrJpeg(std::span<const std::byte> bytes) {
    constexpr unsigned char kPng[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    constexpr unsigned char kJpeg[] = {0xff, 0xd8, 0xff};
    const auto startsWith = [&](const unsigned char* magic, std::size_t size) {
        return bytes.size() >= size && std::memcmp(bytes.data(), magic, size) == 0;
    };
    return startsWith(kPng, sizeof(kPng)) || startsWith(kJpeg, sizeof(kJpeg));
}

void requireSmall(std::uint64_t width, std::uint64_t height, std::uint32_t largestSide, std::string_view place) {
    if (width <= largestSide && height <= largestSide) return;
    throw ImportRefused(place, std::to_string(width) + " x " + std::to_string(height) + " texels are too many, " +
                                   std::to_string(largestSide) + " a side is the limit; scale it down");
}

// stb_image calls a PNG of more than 2^30 samples an unknown type. Width and height are in the first chunk, big endian.
void requireSmallPng(std::span<const std::byte> bytes, std::uint32_t largestSide, std::string_view place) {
    constexpr std::size_t kChunk = 12, kWidth = 16, kHeight = 20;
    if (bytes.size() < kHeight + 4 || std::memcmp(bytes.data() + kChunk, "IHDR", 4) != 0) return;
    const auto number = [&](std::size_t at) {
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<std::uint64_t>(bytes[at + i]);
        return value;
    };
    requireSmall(number(kWidth), number(kHeight), largestSide, place);
}

}  // namespace

DecodedImage decodeImage(std::span<const std::byte> encoded, std::uint32_t largestSide, ByteBudget& sceneBytes,
                         std::string_view place) {
    if (!isPngOrJpeg(encoded)) throw ImportRefused(place, "is neither PNG nor JPEG");
    requireSmallPng(encoded, largestSide, place);
    if (encoded.size() > INT_MAX) throw ImportRefused(place, "is larger than 2 GiB");
    const auto* bytes = reinterpret_cast<const stbi_uc*>(encoded.data());
    const int size = static_cast<int>(encoded.size());
    int width = 0;
    int height = 0;
    int channels = 0;
    if (stbi_info_from_memory(bytes, size, &width, &height, &channels) == 0 || width <= 0 || height <= 0)
        throw ImportRefused(place, "cannot be decoded: " + std::string(stbi_failure_reason()));
    requireSmall(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height), largestSide, place);
    const int wanted = channels == 2 || channels == 4 ? 4 : 3;
    DecodedImage image{
        static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), wanted, {}, channels <= 2};
    const std::size_t texelBytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * wanted;
    sceneBytes.take(texelBytes, place);
    const std::unique_ptr<stbi_uc, void (*)(void*)> texels(
        stbi_load_from_memory(bytes, size, &width, &height, &channels, wanted), stbi_image_free);
    if (!texels) throw ImportRefused(place, "cannot be decoded: " + std::string(stbi_failure_reason()));
    image.texels.assign(texels.get(), texels.get() + texelBytes);
    return image;
}

Ref<Image> createImage(Aspect& scene, const DecodedImage& decoded, const std::string& name) {
    const Ref<Image> image = scene.create<Image>(name);
    auto edit = scene.edit(image);
    edit.set<&Image::width>(decoded.width);
    edit.set<&Image::height>(decoded.height);
    edit.set<&Image::format>(decoded.channels == 4 ? TexelFormat::RGBA8 : TexelFormat::RGB8);
    edit.assign<&Image::texels>(decoded.texels);
    return image;
}

}  // namespace umbriel
