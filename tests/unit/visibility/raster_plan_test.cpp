// What a rasteriser draws: that its texels look where the mappings' pixels look, and that culling loses nothing.
#include "common/visibility/raster_plan.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "common/visibility/chag.h"
#include "common/visibility/triangle_cells.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel::visibility {
namespace {

const RasterView& viewOf(const RasterPlan& plan, std::uint32_t texel) {
    const std::uint32_t row = texel / plan.width;
    return *std::ranges::find_if(plan.views,
                                 [&](const RasterView& v) { return row >= v.bottom && row < v.bottom + v.height; });
}

glm::dvec3 directionOf(const RasterPlan& plan, std::uint32_t texel) {
    const RasterView& v = viewOf(plan, texel);
    const double i = texel % plan.width, j = texel / plan.width - v.bottom;
    return glm::normalize(v.out + (v.x0 + (v.x1 - v.x0) * (i + 0.5) / v.width) * v.along +
                          (v.y0 + (v.y1 - v.y0) * (j + 0.5) / v.height) * v.up);
}

TEST(RasterPlan, TexelsOfPlanesLookWherePixelsLook) {
    for (const Mapping& m :
         {Mapping{MappingKind::HemiCube, 2}, Mapping{MappingKind::HemiCube, 14},
          Mapping{MappingKind::SinglePlane, 16, 2.6}, Mapping{MappingKind::Cube, 2}, Mapping{MappingKind::Cube, 10}}) {
        const RasterPlan plan = rasterPlan(m);
        ASSERT_EQ(plan.texel.size(), pixelCount(m));
        EXPECT_EQ(std::set(plan.texel.begin(), plan.texel.end()).size(), pixelCount(m));
        for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
            ASSERT_LT(plan.texel[p], plan.width * plan.height);
            EXPECT_LT(glm::length(directionOf(plan, plan.texel[p]) - direction(m, p)), 1e-12)
                << name(m.kind) << " " << p;
            EXPECT_EQ(viewOf(plan, plan.texel[p]).lower,
                      directionSide(m) == DirectionSide::Own && direction(m, p).z < 0);
        }
    }
}

TEST(RasterPlan, CopiedTexelsLookNearlyThere) {
    for (const std::uint32_t s : {8u, 32u, 64u}) {
        for (const Mapping& m : {Mapping{MappingKind::HemiSphere, s}, Mapping{MappingKind::Octahedral, s},
                                 Mapping{MappingKind::Fibonacci, s * s}}) {
            const RasterPlan plan = rasterPlan(m);
            ASSERT_EQ(plan.texel.size(), pixelCount(m));
            // The texel in the middle of a face is the largest: 2 / size of the cube, its corner half a diagonal away.
            const double farthest = std::sqrt(2.0) / plan.width;
            for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
                EXPECT_LT(glm::length(directionOf(plan, plan.texel[p]) - direction(m, p)), farthest) << name(m.kind);
            }
            if (m.kind == MappingKind::HemiSphere) {
                EXPECT_LT(farthest, 0.25 * std::numbers::pi / s);
            }
        }
    }
}

TEST(TriangleCells, HoldEveryTriangleOnceInItsBox) {
    for (const Mesh& loaded : {test::cloth(60, 30), test::plate(9), test::box(1, false), test::accordion(5, 8, 0.1f)}) {
        const auto mesh = prepare(loaded);
        for (const std::uint32_t perCell : {1u, 16u, 100000u}) {
            const TriangleCells cells = TriangleCells::make(mesh->view(), perCell);
            const auto key = [](const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
                return std::array{a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z};
            };
            std::map<std::array<float, 9>, int> count;
            for (const glm::uvec3& t : mesh->triangles) {
                ++count[key(mesh->positions[t.x], mesh->positions[t.y], mesh->positions[t.z])];
            }
            std::uint32_t next = 0;
            for (const TriangleCells::Cell& cell : cells.cells) {
                EXPECT_EQ(cell.firstIndex, next);
                EXPECT_GT(cell.indexCount, 0u);
                next += cell.indexCount;
                for (std::uint32_t i = cell.firstIndex; i < next; i += 3) {
                    const glm::vec3 a = cells.positions[cells.indices[i]], b = cells.positions[cells.indices[i + 1]],
                                    c = cells.positions[cells.indices[i + 2]];
                    --count[key(a, b, c)];
                    for (const glm::vec3& p : {a, b, c}) {
                        EXPECT_TRUE(glm::all(glm::lessThanEqual(glm::abs(p - cell.centre), cell.halfSize + 1e-6f)));
                    }
                }
            }
            EXPECT_EQ(next, cells.indices.size());
            for (const auto& [triangle, left] : count) EXPECT_EQ(left, 0);
        }
    }
}

// A cell that is left out has no point in the view: no corner of its triangles, and so no triangle across it unless the
// planes part them.
RC_GTEST_PROP(TriangleCells, CullingKeepsWhatAViewShows, ()) {
    static const BakeMesh mesh = *prepare(test::cloth(40, 20));
    static const TriangleCells cells = TriangleCells::make(mesh.view(), 8);
    const auto row = *rc::gen::inRange<std::uint32_t>(0, static_cast<std::uint32_t>(mesh.rows.size()));
    const double radius = *rc::gen::element(0.05, 0.3, 1.0, 1e30) * mesh.diagonal;
    const RasterPlan plan = rasterPlan({MappingKind::HemiCube, 8});
    const trace::Origin o = origin(mesh, row, DirectionFrame::Vertex);
    const glm::dvec3 eye(mesh.positions[o.position]);
    for (const RasterView& v : plan.views) {
        const glm::dmat3 axes(o.axes);
        const glm::dvec3 out = axes * v.out, along = axes * v.along, up = axes * v.up;
        const ViewPyramid pyramid{glm::vec3(eye),
                                  {glm::vec3(along - v.x0 * out), glm::vec3(v.x1 * out - along),
                                   glm::vec3(up - v.y0 * out), glm::vec3(v.y1 * out - up)},
                                  static_cast<float>(radius),
                                  0.0f};
        for (const TriangleCells::Cell& cell : cells.cells) {
            if (pyramid.mayShow(cell)) continue;
            for (std::uint32_t i = cell.firstIndex; i < cell.firstIndex + cell.indexCount; ++i) {
                const glm::dvec3 p = glm::dvec3(cells.positions[cells.indices[i]]) - eye;
                const double x = glm::dot(p, along), y = glm::dot(p, up), w = glm::dot(p, out);
                const double rounding = 1e-6 * mesh.diagonal;
                RC_ASSERT(!(x > v.x0 * w + rounding && x < v.x1 * w - rounding && y > v.y0 * w + rounding &&
                            y < v.y1 * w - rounding && glm::length(p) < radius - rounding));
            }
        }
    }
}

// The whole cube that the near planes cut off stays clear of a funnel's walls, however it is turned.
TEST(CameraHeight, AllAroundKeepsItsDistance) {
    const double near = 0.01;
    for (double alpha = 0.05; alpha < 3.0; alpha += 0.05) {
        const double lift = cameraHeightAllAround(alpha, near, 1e-6);
        // Distance of the point `lift` above the apex to a line that leaves the apex at alpha.
        const double distance = alpha < std::numbers::pi / 2 ? lift * std::sin(alpha) : lift;
        EXPECT_GE(distance * (1 + 1e-12), std::sqrt(3.0) * near) << alpha;
    }
}

}  // namespace
}  // namespace umbriel::visibility
