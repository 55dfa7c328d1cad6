#include "common/math/lafortune_fit.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace umbriel {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kMaxColumns = kMaxLafortuneLobes + 1;  // the diffuse part first
constexpr double kMaxLogExponent = 14.0;             // base 2

// planar and normal as an angle, the exponent by its logarithm: free of scale and in bounds that a search keeps to.
struct Shape {
    double angle = 0.75 * kPi;
    double logExponent = 0.0;
};

double lobeBase(double planarDot, double normalProduct, const Shape& shape) {
    const double base =
        std::numbers::sqrt2 * (std::cos(shape.angle) * planarDot + std::sin(shape.angle) * normalProduct);
    return std::max(base, 0.0);
}

// One value of the table.
struct Sample {
    double planarDot = 0.0;      // u.x v.x + u.y v.y
    double normalProduct = 0.0;  // u.z v.z
    double weight = 0.0;         // projected solid angles, both
    glm::dvec3 value{0.0};
};

// The part of the axis nearer to entry i than to the others.
std::pair<double, double> cellOf(const std::vector<double>& axis, std::size_t i) {
    return {i == 0 ? axis[0] : 0.5 * (axis[i - 1] + axis[i]),
            i + 1 == axis.size() ? axis[i] : 0.5 * (axis[i] + axis[i + 1])};
}

// The integral of cos sin over the cell.
double projectedWeight(const std::vector<double>& axis, std::size_t i) {
    const auto [first, last] = cellOf(axis, i);
    return 0.5 * (std::sin(last) * std::sin(last) - std::sin(first) * std::sin(first));
}

std::vector<Sample> samplesOf(const BrdfTable& table) {
    std::vector<Sample> samples;
    samples.reserve(table.values.size());
    for (std::size_t i = 0; i < table.thetaIn.size(); ++i) {
        for (std::size_t j = 0; j < table.thetaOut.size(); ++j) {
            for (std::size_t k = 0; k < table.phi.size(); ++k) {
                const auto [first, last] = cellOf(table.phi, k);
                samples.push_back(
                    {std::sin(table.thetaIn[i]) * std::sin(table.thetaOut[j]) * std::cos(table.phi[k]),
                     std::cos(table.thetaIn[i]) * std::cos(table.thetaOut[j]),
                     projectedWeight(table.thetaIn, i) * projectedWeight(table.thetaOut, j) * (last - first),
                     table.at(i, j, k)});
            }
        }
    }
    return samples;
}

// Columns that are not in use are 0.
using Square = Eigen::Matrix<double, kMaxColumns, kMaxColumns>;
using Column = Eigen::Matrix<double, kMaxColumns, 1>;

// Least squares without negative coefficients: the best of all subsets of columns whose own solution has none. There
// are 16 at most, so nothing smarter is due.
Column nonNegativeSolution(const Square& normal, const Column& right, int columns, double& explained) {
    Column best = Column::Zero();
    explained = 0.0;
    for (unsigned subset = 1; subset < (1U << columns); ++subset) {
        // The other columns get an equation of their own that says 0.
        Square part = Square::Identity();
        Column partRight = Column::Zero();
        for (int r = 0; r < columns; ++r) {
            for (int c = 0; c < columns; ++c) {
                if ((subset >> r & subset >> c & 1U) != 0) {
                    part(r, c) = normal(r, c);
                    partRight(r) = right(r);
                }
            }
        }
        const Column solution = part.ldlt().solve(partRight);
        const double gain = solution.dot(partRight);
        if (solution.allFinite() && solution.minCoeff() >= 0.0 && gain > explained) {
            explained = gain;
            best = solution;
        }
    }
    return best;
}

class Objective {
 public:
    explicit Objective(const BrdfTable& table) : _samples(samplesOf(table)) {
        for (const Sample& sample : _samples) {
            _energy += sample.weight * sample.value * sample.value;
        }
    }

    const glm::dvec3& energy() const { return _energy; }

    // Sum over the channels of the squared residual; the weights that reach it on request.
    double operator()(const std::vector<Shape>& shapes, std::array<Column, 3>* coefficients = nullptr,
                      glm::dvec3* residual = nullptr) const {
        const auto columns = static_cast<int>(shapes.size()) + 1;
        Square normal = Square::Zero();
        std::array<Column, 3> right;
        right.fill(Column::Zero());
        std::array<double, kMaxLafortuneLobes> exponents{};
        std::transform(shapes.begin(), shapes.end(), exponents.begin(),
                       [](const Shape& shape) { return std::exp2(shape.logExponent); });
        Column row = Column::Zero();
        row(0) = 1.0 / kPi;
        for (const Sample& sample : _samples) {
            for (int c = 1; c < columns; ++c) {
                const auto lobe = static_cast<std::size_t>(c - 1);
                row(c) = std::pow(lobeBase(sample.planarDot, sample.normalProduct, shapes[lobe]), exponents[lobe]);
            }
            normal.noalias() += (sample.weight * row) * row.transpose();
            for (int channel = 0; channel < 3; ++channel) {
                right[static_cast<std::size_t>(channel)] += (sample.weight * sample.value[channel]) * row;
            }
        }
        double sum = 0.0;
        for (int channel = 0; channel < 3; ++channel) {
            double explained = 0.0;
            const Column solution =
                nonNegativeSolution(normal, right[static_cast<std::size_t>(channel)], columns, explained);
            const double left = _energy[channel] > 0.0 ? std::max(1.0 - explained / _energy[channel], 0.0) : 0.0;
            sum += left;
            if (coefficients != nullptr) {
                (*coefficients)[static_cast<std::size_t>(channel)] = solution;
            }
            if (residual != nullptr) {
                (*residual)[channel] = std::sqrt(left);
            }
        }
        return sum;
    }

