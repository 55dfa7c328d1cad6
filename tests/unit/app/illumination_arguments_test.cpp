#include "client/app/illumination_arguments.h"

#include <gtest/gtest.h>

#include <cmath>

#include "client/app/arguments.h"

namespace umbriel {
namespace {

TEST(IlluminationArguments, EveryModelAndFrequencyHasANameThatIsRead) {
    for (std::uint32_t i = 0; i < kEnumCount<ReflectionModel>; ++i) {
        const auto model = static_cast<ReflectionModel>(i);
        const auto parsed = parseReflectionModel(nameOf(model));
        ASSERT_TRUE(parsed) << i;
        EXPECT_EQ(*parsed, model);
    }
    for (std::uint32_t i = 0; i < kEnumCount<ShadingFrequency>; ++i) {
        const auto parsed = parseShading(nameOf(static_cast<ShadingFrequency>(i)));
        ASSERT_TRUE(parsed) << i;
        EXPECT_EQ(*parsed, static_cast<ShadingFrequency>(i));
    }
    const auto unknown = parseReflectionModel("cook");
    ASSERT_FALSE(unknown);
    EXPECT_NE(unknown.error().message.find("torrance-sparrow"), std::string::npos) << "the message lists what there is";
}

TEST(IlluminationArguments, FogHasALawItsNumbersAndMaybeAColour) {
    const auto linear = parseFog("linear:2:10@0.1,0.2,0.3");
    ASSERT_TRUE(linear);
    EXPECT_EQ(linear->mode, FogMode::Linear);
    EXPECT_EQ(linear->start, 2.0f);
    EXPECT_EQ(linear->end, 10.0f);
    EXPECT_EQ(linear->colour, glm::vec3(0.1f, 0.2f, 0.3f));
    const auto squared = parseFog("exp2:0.25");
    ASSERT_TRUE(squared);
    EXPECT_EQ(squared->mode, FogMode::SquaredExponential);
    EXPECT_EQ(squared->density, 0.25f);
    EXPECT_FALSE(squared->colour);
    EXPECT_EQ(parseFog("quadratic:0:5")->mode, FogMode::Quadratic);
    for (const char* bad : {"", "mist:1", "linear:1", "linear:5:2", "linear:1:2:3", "exp", "exp:-1", "exp:nan",
                            "exp2:inf", "exp:1@1,2", "exp:1@-1,0,0", "linear:a:b"})
        EXPECT_FALSE(parseFog(bad)) << bad;
}

TEST(IlluminationArguments, LightsTakeTheirFormsAsKeys) {
    const auto spot =
        parseLight("spot:1,2,3:0,-1,0:120@4,5,6,exponent=20,attenuation=1/0.5/0.25,ambient=0.1,highlight=0.5");
    ASSERT_TRUE(spot);
    EXPECT_EQ(spot->exponent, 20.0f);
    EXPECT_FALSE(spot->isProduct);
    EXPECT_EQ(spot->attenuation, glm::vec3(1.0f, 0.5f, 0.25f));
    EXPECT_EQ(spot->ambientShare, 0.1f);
    EXPECT_EQ(spot->highlightShare, 0.5f);
    EXPECT_EQ(spot->power, glm::vec3(4, 5, 6));
    const auto product = parseLight("spot:1,2,3:0,-1,0:40@product=3");
    ASSERT_TRUE(product);
    EXPECT_TRUE(product->isProduct);
    EXPECT_FALSE(product->power);
    EXPECT_TRUE(parseLight("spot:0,0,0:0,0,-1:360@exponent=2")) << "an exponent's cone may be a whole ball";
    for (const char* bad :
         {"point:0,0,0@1,1", "point:0,0,0@exponent=2", "dir:0,0,1@attenuation=1/0/0", "point:0,0,0@attenuation=1/0",
          "point:0,0,0@attenuation=1/-1/0", "point:0,0,0@1,1,1,size=2", "spot:0,0,0:0,0,1:60@exponent=-1",
          "spot:0,0,0:0,0,1:60@exponent=1e7", "spot:0,0,0:0,0,1:200", "point:0,0,0@highlight=nan", "point:0,0,0@"})
        EXPECT_FALSE(parseLight(bad)) << bad;
}

TEST(IlluminationArguments, AGoniometricLightNamesAFileThatMayHoldColonsAndAts) {
    const auto light = parseLight("goniometric:C:/a@b/lamp.ies:1,2,3:0,-2,0@1,1,1,turn=90,scale=0.5");
    ASSERT_TRUE(light);
    EXPECT_EQ(light->kind, LightArgument::Kind::Goniometric);
    EXPECT_EQ(light->file, "C:/a@b/lamp.ies");
    EXPECT_EQ(light->position, glm::dvec3(1, 2, 3));
    EXPECT_EQ(light->direction, glm::dvec3(0, -1, 0));
    EXPECT_NEAR(light->turn, std::acos(0.0), 1e-7);
    EXPECT_EQ(light->scale, 0.5f);
    EXPECT_EQ(parseLight("goniometric:a@b.ies:1,2,3:0,-2,0")->file, "a@b.ies");
    EXPECT_FALSE(parseLight("goniometric:lamp.ies:1,2,3"));
    EXPECT_FALSE(parseLight("goniometric:lamp.ies:1,2,3:0,0,0"));
}

}  // namespace
}  // namespace umbriel
