#include <gtest/gtest.h>

#include <fmt/format.h>

#include "tests/numerics/cases/formula_case.h"

// Every formula in float against itself in double, over its whole domain with all extremes. That shows how well it is
// conditioned and that it stays finite; whether it is right is another test's matter.
namespace umbriel::numerics {
namespace {

constexpr size_t kPoints = 100000;

TEST(FormulaCases, EveryFormulaIsFiniteAndFollowsDouble) {
    for (const FormulaCase& formula : formulaCases()) {
        SCOPED_TRACE(formula.name);
        FormulaWorst worst;
        for (const FormulaInput& input : formulaPoints(formula.domain, kPoints))
            worst.add(formula, input, formula.single(input), exactResult(formula, input));
        EXPECT_EQ(worst.notFinite, 0u) << describe(worst.at);
        EXPECT_LE(worst.error, kFormulaTolerance) << describe(worst.at);
        // directionFromLatLong has most, 24: the sine near a multiple of pi, whose argument took three roundings.
        EXPECT_LE(worst.roundings, 32) << describe(worst.roundingsAt);
        RecordProperty(formula.name, fmt::format("{:.1e}, {:.1f} roundings", worst.error, worst.roundings));
    }
}

// The measure itself: it must see an error, and it must not excuse one where the formula is well behaved.
TEST(FormulaCases, AnErrorIsSeenUnlessTheFormulaJumps) {
    const auto named = [](std::string_view name) {
        for (const FormulaCase& formula : formulaCases())
            if (formula.name == name) return formula;
        ADD_FAILURE() << name;
        return formulaCases().front();
    };
    const FormulaCase inverse = named("inverseSquare");
    const FormulaInput two{glm::vec4(0, 0, 2, 2), glm::vec4(0), glm::vec4(0), glm::vec4(0)};
    EXPECT_NEAR(conditionOf(inverse, two), 1, 1e-6) << "1/x moves by one rounding when x does";
    FormulaWorst worst;
    worst.add(inverse, two, glm::dvec3(0.5 * (1 + 1e-4)), glm::dvec3(0.5));
    EXPECT_NEAR(worst.error, 1e-4, 1e-12);
    worst.add(inverse, two, glm::dvec3(std::numeric_limits<double>::quiet_NaN()), glm::dvec3(0.5));
    EXPECT_EQ(worst.notFinite, 1u);

    // On the edge of a cone the light is on or off.
    const FormulaCase cone = named("spotCone");
    const FormulaInput edge{glm::vec4(0.6f, 0, -0.8f, 1), glm::vec4(0, 0, -1, 0), glm::vec4(0, 0, 0, 0.8f),
                            glm::vec4(0)};
    EXPECT_GT(conditionOf(cone, edge), 1e6);
    FormulaInput inside = edge;
    inside[2].w = 0.7f;
    EXPECT_LT(conditionOf(cone, inside), 2);
}

TEST(FormulaCases, PointsAreTheSameEveryTimeAndFinite) {
    for (const FormulaCase& formula : formulaCases()) {
        const auto points = formulaPoints(formula.domain, 3000);
        EXPECT_EQ(points.size(), 3000u) << formula.name;
        EXPECT_EQ(points, formulaPoints(formula.domain, 3000)) << formula.name;
        for (const FormulaInput& p : points)
            for (const glm::vec4& v : p)
                for (int i = 0; i < 4; ++i) ASSERT_TRUE(std::isfinite(v[i])) << formula.name;
    }
}

}  // namespace
}  // namespace umbriel::numerics
