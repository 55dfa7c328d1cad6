#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/image/exr_io.h"
#include "tests/e2e/run_program.h"

namespace umbriel::e2e {
namespace {

// What --explain says of the one shader variant of a torus.
std::string variantOf(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"render", "demo:torus?n=8", "--size", "64x48", "--explain"});
    const Outcome outcome = run("umbriel", arguments);
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("shader variants: 1"), std::string::npos) << outcome.out;
    const std::size_t at = outcome.out.find(" items: ");
    return at == std::string::npos ? "" : outcome.out.substr(at + 8, outcome.out.find('\n', at) - at - 8);
}

std::vector<std::string> wordsOf(const std::string& text) {
    std::istringstream stream(text);
    std::vector<std::string> words;
    for (std::string word; stream >> word;) words.push_back(word);
    std::sort(words.begin(), words.end());
    return words;
}

// How lights come to a shader, beside what they are: "1-light" to "4-lights", and the way that one driver is given them.
bool saysHowLightsCome(const std::string& word) {
    return word == "passed-constants" ||
           (word.size() > 2 && std::isdigit(static_cast<unsigned char>(word[0])) && word[1] == '-');
}

// What one text has beyond the other; not how lights come.
std::vector<std::string> added(const std::string& to, const std::string& from) {
    std::vector<std::string> difference;
    const auto a = wordsOf(to), b = wordsOf(from);
    std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(difference));
    std::erase_if(difference, saysHowLightsCome);
    return difference;
}

using Words = std::vector<std::string>;

TEST(Illumination, AddingAFeatureAddsExactlyThat) {
    const std::string none = variantOf({"--light", "none", "--model", "lambert"});
    EXPECT_EQ(wordsOf(none), (Words{"lambert", "normals"})) << "no lights, no textures, no fog: none of their code";
    const std::string sun = variantOf({"--light", "dir:0,-1,-1", "--model", "lambert"});
    EXPECT_EQ(added(sun, none), Words{"directional"});
    const auto withLight = [&](const std::string& light) {
        return added(variantOf({"--light", "dir:0,-1,-1", "--light", light, "--model", "lambert"}), sun);
    };
    EXPECT_EQ(withLight("dir:1,0,0"), Words{});
    EXPECT_EQ(withLight("point:0,3,0"), Words{"point"});
    EXPECT_EQ(withLight("spot:0,3,0:0,-1,0:60"), Words{"spot"});
    EXPECT_EQ(withLight("spot:0,3,0:0,-1,0:60@exponent=3"), (Words{"spot", "spot-exponent"}));
    EXPECT_EQ(withLight("point:0,3,0@attenuation=1/0/1"), (Words{"attenuation", "point"}));
    EXPECT_EQ(withLight("point:0,3,0@ambient=0.1"), (Words{"light-ambient", "point"}));
    EXPECT_EQ(withLight("point:0,3,0@highlight=0.1"), (Words{"light-highlights", "point"}));
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), {"--light", "dir:0,-1,-1", "--model", "lambert"});
        return added(variantOf(more), sun);
    };
    EXPECT_EQ(with({"--fog", "linear:1:9"}), Words{"linear-fog"});
    EXPECT_EQ(with({"--fog", "quadratic:1:9"}), Words{"quadratic-fog"});
    EXPECT_EQ(with({"--fog", "exp:0.2"}), Words{"exponential-fog"});
    EXPECT_EQ(with({"--fog", "exp2:0.2"}), Words{"squared-exponential-fog"});
    EXPECT_EQ(with({"--shading", "gouraud"}), Words{"vertex-shading"});
    EXPECT_EQ(with({"--shading", "flat"}), (Words{"flat", "vertex-shading"}));
    EXPECT_EQ(with({"--shading", "flat-mean"}), Words{"flat-mean"});
    EXPECT_EQ(with({"--shadow", "std"}), Words{"shadows"});
}

