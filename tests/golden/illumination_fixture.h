#pragma once

#include <algorithm>

#include "common/light/shading_truth.h"
#include "tests/golden/draw_fixture.h"

namespace umbriel {

inline constexpr ReflectionModel kAllModels[] = {
    ReflectionModel::MetallicRoughness, ReflectionModel::BlinnPhong,      ReflectionModel::Unlit,
    ReflectionModel::Lambert,           ReflectionModel::Phong,           ReflectionModel::PhongGated,
    ReflectionModel::Schlick,           ReflectionModel::NormalisedPhong, ReflectionModel::PhongBrdf,
    ReflectionModel::TorranceSparrow,   ReflectionModel::Lafortune,       ReflectionModel::PhongOriginal,
    ReflectionModel::GeneralSum,        ReflectionModel::OpenGlSum};

// Pictures against the formulas in double.
class IlluminationTest : public DrawTest {
 protected:
    static constexpr PixelSize kWall{48, 36};

    Ref<Material> glossy(ReflectionModel model) {
        const Ref<Material> made = scene->create<Material>();
        scene->edit(made)
            .set<&Material::model>(model)
            .set<&Material::baseColour>(glm::vec4(0.5f, 0.3f, 0.2f, 1.0f))
            .set<&Material::metallic>(0.3f)
            .set<&Material::roughness>(0.4f)
            .set<&Material::specular>(glm::vec3(0.3f, 0.4f, 0.5f))
            .set<&Material::shininess>(20.0f)
            .set<&Material::ambient>(glm::vec3(0.1f, 0.2f, 0.3f))
            .set<&Material::ambientShare>(0.25f)
            .set<&Material::emission>(glm::vec3(0.01f, 0.0f, 0.02f))
            .assign<&Material::lobeAlbedos>(std::vector<glm::vec3>{{1.0f, 1.1f, 1.2f}, {0.3f, 0.2f, 0.1f}})
            .assign<&Material::lobeAxes>(std::vector<glm::vec3>{{-1.0f, -1.0f, 0.95f}, {0.4f, 0.4f, 0.5f}})
            .assign<&Material::lobeExponents>(std::vector<float>{15.0f, 2.0f});
        return made;
    }
    // A light at a place, shining towards the origin, that lights everything below the returned node.
    template <class Light>
    Ref<Node> standing(Ref<Node> parent, Ref<Light> light, glm::dvec3 at) {
        const Ref<Node> beacon = placed(root, at, lookingAlong(glm::vec3(-at)));
        scene->edit(light).template set<&Light::beacon>(beacon);
        return node(parent, light);
    }
    // The plane z = 0, 10 m wide, facing +z.
    Ref<Node> plane(Ref<Node> parent, Ref<Material> of, ShadingFrequency shading = ShadingFrequency::Phong) {
        const Ref<Geometry> made = geometry(gridMesh(5.0f), of);
        scene->edit(made).set<&Geometry::shading>(shading);
        return node(parent, made);
    }
    View slanted() const { return lookAt({1.5, -2.0, 2.6}, {0.1, 0.2, 0}, 0.6, kWall); }

    // Where the middle of a pixel looks at the plane z = 0.
    static glm::dvec3 onPlane(const View& view, int x, int y) {
        const glm::dvec2 place((x + 0.5) / view.region.width * 2 - 1, (y + 0.5) / view.region.height * 2 - 1);
        const glm::dvec3 inView(place.x / view.clipFromView[0][0], place.y / view.clipFromView[1][1], -1.0);
        const glm::dvec3 along = glm::transpose(view.viewFromWorld) * inView;
        return view.eyeWorld - along * (view.eyeWorld.z / along.z);
    }
    // The lights below the root, all of which must reach the plane.
    std::vector<LightInEffect> lights() const { return lightsInEffect(*scene, root, Hierarchy(*scene, root)); }

    // Every pixel of the plane against the formulas in double. tolerance: relative to the pixel or, below it, to a
    // tenth of the largest of the picture.
    void expectTruth(const WallImage& image, const View& view, const Material& of, double tolerance,
                     const std::string& what) {
        ASSERT_FALSE(image.values.empty());
        const std::vector<LightInEffect> all = lights();
        std::vector<glm::dvec3> expected;
        double largest = 0.0;
        for (int y = 0; y < kWall.height; ++y)
            for (int x = 0; x < kWall.width; ++x) {
                ShadedPoint point;
                point.positionWorld = onPlane(view, x, y);
                point.toEyeWorld = glm::normalize(view.eyeWorld - point.positionWorld);
                point.baseColour = glm::dvec3(glm::vec3(of.baseColour.get()));
                expected.push_back(radianceTruth(*scene, of, point, all));
                largest = std::max({largest, expected.back().x, expected.back().y, expected.back().z});
            }
        ASSERT_GT(largest, 0.0) << what;
        double worst = 0.0;
        glm::ivec2 where(0);
        for (int y = 0; y < kWall.height; ++y)
            for (int x = 0; x < kWall.width; ++x)
                for (int channel = 0; channel < 3; ++channel) {
                    const double truth = expected[static_cast<std::size_t>(y * kWall.width + x)][channel];
                    const double error =
                        std::abs(static_cast<double>(image.at(x, y)[channel]) - truth) / std::max(truth, 0.1 * largest);
                    if (!(error > worst)) continue;
                    worst = error;
                    where = {x, y};
                }
        EXPECT_LE(worst, tolerance) << what << " at " << where.x << "," << where.y;
    }
};

}  // namespace umbriel
