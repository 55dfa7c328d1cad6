#pragma once

#include "common/scene/nodes.h"

namespace umbriel {

// A camera stands at its beacon node's origin and looks along the beacon's -z, +y up. The client resolves cameras into
// views (common/wall/view.h); servers never look at them.

struct PerspectiveCamera : Container {
    static constexpr std::string_view kTypeName = "PerspectiveCamera";
    Single<Ref<Node>> beacon;
    Single<double> fovY{0.785398163397448};  // radians, in (0, pi)
    Single<double> aspect{0.0};              // width / height; 0: the viewport's
    Single<double> nearDistance{0.0};        // metres; 0: chosen from the scene's size
    Single<double> farDistance{0.0};         // metres; 0: infinite

    static void declare(TypeBuilder<PerspectiveCamera>& type) {
        type.field<&PerspectiveCamera::beacon>("beacon");
        type.field<&PerspectiveCamera::fovY>("fovY");
        type.field<&PerspectiveCamera::aspect>("aspect");
        type.field<&PerspectiveCamera::nearDistance>("nearDistance");
        type.field<&PerspectiveCamera::farDistance>("farDistance");
    }
};

// Half extents in metres, as in glTF.
struct OrthographicCamera : Container {
    static constexpr std::string_view kTypeName = "OrthographicCamera";
    Single<Ref<Node>> beacon;
    Single<double> halfWidth{1.0};
    Single<double> halfHeight{1.0};
    Single<double> nearDistance{0.0};
    Single<double> farDistance{100.0};

    static void declare(TypeBuilder<OrthographicCamera>& type) {
        type.field<&OrthographicCamera::beacon>("beacon");
        type.field<&OrthographicCamera::halfWidth>("halfWidth");
        type.field<&OrthographicCamera::halfHeight>("halfHeight");
        type.field<&OrthographicCamera::nearDistance>("nearDistance");
        type.field<&OrthographicCamera::farDistance>("farDistance");
    }
};

// Two given matrices: viewFromBeacon, and a projection to clip space with z in [-w, w] (OpenGL).
struct MatrixCamera : Container {
    static constexpr std::string_view kTypeName = "MatrixCamera";
    Single<Ref<Node>> beacon;
    Single<glm::dmat4> viewFromBeacon{glm::dmat4(1.0)};
    Single<glm::dmat4> clipFromView{glm::dmat4(1.0)};

    static void declare(TypeBuilder<MatrixCamera>& type) {
        type.field<&MatrixCamera::beacon>("beacon");
        type.field<&MatrixCamera::viewFromBeacon>("viewFromBeacon");
        type.field<&MatrixCamera::clipFromView>("clipFromView");
    }
};

enum class Eye : std::uint32_t { Mono, Left, Right };
template <> inline constexpr std::uint32_t kEnumCount<Eye> = 3;

// Turns the camera it decorates into one eye's: the eye moves sideways by half the separation, the projection is sheared
// so that both eyes' frusta meet in the plane at zeroParallax (off-axis, never toed in).
struct StereoCameraDecorator : Container {
    static constexpr std::string_view kTypeName = "StereoCameraDecorator";
    Single<Ref<Container>> camera;
    Single<Eye> eye{Eye::Mono};
    Single<double> separation{0.065};    // metres between the eyes
    Single<double> zeroParallax{1.0};    // metres from the eye to the screen plane

    static void declare(TypeBuilder<StereoCameraDecorator>& type) {
        type.field<&StereoCameraDecorator::camera>("camera");
        type.field<&StereoCameraDecorator::eye>("eye");
        type.field<&StereoCameraDecorator::separation>("separation");
        type.field<&StereoCameraDecorator::zeroParallax>("zeroParallax");
    }
};

// Shows a part of the picture of the camera it decorates: left, bottom, right, top as fractions, (0,0) lower left.
struct TileCameraDecorator : Container {
    static constexpr std::string_view kTypeName = "TileCameraDecorator";
    Single<Ref<Container>> camera;
    Single<double> left{0.0};
    Single<double> bottom{0.0};
    Single<double> right{1.0};
    Single<double> top{1.0};

    static void declare(TypeBuilder<TileCameraDecorator>& type) {
        type.field<&TileCameraDecorator::camera>("camera");
        type.field<&TileCameraDecorator::left>("left");
        type.field<&TileCameraDecorator::bottom>("bottom");
        type.field<&TileCameraDecorator::right>("right");
        type.field<&TileCameraDecorator::top>("top");
    }
};

}  // namespace umbriel
