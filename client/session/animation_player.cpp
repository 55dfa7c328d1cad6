#include "client/session/animation_player.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/affine.h"

namespace umbriel {

namespace {

using Quaternion = glm::dvec4;  // x y z w

Quaternion normalisedRotation(const Quaternion& q) {
    const double length = glm::length(q);
    return length > 0.0 && std::isfinite(length) ? q / length : Quaternion(0.0, 0.0, 0.0, 1.0);
}

// Shoemake 1985, by the shorter arc. Below 1e-6 of arc the sine has no digits left and the chord is the arc.
Quaternion slerp(const Quaternion& from, Quaternion to, double t) {
    double cosine = glm::dot(from, to);
    if (cosine < 0.0) {
        to = -to;
        cosine = -cosine;
    }
    // From the chord: acos loses half the digits near 1.
    const double angle = 2.0 * std::asin(std::min(1.0, 0.5 * glm::length(to - from)));
    if (angle < 1e-6) return normalisedRotation(glm::mix(from, to, t));
    return normalisedRotation((std::sin((1.0 - t) * angle) * from + std::sin(t * angle) * to) / std::sin(angle));
}

struct Pose {
    glm::dvec3 translation;
    Quaternion rotation;
    glm::dvec3 scale;
};

glm::dmat3 rotationMatrix(const Quaternion& q) {
    return glm::dmat3(1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.z * q.w), 2 * (q.x * q.z - q.y * q.w),
                      2 * (q.x * q.y - q.z * q.w), 1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z + q.x * q.w),
                      2 * (q.x * q.z + q.y * q.w), 2 * (q.y * q.z - q.x * q.w), 1 - 2 * (q.x * q.x + q.y * q.y));
}

// In [0, duration).
double looped(double time, double duration) {
    if (!(duration > 0.0) || !std::isfinite(duration) || !std::isfinite(time)) return 0.0;
    const double rest = std::fmod(time, duration);
    return rest < 0.0 ? rest + duration : rest;
}

}  // namespace

namespace {

// Between which keys a time lies, and the weights of what they hold.
struct KeyPlace {
    std::size_t previous = 0;
    std::size_t next = 0;  // previous, when there is nothing to interpolate
    double t = 0.0;        // from previous to next, in [0, 1)
    double span = 0.0;     // seconds between them
};

// The channel has keys.
KeyPlace placeOf(const AnimationChannel& channel, double time) {
    const std::size_t keys = channel.times.size();
    // The first key after the time.
    std::size_t next = 0;
    for (std::size_t count = keys; count > 0;) {
        const std::size_t half = count / 2;
        if (static_cast<double>(channel.times[next + half]) <= time) {
            next += half + 1;
            count -= half + 1;
        } else {
            count = half;
        }
    }
    const std::size_t previous = next == 0 ? 0 : next - 1;
    if (next == 0 || next == keys || channel.interpolation.get() == AnimationInterpolation::Step)
        return {previous, previous, 0.0, 0.0};
    const double from = channel.times[previous];
    const double span = static_cast<double>(channel.times[next]) - from;
    return {previous, next, span > 0.0 ? (time - from) / span : 0.0, span};
}

// glTF 2.0, appendix C.5. Tangents are per second.
template <class Value>
Value hermite(const Value& from, const Value& outTangent, const Value& to, const Value& inTangent, double t,
              double span) {
    const double t2 = t * t;
    const double t3 = t2 * t;
    return (2.0 * t3 - 3.0 * t2 + 1.0) * from + span * (t3 - 2.0 * t2 + t) * outTangent + (-2.0 * t3 + 3.0 * t2) * to +
           span * (t3 - t2) * inTangent;
}

bool isSpline(const AnimationChannel& channel) {
    return channel.interpolation.get() == AnimationInterpolation::CubicSpline;
}

// Components of a key, without tangents.
std::size_t componentsOf(const AnimationChannel& channel) {
    if (channel.times.empty()) return 0;
    return channel.values.size() / channel.times.size() / (isSpline(channel) ? 3 : 1);
}

}  // namespace

