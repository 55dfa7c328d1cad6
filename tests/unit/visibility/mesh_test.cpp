#include "common/visibility/mesh.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "tests/unit/visibility/test_meshes.h"

namespace umbriel::visibility {
namespace {

TEST(BakeMesh, CornersOfACreaseAreOneRowAndSidesAreTwo) {
    const auto box = prepare(test::box(2, false));
    EXPECT_EQ(box->positions.size(), 26u);
    EXPECT_EQ(box->rows.size(), 26u);
    EXPECT_EQ(box->vertexRow.size(), 6u * 9u);
    for (const Row& row : box->rows) {
        // The normal of a corner is the diagonal, of an edge the half, of a face the axis.
        EXPECT_GT(glm::dot(row.normal, glm::normalize(box->positions[row.position])), 0.999f);
    }

    // A sheet and its back with vertices of its own.
    Mesh sheet = test::plate(2);
    const Mesh front = sheet;
    for (const glm::vec3& p : front.positions) sheet.positions.push_back(p);
    for (std::size_t t = 0; t < front.indices.size(); t += 3) {
        for (const std::size_t k : {0, 2, 1}) sheet.indices.push_back(front.indices[t + k] + 9);
    }
    const auto both = prepare(sheet);
    EXPECT_EQ(both->positions.size(), 9u);
    EXPECT_EQ(both->rows.size(), 18u);
    for (std::uint32_t v = 0; v < 9; ++v) {
        EXPECT_EQ(both->rows[both->vertexRow[v]].normal.z, 1.0f);
        EXPECT_EQ(both->rows[both->vertexRow[v + 9]].normal.z, -1.0f);
    }
}

TEST(BakeMesh, NormalsAreWeightedByAngle) {
    // A cube's corner of triangles: each face has a right angle there, however it is cut into triangles.
    const auto box = prepare(test::box(1, false));
    for (const Row& row : box->rows) {
        for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(std::abs(row.normal[axis]), std::sqrt(1.0 / 3.0), 1e-6);
    }
}

TEST(BakeMesh, AxesAreOrthonormalAndRightHanded) {
    const auto mesh = prepare(test::sphere(3));
    for (const Row& row : mesh->rows) {
        const glm::mat3 a = vertexAxes(row.normal);
        EXPECT_EQ(a[2], row.normal);
        EXPECT_NEAR(glm::dot(a[0], a[1]), 0.0f, 2e-7f);
        EXPECT_NEAR(glm::dot(a[0], a[2]), 0.0f, 2e-7f);
        EXPECT_NEAR(glm::length(a[0]), 1.0f, 2e-7f);
        EXPECT_NEAR(glm::length(glm::cross(a[0], a[1]) - a[2]), 0.0f, 4e-7f);
    }
}

TEST(BakeMesh, RowsFollowACurve) {
    const auto mesh = prepare(test::cloth(80, 40));
    double along = 0.0, before = 0.0;
    for (std::size_t i = 1; i < mesh->rows.size(); ++i) {
        along += glm::length(mesh->positions[mesh->rows[i].position] - mesh->positions[mesh->rows[i - 1].position]);
        before += glm::length(mesh->positions[i] - mesh->positions[(i * 1009) % mesh->positions.size()]);
    }
    EXPECT_LT(along, 0.15 * before);
    EXPECT_EQ(mesh->hash, prepare(test::cloth(80, 40))->hash);
}

TEST(BakeMesh, DegenerateTrianglesAndUnusedVerticesAreCounted) {
    Mesh m = test::plate(1);
    m.positions.push_back({5, 5, 5});          // unused
    m.positions.push_back({0.25f, 0.25f, 0});  // only in triangles without area
    m.indices.insert(m.indices.end(), {0, 5, 5, 0, 5, 3, 0, 0, 1});
    const auto mesh = prepare(m);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->degenerateTriangles, 3u);
    EXPECT_EQ(mesh->unlitVertices, 2u);
    EXPECT_EQ(mesh->vertexRow[4], kNoRow);
    EXPECT_EQ(mesh->vertexRow[5], kNoRow);
    EXPECT_EQ(mesh->triangles.size(), 2u);
    EXPECT_EQ(mesh->rows.size(), 4u);
}

TEST(BakeMesh, AVertexWhoseFacesCancelIsOnTheSideOfTheFirst) {
    // Both faces of one triangle over the same three vertices, exactly opposite and opposite but for rounding.
    for (const float lift : {0.0f, 1e-7f}) {
        for (const bool turned : {false, true}) {
            Mesh m{{{0, 0, 0}, {1, 0, 0}, {0, 1, lift}, {0, 1, 0}}, {0, 1, 2, 0, 3, 1}};
            if (lift == 0.0f) m.indices[4] = 2;
            if (turned)
                m.indices = {m.indices[3], m.indices[4], m.indices[5], m.indices[0], m.indices[1], m.indices[2]};
            const auto mesh = prepare(m);
            ASSERT_TRUE(mesh);
            EXPECT_EQ(mesh->triangles.size(), 2u);
            EXPECT_EQ(mesh->unlitVertices, lift == 0.0f ? 1u : 0u);
            for (const int shared : {0, 1}) {
                ASSERT_NE(mesh->vertexRow[shared], kNoRow);
                EXPECT_NEAR(mesh->rows[mesh->vertexRow[shared]].normal.z, turned ? -1.0f : 1.0f, 1e-6f);
            }
        }
    }
    // Of a corner that is nearly as sharp the mean is what is left: three slopes of a needle point along it.
    const float h = 1e3f;
    const auto needle =
        prepare({{{0, 0, h}, {1, 0, 0}, {-0.5f, 0.8660254f, 0}, {-0.5f, -0.8660254f, 0}}, {0, 1, 2, 0, 2, 3, 0, 3, 1}});
    EXPECT_GT(needle->rows[needle->vertexRow[0]].normal.z, 0.9999f);
}

TEST(BakeMesh, WhatIsFarFromTheOriginIsSaidToBeCoarse) {
    const auto moved = [](float by) {
        Mesh m = test::plate(2);
        for (glm::vec3& p : m.positions) p += by;
        return m;
    };
    const double diagonal = prepare(moved(0))->diagonal;
    EXPECT_LT(coarseness(moved(0)), 1e-6);
    EXPECT_NEAR(coarseness(moved(1024)) * diagonal, 0x1p-13, 0x1p-20);
    EXPECT_EQ(coarseness({}), 0.0);
    const auto refused = prepare(moved(1e9f));
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("move it to the origin"), std::string::npos) << refused.error().message;
}

