#include "common/light/environment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "shaders/formula_cpp.h"
#include "tests/support/panoramas.h"

namespace umbriel {
namespace {

namespace f = formula_f64;
constexpr double kPi = 3.14159265358979323846;

// The texel of a cube level around a direction.
glm::vec3 cubeAt(const std::vector<glm::vec3>& texels, std::size_t first, int size, const glm::dvec3& direction) {
    const glm::dvec2 place = f::cubePlace(direction) * double(size);
    const int x = std::clamp(static_cast<int>(place.x), 0, size - 1);
    const int y = std::clamp(static_cast<int>(place.y), 0, size - 1);
    return texels[first + static_cast<std::size_t>((f::cubeFace(direction) * size + y) * size + x)];
}

std::size_t firstOfLevel(const PrefilteredEnvironment& environment, int level) {
    std::size_t first = 0;
    for (int i = 0; i < level; ++i) {
        const auto size = static_cast<std::size_t>(environment.faceSize >> i);
        first += 6 * size * size;
    }
    return first;
}

TEST(EnvironmentLight, AnEvenEnvironmentStaysEven) {
    for (const float radiance : {1e-30f, 0.75f, 1e30f}) {
        const PrefilteredEnvironment made =
            prefilter(panoramaOf(32, [&](const glm::dvec3&) { return glm::dvec3(radiance); }), 32);
        EXPECT_EQ(made.radiance.size(), 6u * (32 * 32 + 16 * 16 + 8 * 8 + 4 * 4 + 2 * 2 + 1));
        for (const std::vector<glm::vec3>* texels : {&made.radiance, &made.convolved})
            for (const glm::vec3& texel : *texels) ASSERT_NEAR(texel.y / radiance, 1.0, 1e-6);
    }
}

// Radiance 1 + a . direction: its convolution by cos / pi is 1 + 2/3 a . normal (Ramamoorthi & Hanrahan 2001, A_1/A_0).
TEST(EnvironmentLight, ALinearEnvironmentIsConvolvedToTwoThirds) {
    const glm::dvec3 a(0.3, -0.5, 0.2);
    const PrefilteredEnvironment made =
        prefilter(panoramaOf(64, [&](const glm::dvec3& d) { return glm::dvec3(1.0 + glm::dot(a, d)); }), 32);
    for (const glm::dvec3 n : {glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::normalize(glm::dvec3(1, 2, -3))}) {
        const glm::dvec2 place = f::cubePlace(n) * 16.0;
        const glm::dvec3 middle = glm::normalize(
            f::directionFromCube(f::cubeFace(n), (glm::floor(glm::min(place, glm::dvec2(15.5))) + 0.5) / 16.0));
        EXPECT_NEAR(cubeAt(made.convolved, 0, 16, n).x, 1.0 + 2.0 / 3.0 * glm::dot(a, middle), 1e-3);
    }
}

// A sun of one texel: what it sends stays what it sends, in the mirror map and on a surface that faces it.
TEST(EnvironmentLight, ASunOfOneTexelKeepsItsPower) {
    Panorama sky = panoramaOf(128, [](const glm::dvec3&) { return glm::dvec3(0.0); });
    const int row = 40;
    const int column = 100;
    sky.radiance[static_cast<std::size_t>(row * 256 + column)] = glm::vec3(1e5f);
    const double irradiance = 1e5 * f::latLongTexelSolidAngle(row, 256, 128);
    const PrefilteredEnvironment made = prefilter(sky, 64);
    double power = 0.0;
    for (int face = 0; face < 6; ++face)
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x)
                power += made.radiance[static_cast<std::size_t>((face * 64 + y) * 64 + x)].x *
                         f::cubeTexelSolidAngle({(x + 0.5) / 64, (y + 0.5) / 64}, 64.0);
    EXPECT_NEAR(power / irradiance, 1.0, 0.02) << "the mirror map";
    const glm::dvec3 sun = f::directionFromLatLong({(column + 0.5) / 256, (row + 0.5) / 128});
    // The texel of the diffuse map is up to 5 degrees off the sun.
    EXPECT_NEAR(cubeAt(made.convolved, 0, 16, sun).x * kPi / irradiance, 1.0, 0.02);
}

// One bright direction each: found where the formulas say, on every level, brightest there.
TEST(EnvironmentLight, DirectionsStayWhereTheyAre) {
    for (const glm::dvec3 axis : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, -1, 0),
                                  glm::dvec3(0, 0, 1), glm::dvec3(0, 0, -1)}) {
        const PrefilteredEnvironment made = prefilter(
            panoramaOf(64, [&](const glm::dvec3& d) { return glm::dvec3(glm::dot(d, axis) > 0.95 ? 10.0 : 0.0); }), 32);
        for (int level = 0; level < made.levels; ++level) {
            const std::size_t first = firstOfLevel(made, level);
            const int size = made.faceSize >> level;
            const float there = cubeAt(made.radiance, first, size, axis).x;
            for (const glm::dvec3 other : {glm::dvec3(axis.y, axis.z, axis.x), -axis})
                EXPECT_GT(there, 3.0f * cubeAt(made.radiance, first, size, other).x) << level;
        }
    }
}

