#pragma once

#include <vector>

#include "common/scene/animation.h"
#include "common/scene/aspect.h"

namespace umbriel {

// A channel's value at a time (seconds), by the rules of glTF 2.0 (appendix C): step, linear (rotations by the shorter
// great arc), cubic Hermite splines; before the first and after the last key their values. Rotations are unit
// quaternions x y z w; of translations and scales w is 0. False when the channel's times and values do not fit
// together.
bool evaluate(const AnimationChannel& channel, double time, glm::dvec4& value);
// The same for a channel of morph weights, each for itself.
bool evaluateWeights(const AnimationChannel& channel, double time, std::vector<float>& weights);

// Plays a loaded scene's animations together, each looping after its duration. What a channel does not animate keeps
// its pose; only transforms whose value really changes are edited.
class AnimationPlayer {
 public:
    AnimationPlayer(const Aspect& aspect, Ref<LoadedScene> scene);

    bool empty() const { return _animations.empty(); }
    // Moves everything to where it is at this time (seconds, any sign). The aspect is the one given at construction or
    // another with the same containers.
    void advanceTo(double time, Aspect& aspect) const;

 private:
    std::vector<Ref<Animation>> _animations;
};

}  // namespace umbriel
