#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/math/glm.h"

// Every formula as something that can be evaluated at many points in three ways from one text: as float C++, as double
// C++, and as GLSL (formula_bodies.inc).
namespace umbriel::numerics {

// What a case is called with: four vectors and four numbers, .w of each.
using FormulaInput = std::array<glm::vec4, 4>;

// Which points a case is evaluated at (formula_points.cpp).
enum class FormulaDomain { Reflection, Distance, Spot, Fog, Direction, Unit, Frame };

struct FormulaCase {
    const char* name;
    const char* file;  // below shaders/
    FormulaDomain domain;
    // The size of ordinary results: errors count relative to the result, but not to less than a tenth of this. 0 where
    // small results matter as much as large ones.
    double range;
    const char* glslBody;
    glm::vec3 (*single)(const FormulaInput&);
    glm::dvec3 (*exact)(const std::array<glm::dvec4, 4>&);
};

const std::vector<FormulaCase>& formulaCases();

// The extremes of the domain first, then points of a fixed sequence up to `count`, all finite.
std::vector<FormulaInput> formulaPoints(FormulaDomain domain, size_t count);

glm::dvec3 exactResult(const FormulaCase& formula, const FormulaInput& input);

// The largest error of `result` against `expected`, in that same measure (not in units of 2^-24).
double formulaError(const FormulaCase& formula, glm::dvec3 result, glm::dvec3 expected);

// By how much the result moves, in that measure and in units of 2^-24, when every number of the input moves by one
// rounding of float: at least 1, huge where the formula jumps. No way of computing in float can do better than this
// many roundings.
double conditionOf(const FormulaCase& formula, const FormulaInput& input);

// Up to this condition a point counts as well conditioned.
constexpr double kWellConditioned = 20.0;

// Well-conditioned points stay below this error: 1e-5 of the result, or 1e-6 of the range.
constexpr double kFormulaTolerance = 1e-5;

// The worst of many points.
struct FormulaWorst {
    double error = 0;      // of well-conditioned points
    FormulaInput at{};     // where that is
    double roundings = 0;  // of all points, error / (2^-24 condition)
    FormulaInput roundingsAt{};
    size_t beyond = 0;  // points, well conditioned or not, with an error above kFormulaTolerance
    size_t notFinite = 0;

    void add(const FormulaCase& formula, const FormulaInput& input, glm::dvec3 result, glm::dvec3 expected);
};

std::string describe(const FormulaInput& input);

}  // namespace umbriel::numerics
