#include <fmt/format.h>

#include <cstdlib>
#include <string>

#include "server/gl/context.h"
#include "tests/numerics/cases/formula_case.h"
#include "tests/numerics/cases/formula_gpu.h"

// formula_table [points per formula, 100000]: how far float is from double and GLSL from float C++, for every formula
// of shaders/formula, as a Markdown table. docs/illumination.md says what the columns mean. Without OpenGL the GLSL
// columns are left empty.
namespace {

using umbriel::numerics::describe;
using umbriel::numerics::FormulaCase;
using umbriel::numerics::FormulaWorst;

// Every how many points the share of well-conditioned ones is counted.
constexpr size_t kSampled = 50;

std::string cells(const FormulaWorst& worst, size_t points) {
    if (worst.notFinite > 0) return fmt::format("{} NOT FINITE | |", worst.notFinite);
    return fmt::format("{:.1e} | {:.1f} | {:.2f} %", worst.error, worst.roundings,
                       100.0 * static_cast<double>(worst.beyond) / static_cast<double>(points));
}

}  // namespace

int main(int argc, char** argv) {
    const size_t count = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 100000;
    if (count == 0 || count > 1000000) {
        fmt::print(stderr, "formula_table: a number of points from 1 to 1000000, not {}\n", argv[1]);
        return 2;
    }
    const auto context = umbriel::gl::HeadlessContext::create();
    if (!context) fmt::print(stderr, "no OpenGL, so no GLSL columns: {}\n", context.error().message);
    fmt::print(
        "| formula | float: error | roundings | beyond | GLSL: error | roundings | beyond | well conditioned |\n");
    fmt::print("|---|---|---|---|---|---|---|---|\n");
    std::string places;
    for (const FormulaCase& formula : umbriel::numerics::formulaCases()) {
        const auto points = umbriel::numerics::formulaPoints(formula.domain, count);
        FormulaWorst single;
        FormulaWorst gpu;
        std::vector<glm::vec3> drawn;
        if (context) {
            auto results = umbriel::gl::drawFormula(formula, points);
            if (!results) {
                fmt::print(stderr, "{}: {}\n", formula.name, results.error().message);
                return 1;
            }
            drawn = std::move(*results);
        }
        size_t sampled = 0;
        size_t wellConditioned = 0;
        for (size_t i = 0; i < points.size(); ++i) {
            const glm::vec3 here = formula.single(points[i]);
            single.add(formula, points[i], here, umbriel::numerics::exactResult(formula, points[i]));
            if (context) gpu.add(formula, points[i], drawn[i], here);
            if (i % kSampled != 0) continue;
            ++sampled;
            wellConditioned +=
                umbriel::numerics::conditionOf(formula, points[i]) <= umbriel::numerics::kWellConditioned;
        }
        fmt::print("| `{}` | {} | {} | {:.1f} % |\n", formula.name, cells(single, points.size()),
                   context ? cells(gpu, points.size()) : "| |",
                   100.0 * static_cast<double>(wellConditioned) / static_cast<double>(sampled));
        places += fmt::format("- `{}`: float {}; roundings {}", formula.name, describe(single.at),
                              describe(single.roundingsAt));
        if (context) places += fmt::format("; GLSL {}; roundings {}", describe(gpu.at), describe(gpu.roundingsAt));
        places += '\n';
    }
    fmt::print("\nWorst at (a | aw) (b | bw) (c | cw) (d | dw) of tests/numerics/cases/formula_bodies.inc:\n\n{}",
               places);
    return 0;
}
