#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/image/exr_io.h"
#include "common/math/glm.h"
#include "tests/e2e/run_program.h"

namespace umbriel::e2e {
namespace {

void render(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "render");
    const Outcome outcome = run("umbriel", arguments);
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
}

int bitDiffering(const std::string& a, const std::string& b) {
    const Outcome outcome = run("umbriel", {"compare", a, b, "--json"});
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    return outcome.exitCode == 0 ? nlohmann::json::parse(outcome.out)["bit_differing"].get<int>() : -1;
}

struct Wall {
    const char* name;
    glm::vec3 axis;
    glm::vec3 colour;
};
const Wall kWalls[] = {{"east", {1, 0, 0}, {1, 0, 0}}, {"west", {-1, 0, 0}, {0, 1, 1}},
                       {"top", {0, 1, 0}, {0, 1, 0}},  {"floor", {0, -1, 0}, {1, 0, 1}},
                       {"near", {0, 0, 1}, {0, 0, 1}}, {"far", {0, 0, -1}, {1, 1, 0}}};

// A room whose six walls shine in colours of their own, and in a row across its middle mirrors that turn the view from
// z = 4.5 to the east, the west, the top, the floor, and back.
void writeRoom(const std::string& folder) {
    std::ofstream materials(folder + "/room.mtl");
    materials << "newmtl mirror\nKd 0 0 0\nKa 0 0 0\nKs 1 1 1\nNs 10000\nillum 2\n";
    std::ofstream shapes(folder + "/room.obj");
    shapes << "mtllib room.mtl\n";
    int vertices = 0;
    const auto square = [&](const glm::vec3& centre, const glm::vec3& normal, float half, const std::string& material) {
        const glm::vec3 helper = std::abs(normal.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
        const glm::vec3 u = glm::normalize(glm::cross(helper, normal)) * half;
        const glm::vec3 v = glm::cross(normal, u);
        for (const glm::vec3& p : {centre - u - v, centre + u - v, centre + u + v, centre - u + v})
            shapes << fmt::format("v {} {} {}\n", p.x, p.y, p.z);
        shapes << fmt::format("vn {} {} {}\nusemtl {}\n", normal.x, normal.y, normal.z, material);
        shapes << "f";
        for (int i = 1; i <= 4; ++i) shapes << fmt::format(" {}//{}", vertices + i, vertices / 4 + 1);
        shapes << "\n";
        vertices += 4;
    };
    for (const Wall& wall : kWalls) {
        materials << fmt::format("newmtl {}\nKd 0 0 0\nKa 0 0 0\nKs 0 0 0\nKe {} {} {}\nillum 1\n", wall.name,
                                 wall.colour.x, wall.colour.y, wall.colour.z);
        square(wall.axis * 5.0f, -wall.axis, 5.0f, wall.name);
    }
    for (int i = 0; i < 5; ++i)
        square({-1.2f + 0.6f * float(i), 0, 0}, glm::normalize(kWalls[i].axis + glm::vec3(0, 0, 1)), 0.25f, "mirror");
}

// The mirrors show what is really there: the environment is captured and looked up in the same directions.
TEST(Environment, ACapturedRoomIsMirroredTheRightWayRound) {
    const TemporaryFolder folder;
    writeRoom(folder / "");
    render({folder / "room.obj", "--size", "160x120", "--eye", "0,0,4.5", "--target", "0,0,0", "--fov", "40", "--light",
            "none", "--environment", "capture:0,0,1", "--grid", "2x1", "--out", folder / "room.exr"});
    const auto image = readExr(folder / "room.exr");
    ASSERT_TRUE(image);
    for (int i = 0; i < 5; ++i) {
        const double x = (-1.2 + 0.6 * i) / 4.5 / std::tan(20.0 / 180.0 * 3.14159265358979) * 120.0 / 160.0;
        const float* pixel = image->rgba.pixel(static_cast<int>((0.5 + 0.5 * x) * 160), 60);
        for (int channel = 0; channel < 3; ++channel)
            EXPECT_NEAR(pixel[channel], kWalls[i].colour[channel], 0.02f) << kWalls[i].name << " channel " << channel;
    }
}

// Captured by any number of servers, it is one environment, and looked up it has no seams.
TEST(Environment, CapturesAndLookupsAreBitEqualForEveryWall) {
    const TemporaryFolder folder;
    for (const char* grid : {"1x1", "3x2"})
        render({"demo:spheres?n=5", "--size", "161x91", "--tiles", "exact", "--shadow", "std", "--light",
                "dir:-1,-2,-1", "--background", "0.2,0.4,0.8", "--environment", "capture:0,0.7,0:2", "--grid", grid,
                "--out", folder / (std::string(grid) + ".exr")});
    EXPECT_EQ(bitDiffering(folder / "1x1.exr", folder / "3x2.exr"), 0);
}

TEST(Environment, WhatCannotBeCapturedIsSaid) {
    for (const char* place : {"capture", "capture:1,2", "capture:0,0,0:9", "capture:0,0,0:1:1", "no-such-file.hdr"}) {
        const Outcome outcome = run("umbriel", {"render", "demo:spheres?n=1", "--environment", place, "--json"});
        EXPECT_EQ(outcome.exitCode, 2) << place;
        EXPECT_FALSE(outcome.err.empty()) << place;
    }
}

}  // namespace
}  // namespace umbriel::e2e
