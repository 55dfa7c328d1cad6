#include "client/app/check_command.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/temporary_folder.h"

namespace umbriel {
namespace {

using json = nlohmann::json;

// Two triangles that share an edge, each with its own vertices, wound against each other.
MeshInput twoTriangles() {
    MeshInput input;
    input.parts.push_back(
        {"flap", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {0, 1, 2, 3, 4, 5}}});
    return input;
}

json findingOf(const json& report, const std::string& condition) {
    for (const json& finding : report["findings"])
        if (finding["condition"] == condition) return finding;
    return {};
}

json check(const MeshInput& input, CheckArguments arguments = {}) {
    arguments.json = true;
    std::ostringstream out;
    const auto done = checkInput(input, arguments, out);
    EXPECT_TRUE(done) << done.error().message;
    return json::parse(out.str());
}

TEST(CheckCommand, CountsWhatIsWrong) {
    const json whole = check(twoTriangles())["whole"];
    EXPECT_EQ(whole["vertices"], 6);
    EXPECT_EQ(whole["triangles"], 2);
    EXPECT_EQ(whole["components"], 1);
    EXPECT_EQ(whole["closed"], false);
    EXPECT_EQ(findingOf(whole, "duplicate-vertices")["count"], 2);
    EXPECT_EQ(findingOf(whole, "inconsistent-winding")["count"], 1);
    EXPECT_EQ(findingOf(whole, "open-edges")["count"], 4);
    EXPECT_EQ(whole["findings"].size(), 11u);
}

TEST(CheckCommand, PolygonsAreCounted) {
    MeshInput input = twoTriangles();
    input.polygons = 7;
    EXPECT_EQ(findingOf(check(input)["whole"], "polygons")["count"], 7);
}

TEST(CheckCommand, EachGeometryAndAllTogether) {
    MeshInput input = twoTriangles();
    input.parts.push_back({"other", {{{0, 0, 5}, {1, 0, 5}, {0, 1, 5}}, {0, 1, 2}}});
    const json report = check(input);
    ASSERT_EQ(report["geometries"].size(), 2u);
    EXPECT_EQ(report["geometries"][1]["name"], "other");
    EXPECT_EQ(report["geometries"][1]["triangles"], 1);
    EXPECT_EQ(report["whole"]["triangles"], 3);
    EXPECT_EQ(report["whole"]["components"], 2);
}

TEST(CheckCommand, RepairsAndWritesWhatReadsBackAsTheSame) {
    const test::TemporaryFolder folder;
    const auto path = folder / "check.obj";
    CheckArguments arguments;
    arguments.weld = 0.0;
    arguments.orient = true;
    arguments.out = path.string();
    MeshInput input = twoTriangles();
    input.parts[0].mesh.positions[0].x = 0.1f;
    const json repaired = check(input, arguments)["repaired"];
    EXPECT_EQ(repaired["vertices"], 4);
    EXPECT_EQ(repaired["flipped"], 1);
    EXPECT_EQ(findingOf(repaired, "inconsistent-winding")["count"], 0);
    std::ifstream file(path);
    std::string kind;
    float x = 0.0f;
    file >> kind >> x;
    EXPECT_EQ(kind, "v");
    EXPECT_EQ(x, 0.1f);
}

TEST(CheckCommand, CoordinatesThatAreNotFiniteAreReportedAndRefused) {
    MeshInput input = twoTriangles();
    input.parts[0].mesh.positions[1].y = std::numeric_limits<float>::quiet_NaN();
    std::ostringstream out;
    const auto done = checkInput(input, {}, out);
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().kind, Error::Kind::BadInput);
    EXPECT_NE(out.str().find("non-finite-coordinates"), std::string::npos);
}

TEST(CheckCommand, ProceduralScenesAndExitCodes) {
    std::ostringstream out, err;
    CheckArguments arguments;
    arguments.scene = "demo:cloth";
    EXPECT_EQ(runCheck(arguments, out, err), 0) << err.str();
    EXPECT_NE(out.str().find("open-edges"), std::string::npos);
    arguments.out = "mesh.ply";
    EXPECT_EQ(runCheck(arguments, out, err), 2);
    arguments.out = "/nonexistent-folder/mesh.obj";
    EXPECT_EQ(runCheck(arguments, out, err), 1);
    arguments = {.scene = "demo:nothing"};
    EXPECT_EQ(runCheck(arguments, out, err), 2);
    arguments = {.scene = "demo:cloth", .weld = -1.0};
    EXPECT_EQ(runCheck(arguments, out, err), 2);
}

}  // namespace
}  // namespace umbriel
