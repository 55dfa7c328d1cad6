#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/glm.h"

// The white furnace: how much of an even light of radiance 1 comes back, as integrals in double over one hemisphere.
// The normal is +z.
namespace umbriel::numerics {

constexpr int kFurnaceRings = 400;
constexpr int kFurnaceSectors = 200;

inline glm::dvec3 spherical(double cosine, double azimuth) {
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

// Over microfacet normals h, distributed as GGX by tan^2 = alpha^2 u / (1 - u), so that a lobe of any width is met;
// light = mirror of the eye in h, and d(light) = 4 (v.h) dh. `reflect(toLight)` is BRDF times cosine.
template <class Reflect>
double furnaceOverHalfVectors(const Reflect& reflect, glm::dvec3 toEye, double alpha) {
    double sum = 0;
    for (int i = 0; i < kFurnaceRings; ++i)
        for (int k = 0; k < kFurnaceSectors; ++k) {
            const double u = (i + 0.5) / kFurnaceRings;
            const double cosine = std::sqrt((1 - u) / (1 - u + alpha * alpha * u));
            const glm::dvec3 h = spherical(cosine, 2 * std::numbers::pi * (k + 0.5) / kFurnaceSectors);
            const double cosEyeHalf = glm::dot(toEye, h);
            if (cosEyeHalf <= 0) continue;
            const glm::dvec3 toLight = 2 * cosEyeHalf * h - toEye;
            const double t = cosine * cosine * (alpha * alpha - 1) + 1;
            const double density = alpha * alpha / (std::numbers::pi * t * t) * cosine;
            sum += reflect(toLight) * 4 * cosEyeHalf / density;
        }
    return sum / (kFurnaceRings * kFurnaceSectors);
}

// Over directions about `axis`, distributed as (n + 1) / (2 pi) cos^n: for lobes of a power of a cosine.
template <class Reflect>
double furnaceOverCosineLobe(const Reflect& reflect, glm::dvec3 axis, double exponent) {
    const glm::dvec3 helper = std::abs(axis.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 x = glm::normalize(glm::cross(axis, helper));
    const glm::dvec3 y = glm::cross(axis, x);
    double sum = 0;
    for (int i = 0; i < kFurnaceRings; ++i)
        for (int k = 0; k < kFurnaceSectors; ++k) {
            const double u = (i + 0.5) / kFurnaceRings;
            const double cosine = std::pow(u, 1 / (exponent + 1));
            const glm::dvec3 d = spherical(cosine, 2 * std::numbers::pi * (k + 0.5) / kFurnaceSectors);
            const double density = (exponent + 1) / (2 * std::numbers::pi) * std::pow(u, exponent / (exponent + 1));
            sum += reflect(d.x * x + d.y * y + d.z * axis) / density;
        }
    return sum / (kFurnaceRings * kFurnaceSectors);
}

// Over light directions, even in projected solid angle: for what has no peak. `reflect(toLight)` is the BRDF alone.
template <class Reflect>
double furnaceOverLights(const Reflect& reflect) {
    double sum = 0;
    for (int i = 0; i < kFurnaceRings; ++i)
        for (int k = 0; k < kFurnaceSectors; ++k)
            sum += reflect(
                spherical(std::sqrt((i + 0.5) / kFurnaceRings), 2 * std::numbers::pi * (k + 0.5) / kFurnaceSectors));
    return sum * std::numbers::pi / (kFurnaceRings * kFurnaceSectors);
}

}  // namespace umbriel::numerics
