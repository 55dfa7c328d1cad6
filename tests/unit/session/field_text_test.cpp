#include "client/session/field_text.h"

#include "tests/unit/session/scene_fixture.h"

namespace umbriel {
namespace {

class FieldText : public SceneFixture {
 protected:
    FieldText() { viewport = aspect.create<Viewport>("port"); }
    Ref<Viewport> viewport;
    std::string refusal(std::string_view field, std::string_view value) {
        const auto set = setField(aspect, viewport, field, value);
        EXPECT_TRUE(set.has_error()) << field << '=' << value;
        EXPECT_EQ(set.error().kind, Error::Kind::BadInput);
        return set.error().message;
    }
};

TEST_F(FieldText, SetsFieldsOfEveryWritableKindAsEdits) {
    aspect.commit();
    ASSERT_TRUE(setField(aspect, viewport, "mapSize", "2048"));
    ASSERT_TRUE(setField(aspect, viewport, "offBias", "0.25"));
    ASSERT_TRUE(setField(aspect, viewport, "shadowOn", "false"));
    ASSERT_TRUE(setField(aspect, viewport, "shadowColor", "0.5,0,-1"));
    ASSERT_TRUE(setField(aspect, viewport, "shadowFit", "1"));
    const Viewport& now = aspect.get(viewport);
    EXPECT_EQ(now.mapSize.get(), 2048u);
    EXPECT_EQ(now.offBias.get(), 0.25f);
    EXPECT_FALSE(now.shadowOn.get());
    EXPECT_EQ(now.shadowColor.get(), glm::vec3(0.5f, 0.0f, -1.0f));
    EXPECT_EQ(now.shadowFit.get(), ShadowFitMode::Scene);
    EXPECT_FALSE(aspect.commit().empty());
}

TEST_F(FieldText, RefusesWhatDoesNotFitNamingWhatThereIs) {
    for (const char* value : {"", "-1", "1.5", "4294967296", "12 ", "x"}) refusal("mapSize", value);
    for (const char* value : {"", "nan", "inf", "1e99", "1,2"}) refusal("offBias", value);
    for (const char* value : {"1,2", "1,2,3,4", "1,,3", "a,b,c"}) refusal("shadowColor", value);
    refusal("shadowOn", "yes");
    refusal("shadowFit", "3");
    EXPECT_NE(refusal("noSuchField", "1").find("mapSize"), std::string::npos);
    refusal("root", "1");          // a reference
    refusal("excludeNodes", "1");  // a list
    EXPECT_TRUE(hasField(aspect, viewport, "mapSize"));
    EXPECT_FALSE(hasField(aspect, viewport, "excludeNodes"));
    EXPECT_FALSE(hasField(aspect, {}, "mapSize"));
}

}  // namespace
}  // namespace umbriel