TEST(BakeMesh, HashTellsMeshesApart) {
    const Mesh a = test::plate(2);
    Mesh b = a, c = a;
    b.positions[3].x = std::nextafter(b.positions[3].x, 9.0f);
    std::swap(c.indices[0], c.indices[1]);
    EXPECT_NE(prepare(a)->hash, prepare(b)->hash);
    EXPECT_NE(prepare(a)->hash, prepare(c)->hash);
    EXPECT_NE(directionHash({MappingKind::HemiSphere, 16}), directionHash({MappingKind::HemiSphere, 18}));
    EXPECT_NE(directionHash({MappingKind::SinglePlane, 16, 1.0}), directionHash({MappingKind::SinglePlane, 16, 1.1}));
}

TEST(BakeMesh, BadMeshesAreRefusedInWords) {
    const auto refused = [](Mesh m, const char* words) {
        const auto answer = prepare(m);
        ASSERT_FALSE(answer);
        EXPECT_NE(answer.error().message.find(words), std::string::npos) << answer.error().message;
        EXPECT_EQ(answer.error().kind, Error::Kind::BadInput);
    };
    refused({}, "no triangles");
    refused({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1}}, "three for each triangle");
    refused({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 1000000000}}, "vertex 1000000000");
    refused({{{0, 0, 0}, {1, 0, 0}, {0, std::nanf(""), 0}}, {0, 1, 2}}, "vertex 2");
    refused({{{0, 0, 0}, {1, 0, 0}, {0, 1e30f, 0}}, {0, 1, 2}}, "above 1e18");
    refused({{{0, 0, 0}, {std::numeric_limits<float>::infinity(), 0, 0}, {0, 1, 0}}, {0, 1, 2}}, "vertex 1");
    refused({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {0, 1, 2}}, "degenerate");
}

}  // namespace
}  // namespace umbriel::visibility