TEST(EnvironmentLight, HalfATurnIsItsOwnInverse) {
    const Panorama marked = panoramaOf(8, [](const glm::dvec3& d) { return d + 1.0; });
    const Panorama turned = halfTurned(marked);
    // What was at +X, right of the middle, is left of it now: at -X.
    EXPECT_NEAR(turned.at(4, 4).x, 0.0f + marked.at(12, 4).x, 0.0f);
    EXPECT_EQ(halfTurned(turned).radiance, marked.radiance);
}

TEST(EnvironmentLight, FacesBecomeThePanoramaTheyShow) {
    const int side = 64;
    std::vector<std::vector<glm::vec3>> faces(6);
    for (int face = 0; face < 6; ++face)
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x)
                faces[static_cast<std::size_t>(face)].push_back(
                    glm::vec3(glm::normalize(f::directionFromCube(face, {(x + 0.5) / side, (y + 0.5) / side}))));
    const Panorama made = panoramaFromFaces(faces, side);
    for (int row = 0; row < made.rows; ++row)
        for (int column = 0; column < made.columns; ++column) {
            const glm::dvec3 d = f::directionFromLatLong({(column + 0.5) / made.columns, (row + 0.5) / made.rows});
            ASSERT_LT(glm::length(glm::dvec3(made.at(column, row)) - d), 0.02);
        }
}

TEST(EnvironmentLight, WhatIsNoRadianceIsRepairedAndCounted) {
    Panorama bad = panoramaOf(2, [](const glm::dvec3&) { return glm::dvec3(1.0); });
    bad.radiance[0].x = -1.0f;
    bad.radiance[1].y = std::numeric_limits<float>::quiet_NaN();
    bad.radiance[2].z = std::numeric_limits<float>::infinity();
    bad.radiance[3].x = 3e38f;
    const PanoramaRepairs repairs = repair(bad);
    EXPECT_EQ(repairs.negative, 1u);
    EXPECT_EQ(repairs.notFinite, 2u);
    EXPECT_EQ(repairs.tooLarge, 1u);
    EXPECT_EQ(bad.radiance[0].x, 0.0f);
    EXPECT_EQ(bad.radiance[1].y, 0.0f);
    EXPECT_EQ(bad.radiance[2].z, 1e30f);
}

// The table against the BRDF itself, integrated over the hemisphere by midpoints: what a material reflects of an even
// environment of radiance 1.
TEST(EnvironmentLight, SharesAreTheBrdfsAlbedo) {
    const std::vector<glm::vec3> shares = mirroredShares();
    for (const int row : {6, 15, 31})
        for (const int column : {3, 12, 31})
            for (const double metallic : {0.0, 1.0}) {
                f::MetallicRoughness material;
                material.baseColour = glm::dvec3(0.8);
                material.metallic = metallic;
                material.roughness = (row + 0.5) / kReflectanceSide;
                const double cosEye = (column + 0.5) / kReflectanceSide;
                const glm::dvec3 toEye(std::sqrt(1 - cosEye * cosEye), 0, cosEye);
                double sum = 0.0;
                constexpr int kSteps = 800;
                for (int i = 0; i < kSteps; ++i)
                    for (int k = 0; k < kSteps; ++k) {
                        const double cosine = (i + 0.5) / kSteps;
                        const double sine = std::sqrt(1 - cosine * cosine);
                        const double azimuth = kPi * (k + 0.5) / kSteps;  // the other half is its mirror image
                        const glm::dvec3 toLight(sine * std::cos(azimuth), sine * std::sin(azimuth), cosine);
                        sum += f::metallicRoughnessReflect(material, {0, 0, 1}, toLight, toEye).x;
                    }
                sum *= 2 * kPi / (kSteps * kSteps);
                const glm::vec3 share = shares[static_cast<std::size_t>(row * kReflectanceSide + column)];
                const glm::dvec3 f0 = f::reflectanceAtNormal(material);
                const double mirrored = f::environmentMirrored(f0, share.x, share.y).x;
                const double diffuse = f::environmentUnmirrored(f0, share.z).x * f::diffuseAlbedo(material).x;
                EXPECT_NEAR(mirrored + diffuse, sum, 0.004) << row << " " << column << " " << metallic;
                // glTF's dielectric with a white base gives back more than it gets at grazing angles; a metal does not.
                if (metallic > 0.0) {
                    EXPECT_LE(mirrored + diffuse, 1.001);
                }
            }
}

}  // namespace
}  // namespace umbriel
