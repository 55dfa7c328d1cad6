#include "tests/unit/visibility/closed_forms.h"

#include <gtest/gtest.h>

#include <numbers>

namespace umbriel::visibility {
namespace {

// The project's promise at about 1024 directions of the hemisphere.
TEST(ClosedForms, WallAndCapAtAThousandDirections) {
    for (const Mapping& m : {Mapping{MappingKind::HemiSphere, 32}, Mapping{MappingKind::HemiCube, 18},
                             Mapping{MappingKind::Cube, 18}, Mapping{MappingKind::Octahedral, 46}}) {
        const test::FormErrors e = test::formErrors(m);
        EXPECT_LE(e.wall, 0.0028) << name(m.kind);
        EXPECT_LE(e.cap, 0.0028) << name(m.kind);
    }
    const test::FormErrors e = test::formErrors({MappingKind::Fibonacci, 1024});
    EXPECT_LE(e.wall, 0.0018);
    EXPECT_LE(e.cap, 0.0018);
}

// Four times the directions halve the pitch; the error of an edge falls by more, as pixels err to both sides. A wrong
// closed form would leave an error that stays.
TEST(ClosedForms, MoreDirectionsErrLess) {
    for (const MappingKind kind : {MappingKind::HemiSphere, MappingKind::HemiCube}) {
        const test::FormErrors coarse = test::formErrors({kind, 16}, 1000), fine = test::formErrors({kind, 64}, 1000);
        EXPECT_LT(fine.wall, 0.25 * coarse.wall) << name(kind);
        EXPECT_LT(fine.cap, 0.25 * coarse.cap) << name(kind);
    }
}

// Its rim is lost, which no number of directions brings back.
TEST(ClosedForms, SinglePlaneKeepsAnErrorOfItsRim) {
    const double fovy = 150.0 * std::numbers::pi / 180.0;
    EXPECT_GT(test::formErrors({MappingKind::SinglePlane, 128, fovy}, 500).wall, 0.01);
}

}  // namespace
}  // namespace umbriel::visibility
