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

bool evaluate(const AnimationChannel& channel, double time, glm::dvec4& value) {
    const bool isRotation = channel.path.get() == AnimationPath::Rotation;
    const bool isSpline = channel.interpolation.get() == AnimationInterpolation::CubicSpline;
    const std::size_t components = isRotation ? 4 : 3;
    const std::size_t stride = components * (isSpline ? 3 : 1);
    const std::size_t keys = channel.times.size();
    if (keys == 0 || channel.values.size() != keys * stride) return false;
    // part: 0 in-tangent, 1 value, 2 out-tangent of a spline's key.
    const auto at = [&](std::size_t key, std::size_t part) {
        glm::dvec4 element(0.0);
        for (std::size_t i = 0; i < components; ++i)
            element[static_cast<int>(i)] = channel.values[key * stride + (isSpline ? part * components : 0) + i];
        return element;
    };
    const auto keyValue = [&](std::size_t key) { return isRotation ? normalisedRotation(at(key, 1)) : at(key, 1); };
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
    if (next == 0 || next == keys || channel.interpolation.get() == AnimationInterpolation::Step) {
        value = keyValue(next == 0 ? 0 : next - 1);
        return true;
    }
    const std::size_t previous = next - 1;
    const double from = channel.times[previous];
    const double span = static_cast<double>(channel.times[next]) - from;
    const double t = span > 0.0 ? (time - from) / span : 0.0;
    if (isSpline) {
        const double t2 = t * t;
        const double t3 = t2 * t;
        value = (2.0 * t3 - 3.0 * t2 + 1.0) * at(previous, 1) + span * (t3 - 2.0 * t2 + t) * at(previous, 2) +
                (-2.0 * t3 + 3.0 * t2) * at(next, 1) + span * (t3 - t2) * at(next, 0);
        if (isRotation) value = normalisedRotation(value);
    } else {
        value = isRotation ? slerp(keyValue(previous), keyValue(next), t) : glm::mix(at(previous, 1), at(next, 1), t);
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