 private:
    std::vector<Sample> _samples;
    glm::dvec3 _energy{0.0};
};

Shape withinBounds(Shape shape) {
    return {std::clamp(shape.angle, 0.0, kPi), std::clamp(shape.logExponent, 0.0, kMaxLogExponent)};
}

// The best place for one more lobe, the others held.
void addLobe(const Objective& objective, std::vector<Shape>& shapes) {
    constexpr int kAngles = 16;
    Shape best;
    double least = std::numeric_limits<double>::infinity();
    shapes.emplace_back();
    for (int a = 1; a < kAngles; ++a) {
        for (int e = 0; e <= static_cast<int>(kMaxLogExponent); ++e) {
            shapes.back() = {kPi * a / kAngles, static_cast<double>(e)};
            const double error = objective(shapes);
            if (error < least) {
                least = error;
                best = shapes.back();
            }
        }
    }
    shapes.back() = best;
}

// Tries each parameter up and down and keeps what helps.
double explore(const Objective& objective, std::vector<Shape>& shapes, double error, double step) {
    constexpr double kAngleStep = 0.25;  // of a radian, for each unit of the exponent's logarithm
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        for (const bool angle : {true, false}) {
            for (const double sign : {1.0, -1.0}) {
                const Shape kept = shapes[i];
                (angle ? shapes[i].angle : shapes[i].logExponent) += sign * step * (angle ? kAngleStep : 1.0);
                shapes[i] = withinBounds(shapes[i]);
                const double tried = objective(shapes);
                if (tried < error) {
                    error = tried;
                    break;
                }
                shapes[i] = kept;
            }
        }
    }
    return error;
}

void refine(const Objective& objective, std::vector<Shape>& shapes) {
    constexpr double kFirstStep = 0.5;
    constexpr double kLastStep = 1e-6;
    constexpr int kMaxMoves = 400;
    double error = objective(shapes);
    double step = kFirstStep;
    for (int move = 0; move < kMaxMoves && step > kLastStep; ++move) {
        const std::vector<Shape> before = shapes;
        const double found = explore(objective, shapes, error, step);
        if (!(found < error)) {
            step *= 0.5;
            continue;
        }
        error = found;
        // As far again in the direction that helped.
        std::vector<Shape> further = shapes;
        for (std::size_t i = 0; i < shapes.size(); ++i) {
            further[i] = withinBounds(
                {2.0 * shapes[i].angle - before[i].angle, 2.0 * shapes[i].logExponent - before[i].logExponent});
        }
        const double leapt = explore(objective, further, objective(further), step);
        if (leapt < error) {
            error = leapt;
            shapes = further;
        }
    }
}

}  // namespace

glm::dvec3 LafortuneModel::value(const glm::dvec3& inLocal, const glm::dvec3& outLocal) const {
    if (!(inLocal.z > 0.0) || !(outLocal.z > 0.0)) {
        return glm::dvec3(0.0);
    }
    const double planarDot = inLocal.x * outLocal.x + inLocal.y * outLocal.y;
    glm::dvec3 sum = diffuse / kPi;
    for (const LafortuneLobe& lobe : lobes) {
        const double base = lobe.planar * planarDot + lobe.normal * (inLocal.z * outLocal.z);
        if (base > 0.0) {
            sum += lobe.weight * std::pow(base, lobe.exponent);
        }
    }
    return sum;
}

Result<LafortuneFit> fitLafortune(const BrdfTable& table, int lobes) {
    if (const Result<void> checked = checkBrdfTable(table); !checked) {
        return checked.error();
    }
    if (lobes < 1 || lobes > kMaxLafortuneLobes) {
        return badInput(fmt::format("{} Lafortune lobes: expected 1 to {}", lobes, kMaxLafortuneLobes));
    }
    const Objective objective(table);
    const glm::dvec3 energy = objective.energy();
    if (!(energy.x + energy.y + energy.z > 0.0) || !std::isfinite(energy.x + energy.y + energy.z)) {
        return badInput("the BRDF table is 0 everywhere, or too large to be squared");
    }
    std::vector<Shape> shapes;
    for (int i = 0; i < lobes; ++i) {
        addLobe(objective, shapes);
        refine(objective, shapes);
    }
    LafortuneFit fit;
    std::array<Column, 3> coefficients;
    objective(shapes, &coefficients, &fit.residual);
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        const auto row = static_cast<int>(i) + 1;
        fit.model.lobes.push_back({std::numbers::sqrt2 * std::cos(shapes[i].angle),
                                   std::numbers::sqrt2 * std::sin(shapes[i].angle),
                                   std::exp2(shapes[i].logExponent),
                                   {coefficients[0](row), coefficients[1](row), coefficients[2](row)}});
    }
    fit.model.diffuse = {coefficients[0](0), coefficients[1](0), coefficients[2](0)};
    return fit;
}

}  // namespace umbriel
