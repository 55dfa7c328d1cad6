#pragma once

#include <string>
#include <vector>

#include "common/scene/aspect.h"

namespace umbriel {

// Holds the numbers of all materials, lights and fogs of a scene within the domain of their formulas
// (docs/illumination.md): colours and strengths from 0 to 1e30, shares and roughness from 0 to 1, exponents from 0 to
// 1e6 and so on. What lies outside becomes the nearest value inside, what is no number the field's default. Each repair
// is one sentence that names the container, the field, what it held and what was taken. Costs a look at every
// container; call it where scenes are made.
std::vector<std::string> repairShadingValues(Aspect& scene);

}  // namespace umbriel
