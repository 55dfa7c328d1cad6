#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/materials.h"
#include "tests/unit/import/gltf_maker.h"

namespace umbriel::test {
namespace {

constexpr const char* kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

class Obj : public testing::Test {
 protected:
    Loaded loadText(const std::string& text) const { return Loaded(_folder.write("scene.obj", text)); }
    void expectRefused(const std::string& text, const std::string& reason) const {
        const Loaded loaded = loadText(text);
        ASSERT_FALSE(loaded.file) << reason;
        EXPECT_NE(loaded.error().find(reason), std::string::npos) << loaded.error();
        EXPECT_NE(loaded.error().find("scene.obj"), std::string::npos) << loaded.error();
        EXPECT_EQ(loaded.file.error().kind, Error::Kind::BadInput);
    }
    TempFolder _folder;
};

TEST_F(Obj, QuadsBecomeTrianglesOfSharedVertices) {
    const Loaded loaded = loadText(std::string(kSquare) + "f 1 2 3 4\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    const auto& geometry = loaded.only<Geometry>();
    EXPECT_EQ(geometry.positions.size(), 4u);
    EXPECT_EQ(geometry.indices.size(), 6u);
    EXPECT_TRUE(geometry.normals.empty());
    EXPECT_TRUE(geometry.texCoords0.empty());
    EXPECT_EQ(loaded.only<Material>().model.get(), ReflectionModel::BlinnPhong);
    EXPECT_TRUE(loaded.only<Material>().doubleSided.get());
}

// A polygon of n corners is n - 2 triangles, to the largest that is read; beyond, the message says where and what to
// do.
TEST_F(Obj, FacesOfManyCornersAreReadUpToALimit) {
    const auto disc = [](std::size_t corners) {
        std::string text, face = "f";
        for (std::size_t i = 0; i < corners; ++i) {
            const double angle = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(corners);
            text += "v " + std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + " 0\n";
            face += " " + std::to_string(i + 1);
        }
        return text + face + "\n";
    };
    const std::size_t most = ImportLimits{}.faceCorners;
    for (const std::size_t corners : {std::size_t{5}, std::size_t{1000}, most}) {
        const Loaded loaded = loadText(disc(corners));
        ASSERT_TRUE(loaded.file) << loaded.error();
        EXPECT_EQ(loaded.only<Geometry>().indices.size(), 3 * (corners - 2)) << corners;
    }
    expectRefused(disc(most + 1),
                  "line " + std::to_string(most + 2) + ": is a face of 16385 corners, and at most 16384");
}

TEST_F(Obj, NegativeIndicesCountFromTheEnd) {
    const auto positive = loadText(std::string(kSquare) + "f 1 2 3\n");
    const auto negative = loadText(std::string(kSquare) + "f -4 -3 -2\n");
    ASSERT_TRUE(negative.file) << negative.error();
    EXPECT_TRUE(negative.only<Geometry>().positions.storage().equals(positive.only<Geometry>().positions.storage()));
}

TEST_F(Obj, TextureCoordinatesAreTurnedToFirstRowFirst) {
    const Loaded loaded = loadText(std::string(kSquare) + "vt 0 0\nvt 1 0\nvt 1 0.75\nvn 0 0 2\nf 1/1/1 2/2/1 3/3/1\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.only<Geometry>().texCoords0[0], glm::vec2(0, 1));
    EXPECT_EQ(loaded.only<Geometry>().texCoords0[2], glm::vec2(1, 0.25f));
    EXPECT_EQ(loaded.only<Geometry>().normals[0], glm::vec3(0, 0, 1)) << "normalised";
}

TEST_F(Obj, ObjectsAndGroupsAreNodes) {
    const Loaded loaded = loadText(std::string(kSquare) + "o left\nf 1 2 3\no right\nf 1 3 4\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    const Node& root = loaded.scene->get(loaded.root().root.get());
    ASSERT_EQ(root.children.size(), 2u);
    EXPECT_EQ(loaded.scene->get(root.children[0]).name.get(), "left");
    EXPECT_EQ(loaded.scene->get(root.children[1]).name.get(), "right");
}

TEST_F(Obj, MaterialsComeFromTheLibrary) {
    _folder.write("looks.mtl",
                  "newmtl red\nKd 1 0 0\nKs 0.5 0.5 0.5\nKa 0.1 0.1 0.1\nKe 0 0 2\nNs 40\nd 0.25\nmap_Kd absent.png\n"
                  "newmtl dull\nKd 0.5 0.5 0.5\nNs 0\n");
    const Loaded loaded =
        loadText("mtllib looks.mtl\n" + std::string(kSquare) + "usemtl red\nf 1 2 3\nusemtl dull\nf 1 3 4\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.count<Geometry>(), 2u);
    const Material* red = nullptr;
    for (const ContainerId id : loaded.scene->ids())
        if (const auto* material = loaded.scene->findAs<Material>(id); material && material->name.get() == "red")
            red = material;
    ASSERT_TRUE(red);
    EXPECT_EQ(red->baseColour.get(), glm::vec4(1, 0, 0, 0.25f));
    EXPECT_EQ(red->alphaMode.get(), AlphaMode::Blend);
    EXPECT_EQ(red->specular.get(), glm::vec3(0.5f));
    EXPECT_EQ(red->ambient.get(), glm::vec3(0.1f));
    EXPECT_EQ(red->emission.get(), glm::vec3(0, 0, 2));
    EXPECT_EQ(red->shininess.get(), 40.0f);
    EXPECT_TRUE(loaded.warnsOf("material 'red' map_Kd: cannot read 'absent.png'"));
}

TEST_F(Obj, AMissingLibraryIsAWarning) {
    const Loaded loaded = loadText("mtllib absent.mtl\n" + std::string(kSquare) + "usemtl red\nf 1 2 3\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.warnsOf("absent.mtl"));
    EXPECT_EQ(loaded.only<Material>().baseColour.get(), glm::vec4(0.8f, 0.8f, 0.8f, 1.0f));
}

TEST_F(Obj, ALibraryOutsideTheFolderIsNotRead) {
    const TempFolder outside;
    const std::string secret = outside.write("secret.mtl", "newmtl red\nKd 1 0 0\n");
    for (const std::string& name : {secret, std::string("../secret.mtl")}) {
        const Loaded loaded = loadText("mtllib " + name + "\n" + kSquare + "usemtl red\nf 1 2 3\n");
        ASSERT_TRUE(loaded.file) << loaded.error();
        EXPECT_TRUE(loaded.warnsOf("only files below the folder")) << name;
    }
}

TEST_F(Obj, TrailingSlashesAreNoIndices) {
    const Loaded loaded = loadText(std::string(kSquare) + "vt 0 0\nf 1/1/ 2/1/ 3/1/\nf 1// 3// 4//\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.only<Geometry>().indices.size(), 6u);
}

TEST_F(Obj, NumbersThatAreNoneAreRefusedWithTheirLine) {
    expectRefused("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "line 2: 'nan' is not a finite coordinate");
    expectRefused("v 0 0 0\nv 1 -inf 0\nv 0 1 0\nf 1 2 3\n", "line 2: '-inf' is not a finite coordinate");
    expectRefused("v 0 0 0\nv 1 1e39 0\nv 0 1 0\nf 1 2 3\n", "line 2: '1e39' is not a finite coordinate");
    expectRefused("v 0 0 0\nv 1 -1e999 0\nv 0 1 0\nf 1 2 3\n", "line 2: '-1e999' is not a finite coordinate");
    expectRefused("v 0 0 0\nv 1 " + std::string(400, '9') + " 0\nv 0 1 0\nf 1 2 3\n", "is not a finite coordinate");
    expectRefused("v 0 0 0\nv 1 zero 0\nv 0 1 0\nf 1 2 3\n", "line 2: 'zero' is not a number");
    expectRefused("v 0 0\n", "line 1: has 2 numbers where 3 are needed");
}

TEST_F(Obj, NumbersTooSmallToHoldAreZero) {
    const Loaded loaded = loadText("v 0 0 1e-999\nv 1 0 -1e-400\nv 0 1 0\nf 1 2 3\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    for (const glm::vec3& p : loaded.only<Geometry>().positions.toVector()) EXPECT_EQ(p.z, 0.0f);
}

// Never a partial scene: triangles, quads and polygons alike.
TEST_F(Obj, CornersThatAreNotThereAreRefusedWithTheirLine) {
    const std::string square(kSquare);
    expectRefused(square + "f 1 2 3\nf 1 2 9\n", "line 6: names vertex 9, there are 4");
    expectRefused(square + "f 1 2 3 9\n", "line 5: names vertex 9, there are 4");
    expectRefused(square + "f 1 2 3 4 -5\n", "line 5: names vertex -5, there are 4");
    expectRefused(square + "f -1 -2 -3\nv 5 5 5\nf 1 2 6\n", "line 7: names vertex 6, there are 5");
    expectRefused("f -1 -2 -3\n" + square, "line 1: names vertex -1, there are 0");
    expectRefused(square + "vt 0 0\nf 1/1 2/2 3/1\n", "line 6: names texture coordinate 2, there are 1");
    expectRefused(square + "vn 0 0 1\nf 1//1 2//1 3//7\n", "line 6: names normal 7, there are 1");
    expectRefused(square + "f 99999999999999999999 1 2\n", "line 5: names vertex 99999999999999999999, there are 4");
    for (const char* corner : {"0", "1/0", "x", "1x", "1/x", "/1", "1/1/1/1", "1.5"})
        expectRefused(square + "vt 0 0\nvn 0 0 1\nf 1 2 " + corner + "\n",
                      std::string("line 7: '") + corner + "' is not a corner of a face");
}

TEST_F(Obj, FacesMayNameWhatComesLater) {
    const Loaded loaded = loadText("f 1 2 3\n" + std::string(kSquare));
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.only<Geometry>().indices.size(), 3u);
}

TEST_F(Obj, FacesOfFewerThanThreeCornersAreNamedByTheirLine) {
    const Loaded loaded = loadText(std::string(kSquare) + "f 1 2\nf 3\nf 1 2 3 # 4\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.only<Geometry>().indices.size(), 3u);
    EXPECT_TRUE(loaded.warnsOf("line 5: a face of 2 corners is not drawn"));
    EXPECT_TRUE(loaded.warnsOf("line 6: a face of 1 corners is not drawn"));
}

// The first vertex would be lost with the mark, and every face would name the one after its own.
TEST_F(Obj, AByteOrderMarkIsNoPartOfTheFirstLine) {
    _folder.write("looks.mtl", "\xef\xbb\xbfnewmtl red\nKd 1 0 0\n");
    const Loaded loaded = loadText("\xef\xbb\xbf" + std::string(kSquare) + "mtllib looks.mtl\nusemtl red\nf 1 2 3\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.only<Geometry>().positions[0], glm::vec3(0, 0, 0));
    EXPECT_EQ(loaded.only<Material>().baseColour.get(), glm::vec4(1, 0, 0, 1));
}

TEST_F(Obj, LinesGoOnBehindABackslashAndKeepTheirNumbers) {
    for (const char* end : {"\n", "\r\n"}) {
        const std::string text = std::string("v 0 0 \\") + end + "0" + end + "v 1 0 0" + end + "v 1 1 0" + end + "v 0 1 0" +
                                 end + "# C:\\models\\" + end + "f 1 2 \\" + end + "3 \\" + end + "4" + end;
        const Loaded loaded = loadText(text);
        ASSERT_TRUE(loaded.file) << loaded.error();
        EXPECT_EQ(loaded.only<Geometry>().indices.size(), 6u);
        expectRefused(text + "v x 0 0" + end, "line 10: 'x' is not a number");
    }
}

TEST_F(Obj, NamesMayHaveBlanks) {
    const char* library = "newmtl dark  wood \r\nKd 1 0 0\r\nnewmtl dark\r\nKd 0 1 0\r\n";
    _folder.write("my looks.mtl", library);
    _folder.write("a.mtl", "newmtl other\nKd 0 0 1\n");
    _folder.write("b.mtl", library);
    for (const char* libraries : {"my looks.mtl", "a.mtl b.mtl", ".\\b.mtl", "b.mtl  "}) {
        const Loaded loaded = loadText("mtllib " + std::string(libraries) + "\n" + kSquare + "usemtl dark  wood\nf 1 2 3\n");
        ASSERT_TRUE(loaded.file) << loaded.error();
        EXPECT_EQ(loaded.only<Material>().baseColour.get(), glm::vec4(1, 0, 0, 1)) << libraries;
        EXPECT_EQ(loaded.only<Material>().name.get(), "dark  wood");
        EXPECT_TRUE(loaded.file->warnings.empty()) << libraries;
    }
    const Loaded absent = loadText("mtllib a.mtl no.mtl\n" + std::string(kSquare) + "usemtl some thing\nf 1 2 3\n");
    ASSERT_TRUE(absent.file) << absent.error();
    EXPECT_TRUE(absent.warnsOf("cannot read 'no.mtl'"));
    EXPECT_TRUE(absent.warnsOf("'some thing'"));
}

TEST_F(Obj, MaterialValuesThatAreNoNumbersAreNamed) {
    _folder.write("looks.mtl", "newmtl odd\nKd nan 0.5 1\nKs inf 0 0\nNs x\nd -halo 0.5\n");
    const Loaded loaded = loadText("mtllib looks.mtl\n" + std::string(kSquare) + "usemtl odd\nf 1 2 3\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.only<Material>().baseColour.get()[0], 0.0f);
    EXPECT_EQ(loaded.only<Material>().baseColour.get()[1], 0.5f);
    EXPECT_EQ(loaded.only<Material>().specular.get(), glm::vec3(0.0f));
    EXPECT_TRUE(loaded.warnsOf("mtllib 'looks.mtl', line 2: Kd 'nan' is not a finite number and taken as 0"));
    EXPECT_TRUE(loaded.warnsOf("line 3: Ks 'inf'"));
    EXPECT_TRUE(loaded.warnsOf("line 4: Ns 'x'"));
}

TEST_F(Obj, WhatIsNoTextIsRefused) {
    expectRefused(std::string("v 0 0 0\0v 1 0 0\n", 17), "is no text file");
    _folder.write("looks.mtl", std::string("newmtl red\0\n", 12));
    const Loaded loaded = loadText("mtllib looks.mtl\n" + std::string(kSquare) + "f 1 2 3\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.warnsOf("mtllib 'looks.mtl': is no text file"));
}

TEST_F(Obj, PointsAndLinesOnlyIsAnEmptyScene) {
    const Loaded loaded = loadText(std::string(kSquare) + "p 1\nl 1 2\n");
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.warnsOf("nothing to draw"));
}

}  // namespace
}  // namespace umbriel::test
