#pragma once

#include <map>
#include <memory>
#include <unordered_map>

#include "common/scene/aspect.h"
#include "common/scene/light_map.h"
#include "server/draw/gpu_geometry.h"
#include "server/gl/buffer.h"
#include "server/gl/object.h"

namespace umbriel {

// Whether all that a light map says fits together: counts, and every chart within the atlas' numbers.
bool isUsable(const LightMap& map);

// A light map on the GPU, as snippet/shadow_light_map.glsl reads it.
class GpuLightMap {
 public:
    // map: usable. largestPage: beyond so many texels a side, or the driver's limit, it is cut into pages. Error: the
    // driver is out of memory, or its textures end below what the pages take.
    static Result<GpuLightMap> upload(const LightMap& map, std::uint32_t largestPage);

    // False when the node is not in the map, or its geometry has not as many triangles.
    bool holds(ContainerId node, const GpuGeometry& geometry) const;
    // The charts of a surface's triangles in the order they are drawn in now; the map holds it.
    Result<const gl::Buffer*> placesOf(const LightMap& map, ContainerId node, const GpuGeometry& geometry);
    // The atlas and the charts; a surface's places are bound with it.
    void bind() const;
    bool isPaged() const { return _pages.columns > 1; }
    std::uint32_t pageSize() const { return _pages.side; }
    std::uint32_t layers() const { return _layers; }  // by light and page
    // Of atlas, charts and places.
    std::uint64_t bytes() const;

    // Where the places of a surface are bound (shader storage).
    static constexpr GLuint kPlacesBinding = 7;

 private:
    struct Surface {
        std::size_t first = 0;  // in LightMap::places
        std::uint32_t triangles = 0;
        bool isReordered = false;  // as the geometry was when the places were made
        gl::Buffer places;
    };
    LightMapPages _pages;
    std::uint32_t _layers = 0;
    gl::Name<gl::deleteTexture> _texels;
    gl::Name<gl::deleteSampler> _sampler;
    gl::Buffer _charts;
    std::unordered_map<ContainerId, Surface> _surfaces;  // looked up only
    std::uint64_t _placesBytes = 0;
};

// The light maps that views use, uploaded when one first asks.
class GpuLightMaps {
 public:
    explicit GpuLightMaps(std::uint32_t largestPage) : _largestPage(largestPage) {}
    // Null when there is no such map, or it is not usable.
    Result<GpuLightMap*> find(const Aspect& scene, ContainerId map);
    void forget(ContainerId map) { _maps.erase(map); }

 private:
    std::uint32_t _largestPage;
    std::map<ContainerId, GpuLightMap> _maps;
};

}  // namespace umbriel
