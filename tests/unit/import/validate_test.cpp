#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <unistd.h>

#include <functional>
#include <limits>
#include <thread>

#include "client/import/import_answer.h"
#include "client/import/validate.h"
#include "common/scene/cameras.h"
#include "common/scene/core_types.h"
#include "common/scene/lights.h"
#include "common/scene/materials.h"
#include "common/scene/windows.h"
#include "tests/support/wait_until.h"

// A compromised import process can answer anything; what gets past these checks cannot break the client.

namespace umbriel {
namespace {

constexpr TreeLimits kLimits{10, 60};

// A scene with one of everything an importer builds.
struct Everything {
    TypeRegistry types;
    IdSource ids;
    std::unique_ptr<Aspect> scene;
    Ref<Node> root, child;
    Ref<Transform> transform;
    Ref<Geometry> geometry;
    Ref<Material> material;
    Ref<Texture> texture;
    Ref<Image> image;
    Ref<SpotLight> lamp;
    Ref<PerspectiveCamera> camera;
    Ref<AnimatedPose> pose;
    Ref<AnimationChannel> channel;
    Ref<Animation> animation;
    Ref<LoadedScene> loaded;

    Everything() {
        registerCoreTypes(types);
        scene = std::make_unique<Aspect>(types, ids);
        root = scene->create<Node>("root");
        child = scene->create<Node>("child");
        transform = scene->create<Transform>();
        geometry = scene->create<Geometry>();
        material = scene->create<Material>("paint");
        texture = scene->create<Texture>();
        image = scene->create<Image>();
        lamp = scene->create<SpotLight>();
        camera = scene->create<PerspectiveCamera>("camera 0");
        pose = scene->create<AnimatedPose>();
        channel = scene->create<AnimationChannel>();
        animation = scene->create<Animation>();
        loaded = scene->create<LoadedScene>("file");
        scene->edit(root).set<&Node::core>(lamp).append<&Node::children>(child);
        scene->edit(child).set<&Node::core>(geometry);
        scene->edit(geometry)
            .assign<&Geometry::positions>(std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})
            .assign<&Geometry::indices>(std::vector<std::uint32_t>{0, 1, 2})
            .set<&Geometry::material>(material);
        scene->edit(material).set<&Material::baseColourTexture>(texture);
        scene->edit(texture).set<&Texture::image>(image);
        scene->edit(image).set<&Image::width>(1u).set<&Image::height>(1u).assign<&Image::texels>(
            std::vector<std::uint8_t>{1, 2, 3, 4});
        scene->edit(lamp).set<&SpotLight::beacon>(child);
        scene->edit(camera).set<&PerspectiveCamera::beacon>(root);
        scene->edit(pose).set<&AnimatedPose::target>(transform);
        scene->edit(channel)
            .set<&AnimationChannel::pose>(pose)
            .assign<&AnimationChannel::times>(std::vector<float>{0, 1})
            .assign<&AnimationChannel::values>(std::vector<float>{0, 0, 0, 1, 1, 1});
        scene->edit(animation).append<&Animation::channels>(channel).set<&Animation::duration>(1.0);
        scene->edit(loaded)
            .set<&LoadedScene::root>(root)
            .append<&LoadedScene::cameras>(Ref<Container>(camera.id))
            .append<&LoadedScene::animations>(animation);
    }
};

TEST(Validate, WhatAnImporterBuildsPasses) {
    const Everything whole;
    const auto valid = validateLoadedScene(*whole.scene, whole.loaded, kLimits);
    EXPECT_TRUE(valid) << valid.error().message;
}

struct Corruption {
    const char* name;
    std::function<void(Everything&)> apply;
    const char* reason;
};

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

const std::vector<Corruption> kCorruptions = {
    {"IndexBeyondVertices", [](Everything& e) { e.scene->edit(e.geometry).setElement<&Geometry::indices>(2, 3u); },
     "index beyond its vertices"},
    {"IncompleteTriangle", [](Everything& e) { e.scene->edit(e.geometry).append<&Geometry::indices>(0u); },
     "incomplete"},
    {"ShortNormals",
     [](Everything& e) {
         e.scene->edit(e.geometry).assign<&Geometry::normals>(std::vector<glm::vec3>{{0, 0, 1}});
     },
     "different lengths"},
    {"NanPosition",
     [](Everything& e) { e.scene->edit(e.geometry).setElement<&Geometry::positions>(1, glm::vec3(0, kNan, 0)); },
     "positions are not finite"},
    {"InfiniteTranslation",
     [](Everything& e) {
         e.scene->edit(e.transform)
             .set<&Transform::translation>(glm::dvec3(std::numeric_limits<double>::infinity(), 0, 0));
     },
     "translation are not finite"},
    {"NanRoughness", [](Everything& e) { e.scene->edit(e.material).set<&Material::roughness>(kNan); }, "roughness"},
    {"ShortImage", [](Everything& e) { e.scene->edit(e.image).set<&Image::width>(2u); }, "do not suit its size"},
    {"HugeImage", [](Everything& e) { e.scene->edit(e.image).set<&Image::width>(0xffffffffu); }, "impossible size"},
    {"Cycle", [](Everything& e) { e.scene->edit(e.child).append<&Node::children>(e.root); }, "cycle"},
    {"TwoParents",
     [](Everything& e) {
         const Ref<Node> other = e.scene->create<Node>();
         e.scene->edit(other).append<&Node::children>(e.child);
     },
     "two parents"},
    {"SameChildTwice", [](Everything& e) { e.scene->edit(e.root).append<&Node::children>(e.child); }, "two parents"},
    {"TooDeep",
     [](Everything& e) {
         Ref<Node> last = e.child;
         for (int i = 0; i < 12; ++i) {
             const Ref<Node> next = e.scene->create<Node>();
             e.scene->edit(last).append<&Node::children>(next);
             last = next;
         }
     },
     "too deep"},
    {"JointsTooDeep",
     [](Everything& e) {
         // 2 steps for each of them.
         const Ref<Skin> skin = e.scene->create<Skin>();
         e.scene->edit(skin)
             .assign<&Skin::joints>(std::vector<Ref<Node>>(40, e.child))
             .assign<&Skin::inverseBinds>(std::vector<glm::mat4>(40, glm::mat4(1.0f)));
     },
     "lies too deep"},
    {"ChildIsNoNode", [](Everything& e) { e.scene->edit(e.root).append<&Node::children>(Ref<Node>(e.material.id)); },
     "not fit"},
    {"ChildIsNothing", [](Everything& e) { e.scene->edit(e.root).append<&Node::children>(Ref<Node>()); },
     "refers to nothing"},
    {"CoreDangles", [](Everything& e) { e.scene->edit(e.child).set<&Node::core>(Ref<Container>(ContainerId{999})); },
     "#999"},
    {"MaterialIsNone",
     [](Everything& e) { e.scene->edit(e.geometry).set<&Geometry::material>(Ref<Container>(e.root.id)); }, "not fit"},
    {"LampIsInsideOut", [](Everything& e) { e.scene->edit(e.lamp).set<&SpotLight::innerAngle>(1.5f); }, "out of range"},
    {"LampIsNegative", [](Everything& e) { e.scene->edit(e.lamp).set<&SpotLight::intensity>(glm::vec3(-1)); },
     "out of range"},
    {"CameraIsFlat", [](Everything& e) { e.scene->edit(e.camera).set<&PerspectiveCamera::fovY>(0.0); }, "out of range"},
    {"KeysDescend", [](Everything& e) { e.scene->edit(e.channel).setElement<&AnimationChannel::times>(0, 2.0f); },
     "ascend"},
    {"ValuesMissing", [](Everything& e) { e.scene->edit(e.channel).resize<&AnimationChannel::values>(5); },
     "do not suit"},
    {"PoseWithoutTarget", [](Everything& e) { e.scene->edit(e.pose).set<&AnimatedPose::target>(Ref<Transform>()); },
     "no target"},
    {"AWindowInAFile", [](Everything& e) { e.scene->create<Window>(); }, "does not belong"},
    {"TwoLoadedScenes",
     [](Everything& e) {
         const auto second = e.scene->create<LoadedScene>();
         e.scene->edit(second).set<&LoadedScene::root>(e.root);
     },
     "several"},
    {"NoRoot", [](Everything& e) { e.scene->edit(e.loaded).set<&LoadedScene::root>(Ref<Node>()); }, "no root"},
};

class Corrupted : public testing::TestWithParam<Corruption> {};

TEST_P(Corrupted, IsRefused) {
    Everything whole;
    GetParam().apply(whole);
    const auto valid = validateLoadedScene(*whole.scene, whole.loaded, kLimits);
    ASSERT_FALSE(valid);
    EXPECT_NE(valid.error().message.find(GetParam().reason), std::string::npos) << valid.error().message;
}

INSTANTIATE_TEST_SUITE_P(Scenes, Corrupted, testing::ValuesIn(kCorruptions),
                         [](const auto& info) { return std::string(info.param.name); });

// The bytes an import process answers with for this scene.
std::vector<std::byte> answerOf(const Everything& whole) {
    int ends[2];
    UMBRIEL_ASSERT(pipe(ends) == 0, "no pipe");
    std::vector<std::byte> bytes;
    std::thread writer([&] {
        AnswerWriter answer(ends[1]);
        answer.warning("a warning");
        answer.scene(*whole.scene, whole.loaded);
        close(ends[1]);
    });
    std::byte piece[4096];
    for (ssize_t got; (got = read(ends[0], piece, sizeof(piece))) > 0;) bytes.insert(bytes.end(), piece, piece + got);
    writer.join();
    close(ends[0]);
    return bytes;
}

struct Received {
    TypeRegistry types;
    IdSource ids;
    std::unique_ptr<Aspect> scene;
    Ref<LoadedScene> loaded;
    AnswerReader::End end = AnswerReader::End::Late;
    std::vector<std::string> warnings;

