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

ExactInput exactly(const FormulaInput& input) {
    return {glm::dvec4(input[0]), glm::dvec4(input[1]), glm::dvec4(input[2]), glm::dvec4(input[3])};
}

bool isFinite(glm::dvec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

const std::vector<FormulaCase>& formulaCases() {
    static const std::vector<FormulaCase> cases{
#define FORMULA_CASE(name, file, domain, range, ...)                    \
    FormulaCase{#name,                                                  \
                "formula/" file ".glsl",                                \
                FormulaDomain::domain,                                  \
                range,                                                  \
                #__VA_ARGS__,                                           \
                call<formula_f32::name##Case, glm::vec3, FormulaInput>, \
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
        // Denormal floats may count as 0 (GLSL 4.50, 4.7.1).
        if (difference < 2e-38) continue;
        worst = std::max(worst, difference / std::max(std::abs(expected[i]), formula.range / 10));
    }
    return worst;
}

double conditionOf(const FormulaCase& formula, const FormulaInput& input) {
    constexpr double kRounding = 0x1p-24;
    const ExactInput unmoved = exactly(input);
    const glm::dvec3 exact = formula.exact(unmoved);
    const auto moved = [&](const ExactInput& to) {
        return formulaError(formula, formula.exact(to), exact) / kRounding;
    };
    // What each number alone changes, at worst all in one direction.
    double sum = 0;
    for (size_t vector = 0; vector < 4; ++vector)
        for (int k = 0; k < 4; ++k) {
            ExactInput to = unmoved;
            to[vector][k] *= 1 + kRounding;
            sum += moved(to);
        }
    // A jump may lie on the other side, or where several numbers move together; each pattern of signs both ways, and
    // twice as far.
    for (const uint32_t signs : {0x1353u, 0x6ca6u, 0x953cu}) {
        for (const double step : {2 * kRounding, -2 * kRounding}) {
            ExactInput to = unmoved;
            for (uint32_t i = 0; i < 16; ++i)
                to[i / 4][static_cast<int>(i % 4)] *= 1 + ((signs >> i & 1) != 0 ? step : -step);
            sum = std::max(sum, moved(to) / 2);
        }
    }
    return std::max(1.0, sum);
}

void FormulaWorst::add(const FormulaCase& formula, const FormulaInput& input, glm::dvec3 result, glm::dvec3 expected) {
    if (!isFinite(result) || !isFinite(expected)) {
        if (notFinite++ == 0) at = input;
        return;
    }
    // The condition is at least 1 and costs twenty evaluations: it is asked for only where it can matter.
    const double difference = formulaError(formula, result, expected);
    beyond += difference > kFormulaTolerance;
    if (!(difference > error) && !(difference > roundings * 0x1p-24)) return;
    const double condition = conditionOf(formula, input);
    const double share = difference / (0x1p-24 * condition);
    if (share > roundings) {
        roundings = share;
        roundingsAt = input;
    }
    if (condition <= kWellConditioned && difference > error) {
        error = difference;
        if (notFinite == 0) at = input;
    }
}

glm::dvec3 exactResult(const FormulaCase& formula, const FormulaInput& input) {
    return formula.exact(exactly(input));
}

std::string describe(const FormulaInput& input) {
    std::string text;
    for (const glm::vec4& v : input) text += fmt::format("({:.9g} {:.9g} {:.9g} | {:.9g}) ", v.x, v.y, v.z, v.w);
    text.pop_back();
    return text;
}

}  // namespace umbriel::numerics
