#include "client/app/viewport_text.h"

#include <gtest/gtest.h>

namespace umbriel {
namespace {

TEST(ViewportText, FieldsOfViewportsTakeTheNamesOfTheirValues) {
    EXPECT_EQ(viewportFieldText("shadowMode", "lisp").value(), "3");
    EXPECT_EQ(viewportFieldText("filteredMap", "TRAPEZ_SHADOW_MAP").value(), "4");
    EXPECT_EQ(viewportFieldText("shadowFit", "scene").value(), "1");
    EXPECT_EQ(viewportFieldText("shadowFit", "per-view").value(), "2");
    EXPECT_EQ(viewportFieldText("show", "edge-map").value(), "5");
    for (const char* field : {"shadowMode", "shadowFit", "show", "gauss"}) {
        EXPECT_EQ(viewportFieldText(field, "3").value(), "3");
    }
    EXPECT_EQ(viewportFieldText("planeNormal", "0,1,0").value(), "0,1,0");
    EXPECT_EQ(viewportFieldText("foo", "lisp").value(), "lisp");  // setField() says what fields there are
    for (const char* field : {"shadowMode", "filteredMap", "shadowFit", "show"})
        EXPECT_FALSE(viewportFieldText(field, "nonsense")) << field;
}

TEST(ViewportText, FitsAreReadByTheNamesTheyAreShownWith) {
    for (const ShadowFitMode fit : {ShadowFitMode::Union, ShadowFitMode::Scene, ShadowFitMode::PerView})
        EXPECT_EQ(parseShadowFit(nameOf(fit)).value(), fit);
}

}  // namespace
}  // namespace umbriel
