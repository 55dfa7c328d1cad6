#include "tests/numerics/cases/formula_case.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "shaders/formula_cpp.h"

#define REAL(x) Real(x)
#define FORMULA_CASE(name, file, domain, range, ...)                                                              \
    [[maybe_unused]] inline Vec3 name##Case(Vec3 a, Real aw, Vec3 b, Real bw, Vec3 c, Real cw, Vec3 d, Real dw) { \
        (void)a, (void)aw, (void)b, (void)bw, (void)c, (void)cw, (void)d, (void)dw;                               \
        __VA_ARGS__                                                                                               \
    }
namespace umbriel::formula_f32 {
#include "tests/numerics/cases/formula_bodies.inc"
}
namespace umbriel::formula_f64 {
#include "tests/numerics/cases/formula_bodies.inc"
}
#undef FORMULA_CASE
#undef REAL

namespace umbriel::numerics {
namespace {

using ExactInput = std::array<glm::dvec4, 4>;

template <auto function, class Result, class Input>
Result call(const Input& in) {
    return function(Result(in[0]), in[0].w, Result(in[1]), in[1].w, Result(in[2]), in[2].w, Result(in[3]), in[3].w);
}

// One rounding of float, up or down, in each number of the inputs; the signs are the bits of `signs`.
ExactInput nudged(const FormulaInput& input, uint32_t signs) {
    ExactInput moved;
    for (int i = 0; i < 16; ++i) {
        const double value = input[static_cast<size_t>(i / 4)][i % 4];
        moved[static_cast<size_t>(i / 4)][i % 4] = value * (1 + ((signs >> i & 1) != 0 ? 0x1p-24 : -0x1p-24));
    }
    return moved;
}

bool isFinite(glm::dvec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

const std::vector<FormulaCase>& formulaCases() {
    static const std::vector<FormulaCase> cases{
#define FORMULA_CASE(name, file, domain, range, ...)                                              \
    FormulaCase{#name,                                                                            \
                "formula/" file ".glsl",                                                          \
                FormulaDomain::domain,                                                            \
                range,                                                                            \
                #__VA_ARGS__,                                                                     \
                call<formula_f32::name##Case, glm::vec3, FormulaInput>,                           \
                call<formula_f64::name##Case, glm::dvec3, ExactInput>},
#include "tests/numerics/cases/formula_bodies.inc"
#undef FORMULA_CASE
    };
    return cases;
}

double formulaError(const FormulaCase& formula, glm::dvec3 result, glm::dvec3 expected) {
    double worst = 0;
    for (int i = 0; i < 3; ++i) {
        const double difference = std::abs(result[i] - expected[i]);
        // Below 1e-36 floats are denormal, or nearly so.
        const double scale = std::max({std::abs(expected[i]), formula.range / 10, 1e-36});
        worst = std::max(worst, difference / scale);
    }
    return worst;
}

JudgedPoint judge(const FormulaCase& formula, const FormulaInput& input) {
    JudgedPoint point;
    point.exact = formula.exact({glm::dvec4(input[0]), glm::dvec4(input[1]), glm::dvec4(input[2]), glm::dvec4(input[3])});
    point.condition = 1;
    // Both signs of one pattern move across a jump on either side; three patterns that differ within each vector.
    for (const uint32_t signs : {0x1353u, 0x6ca6u, 0x953cu, 0xecacu, 0x9359u, 0x6ac3u}) {
        const glm::dvec3 moved = formula.exact(nudged(input, signs));
        point.condition = std::max(point.condition, formulaError(formula, moved, point.exact) / 0x1p-24);
    }
    return point;
}

void FormulaWorst::add(const FormulaCase& formula, const FormulaInput& input, const JudgedPoint& point,
                       glm::dvec3 result, glm::dvec3 expected) {
    if (!isFinite(result) || !isFinite(expected)) {
        if (notFinite++ == 0) at = input;
        return;
    }
    const double difference = formulaError(formula, result, expected);
    const double share = difference / (0x1p-24 * point.condition);
    if (share > roundings) {
        roundings = share;
        roundingsAt = input;
    }
    if (point.condition > kWellConditioned) return;
    ++judged;
    if (difference > error) {
        error = difference;
        if (notFinite == 0) at = input;
    }
}

std::string describe(const FormulaInput& input) {
    std::string text;
    for (const glm::vec4& v : input) text += fmt::format("({:.9g} {:.9g} {:.9g} | {:.9g}) ", v.x, v.y, v.z, v.w);
    text.pop_back();
    return text;
}

}  // namespace umbriel::numerics
