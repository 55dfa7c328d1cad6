#include "common/scene/digest.h"

#include <gtest/gtest.h>

#include <set>

#include "common/scene/animation.h"
#include "common/scene/lights.h"
#include "tests/support/random_scene.h"

namespace umbriel {
namespace {

using test::EveryKind;

struct DigestTest : testing::Test {
    DigestTest() {
        registerCoreTypes(types);
        types.add<EveryKind>();
    }
    std::uint64_t fromScratch() const {
        StateDigest fresh;
        fresh.update(aspect.snapshot(), aspect);
        return fresh.total();
    }
    std::uint64_t follow() {
        digest.update(aspect.commit(), aspect);
        EXPECT_EQ(digest.total(), fromScratch());
        return digest.total();
    }
    TypeRegistry types;
    IdSource ids;
    Aspect aspect{types, ids};
    StateDigest digest;
};

TEST_F(DigestTest, dependsOnTheStateNotOnItsHistory) {
    EXPECT_EQ(follow(), 0u);
    test::RandomEditor editor(aspect);
    editor.grow(60, 1);
    std::set<std::uint64_t> totals;
    for (std::uint64_t step = 0; step < 300; ++step) {
        for (std::uint64_t i = 0; i < 5; ++i) editor.step(step * 5 + i);
        totals.insert(follow());
    }
    EXPECT_GT(totals.size(), 250u);
    for (const ContainerId id : aspect.ids()) aspect.destroy(id);
    EXPECT_EQ(follow(), 0u);
    EXPECT_TRUE(digest.containers().empty());
}

TEST_F(DigestTest, movingAValueElsewhereChangesIt) {
    const auto a = aspect.create<EveryKind>();
    const auto b = aspect.create<EveryKind>();
    const auto set = [&](Ref<EveryKind> ref, float first, float second) {
        auto edit = aspect.edit(ref);
        edit.assign<&EveryKind::reals>(std::vector<float>(1000))
            .assign<&EveryKind::dwords>(std::vector<std::uint32_t>(1000));
        edit.setElement<&EveryKind::reals>(0, first).setElement<&EveryKind::reals>(256, second);
    };
    std::set<std::uint64_t> totals;
    set(a, 1, 2);
    set(b, 0, 0);
    totals.insert(follow());
    set(a, 2, 1);  // another block of the field
    totals.insert(follow());
    set(a, 0, 0);
    set(b, 1, 2);  // another container
    totals.insert(follow());
    set(b, 0, 0);
    const std::uint32_t one = std::bit_cast<std::uint32_t>(1.0f);
    const std::uint32_t two = std::bit_cast<std::uint32_t>(2.0f);
    aspect.edit(b).setElement<&EveryKind::dwords>(0, one).setElement<&EveryKind::dwords>(256, two);  // another field
    totals.insert(follow());
    aspect.edit(b).setElement<&EveryKind::dwords>(0, 0u).setElement<&EveryKind::dwords>(256, 0u);
    aspect.edit(b).set<&EveryKind::vec2>({5, 6}).set<&EveryKind::qword>(std::uint64_t{0});
    totals.insert(follow());
    aspect.edit(b).set<&EveryKind::qword>(std::bit_cast<std::uint64_t>(glm::vec2(5, 6))).set<&EveryKind::vec2>({0, 0});
    totals.insert(follow());
    EXPECT_EQ(totals.size(), 6u);
}

TEST_F(DigestTest, lengthsCountEvenWhereTheBytesAreZero) {
    const auto every = aspect.create<EveryKind>();
    std::set<std::uint64_t> totals = {follow()};
    const std::size_t sizes[] = {1, 255, 256, 257, 512, 5000, 4096, 100, 0};
    for (const std::size_t size : sizes) {
        aspect.edit(every).resize<&EveryKind::reals>(size);
        totals.insert(follow());
    }
    EXPECT_EQ(totals.size(), std::size(sizes)) << "all differ, but no elements is as before";
}

TEST_F(DigestTest, existenceAndTypeCount) {
    aspect.create<DirectionalLight>();
    const std::uint64_t light = follow();
    Aspect other(types, ids);
    RawEdit(other).create({1}, types.of<PointLight>());
    StateDigest otherDigest;
    otherDigest.update(other.commit(), other);
    EXPECT_NE(otherDigest.total(), light);
    EXPECT_NE(light, 0u);
    aspect.create<AnimatedPose>();
    EXPECT_EQ(follow(), light) << "what is not shipped does not count";
}

TEST_F(DigestTest, namesTheContainerAndFieldThatDiffer) {
    const auto a = aspect.create<EveryKind>();
    const auto b = aspect.create<EveryKind>();
    follow();
    const auto before = digest.containers();
    const std::uint64_t text = digest.ofField(b, 17);
    const std::uint64_t season = digest.ofField(b, 18);
    aspect.edit(b).set<&EveryKind::text>("other");
    follow();
    const auto after = digest.containers();
    ASSERT_EQ(after.size(), 2u);
    EXPECT_EQ(after[0], before[0]);
    EXPECT_NE(after[1], before[1]);
    EXPECT_EQ(after[1].second, digest.ofContainer(b));
    EXPECT_EQ(after[0].first, a.id);
    EXPECT_NE(digest.ofField(b, 17), text);
    EXPECT_EQ(digest.ofField(b, 18), season);
    EXPECT_EQ(digest.ofContainer({99}), 0u);
    EXPECT_EQ(digest.ofField({99}, 0), 0u);
    EXPECT_EQ(digest.ofField(b, 63), 0u);
}

}  // namespace
}  // namespace umbriel
