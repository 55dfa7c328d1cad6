#pragma once

#include "common/scene/deformation.h"

namespace umbriel {

enum class AnimationPath : std::uint32_t { Translation, Rotation, Scale, Weights };
enum class AnimationInterpolation : std::uint32_t { Step, Linear, CubicSpline };
template <>
inline constexpr std::uint32_t kEnumCount<AnimationPath> = 4;
template <>
inline constexpr std::uint32_t kEnumCount<AnimationInterpolation> = 3;

// The translation, rotation and scale a node came with, before it became a matrix; the client's player replaces the
// animated ones and writes the product into the Transform. Client only.
struct AnimatedPose : Container {
    static constexpr std::string_view kTypeName = "AnimatedPose";
    static constexpr bool kShipped = false;
    Single<Ref<Transform>> target;
    Single<glm::dvec3> translation;
    Single<glm::vec4> rotation{glm::vec4(0.0f, 0.0f, 0.0f, 1.0f)};  // quaternion x y z w
    Single<glm::vec3> scale{glm::vec3(1.0f)};

    static void declare(TypeBuilder<AnimatedPose>& type) {
        type.field<&AnimatedPose::target>("target");
        type.field<&AnimatedPose::translation>("translation");
        type.field<&AnimatedPose::rotation>("rotation");
        type.field<&AnimatedPose::scale>("scale");
    }
};

// One glTF animation channel: keys at ascending times (seconds); values hold 3 (translation, scale), 4 (rotation, x y z
// w) or as many floats a key as there are morph weights, three times that for cubic splines (in-tangent, value,
// out-tangent). Client only.
struct AnimationChannel : Container {
    static constexpr std::string_view kTypeName = "AnimationChannel";
    static constexpr bool kShipped = false;
    Single<Ref<AnimatedPose>> pose;   // of Translation, Rotation, Scale
    Single<Ref<MorphWeights>> morph;  // of Weights
    Single<AnimationPath> path{AnimationPath::Translation};
    Single<AnimationInterpolation> interpolation{AnimationInterpolation::Linear};
    Multi<float> times;
    Multi<float> values;

    static void declare(TypeBuilder<AnimationChannel>& type) {
        type.field<&AnimationChannel::pose>("pose");
        type.field<&AnimationChannel::morph>("morph");
        type.field<&AnimationChannel::path>("path");
        type.field<&AnimationChannel::interpolation>("interpolation");
        type.field<&AnimationChannel::times>("times");
        type.field<&AnimationChannel::values>("values");
    }
};

// Channels that play together, looping after duration. Client only.
struct Animation : Container {
    static constexpr std::string_view kTypeName = "Animation";
    static constexpr bool kShipped = false;
    Multi<Ref<AnimationChannel>> channels;
    Single<double> duration{0.0};  // seconds

    static void declare(TypeBuilder<Animation>& type) {
        type.field<&Animation::channels>("channels");
        type.field<&Animation::duration>("duration");
    }
};

// What a file brought: where its parts are. Client only; one per loaded file.
struct LoadedScene : Container {
    static constexpr std::string_view kTypeName = "LoadedScene";
    static constexpr bool kShipped = false;
    Single<Ref<Node>> root;
    Multi<Ref<Container>> cameras;  // in file order; names are the files' camera names
    Multi<Ref<Animation>> animations;

    static void declare(TypeBuilder<LoadedScene>& type) {
        type.field<&LoadedScene::root>("root");
        type.field<&LoadedScene::cameras>("cameras");
        type.field<&LoadedScene::animations>("animations");
    }
};

}  // namespace umbriel
