#pragma once

#include "common/scene/aspect.h"
#include "common/scene/materials.h"
#include "common/scene/nodes.h"

namespace umbriel {

// Gives every material of a scene the model, and the parameters that this model reads, derived from those of the model
// it had: a roughness becomes the exponent of the highlight that is as wide (Blinn's: 2 / alpha^2 - 2; Phong's mirrored
// light needs a quarter), a reflectance a specular colour whose highlight is about as bright, 1 at most; and back.
// Unlit materials stay as they are. The same model again changes nothing.
void overrideModel(Aspect& scene, ReflectionModel model);

// Gives every geometry of a scene the frequency.
void overrideShading(Aspect& scene, ShadingFrequency frequency);

}  // namespace umbriel
