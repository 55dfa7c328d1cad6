#include "client/app/arguments.h"

#include <gtest/gtest.h>

namespace umbriel {
namespace {

TEST(Arguments, SizesAreTwoPositiveNumbers) {
    EXPECT_EQ(parseSize("--size", "1277x719").value(), (PixelSize{1277, 719}));
    for (const char* bad : {"", "x", "0x5", "5x0", "-1x5", "1280", "1280x720x3", "1e3x5", "5x 5", "65537x1", "99999999999x1"})
        EXPECT_FALSE(parseSize("--size", bad)) << bad;
}

TEST(Arguments, ColoursHave8Or16Or32Bits) {
    EXPECT_EQ(parseColourBits(8).value(), ColourPrecision::Byte);
    EXPECT_EQ(parseColourBits(16).value(), ColourPrecision::Half);
    EXPECT_EQ(parseColourBits(32).value(), ColourPrecision::Float);
    for (const int bad : {-8, 0, 1, 10, 24, 64}) {
        const auto refused = parseColourBits(bad);
        ASSERT_FALSE(refused) << bad;
        EXPECT_EQ(refused.error().kind, Error::Kind::BadInput);
        EXPECT_NE(refused.error().message.find("--colour-bits"), std::string::npos);
    }
}

TEST(Arguments, ErrorsNameTheArgumentAndWhatWasGiven) {
    const auto result = parseSize("--size", "big");
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind, Error::Kind::BadInput);
    EXPECT_NE(result.error().message.find("--size 'big'"), std::string::npos);
}

TEST(Arguments, DirectionalLightsAreNormalisedAtAnyScale) {
    for (const char* text : {"dir:0,-2,0", "dir:0,-1e-300,0", "dir:0,-1e300,0"}) {
        const auto light = parseLight(text);
        ASSERT_TRUE(light) << text;
        EXPECT_EQ(light->direction, glm::dvec3(0, -1, 0)) << text;
        EXPECT_FALSE(light->power);
    }
}

TEST(Arguments, SpotLightsHaveAFullConeAngleAndAnOptionalRadius) {
    const auto light = parseLight("spot:1,2,3:0,0,-1:90@4,5,6,radius=0.5");
    ASSERT_TRUE(light);
    EXPECT_EQ(light->kind, LightArgument::Kind::Spot);
    EXPECT_EQ(light->position, glm::dvec3(1, 2, 3));
    EXPECT_DOUBLE_EQ(light->coneAngle, 1.5707963267948966);
    EXPECT_EQ(*light->power, glm::vec3(4, 5, 6));
    EXPECT_EQ(light->radius, 0.5f);
}

TEST(Arguments, ImpossibleLightsAreRefused) {
    for (const char* bad : {"", "dir", "dir:0,0,0", "dir:1,2", "dir:nan,0,0", "point:inf,0,0", "spot:0,0,0:0,0,1",
                            "spot:0,0,0:0,0,1:0", "spot:0,0,0:0,0,1:181", "spot:0,0,0:0,0,0:40", "sun:1,1,1",
                            "dir:0,1,0@-1,1,1", "dir:0,1,0@1,1", "dir:0,1,0@1,1,1,radius=-1", "dir:0,1,0@1e300,1,1"})
        EXPECT_FALSE(parseLight(bad)) << bad;
}

TEST(Arguments, ServersMayBeNamedAndIPv6) {
    const auto servers = parseServers("left=render1:7420,[::1]:7421");
    ASSERT_TRUE(servers);
    ASSERT_EQ(servers->size(), 2u);
    EXPECT_EQ((*servers)[0].name, "left");
    EXPECT_EQ((*servers)[0].host, "render1");
    EXPECT_EQ((*servers)[0].port, 7420);
    EXPECT_EQ((*servers)[1].host, "::1");
    for (const char* bad : {"", "host", "host:", ":7420", "host:0", "host:65536", "=host:1", "a:1,,b:2", "::1:7421"})
        EXPECT_FALSE(parseServers(bad)) << bad;
}

// The same server twice would draw against itself; the handshake alone would say so in terms of epochs.
TEST(Arguments, NoServerIsThereTwice) {
    for (const auto& [bad, which] : {std::pair{"a:1,b:2,a:1", "a:1"},
                                     {"left=a:1,left=b:2", "left"},
                                     {"left=a:1,right=a:1", "right"},
                                     {"[::1]:5,[::1]:5", "[::1]:5"}}) {
        const auto servers = parseServers(bad);
        ASSERT_FALSE(servers) << bad;
        EXPECT_EQ(servers.error().kind, Error::Kind::BadInput);
        EXPECT_NE(servers.error().message.find(std::string(which) + " is there twice"), std::string::npos)
            << servers.error().message;
    }
    EXPECT_FALSE(parseServers("left,left", true));
    EXPECT_TRUE(parseServers("left,right", true));
    EXPECT_TRUE(parseServers("a:1,a:2,b:1"));
}

// A number that a double holds and a float does not would be infinity, and infinity times 0 no number.
TEST(Arguments, ColoursAreFiniteFloatsAndTakeNoLightAway) {
    EXPECT_EQ(parseColour("--background", "0,0.5,1e30").value(), glm::vec3(0.0f, 0.5f, 1e30f));
    for (const char* bad : {"", "1,2", "1,2,3,4", "-1,0,0", "0,0,1e39", "nan,0,0", "0,inf,0"}) {
        const auto colour = parseColour("--background", bad);
        ASSERT_FALSE(colour) << bad;
        EXPECT_NE(colour.error().message.find("--background '" + std::string(bad) + "'"), std::string::npos)
            << colour.error().message;
    }
}

TEST(Arguments, ShadowModesOfLaterVersionsAreRefusedAsSuch) {
    EXPECT_EQ(parseShadowMode("std").value(), ShadowMode::Standard);
    EXPECT_EQ(parseShadowMode("NO_SHADOW").value(), ShadowMode::None);
    EXPECT_EQ(parseShadowMode("lisp").value(), ShadowMode::LightSpacePerspective);
    EXPECT_EQ(parseShadowMode("zfail").value(), ShadowMode::VolumeZFail);
    EXPECT_NE(parseShadowMode("visibility-map").error().message.find("this version"), std::string::npos);
    EXPECT_FALSE(parseShadowMode("nonsense"));
}

TEST(Arguments, LayersAreAMaskThatAlwaysHasColour) {
    EXPECT_EQ(parseLayers("depth,ids").value(), 1u | 2u | 16u);
    EXPECT_FALSE(parseLayers("depth,"));
}

}  // namespace
}  // namespace umbriel
