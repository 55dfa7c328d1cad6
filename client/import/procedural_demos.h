#pragma once

#include "common/scene/animation.h"
#include "common/scene/aspect.h"

namespace umbriel {

// The scenes behind demo:car and so on (procedural.h); counts have been checked there.
Ref<LoadedScene> buildCar(Aspect& aspect);
Ref<LoadedScene> buildCity(Aspect& aspect, int buildings);
Ref<LoadedScene> buildCloth(Aspect& aspect);
Ref<LoadedScene> buildPalms(Aspect& aspect, int palms);
Ref<LoadedScene> buildSpheres(Aspect& aspect, int count);
Ref<LoadedScene> buildTorus(Aspect& aspect, int segments);

}  // namespace umbriel
