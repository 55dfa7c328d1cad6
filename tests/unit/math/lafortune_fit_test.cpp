#include "common/math/lafortune_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace umbriel {
namespace {

constexpr double kPi = std::numbers::pi;

glm::dvec3 direction(double theta, double phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

template <class Function>
BrdfTable tableOf(Function brdf) {
    BrdfTable table;
    for (int i = 0; i < 16; ++i) {
        table.thetaIn.push_back(0.5 * kPi * i / 16);
        table.thetaOut.push_back(0.5 * kPi * i / 16);
        table.phi.push_back(kPi * i / 15);
    }
    for (const double in : table.thetaIn) {
        for (const double out : table.thetaOut) {
            for (const double phi : table.phi) {
                table.values.push_back(brdf(direction(in, 0.0), direction(out, phi)));
            }
        }
    }
    return table;
}

LafortuneModel oneLobe() {
    return {{0.3, 0.2, 0.1}, {{-1.1, std::sqrt(2.0 - 1.21), 12.0, {0.5, 0.5, 0.25}}}};
}

LafortuneModel twoLobes() {
    LafortuneModel model = oneLobe();
    model.lobes.push_back({0.9, std::sqrt(2.0 - 0.81), 40.0, {0.8, 0.4, 0.2}});  // reflects back
    return model;
}

// Torrance-Sparrow with GGX and Schlick's Fresnel: no sum of lobes.
glm::dvec3 microfacet(const glm::dvec3& in, const glm::dvec3& out) {
    constexpr double kAlpha2 = 0.09 * 0.09 * 16.0;
    const glm::dvec3 half = glm::normalize(in + out);
    const double t = half.z * half.z * (kAlpha2 - 1.0) + 1.0;
    const auto lambda = [&](double z) { return z + std::sqrt(kAlpha2 + (1.0 - kAlpha2) * z * z); };
    const double fresnel = 0.05 + 0.95 * std::pow(1.0 - glm::dot(in, half), 5.0);
    return glm::dvec3(0.2 / kPi + fresnel * kAlpha2 / (kPi * t * t) / (lambda(in.z) * lambda(out.z)));
}

TEST(Lafortune, RecoversItsOwnLobes) {
    for (const LafortuneModel& truth : {oneLobe(), twoLobes()}) {
        const auto count = static_cast<int>(truth.lobes.size());
        const BrdfTable table =
            tableOf([&](const glm::dvec3& in, const glm::dvec3& out) { return truth.value(in, out); });
        const Result<LafortuneFit> fit = fitLafortune(table, count);
        ASSERT_TRUE(fit.has_value());
        for (int c = 0; c < 3; ++c) {
            EXPECT_LT(fit->residual[c], 1e-3) << count;
            EXPECT_NEAR(fit->model.diffuse[c], truth.diffuse[c], 1e-3);
        }
        for (const LafortuneLobe& wanted : truth.lobes) {
            const auto same = [&](const LafortuneLobe& lobe) {
                return std::abs(lobe.planar - wanted.planar) < 0.01 &&
                       std::abs(lobe.exponent / wanted.exponent - 1.0) < 0.02 &&
                       glm::length(lobe.weight - wanted.weight) < 0.01;
            };
            EXPECT_TRUE(std::any_of(fit->model.lobes.begin(), fit->model.lobes.end(), same)) << wanted.exponent;
        }
    }
}

TEST(Lafortune, MoreLobesFitNoWorseAndTheResidualIsWhatItSays) {
    const BrdfTable table = tableOf(microfacet);
    double last = 1.0;
    for (int lobes = 1; lobes <= kMaxLafortuneLobes; ++lobes) {
        const Result<LafortuneFit> fit = fitLafortune(table, lobes);
        ASSERT_TRUE(fit.has_value());
        EXPECT_LE(fit->residual.x, last + 1e-9);
        last = fit->residual.x;
        // The same by hand, over the table's own cells.
        double error = 0.0;
        double energy = 0.0;
        const auto cell = [](const std::vector<double>& axis, std::size_t i) {
            const double first = i == 0 ? axis[0] : 0.5 * (axis[i - 1] + axis[i]);
            const double end = i + 1 == axis.size() ? axis[i] : 0.5 * (axis[i] + axis[i + 1]);
            return std::pair(first, end);
        };
        for (std::size_t i = 0; i < 16; ++i) {
            for (std::size_t j = 0; j < 16; ++j) {
                for (std::size_t k = 0; k < 16; ++k) {
                    double weight = cell(table.phi, k).second - cell(table.phi, k).first;
                    for (const auto& [first, end] : {cell(table.thetaIn, i), cell(table.thetaOut, j)}) {
                        weight *= 0.25 * (std::cos(2.0 * first) - std::cos(2.0 * end));
                    }
                    const glm::dvec3 fitted =
                        fit->model.value(direction(table.thetaIn[i], 0.0), direction(table.thetaOut[j], table.phi[k]));
                    const double difference = fitted.x - table.at(i, j, k).x;
                    error += weight * difference * difference;
                    energy += weight * table.at(i, j, k).x * table.at(i, j, k).x;
                }
            }
        }
        EXPECT_NEAR(fit->residual.x, std::sqrt(error / energy), 1e-6);
        EXPECT_GE(std::min(fit->model.diffuse.x, fit->model.lobes.back().weight.x), 0.0);
    }
    // 0.273, 0.200, 0.190 with one to three lobes: the best of 60 random starts is no better. What is left lies at
    // grazing angles, where a microfacet model grows without bound.
    EXPECT_LT(last, 0.2);
}

TEST(Lafortune, LambertNeedsNoLobe) {
    const Result<LafortuneFit> fit =
        fitLafortune(tableOf([](const glm::dvec3&, const glm::dvec3&) { return glm::dvec3(0.5, 0.0, 0.25) / kPi; }), 2);
    ASSERT_TRUE(fit.has_value());
    for (const auto& [in, out] :
         {std::pair(direction(0.3, 0.0), direction(1.2, 2.0)), {direction(1.5, 0), direction(1.5, kPi)}}) {
        EXPECT_NEAR(fit->model.value(in, out).x, 0.5 / kPi, 1e-6);
        EXPECT_EQ(fit->model.value(in, out).y, 0.0);
    }
    EXPECT_LT(fit->residual.x + fit->residual.y + fit->residual.z, 1e-6);
}

TEST(Lafortune, SameTableGivesTheSameBits) {
    const BrdfTable table = tableOf(microfacet);
    const LafortuneFit a = *fitLafortune(table, 2);
    const LafortuneFit b = *fitLafortune(table, 2);
    EXPECT_EQ(a.residual, b.residual);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(a.model.lobes[i].exponent, b.model.lobes[i].exponent);
        EXPECT_EQ(a.model.lobes[i].planar, b.model.lobes[i].planar);
        EXPECT_EQ(a.model.lobes[i].weight, b.model.lobes[i].weight);
    }
}

TEST(Lafortune, IsReciprocalAndDarkBelowTheSurface) {
    const LafortuneModel model = twoLobes();
    for (int i = 0; i < 200; ++i) {
        const glm::dvec3 u = direction(0.007 * i, 0.1 * i);
        const glm::dvec3 v = direction(1.5 - 0.007 * i, 0.3 * i);
        EXPECT_EQ(model.value(u, v), model.value(v, u));
    }
    EXPECT_EQ(model.value(direction(1.6, 0.0), direction(0.0, 0.0)), glm::dvec3(0.0));
}

TEST(BrdfTable, IsTrilinearAndSymmetric) {
    const BrdfTable table = tableOf(microfacet);
    for (const std::size_t i : {1U, 7U, 15U}) {
        for (const std::size_t k : {0U, 4U, 15U}) {
            const glm::dvec3 in = direction(table.thetaIn[i], 0.5);
            EXPECT_NEAR(table.value(in, direction(table.thetaOut[3], 0.5 + table.phi[k])).x, table.at(i, 3, k).x, 1e-9);
            EXPECT_NEAR(table.value(in, direction(table.thetaOut[3], 0.5 - table.phi[k])).x, table.at(i, 3, k).x, 1e-9);
        }
    }
    const double middle = 0.5 * (table.thetaOut[3] + table.thetaOut[4]);
    EXPECT_NEAR(table.value(direction(table.thetaIn[2], 0.0), direction(middle, 0.0)).x,
                0.5 * (table.at(2, 3, 0).x + table.at(2, 4, 0).x), 1e-9);
    EXPECT_EQ(table.value({0, 0, -1}, {0, 0, 1}), glm::dvec3(0.0));
}

TEST(BrdfTable, UnsoundTablesAreRefusedInWords) {
    const BrdfTable sound = tableOf(microfacet);
    const auto refusal = [](const BrdfTable& table) {
        const Result<LafortuneFit> fit = fitLafortune(table, 1);
        EXPECT_FALSE(fit.has_value());
        return fit ? std::string() : fit.error().message;
    };
    BrdfTable table = sound;
    table.values.pop_back();
    EXPECT_NE(refusal(table).find("4095 values for a grid of 4096"), std::string::npos);
    for (const double bad : {-1e-9, std::nan(""), std::numeric_limits<double>::infinity()}) {
        table = sound;
        table.values[17].y = bad;
        EXPECT_NE(refusal(table).find("BRDF value 18"), std::string::npos);
    }
    table = sound;
    table.thetaIn[5] = table.thetaIn[4];
    EXPECT_NE(refusal(table).find("theta_in value 6"), std::string::npos);
    table = sound;
    table.phi.back() = 4.0;
    EXPECT_NE(refusal(table).find("phi value 16"), std::string::npos);
    table = sound;
    table.thetaOut = {0.0};
    EXPECT_NE(refusal(table).find("theta_out"), std::string::npos);
    table = sound;
    std::fill(table.values.begin(), table.values.end(), glm::dvec3(0.0));
    EXPECT_NE(refusal(table).find("0 everywhere"), std::string::npos);
    EXPECT_EQ(fitLafortune(sound, 0).error().kind, Error::Kind::BadInput);
    EXPECT_EQ(fitLafortune(sound, 4).error().kind, Error::Kind::BadInput);
}

}  // namespace
}  // namespace umbriel
