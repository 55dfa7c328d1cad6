#pragma once

#include "common/scene/animation.h"
#include "common/scene/aspect.h"

namespace umbriel {

// The scenes behind demo:car and so on (procedural.h); counts have been checked there.
Ref<LoadedScene> buildCar(Aspect& aspect);
Ref<LoadedScene> buildCity(Aspect& aspect, int buildings);
Ref<LoadedScene> buildCloth(Aspect& aspect);
// triangles: of the whole scene, where positive; then there are as many palms as that takes, the last one cut short.
Ref<LoadedScene> buildPalms(Aspect& aspect, int palms, int triangles);
Ref<LoadedScene> buildSpheres(Aspect& aspect, int count);
Ref<LoadedScene> buildTorus(Aspect& aspect, int segments);

}  // namespace umbriel
