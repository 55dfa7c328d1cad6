#pragma once

#include "common/scene/container.h"
#include "common/scene/type_descriptor.h"

namespace umbriel {

// Hierarchy only. Content is in the core, which several nodes may share (a car has four wheel nodes and one wheel
// geometry); a node without a core is a group. A node has at most one parent; the graph is a tree of nodes.
struct Node : Container {
    static constexpr std::string_view kTypeName = "Node";
    Multi<Ref<Node>> children;
    Single<Ref<Container>> core;
    Single<bool> visible{true};  // false: neither this node nor what is below it is drawn, lights or casts shadows

    static void declare(TypeBuilder<Node>& type) {
        type.field<&Node::children>("children");
        type.field<&Node::core>("core");
        type.field<&Node::visible>("visible");
    }
};

// Places what is below its node: parent point = linear * point + translation. The translation is double, so that a
// scene may lie 1e6 m from the origin; 60 bytes on the wire.
struct Transform : Container {
    static constexpr std::string_view kTypeName = "Transform";
    Single<glm::mat3> linear{glm::mat3(1.0f)};  // rotation, scale, shear
    Single<glm::dvec3> translation;             // metres

    static void declare(TypeBuilder<Transform>& type) {
        type.field<&Transform::linear>("linear");
        type.field<&Transform::translation>("translation");
    }
};

// Draws the child with the given index only; kAll draws every child, kNone none.
struct Switch : Container {
    static constexpr std::string_view kTypeName = "Switch";
    static constexpr std::int32_t kNone = -1;
    static constexpr std::int32_t kAll = -2;
    Single<std::int32_t> choice{kAll};

    static void declare(TypeBuilder<Switch>& type) { type.field<&Switch::choice>("choice"); }
};

// Draws child i while the wall's eye is nearer to the node's origin than ranges[i] (ascending, metres); beyond the last
// range, the last child. Decided by the wall's eye, never the tile's, so that tiles agree.
struct LevelOfDetail : Container {
    static constexpr std::string_view kTypeName = "LevelOfDetail";
    Multi<float> ranges;

    static void declare(TypeBuilder<LevelOfDetail>& type) { type.field<&LevelOfDetail::ranges>("ranges"); }
};

// Where a geometry is shaded: in each pixel with the interpolated normal (Phong); at its vertices, colours interpolated
// (Gouraud); once a triangle, at its first vertex (Flat) or at its centre with the mean of its normals (FlatMean).
// Without normals all are flat, by the face normal.
enum class ShadingFrequency : std::uint32_t { Phong, Gouraud, Flat, FlatMean };
template <> inline constexpr std::uint32_t kEnumCount<ShadingFrequency> = 4;

// Triangles. Vertex attributes are empty or as long as positions; indices are a list of triangles, three each. Normals
// empty: the face normal is used (flat). Tangents: xyz and the bitangent's sign in w (glTF). Bounds are derived where
// they are needed, never stored.
struct Geometry : Container {
    static constexpr std::string_view kTypeName = "Geometry";
    Multi<glm::vec3> positions;  // object space, metres
    Multi<glm::vec3> normals;    // unit length
    Multi<glm::vec4> tangents;
    Multi<glm::vec4> colours;     // linear RGBA, multiplies the base colour
    Multi<glm::vec2> texCoords0;  // (0,0) is the first texel of the first row of the image
    Multi<glm::vec2> texCoords1;
    Multi<std::uint32_t> indices;
    Single<Ref<Container>> material;  // a Material; none: a default grey one
    // What a DeformedGeometry deforms; without one, nothing. Four joints a vertex (indices in its skin) with their
    // weights; displacements target after target, each of all vertices.
    Multi<std::uint16_t> joints;
    Multi<glm::vec4> jointWeights;
    Multi<glm::vec3> morphPositions;
    Multi<glm::vec3> morphNormals;
    Multi<glm::vec3> morphTangents;
    Single<ShadingFrequency> shading{ShadingFrequency::Phong};

    static void declare(TypeBuilder<Geometry>& type) {
        type.field<&Geometry::positions>("positions");
        type.field<&Geometry::normals>("normals");
        type.field<&Geometry::tangents>("tangents");
        type.field<&Geometry::colours>("colours");
        type.field<&Geometry::texCoords0>("texCoords0");
        type.field<&Geometry::texCoords1>("texCoords1");
        type.field<&Geometry::indices>("indices");
        type.field<&Geometry::material>("material");
        type.field<&Geometry::joints>("joints");
        type.field<&Geometry::jointWeights>("jointWeights");
        type.field<&Geometry::morphPositions>("morphPositions");
        type.field<&Geometry::morphNormals>("morphNormals");
        type.field<&Geometry::morphTangents>("morphTangents");
        type.field<&Geometry::shading>("shading");
    }
};

// Replaces the material of everything below its node; the innermost group wins.
struct MaterialGroup : Container {
    static constexpr std::string_view kTypeName = "MaterialGroup";
    Single<Ref<Container>> material;

    static void declare(TypeBuilder<MaterialGroup>& type) { type.field<&MaterialGroup::material>("material"); }
};

}  // namespace umbriel
