#pragma once

#include "common/scene/nodes.h"

namespace umbriel {

// How much of each static light arrives at the surfaces that stay where they are, in the texels of one atlas; made by
// `umbriel bake SCENE --light-map N`. A chart is a part of a surface that lies flat in the atlas: the place of a point
// there is an affine function of its place in the geometry's object space.
//
// Where textures end below `size`, an atlas is cut into pages as it is uploaded: nothing here knows of them.
//
// What the map holds is true for one state of the scene (light_map_state.h): `states` and `lightStates` say which.
struct LightMap : Container {
    static constexpr std::string_view kTypeName = "LightMap";
    // Four pages of the side that every driver has.
    static constexpr std::uint32_t kPageSize = 16384;
    static constexpr std::uint32_t kMaxSize = 2 * kPageSize - 1;
    static constexpr std::uint32_t kNoChart = 0xffffffffu;
    Single<std::uint32_t> size{0u};    // texels along each side
    Multi<std::uint8_t> texels;        // size x size of each light, first row at v = 0: 255 all of it arrives
    Multi<std::uint64_t> lightStates;  // of the lights, in the order of their texels
    Multi<Ref<Node>> surfaces;         // the nodes whose geometries are in the atlas, or cast only
    Multi<std::uint64_t> states;       // of each surface: place, shape, whether and how it casts
    Multi<std::uint32_t> triangles;    // of each surface
    Multi<std::uint32_t> places;       // by surface and triangle: its chart, or kNoChart
    Multi<glm::vec4> charts;           // three each: u and v in texels as functions of (x, y, z, 1), and the
                                       // least u, v and largest u, v that may be looked up

    static void declare(TypeBuilder<LightMap>& type) {
        type.field<&LightMap::size>("size");
        type.field<&LightMap::texels>("texels");
        type.field<&LightMap::lightStates>("lightStates");
        type.field<&LightMap::surfaces>("surfaces");
        type.field<&LightMap::states>("states");
        type.field<&LightMap::triangles>("triangles");
        type.field<&LightMap::places>("places");
        type.field<&LightMap::charts>("charts");
    }
};

// An atlas as textures of one size: columns x columns pages of side x side texels. Pages share a row and a column with
// their neighbours, so that the four texels around any place lie in one of them; the last ones may reach beyond it.
struct LightMapPages {
    std::uint32_t columns = 1;
    std::uint32_t side = 0;
    // largest: what the driver allows along each side, 2 or more.
    static constexpr LightMapPages of(std::uint32_t size, std::uint32_t largest) {
        if (size <= largest) return {1, size};
        const std::uint32_t columns = (size - 1 + largest - 2) / (largest - 1);
        return {columns, (size - 1 + columns - 1) / columns + 1};
    }
};

}  // namespace umbriel
