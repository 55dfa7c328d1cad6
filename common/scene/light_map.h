#pragma once

#include "common/scene/nodes.h"

namespace umbriel {

// How much of each static light arrives at the surfaces that stay where they are, in the texels of one atlas; made by
// `umbriel bake SCENE --light-map N`. A chart is a part of a surface that lies flat in the atlas: the place of a point
// there is an affine function of its place in the geometry's object space.
//
// What the map holds is true for one state of the scene (light_map_state.h): `states` and `lightStates` say which.
struct LightMap : Container {
    static constexpr std::string_view kTypeName = "LightMap";
    static constexpr std::uint32_t kMaxSize = 16384;
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

}  // namespace umbriel