    explicit Received(const std::vector<std::byte>& answer) {
        registerCoreTypes(types);
        scene = std::make_unique<Aspect>(types, ids);
        int ends[2];
        UMBRIEL_ASSERT(pipe(ends) == 0, "no pipe");
        std::thread writer([&] {
            // A reader that has seen enough closes its end.
            for (std::size_t at = 0; at < answer.size();) {
                const ssize_t sent = write(ends[1], answer.data() + at, answer.size() - at);
                if (sent <= 0) break;
                at += static_cast<std::size_t>(sent);
            }
            close(ends[1]);
        });
        {
            AnswerReader reader(ends[0], std::chrono::steady_clock::now() + test::kPatience, 1 << 20);
            end = reader.read(*scene, 1000);
            loaded = reader.scene();
            warnings = reader.warnings();
        }
        writer.join();
    }
};

TEST(Answer, ArrivesAsItWasSent) {
    const Everything whole;
    const Received received(answerOf(whole));
    ASSERT_EQ(received.end, AnswerReader::End::Done);
    EXPECT_TRUE(received.scene->equals(*whole.scene));
    EXPECT_EQ(received.loaded, whole.loaded);
    EXPECT_EQ(received.warnings, std::vector<std::string>{"a warning"});
}

TEST(Answer, EveryTruncationIsNoScene) {
    const Everything whole;
    std::vector<std::byte> answer = answerOf(whole);
    while (!answer.empty()) {
        answer.pop_back();
        ASSERT_EQ(Received(answer).end, AnswerReader::End::Closed) << answer.size();
    }
}

RC_GTEST_PROP(Answer, DamagedBytesAreRefusedOrGiveAValidScene, ()) {
    static const Everything whole;
    static const std::vector<std::byte> original = answerOf(whole);
    std::vector<std::byte> answer = original;
    const auto flips = *rc::gen::inRange(1, 6);
    for (int i = 0; i < flips; ++i) {
        const auto at = *rc::gen::inRange<std::size_t>(0, answer.size());
        answer[at] = static_cast<std::byte>(*rc::gen::inRange(0, 256));
    }
    const Received received(answer);
    // Neither reader nor validation may break, which the sanitizers watch.
    if (received.end == AnswerReader::End::Done) {
        const auto valid = validateLoadedScene(*received.scene, received.loaded, kLimits);
        const Geometry* geometry = received.scene->find(whole.geometry);
        for (std::size_t i = 0; valid && geometry && i < geometry->indices.size(); ++i)
            RC_ASSERT(geometry->indices[i] < geometry->positions.size());
    }
}

}  // namespace
}  // namespace umbriel
