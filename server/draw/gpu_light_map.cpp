#include "server/draw/gpu_light_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/assert.h"
#include "server/draw/gpu_materials.h"

namespace umbriel {
namespace {

constexpr GLuint kChartsBinding = 3;
// Of the rows that are read from the scene and uploaded at once.
constexpr std::size_t kUploadedBytes = std::size_t{4} << 20;

// One page of one light.
void uploadPage(const LightMap& map, const LightMapPages& pages, GLuint texture, std::uint32_t layer) {
    const std::size_t size = map.size, stride = pages.side - 1;
    const std::uint32_t page = layer % (pages.columns * pages.columns);
    const std::size_t light = layer / (pages.columns * pages.columns);
    const std::size_t left = page % pages.columns * stride, bottom = page / pages.columns * stride;
    const std::size_t width = std::min<std::size_t>(pages.side, size - left);
    const std::size_t height = std::min<std::size_t>(pages.side, size - bottom);
    const std::size_t rows = std::clamp<std::size_t>(kUploadedBytes / width, 1, height);
    std::vector<std::byte> texels(rows * width);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    for (std::size_t first = 0; first < height; first += rows) {
        const std::size_t count = std::min(rows, height - first);
        for (std::size_t row = 0; row < count; ++row)
            map.texels.storage().read((light * size + bottom + first + row) * size + left,
                                      std::span(texels).subspan(row * width, width));
        glTextureSubImage3D(texture, 0, 0, static_cast<GLint>(first), static_cast<GLint>(layer),
                            static_cast<GLsizei>(width), static_cast<GLsizei>(count), 1, GL_RED, GL_UNSIGNED_BYTE,
                            texels.data());
    }
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
}

}  // namespace

bool isUsable(const LightMap& map) {
    const std::uint64_t size = map.size;
    if (size == 0 || size > LightMap::kMaxSize || map.lightStates.empty()) return false;
    if (map.texels.size() != size * size * map.lightStates.size()) return false;
    if (map.triangles.size() != map.surfaces.size() || map.states.size() != map.surfaces.size()) return false;
    if (map.charts.size() % 3 != 0) return false;
    std::uint64_t triangles = 0;
    for (const std::uint32_t count : map.triangles.toVector()) triangles += count;
    if (map.places.size() != triangles) return false;
    const std::size_t charts = map.charts.size() / 3;
    for (const std::uint32_t chart : map.places.toVector())
        if (chart != LightMap::kNoChart && chart >= charts) return false;
    for (const glm::vec4& row : map.charts.toVector())
        for (int i = 0; i < 4; ++i)
            if (!std::isfinite(row[i])) return false;
    return true;
}

Result<GpuLightMap> GpuLightMap::upload(const LightMap& map, std::uint32_t largestPage) {
    GpuLightMap result;
    GLint maxSize = 0, maxLayers = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &maxSize);
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &maxLayers);
    const std::uint32_t size = map.size;
    result._pages = LightMapPages::of(size, std::min(largestPage, static_cast<std::uint32_t>(maxSize)));
    const LightMapPages pages = result._pages;
    const auto lights = static_cast<std::uint32_t>(map.lightStates.size());
    result._layers = lights * pages.columns * pages.columns;
    const auto tooLarge = [&](const std::string& why) {
        return failure(
            fmt::format("a light map of {} x {} texels for {} lights is more than this driver allows ({}); "
                        "bake a smaller one",
                        size, size, lights, why));
    };
    if (result._layers > static_cast<std::uint32_t>(maxLayers))
        return tooLarge(fmt::format("{} layers of {}", result._layers, maxLayers));
    GLuint id = 0;
    glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &id);
    result._texels = gl::Name<gl::deleteTexture>(id);
    const auto side = static_cast<GLsizei>(pages.side);
    glTextureStorage3D(id, 1, GL_R8, side, side, static_cast<GLsizei>(result._layers));
    if (auto checked = gl::checkError("a light map's texture"); !checked) return tooLarge(checked.error().message);
    for (std::uint32_t layer = 0; layer < result._layers; ++layer) uploadPage(map, pages, id, layer);
    glCreateSamplers(1, &id);
    result._sampler = gl::Name<gl::deleteSampler>(id);
    glSamplerParameteri(id, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glSamplerParameteri(id, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glSamplerParameteri(id, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glSamplerParameteri(id, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    std::vector<glm::vec4> charts = map.charts.toVector();
    if (charts.empty()) charts.emplace_back(0.0f);
    auto buffer = gl::Buffer::create(std::as_bytes(std::span(charts)));
    if (!buffer) return buffer.error();
    result._charts = std::move(*buffer);
    std::size_t first = 0;
    for (std::size_t i = 0; i < map.surfaces.size(); ++i) {
        const std::uint32_t triangles = map.triangles[i];
        result._surfaces[map.surfaces[i]] = {first, triangles, false, {}};
        first += triangles;
    }
    if (auto checked = gl::checkError("a light map"); !checked) return checked.error();
    return result;
}

bool GpuLightMap::holds(ContainerId node, const GpuGeometry& geometry) const {
    const auto found = _surfaces.find(node);
    return found != _surfaces.end() && found->second.triangles == geometry.triangles();
}

Result<const gl::Buffer*> GpuLightMap::placesOf(const LightMap& map, ContainerId node, const GpuGeometry& geometry) {
    UMBRIEL_ASSERT(holds(node, geometry), "a surface that is not in the light map");
    Surface& surface = _surfaces.at(node);
    if (surface.places && surface.isReordered == geometry.isReordered()) return &surface.places;
    std::vector<std::uint32_t> drawn(surface.triangles);
    map.places.storage().read(surface.first, std::as_writable_bytes(std::span(drawn)));
    if (geometry.isReordered()) {
        const std::vector<std::uint32_t> written = drawn;
        const std::span<const std::uint32_t> order = geometry.sceneTriangles();
        for (std::size_t i = 0; i < drawn.size(); ++i) drawn[i] = written[order[i]];
    }
    auto buffer = gl::Buffer::create(std::as_bytes(std::span(drawn)));
    if (!buffer) return buffer.error();
    _placesBytes += buffer->size() - surface.places.size();
    surface.places = std::move(*buffer);
    surface.isReordered = geometry.isReordered();
    return &surface.places;
}

void GpuLightMap::bind() const {
    const auto unit = static_cast<GLuint>(TextureUnit::LightMap);
    glBindTextureUnit(unit, _texels.id());
    glBindSampler(unit, _sampler.id());
    _charts.bindBase(GL_SHADER_STORAGE_BUFFER, kChartsBinding);
}

std::uint64_t GpuLightMap::bytes() const {
    return std::uint64_t{_pages.side} * _pages.side * _layers + _charts.size() + _placesBytes;
}

Result<GpuLightMap*> GpuLightMaps::find(const Aspect& scene, ContainerId id) {
    if (const auto found = _maps.find(id); found != _maps.end()) return &found->second;
    const LightMap* map = scene.findAs<LightMap>(id);
    if (!map || !isUsable(*map)) return nullptr;
    auto uploaded = GpuLightMap::upload(*map, _largestPage);
    if (!uploaded) return uploaded.error();
    return &_maps.emplace(id, std::move(*uploaded)).first->second;
}

}  // namespace umbriel