bool evaluate(const AnimationChannel& channel, double time, glm::dvec4& value) {
    const bool isRotation = channel.path.get() == AnimationPath::Rotation;
    const bool spline = isSpline(channel);
    const std::size_t components = isRotation ? 4 : 3;
    const std::size_t stride = components * (spline ? 3 : 1);
    if (channel.times.empty() || channel.values.size() != channel.times.size() * stride) return false;
    // part: 0 in-tangent, 1 value, 2 out-tangent of a spline's key.
    const auto at = [&](std::size_t key, std::size_t part) {
        glm::dvec4 element(0.0);
        for (std::size_t i = 0; i < components; ++i)
            element[static_cast<int>(i)] = channel.values[key * stride + (spline ? part * components : 0) + i];
        return element;
    };
    const auto keyValue = [&](std::size_t key) { return isRotation ? normalisedRotation(at(key, 1)) : at(key, 1); };
    const auto [previous, next, t, span] = placeOf(channel, time);
    if (previous == next) {
        value = keyValue(previous);
    } else if (spline) {
        value = hermite(at(previous, 1), at(previous, 2), at(next, 1), at(next, 0), t, span);
        if (isRotation) value = normalisedRotation(value);
    } else {
        value = isRotation ? slerp(keyValue(previous), keyValue(next), t) : glm::mix(at(previous, 1), at(next, 1), t);
    }
    return true;
}

bool evaluateWeights(const AnimationChannel& channel, double time, std::vector<float>& weights) {
    const std::size_t components = componentsOf(channel);
    const bool spline = isSpline(channel);
    if (components == 0 || channel.values.size() != channel.times.size() * components * (spline ? 3 : 1)) return false;
    const KeyPlace place = placeOf(channel, time);
    weights.resize(components);
    for (std::size_t i = 0; i < components; ++i) {
        const auto at = [&](std::size_t key, std::size_t part) -> double {
            return channel.values[spline ? (key * 3 + part) * components + i : key * components + i];
        };
        double value = at(place.previous, 1);
        if (place.previous != place.next)
            value = spline ? hermite(value, at(place.previous, 2), at(place.next, 1), at(place.next, 0), place.t,
                                     place.span)
                           : glm::mix(value, at(place.next, 1), place.t);
        weights[i] = static_cast<float>(value);
    }
    return true;
}

AnimationPlayer::AnimationPlayer(const Aspect& aspect, Ref<LoadedScene> scene) {
    if (const LoadedScene* loaded = aspect.find(scene)) _animations = loaded->animations.toVector();
}

void AnimationPlayer::advanceTo(double time, Aspect& aspect) const {
    std::map<ContainerId, Pose> poses;  // ordered, so that edits happen in the same order every time
    for (const Ref<Animation> animationRef : _animations) {
        const Animation* animation = aspect.find(animationRef);
        if (!animation) continue;
        const double within = looped(time, animation->duration);
        for (const Ref<AnimationChannel> channelRef : animation->channels.toVector()) {
            const AnimationChannel* channel = aspect.find(channelRef);
            if (channel && channel->path.get() == AnimationPath::Weights) {
                std::vector<float> weights;
                if (aspect.find(channel->morph.get()) && evaluateWeights(*channel, within, weights))
                    aspect.edit(channel->morph.get()).assign<&MorphWeights::weights>(weights);
                continue;
            }
            const AnimatedPose* rest = channel ? aspect.find(channel->pose.get()) : nullptr;
            glm::dvec4 value;
            if (!rest || !evaluate(*channel, within, value)) continue;
            const auto [entry, isNew] = poses.try_emplace(rest->id());
            Pose& pose = entry->second;
            if (isNew)
                pose = {rest->translation, normalisedRotation(glm::dvec4(rest->rotation.get())),
                        glm::dvec3(rest->scale.get())};
            if (channel->path.get() == AnimationPath::Translation) pose.translation = glm::dvec3(value);
            if (channel->path.get() == AnimationPath::Rotation) pose.rotation = value;
            if (channel->path.get() == AnimationPath::Scale) pose.scale = glm::dvec3(value);
        }
    }
    for (const auto& [id, pose] : poses) {
        const Ref<Transform> target = aspect.findAs<AnimatedPose>(id)->target;
        if (!aspect.find(target)) continue;
        glm::dmat3 linear = rotationMatrix(pose.rotation);
        for (int axis = 0; axis < 3; ++axis) linear[axis] *= pose.scale[axis];
        if (!isFinite(linear) || !isFinite(pose.translation)) continue;
        aspect.edit(target).set<&Transform::linear>(glm::mat3(linear)).set<&Transform::translation>(pose.translation);
    }
}

}  // namespace umbriel
