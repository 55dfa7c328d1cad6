#pragma once

#include <vector>

#include "common/base/result.h"
#include "tests/numerics/cases/formula_case.h"

namespace umbriel::gl {

// Draws a case as GLSL, one pixel of an RGBA32F target per point, in a current context. At most 2^20 points. Errors:
// the shader does not compile, out of memory.
Result<std::vector<glm::vec3>> drawFormula(const numerics::FormulaCase& formula,
                                           const std::vector<numerics::FormulaInput>& points);

}  // namespace umbriel::gl