TEST(Illumination, AModelReplacesTheOtherAndAddsNothing) {
    const std::string own = variantOf({"--light", "dir:0,-1,-1"});
    for (const char* model :
         {"torrance-sparrow", "lambert", "phong", "phong-gated", "blinn-phong", "schlick", "normalised-phong",
          "phong-brdf", "lafortune", "phong-original", "general-sum", "opengl-sum"}) {
        const std::string other = variantOf({"--light", "dir:0,-1,-1", "--model", model});
        EXPECT_EQ(added(other, own), Words{model});
        EXPECT_EQ(added(own, other), Words{"metallic-roughness"}) << model;
    }
}

TEST(Illumination, AGoniometricLightLightsTheSceneFromItsFile) {
    const char* shared = std::getenv("UMBRIEL_SHARED");
    if (!shared) GTEST_SKIP() << "UMBRIEL_SHARED is not set: no photometric files";
    const std::string file = std::string(shared) + "/data/photometric/vee.ies";
    const TemporaryFolder folder;
    const Outcome outcome =
        run("umbriel", {"render", "demo:torus?n=32", "--size", "64x48", "--light",
                        "goniometric:" + file + ":0,3,0:0,-1,0", "--out", folder / "a.exr", "--explain"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("goniometric"), std::string::npos) << outcome.out;
    const auto image = readExr(folder / "a.exr");
    ASSERT_TRUE(image);
    float brightest = 0.0f;
    for (const float value : image->rgba.samples()) brightest = std::max(brightest, value);
    EXPECT_GT(brightest, 0.05f);
}

TEST(Illumination, BadLightsFogsAndModelsAreRefusedWithCodeTwo) {
    for (const std::vector<std::string>& bad : {std::vector<std::string>{"--model", "cook"},
                                                {"--shading", "cel"},
                                                {"--fog", "linear:5:1"},
                                                {"--light", "goniometric:/nowhere.ies:0,0,0:0,-1,0"},
                                                {"--light", "point:0,0,0@attenuation=1/-1/0"}}) {
        std::vector<std::string> arguments{"render", "demo:torus?n=8", "--size", "32x18"};
        arguments.insert(arguments.end(), bad.begin(), bad.end());
        const Outcome outcome = run("umbriel", arguments);
        EXPECT_EQ(outcome.exitCode, 2) << bad[1] << outcome.err;
        EXPECT_FALSE(outcome.err.empty());
    }
}

TEST(Illumination, WrongMaterialValuesAreRepairedWithAMessageThatSaysWhich) {
    const TemporaryFolder folder;
    writeFile(folder / "a.mtl", "newmtl odd\nKd 0.5 -1 0.5\nKs 0.1 0.1 0.1\nNs -4\n");
    writeFile(folder / "a.obj", "mtllib a.mtl\nusemtl odd\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const Outcome outcome = run("umbriel", {"render", folder / "a.obj", "--size", "16x16", "--out", folder / "a.exr"});
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("Kd"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("Ns"), std::string::npos) << outcome.err;
}

TEST(Models, TheSheetsFiguresHoldWhatTheTextbookSays) {
    const TemporaryFolder folder;
    const Outcome outcome = run("umbriel", {"models", "demo:torus?n=16", "--size", "96x72", "--frames", "1", "--out",
                                            folder / "sheet.png", "--json"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    const auto report = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(report["cases"].size(), 16u);
    double gouraud = 0.0, flat = 0.0;
    for (const auto& one : report["cases"]) {
        EXPECT_GT(one["judged"], 0.99);
        if (one["shading"] == "phong")
            EXPECT_LT(one["max_error"], 2e-4) << one.dump();  // float against double, per pixel
        else
            EXPECT_GT(one["rmse"], 1e-3) << one.dump();
        if (one["shading"] == "gouraud") gouraud = one["rmse"];
        if (one["shading"] == "flat") flat = one["rmse"];
        if (one["model"] == "general-sum") {
            EXPECT_LT(one["rmse_to_phong"], 1e-7);
        }
    }
    EXPECT_LT(gouraud, flat);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"sheet.png"});
}

}  // namespace
}  // namespace umbriel::e2e
