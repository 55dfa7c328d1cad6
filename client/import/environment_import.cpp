#include "client/import/environment_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/image/isolated_reader.h"

namespace umbriel {
namespace {

constexpr int kLargestColumns = 16384;

glm::vec3 texelAt(const FloatImage& image, int column, int row) {
    const float* pixel = image.pixel(column, row);
    return {pixel[0], pixel[1], pixel[2]};
}

// OpenEXR's cube: six faces from top to bottom, +X -X +Y -Y +Z -Z; where a direction lies on each is in ImfEnvmap.cpp
// (CubeMap::pixelPosition). `along` grows with the column, `down` with the row.
struct ExrFace {
    glm::vec3 forward, along, down;
};
constexpr std::array<ExrFace, 6> kExrFaces{{
    {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}},
    {{-1, 0, 0}, {0, 0, -1}, {0, -1, 0}},
    {{0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
    {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
    {{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}},
    {{0, 0, -1}, {1, 0, 0}, {0, -1, 0}},
}};

Panorama fromLatLong(const FloatImage& image) {
    Panorama panorama{image.width(), image.height(), {}};
    panorama.radiance.reserve(image.pixelCount());
    for (int row = 0; row < image.height(); ++row)
        for (int column = 0; column < image.width(); ++column) panorama.radiance.push_back(texelAt(image, column, row));
    return panorama;
}

// The faces in OpenGL's order and orientation.
Panorama fromExrCube(const FloatImage& image) {
    const int side = image.width();
    std::vector<std::vector<glm::vec3>> faces(6);
    for (int face = 0; face < 6; ++face)
        for (int row = 0; row < side; ++row)
            for (int column = 0; column < side; ++column) {
                const glm::vec3 direction =
                    cubeDirection(face, {(float(column) + 0.5f) / float(side), (float(row) + 0.5f) / float(side)});
                const ExrFace& source = kExrFaces[static_cast<std::size_t>(face)];
                const float s = glm::dot(direction, source.along) / glm::dot(direction, source.forward);
                const float t = glm::dot(direction, source.down) / glm::dot(direction, source.forward);
                const auto texel = [&](float place) {
                    return std::clamp(static_cast<int>((0.5f * place + 0.5f) * float(side)), 0, side - 1);
                };
                faces[static_cast<std::size_t>(face)].push_back(texelAt(image, texel(s), face * side + texel(t)));
            }
    return panoramaFromFaces(faces, side);
}

}  // namespace

Result<Panorama> loadPanorama(const std::string& file, std::vector<std::string>& notes) {
    IsolationLimits limits;
    limits.image.pixels = std::uint64_t{kLargestColumns} * kLargestColumns / 2;
    const auto read = readImageIsolated(file, limits);
    if (!read) return read.error();
    const FloatImage& image = read->rgba;
    const auto kind = read->texts.find(std::string(kEnvironmentKindText));
    const bool isCube = kind != read->texts.end() && kind->second == "cube";
    const bool isExr = kind != read->texts.end() && kind->second == "latlong";
    if (isCube ? image.height() != 6 * image.width() : image.width() != 2 * image.height())
        return badInput(fmt::format(
            "{}: is {}x{} pixels; {}", file, image.width(), image.height(),
            isCube ? "a cube of six faces is six times as high as wide" : "a panorama is twice as wide as high"));
    if (image.width() > kLargestColumns)
        return badInput(fmt::format("{}: is {} pixels wide; {} are enough for a panorama, scale it down", file,
                                    image.width(), kLargestColumns));
    Panorama panorama = isCube ? fromExrCube(image) : fromLatLong(image);
    const PanoramaRepairs repairs = repair(panorama);
    const auto say = [&](std::uint64_t count, const char* what) {
        if (count > 0) notes.push_back(fmt::format("{}: {} samples {}", file, count, what));
    };
    say(repairs.negative, "are negative; they count as 0");
    say(repairs.notFinite, "are not finite; NaN counts as 0, infinity as 1e30");
    say(repairs.tooLarge, "are larger than 1e30; they are cut to that");
    if (isExr) panorama = halfTurned(panorama);
    return panorama;
}

}  // namespace umbriel
