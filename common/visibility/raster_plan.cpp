#include "common/visibility/raster_plan.h"

#include <algorithm>
#include <cmath>

#include "common/base/assert.h"
#include "common/visibility/cube.h"
#include "common/visibility/cube_face.h"

namespace umbriel::visibility {
namespace {

constexpr int kTop = 4, kBottom = 5;  // of faceAxes()

void add(RasterPlan& plan, const FaceAxes& side, double y0, double y1, std::uint32_t s, bool lower) {
    RasterView view{side.out, side.along, side.up};
    view.y0 = y0;
    view.y1 = y1;
    view.width = s;
    view.height = y1 - y0 > 1.5 ? s : s / 2;
    view.bottom = plan.height;
    view.lower = lower;
    plan.width = std::max(plan.width, view.width);
    plan.height += view.height;
    plan.views.push_back(view);
}

// In the order of the mapping's pixels, so that texel i of the tile is pixel i.
RasterPlan hemiCubeViews(std::uint32_t s) {
    RasterPlan plan;
    add(plan, faceAxes(kTop), -1, 1, s, false);
    for (int side = 0; side < 4; ++side) add(plan, faceAxes(side), 0, 1, s, false);
    return plan;
}

// Both halves of each side of a cube, each from its own side of the surface.
RasterPlan twoHemiCubes(std::uint32_t s) {
    RasterPlan plan;
    for (int side = 0; side < 4; ++side) {
        add(plan, faceAxes(side), -1, 0, s, true);
        add(plan, faceAxes(side), 0, 1, s, false);
    }
    add(plan, faceAxes(kTop), -1, 1, s, false);
    add(plan, faceAxes(kBottom), -1, 1, s, true);
    return plan;
}

RasterPlan wholeCube(std::uint32_t s) {
    RasterPlan plan;
    for (int side = 0; side < 6; ++side) add(plan, faceAxes(side), -1, 1, s, false);
    plan.allAround = true;
    return plan;
}

void copyAll(RasterPlan& plan, std::uint32_t pixels) {
    plan.texel.resize(pixels);
    for (std::uint32_t p = 0; p < pixels; ++p) plan.texel[p] = p;
}

std::uint32_t even(double size) {
    return 2 * static_cast<std::uint32_t>(std::ceil(0.5 * size));
}

}  // namespace

RasterPlan rasterPlan(const Mapping& m) {
    switch (m.kind) {
        case MappingKind::HemiCube: {
            RasterPlan plan = hemiCubeViews(m.size);
            copyAll(plan, pixelCount(m));
            return plan;
        }
        case MappingKind::Cube: {
            RasterPlan plan = twoHemiCubes(m.size);
            copyAll(plan, pixelCount(m));
            return plan;
        }
        case MappingKind::SinglePlane: {
            RasterPlan plan;
            add(plan, faceAxes(kTop), -1, 1, m.size, false);
            RasterView& view = plan.views.front();
            view.x1 = view.y1 = std::tan(0.5 * m.fovy);
            view.x0 = view.y0 = -view.x1;
            copyAll(plan, pixelCount(m));
            return plan;
        }
        case MappingKind::Octahedral: {
            // Its pixels are about as wide as those of a cube of half its size.
            const std::uint32_t s = even(1.5 * m.size);
            RasterPlan plan = wholeCube(s);
            for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
                plan.texel.push_back(*cube::pixelOf(s, direction(m, p)));
            }
            return plan;
        }
        default: {
            const std::uint32_t s =
                m.kind == MappingKind::HemiSphere ? 2 * m.size : even(2.0 * std::sqrt(static_cast<double>(m.size)));
            RasterPlan plan = hemiCubeViews(s);
            plan.texel = sourceTable({MappingKind::HemiCube, s}, m);
            UMBRIEL_ASSERT(std::ranges::count(plan.texel, kNoSource) == 0, "a HemiCube sees all of the hemisphere");
            return plan;
        }
    }
}

}  // namespace umbriel::visibility
