// umbriel check and umbriel bake as a user runs them.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/image/exr_io.h"
#include "tests/e2e/run_program.h"

namespace umbriel::e2e {
namespace {

using json = nlohmann::json;

// A closed box of eight vertices; `corner` replaces the first.
std::string boxObj(const std::string& corner = "0 0 0") {
    return "v " + corner +
           "\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
           "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
}

// A flat sheet of n x n vertices.
std::string sheetObj(int n) {
    std::string text;
    for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x) text += "v " + std::to_string(x) + " " + std::to_string(y) + " 0\n";
    for (int y = 0; y + 1 < n; ++y)
        for (int x = 0; x + 1 < n; ++x) {
            const int a = y * n + x + 1;
            text += "f " + std::to_string(a) + " " + std::to_string(a + 1) + " " + std::to_string(a + n + 1) + " " +
                    std::to_string(a + n) + "\n";
        }
    return text;
}

TEST(Check, ABoxIsClosedAndSound) {
    TemporaryFolder folder;
    writeFile(folder / "box.obj", boxObj());
    const Outcome outcome = run("umbriel", {"check", folder / "box.obj", "--json"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    const json whole = json::parse(outcome.out)["whole"];
    EXPECT_EQ(whole["vertices"], 8);
    EXPECT_EQ(whole["triangles"], 12);
    EXPECT_EQ(whole["closed"], true);
    for (const json& finding : whole["findings"]) {
        EXPECT_EQ(finding["count"], finding["condition"] == "polygons" ? 6 : 0) << finding;
    }
}

TEST(Bake, InconsistentWindingIsOneWarning) {
    TemporaryFolder folder;
    writeFile(folder / "box.obj", boxObj());
    std::string turned = boxObj();
    turned.replace(turned.find("f 1 4 3 2"), 9, "f 1 2 3 4");
    writeFile(folder / "turned.obj", turned);
    const auto bakeOf = [&](const std::string& mesh) {
        return run("umbriel", {"bake", folder / mesh, "--mapping", "hemisphere", "--size", "8", "--out", folder / "maps.umvis"});
    };
    const Outcome sound = bakeOf("box.obj");
    EXPECT_EQ(sound.exitCode, 0) << sound.err;
    EXPECT_EQ(sound.err.find("wound"), std::string::npos) << sound.err;
    const Outcome outcome = bakeOf("turned.obj");
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    const std::size_t at = outcome.err.find("turned.obj: triangles at 4 edges are wound to different sides");
    ASSERT_NE(at, std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find("wound", at + 60), std::string::npos) << outcome.err;
}

// What an importer for drawing would hide: it drops unused vertices and splits used ones.
TEST(Check, AnObjFileIsSeenAsItIsWritten) {
    TemporaryFolder folder;
    // A square of a quad and two triangles with a seam of vertices that are there twice, an unused vertex, normals and
    // texture coordinates that differ at shared corners, two objects.
    writeFile(folder / "seam.obj",
              "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\nv 1 0 0\nv 1 1 0\nv 2 0 0\nv 2 1 0\n"
              "vn 0 0 1\nvn 0 1 0\nvt 0 0\nvt 1 1\n"
              "o left\nf 1/1/1 2/2/1 3/1/2 4/1/1\no right\nf 6/1/1 8/1/1 9/2/2\nf 6/2/2 9/1/1 7/1/1\n");
    const Outcome outcome = run("umbriel", {"check", folder / "seam.obj", "--json", "--weld", "0", "--orient", "--out",
                                            folder / "welded.obj"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    const json report = json::parse(outcome.out);
    const auto finding = [&](const json& of, const std::string& condition) {
        for (const json& one : of["findings"])
            if (one["condition"] == condition) return one;
        return json();
    };
    const json whole = report["whole"];
    EXPECT_EQ(whole["vertices"], 9);
    EXPECT_EQ(whole["triangles"], 4);
    EXPECT_EQ(finding(whole, "duplicate-vertices")["count"], 2);
    EXPECT_EQ(finding(whole, "unused-vertices")["count"], 1);
    EXPECT_NE(finding(whole, "unused-vertices")["examples"][0].get<std::string>().find("4"), std::string::npos);
    EXPECT_EQ(finding(whole, "polygons")["count"], 1);
    EXPECT_FALSE(report.contains("geometries"));
    EXPECT_EQ(report["repaired"]["vertices"], 6);
    EXPECT_EQ(finding(report["repaired"], "duplicate-vertices")["count"], 0);
    const Outcome again = run("umbriel", {"check", folder / "welded.obj", "--json"});
    EXPECT_EQ(json::parse(again.out)["whole"]["vertices"], 6);
    EXPECT_EQ(finding(json::parse(again.out)["whole"], "polygons")["count"], 0);
}

TEST(Check, BadFilesAreRefused) {
    TemporaryFolder folder;
    writeFile(folder / "nan.obj", boxObj("nan 0 0"));
    writeFile(folder / "lie.obj", boxObj() + "f 1 2 1000000000\n");
    writeFile(folder / "empty.obj", "v 0 0 0\n");
    for (const std::string command : {"check", "bake"}) {
        for (const std::string file : {"nan.obj", "lie.obj", "empty.obj", "none.obj"}) {
            std::vector<std::string> arguments{command, folder / file};
            if (command == "bake") arguments.insert(arguments.end(), {"--out", folder / "maps.umvis"});
            const Outcome outcome = run("umbriel", arguments);
            EXPECT_EQ(outcome.exitCode, 2) << command << " " << file << ": " << outcome.err;
            EXPECT_NE(outcome.err.find(file), std::string::npos) << outcome.err;
        }
    }
    EXPECT_EQ(folder.names().size(), 3u);
}

TEST(Bake, PartsInProcessesOfTheirOwnMergeToTheWholeFile) {
    TemporaryFolder folder;
    writeFile(folder / "sheet.obj", sheetObj(50));  // three blocks
    const std::vector<std::string> bake{"bake", folder / "sheet.obj", "--size", "8", "--distance", "--json"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), bake.begin(), bake.end());
        return run("umbriel", more);
    };
    const Outcome whole = with({"--threads", "1", "--out", folder / "whole.umvis"});
    ASSERT_EQ(whole.exitCode, 0) << whole.err;
    const json report = json::parse(whole.out);
    EXPECT_EQ(report["vertices"], 2500);
    EXPECT_EQ(report["directions"], 64);
    EXPECT_EQ(report["rays"], 2500 * 64);
    EXPECT_EQ(report.size(), 10u);
    std::vector<std::string> merge{"bake", "merge"};
    for (const std::string part : {"2", "0", "1"}) {
        const std::string file = folder / ("part" + part);
        ASSERT_EQ(with({"--shard", part + "/3", "--out", file}).exitCode, 0);
        merge.push_back(file);
    }
    merge.insert(merge.end(), {"--out", folder / "merged.umvis", "--json"});
    const Outcome merged = run("umbriel", merge);
    ASSERT_EQ(merged.exitCode, 0) << merged.err;
    EXPECT_EQ(json::parse(merged.out)["sha256"], report["sha256"]);
    EXPECT_EQ(readFile(folder / "merged.umvis"), readFile(folder / "whole.umvis"));

    const std::string part = readFile(folder / "part1");
    writeFile(folder / "part1", part.substr(0, part.size() - 1));
    const Outcome truncated = run("umbriel", merge);
    EXPECT_EQ(truncated.exitCode, 2);
    EXPECT_NE(truncated.err.find("part1"), std::string::npos) << truncated.err;
    EXPECT_EQ(readFile(folder / "merged.umvis"), readFile(folder / "whole.umvis"));
}

TEST(Bake, ComesBackFromAPictureAsTheSameFile) {
    TemporaryFolder folder;
    const std::string mesh = folder / "box.obj", maps = folder / "box.umvis", picture = folder / "box.exr";
    writeFile(mesh, boxObj());
    ASSERT_EQ(run("umbriel", {"bake", mesh, "--size", "8", "--distance", "--hit-distance", "--index", "--out", maps}).exitCode,
              0);
    const Outcome exported = run("umbriel", {"bake", "export", maps, "--out", picture, "--json"});
    ASSERT_EQ(exported.exitCode, 0) << exported.err;
    EXPECT_EQ(json::parse(exported.out)["vertices"], 8);
    EXPECT_EQ(json::parse(exported.out)["layers"], json({"distance", "hit", "index"}));
    const std::string back = folder / "back.umvis";
    const Outcome imported = run("umbriel", {"bake", "import", picture, "--mesh", mesh, "--out", back, "--json"});
    ASSERT_EQ(imported.exitCode, 0) << imported.err;
    EXPECT_EQ(readFile(back), readFile(maps));

    // Two vertices of choice, and what is refused.
    const Outcome two =
        run("umbriel", {"bake", "export", maps, "--vertices", "0,6", "--show-distance", "--out", folder / "two.exr", "--json"});
    ASSERT_EQ(two.exitCode, 0) << two.err;
    EXPECT_EQ(json::parse(two.out)["vertices"], 2);
    EXPECT_EQ(run("umbriel", {"bake", "export", maps, "--vertices", "8", "--out", picture}).exitCode, 2);
    EXPECT_EQ(run("umbriel", {"bake", "export", maps, "--rows", "8", "--out", picture}).exitCode, 2);
    EXPECT_EQ(run("umbriel", {"bake", "export", mesh, "--out", picture}).exitCode, 2);
    EXPECT_EQ(run("umbriel", {"bake", "export", maps, "--out", folder / "box.jpg"}).exitCode, 2);
    EXPECT_EQ(run("umbriel", {"bake", "export", maps, "--out", folder / "box.png", "--scale", "4"}).exitCode, 0);
    EXPECT_EQ(run("umbriel", {"bake", "export", maps, "--out", picture, "--scale", "4"}).exitCode, 2);

    const std::string sound = readFile(picture);
    writeFile(folder / "other.obj", boxObj("0 0 -1"));
    const auto refused = [&](const std::string& file, const std::string& of) {
        const Outcome outcome = run("umbriel", {"bake", "import", file, "--mesh", of, "--out", folder / "no.umvis"});
        EXPECT_FALSE(outcome.err.empty()) << file;
        return outcome.exitCode == 2;
    };
    EXPECT_TRUE(refused(picture, folder / "other.obj"));
    EXPECT_TRUE(refused(folder / "two.exr", mesh));
    EXPECT_TRUE(refused(mesh, mesh));
    EXPECT_TRUE(refused(folder / "none.exr", mesh));
    writeFile(folder / "cut.exr", sound.substr(0, sound.size() - 200));
    EXPECT_TRUE(refused(folder / "cut.exr", mesh));
    // A changed byte anywhere is refused, or is one that no sample depends on.
    for (std::size_t at = 10; at < sound.size(); at += sound.size() / 24) {
        std::string changed = sound;
        changed[at] = static_cast<char>(changed[at] ^ 0x5a);
        writeFile(folder / "changed.exr", changed);
        const Outcome outcome =
            run("umbriel", {"bake", "import", folder / "changed.exr", "--mesh", mesh, "--out", folder / "changed.umvis"});
        EXPECT_TRUE(outcome.exitCode == 2 || outcome.exitCode == 0) << at << ": " << outcome.exitCode << outcome.err;
    }
    for (const std::string& name : folder.names()) EXPECT_NE(name, "no.umvis");
}

// A server draws what rays find.
TEST(Bake, MapsAreDrawnByAServer) {
    TemporaryFolder folder;
    // Two walls of unlike height on a floor, at odd angles.
    writeFile(folder / "fold.obj",
              "v 0 0 0\nv 1.13 0 0\nv 1.13 2.17 0\nv 0 2.17 0\nv -0.31 0.07 0.77\nv -0.29 2.11 0.83\n"
              "v 1.51 0.03 1.19\nv 1.47 2.23 1.23\nf 1 2 3\nf 1 3 4\nf 4 6 5\nf 4 5 1\nf 2 7 8\nf 2 8 3\n");
    for (const std::string mapping : {"hemicube", "hemisphere", "octahedral"}) {
        std::vector<LayeredImage> pictures;
        for (const std::string maker : {"rays", "gl"}) {
            const std::string maps = folder / (maker + ".umvis"), picture = folder / (maker + ".exr");
            const Outcome baked = run("umbriel", {"bake", folder / "fold.obj", "--mapping", mapping, "--maker", maker, "--size",
                                                  "16", "--distance", "--json", "--quiet", "--out", maps});
            ASSERT_EQ(baked.exitCode, 0) << baked.err;
            EXPECT_EQ(json::parse(baked.out)["servers"], maker == "gl" ? 1 : 0);
            ASSERT_EQ(run("umbriel", {"bake", "export", maps, "--out", picture}).exitCode, 0);
            auto read = readExr(picture);
            ASSERT_TRUE(read);
            pictures.push_back(std::move(*read));
        }
        EXPECT_EQ(pictures[1].texts["umvisMaker"], "2");
        EXPECT_TRUE(pictures[1].texts["umvisClass"].starts_with("gl ")) << pictures[1].texts["umvisClass"];
        int blocked = 0, differing = 0, all = 0;
        for (int y = 0; y < pictures[0].height(); ++y) {
            for (int x = 0; x < pictures[0].width(); ++x) {
                if (pictures[0].rgba.pixel(x, y)[3] == 0.0f) continue;
                ++all;
                blocked += pictures[0].rgba.pixel(x, y)[0] == 0.0f;
                differing += pictures[0].rgba.pixel(x, y)[0] != pictures[1].rgba.pixel(x, y)[0];
            }
        }
        EXPECT_GT(blocked, all / 10) << mapping;
        EXPECT_LT(differing, all / 50) << mapping;  // silhouettes; tests/golden/gl_maker_test.cpp looks at each
    }
}

// Back to back triangles over the same vertices: their normals cancel.
TEST(Bake, BothFacesOfASheetMayShareTheirVertices) {
    TemporaryFolder folder;
    writeFile(folder / "leaf.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n");
    const Outcome outcome =
        run("umbriel", {"bake", folder / "leaf.obj", "--json", "--quiet", "--out", folder / "leaf.umvis"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_EQ(json::parse(outcome.out)["vertices"], 3);
}

TEST(Bake, WhatIsReadIsNeverReplaced) {
    TemporaryFolder folder;
    const std::string mesh = folder / "box.obj", maps = folder / "box.umvis";
    writeFile(mesh, boxObj());
    std::filesystem::create_symlink("box.obj", std::string(folder / "link.obj"));
    for (const std::string& out : {mesh, folder / "./box.obj", folder / "link.obj"}) {
        const Outcome outcome = run("umbriel", {"bake", mesh, "--size", "8", "--out", out});
        EXPECT_EQ(outcome.exitCode, 2) << out;
        EXPECT_NE(outcome.err.find("is the mesh itself"), std::string::npos) << outcome.err;
    }
    EXPECT_EQ(readFile(mesh), boxObj());
    const std::string both = folder / "both.exr";
    EXPECT_EQ(run("umbriel", {"bake", mesh, "--size", "8", "--out", both, "--atlas", both}).exitCode, 2);
    EXPECT_EQ(folder.names(), (std::vector<std::string>{"box.obj", "link.obj"}));
}

TEST(Bake, AMeshFarFromTheOriginIsWarnedOf) {
    TemporaryFolder folder;
    writeFile(folder / "near.obj", sheetObj(3));
    writeFile(folder / "far.obj", "v 1000000 0 0\nv 1000001 0 0\nv 1000000 1 0\nf 1 2 3\n");
    const auto bake = [&](const std::string& file) {
        return run("umbriel", {"bake", file, "--size", "32", "--out", folder / "maps.umvis"});
    };
    EXPECT_EQ(bake(folder / "near.obj").err, "");
    const Outcome far = bake(folder / "far.obj");
    EXPECT_EQ(far.exitCode, 0);
    EXPECT_NE(far.err.find("rounded to 0.084 of the mesh's diagonal"), std::string::npos) << far.err;
}

TEST(Bake, WhatThisVersionCannotDoIsRefusedAtOnce) {
    TemporaryFolder folder;
    const std::string out = folder / "maps.umvis";
    const std::vector<std::vector<std::string>> wrong{{"--maker", "gl", "--shard", "0/2"},
                                                      {"--servers", "nonsense"},
                                                      {"--local", "0"},
                                                      {"--mapping", "sphere"},
                                                      {"--size", "7"},
                                                      {"--mapping", "singleplane"},
                                                      {"--fovy", "90"},
                                                      {"--far", "0"},
                                                      {"--maker", "gl", "--mapping", "singleplane", "--fovy", "0.01"},
                                                      {"--maker", "gl", "--mapping", "singleplane", "--fovy", "179.9"},
                                                      {"--servers", "127.0.0.1:9,127.0.0.1:9"},
                                                      {"--guard", "none"},
                                                      {"--shard", "3/3"},
                                                      {"--shard", "1/2/3"},
                                                      {"--shards", "2", "--shard", "0/2"},
                                                      {"--atlas", "maps.png"},
                                                      {"--index", "--environment", "9999x9999"},
                                                      {"--threads", "-1"}};
    for (std::vector<std::string> arguments : wrong) {
        const std::string what = arguments[0] + " " + arguments.back();
        arguments.insert(arguments.begin(), {"bake", "demo:cloth", "--out", out});
        const Outcome outcome = run("umbriel", arguments);
        EXPECT_EQ(outcome.exitCode, 2) << what;
        EXPECT_FALSE(outcome.err.empty()) << what;
    }
    EXPECT_EQ(run("umbriel", {"bake", "demo:cloth"}).exitCode, 2);
    EXPECT_EQ(run("umbriel", {"bake", "--out", out}).exitCode, 2);
    EXPECT_TRUE(folder.names().empty());
}

TEST(Bake, AtlasLiesBesideTheMaps) {
    TemporaryFolder folder;
    writeFile(folder / "box.obj", boxObj());
    const Outcome outcome = run("umbriel", {"bake", folder / "box.obj", "--size", "8", "--out", folder / "box.umvis",
                                            "--atlas", folder / "box.exr"});
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_EQ(folder.names(), (std::vector<std::string>{"box.exr", "box.obj", "box.umvis"}));
    const Outcome lost = run("umbriel", {"bake", folder / "box.obj", "--out", "/nonexistent-folder/box.umvis"});
    EXPECT_EQ(lost.exitCode, 1);
}

}  // namespace
}  // namespace umbriel::e2e
