#pragma once

#include "common/scene/nodes.h"

namespace umbriel {

// The joints that move a geometry's vertices (glTF 2.0, section 3.7.3): nodes, and for each the way from the geometry's
// object space to the joint's frame at rest. A vertex stands where the weighted sum of worldFromJoint * inverseBind of
// its joints takes it; where the geometry's own node stands does not matter.
struct Skin : Container {
    static constexpr std::string_view kTypeName = "Skin";
    Multi<Ref<Node>> joints;
    Multi<glm::mat4> inverseBinds;  // as many as joints; the last row is 0 0 0 1

    static void declare(TypeBuilder<Skin>& type) {
        type.field<&Skin::joints>("joints");
        type.field<&Skin::inverseBinds>("inverseBinds");
    }
};

// How far a geometry is on the way to each of its morph targets; several geometries may share it. Those that are
// missing are 0.
struct MorphWeights : Container {
    static constexpr std::string_view kTypeName = "MorphWeights";
    Multi<float> weights;  // by target; any number

    static void declare(TypeBuilder<MorphWeights>& type) { type.field<&MorphWeights::weights>("weights"); }
};

// A core that draws a geometry deformed: morphed first, then skinned. The geometry may be shared by others, deformed or
// not.
struct DeformedGeometry : Container {
    static constexpr std::string_view kTypeName = "DeformedGeometry";
    Single<Ref<Geometry>> geometry;
    Single<Ref<Skin>> skin;           // none: placed by its node, as a Geometry
    Single<Ref<MorphWeights>> morph;  // none: not morphed

    static void declare(TypeBuilder<DeformedGeometry>& type) {
        type.field<&DeformedGeometry::geometry>("geometry");
        type.field<&DeformedGeometry::skin>("skin");
        type.field<&DeformedGeometry::morph>("morph");
    }
};

}  // namespace umbriel
