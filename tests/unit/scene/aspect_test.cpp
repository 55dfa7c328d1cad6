#include "common/scene/aspect.h"

#include <gtest/gtest.h>

#include "common/scene/core_types.h"
#include "common/scene/digest.h"
#include "common/scene/nodes.h"
#include "common/scene/print.h"
#include "common/scene/windows.h"
#include "tests/support/every_kind.h"

namespace umbriel {
namespace {

using test::EveryKind;

struct AspectTest : testing::Test {
    AspectTest() {
        registerCoreTypes(types);
        types.add<EveryKind>();
    }
    TypeRegistry types;
    IdSource ids;
    Aspect application{types, ids};
    Aspect drawing{types, ids};
};

using AspectDeathTest = AspectTest;

TEST_F(AspectTest, whatIsEditedIsInvisibleElsewhereUntilItIsApplied) {
    const auto node = application.create<Node>("root");
    EXPECT_EQ(drawing.find(node), nullptr);
    drawing.apply(application.commit(), application);
    application.edit(node).set<&Node::visible>(false);
    EXPECT_TRUE(drawing.get(node).visible);
    drawing.apply(application.commit(), application);
    EXPECT_FALSE(drawing.get(node).visible);
    EXPECT_EQ(drawing.get(node).name.get(), "root");
    EXPECT_TRUE(drawing.commit().empty()) << "what is applied counts as committed";
    EXPECT_TRUE(drawing.equals(application));
}

TEST_F(AspectTest, aHundredChangesOfAFieldAreOneEntry) {
    const auto transform = application.create<Transform>();
    const auto node = application.create<Node>();
    application.commit();
    for (int i = 1; i <= 100; ++i) {
        application.edit(node).set<&Node::core>(transform).set<&Node::visible>(i % 2 == 0);
        application.edit(transform).set<&Transform::translation>({double(i), 0.0, 0.0});
    }
    const ChangeList changes = application.commit();
    ASSERT_EQ(changes.entryCount(), 2u);
    EXPECT_EQ(changes.changed[0].id, transform.id) << "sorted by id";
    EXPECT_EQ(changes.changed[0].fields, FieldMask{1} << 2);
    EXPECT_EQ(changes.changed[1].fields, FieldMask{1} << 2 | FieldMask{1} << 3);
    EXPECT_TRUE(application.commit().empty());
}

TEST_F(AspectTest, whatIsCreatedAndDestroyedWithinAFrameIsNothing) {
    const auto kept = application.create<Node>("kept");
    application.commit();
    const auto node = application.create<Node>("gone");
    application.edit(node).append<&Node::children>(kept);
    application.destroy(node);
    EXPECT_TRUE(application.commit().empty());
    application.edit(kept).set<&Node::visible>(false);
    application.destroy(kept);
    const ChangeList changes = application.commit();
    EXPECT_TRUE(changes.changed.empty()) << "changes of what is gone are gone";
    EXPECT_EQ(changes.destroyed, std::vector<ContainerId>{kept.id});
    EXPECT_EQ(changes.destroyedTypes, std::vector<std::uint32_t>{types.of<Node>().index});
    EXPECT_EQ(application.containerCount(), 0u);
}

TEST_F(AspectTest, settingWhatIsThereAlreadyIsNoChange) {
    const auto every = application.create<EveryKind>("name");
    application.edit(every).assign<&EveryKind::vec3s>({{1, 2, 3}, {4, 5, 6}});
    application.commit();
    application.edit(every)
        .set<&EveryKind::name>("name")
        .set<&EveryKind::real>(6.5f)
        .assign<&EveryKind::vec3s>({{1, 2, 3}, {4, 5, 6}})
        .write<&EveryKind::vec3s>(1, {{4, 5, 6}})
        .resize<&EveryKind::vec3s>(2);
    EXPECT_TRUE(application.commit().empty());
    application.edit(every).set<&EveryKind::real>(-0.0f);
    application.commit();
    application.edit(every).set<&EveryKind::real>(0.0f);
    EXPECT_EQ(application.commit().entryCount(), 1u) << "bit for bit: -0 is not 0";
}

TEST_F(AspectTest, touchedRangesAreThoseOfTheFieldAsItIsAtTheCommit) {
    const auto every = application.create<EveryKind>();
    application.edit(every).resize<&EveryKind::reals>(100);
    application.commit();
    const auto touched = [&] {
        const ChangeList changes = application.commit();
        return changes.changed.at(0).multis.at(0).touched.ranges();
    };
    application.edit(every).setElement<&EveryKind::reals>(90, 1).setElement<&EveryKind::reals>(3, 1);
    application.edit(every).resize<&EveryKind::reals>(50);
    EXPECT_EQ(touched(), (std::vector<IndexRange>{{3, 1}}));
    application.edit(every).resize<&EveryKind::reals>(20);
    EXPECT_EQ(touched(), std::vector<IndexRange>{}) << "a cut alone is a change without ranges";
    application.edit(every).resize<&EveryKind::reals>(10).resize<&EveryKind::reals>(30);
    EXPECT_EQ(touched(), (std::vector<IndexRange>{{10, 20}})) << "10 to 19 are zeros now";
    application.edit(every).append<&EveryKind::reals>(5);
    EXPECT_EQ(touched(), (std::vector<IndexRange>{{30, 1}}));
}

TEST_F(AspectTest, editsNestEvenOnTheSameContainer) {
    const auto node = application.create<Node>();
    const auto transform = application.create<Transform>();
    application.commit();
    {
        auto outer = application.edit(node);
        outer.only<&Node::visible, &Node::core>().set<&Node::visible>(false);
        {
            auto inner = application.edit(node);
            inner.append<&Node::children>(node);
            application.edit(transform).set<&Transform::translation>({1.0, 0.0, 0.0});
        }
        outer.set<&Node::core>(transform);
        EXPECT_EQ(outer.read().children.size(), 1u);
    }
    const ChangeList changes = application.commit();
    ASSERT_EQ(changes.changed.size(), 2u);
    EXPECT_EQ(changes.changed[0].fields, FieldMask{0b1110});
}

TEST_F(AspectDeathTest, misuseEndsTheProcessWithAReason) {
    const auto node = application.create<Node>();
    EXPECT_DEATH(application.edit(node).only<&Node::core>().set<&Node::visible>(false), "did not announce the field");
    EXPECT_DEATH(
        {
            auto edit = application.edit(node);
            application.commit();
        },
        "commit while an edit is open");
    EXPECT_DEATH(
        {
            auto edit = application.edit(node);
            application.destroy(node);
        },
        "destroyed while it is edited");
    EXPECT_DEATH(
        {
            auto edit = application.edit(node);
            application.apply({}, drawing);
        },
        "an edit is open");
    EXPECT_DEATH(application.get(Ref<Transform>(node.id)), "no such container of this type");
    EXPECT_DEATH(application.destroy({77}), "no such container");
    EXPECT_DEATH(application.edit(node).setElement<&Node::children>(0, node), "elements out of range");
}

TEST_F(AspectTest, referencesToWhatIsGoneResolveToNothing) {
    const auto node = application.create<Node>();
    const auto transform = application.create<Transform>();
    application.edit(node).set<&Node::core>(transform);
    application.destroy(transform);
    EXPECT_EQ(application.find(application.get(node).core.get()), nullptr);
    EXPECT_EQ(application.findAs<Node>(transform), nullptr);
    EXPECT_EQ(application.findAs<Transform>(node), nullptr) << "nor does one to another type";
}

// The thesis lets a thread with an empty list overwrite what the other one edited; here the applied list wins for the
// fields that are in it and for no others, whichever way round it is applied.
TEST_F(AspectTest, theAppliedListWinsForItsFieldsInBothDirections) {
    const auto every = application.create<EveryKind>();
    application.edit(every).resize<&EveryKind::reals>(4);
    drawing.apply(application.commit(), application);
    Aspect third(types, ids);
    third.apply(application.snapshot(), application);
    const auto conflict = [&](Aspect& loser, Aspect& winner, float losing, float winning) {
        loser.edit(every).set<&EveryKind::real>(losing).set<&EveryKind::integer>(int(losing));
        loser.edit(every).setElement<&EveryKind::reals>(0, losing);
        winner.edit(every).set<&EveryKind::real>(winning).set<&EveryKind::dword>(unsigned(winning));
        winner.edit(every).setElement<&EveryKind::reals>(1, winning).append<&EveryKind::reals>(winning);
        const ChangeList won = winner.commit();
        loser.apply(won, winner);
        third.apply(won, winner);
        EXPECT_EQ(loser.get(every).real, winning);
        EXPECT_EQ(loser.get(every).integer, int(losing)) << "not in the list: kept";
        EXPECT_EQ(loser.get(every).dword, unsigned(winning));
        EXPECT_EQ(loser.get(every).reals[1], winning);
        EXPECT_EQ(loser.get(every).reals[0], winner.get(every).reals[0]) << "the whole field wins";
        // The loser's list still names the field, with the value that won: all aspects agree afterwards.
        const ChangeList lost = loser.commit();
        ASSERT_EQ(lost.changed.size(), 1u);
        EXPECT_TRUE(lost.changed[0].fields >> 7 & 1) << "real";
        EXPECT_EQ(lost.changed[0].multis.at(0).touched.elementCount(), winner.get(every).reals.size())
            << "all that was replaced counts as touched: a receiver by ranges may have had what lost";
        winner.apply(lost, loser);
        third.apply(lost, loser);
        EXPECT_EQ(winner.get(every).real, winning);
        EXPECT_EQ(winner.get(every).integer, int(losing));
        EXPECT_TRUE(winner.equals(loser));
        EXPECT_TRUE(third.equals(loser));
    };
    conflict(application, drawing, 10, 20);
    conflict(drawing, application, 30, 40);
    // An empty list overwrites nothing.
    drawing.edit(every).set<&EveryKind::real>(50.0f);
    drawing.apply(application.commit(), application);
    EXPECT_EQ(drawing.get(every).real, 50.0f);
}

TEST_F(AspectTest, whatOneDestroyedTheOthersChangesDoNotBringBack) {
    const auto node = application.create<Node>();
    drawing.apply(application.commit(), application);
    application.destroy(node);
    drawing.edit(node).set<&Node::visible>(false);
    application.apply(drawing.commit(), drawing);
    EXPECT_EQ(application.find(node), nullptr);
    const ChangeList changes = application.commit();
    EXPECT_EQ(changes.destroyed.size(), 1u);
    drawing.apply(changes, application);
    EXPECT_EQ(drawing.containerCount(), 0u);
    drawing.apply(changes, application);
    EXPECT_TRUE(drawing.commit().empty());
}

TEST_F(AspectTest, aSnapshotIsTheWholeAspectWithoutItsDefaults) {
    const auto first = application.create<Viewport>();
    const auto second = application.create<Viewport>("second");
    const ChangeList snapshot = application.snapshot();
    EXPECT_EQ(snapshot.created.size(), 2u);
    ASSERT_EQ(snapshot.changed.size(), 1u);
    EXPECT_EQ(snapshot.changed[0].id, second.id);
    EXPECT_EQ(snapshot.changed[0].fields, FieldMask{1});
    // Over an aspect that has something else there, it brings the defaults back as well.
    drawing.apply(snapshot, application);
    drawing.edit(first).set<&Viewport::passive>(true);
    drawing.commit();
    drawing.apply(application.snapshot(), application);
    EXPECT_TRUE(drawing.equals(application));
    EXPECT_EQ(application.commit().created.size(), 2u) << "a snapshot commits nothing";
}

TEST_F(AspectTest, aMergedAspectTravelsOnWithTheNextList) {
    const auto every = application.create<EveryKind>();
    application.edit(every).resize<&EveryKind::dwords>(20'000);
    drawing.apply(application.commit(), application);
    Aspect loader(types, ids);
    loader.apply(application.snapshot(), application);
    // The application goes on while the loader works on an older state.
    application.edit(every).setElement<&EveryKind::dwords>(15'000, 7u);
    drawing.apply(application.commit(), application);
    const auto loaded = loader.create<Node>("loaded");
    loader.edit(every).setElement<&EveryKind::dwords>(1, 1u).set<&EveryKind::text>("loaded");
    application.merge(loader.commit(), loader);
    EXPECT_EQ(application.get(every).text.get(), "loaded");
    const ChangeList changes = application.commit();
    EXPECT_EQ(changes.created.size(), 1u);
    // Touched is all that differs, the application's own change that lost as well: receivers by ranges agree, too.
    const auto& ranges = changes.changed.back().multis.empty() ? changes.changed.front().multis[0].touched.ranges()
                                                               : changes.changed.back().multis[0].touched.ranges();
    const auto touches = [&](std::size_t index) {
        return std::any_of(ranges.begin(), ranges.end(), [&](const IndexRange& range) {
            return index >= range.first && index < range.first + range.count;
        });
    };
    EXPECT_TRUE(touches(1));
    EXPECT_TRUE(touches(15'000));
    EXPECT_FALSE(touches(9000)) << "chunks that are equal are not touched";
    drawing.apply(changes, application);
    EXPECT_TRUE(drawing.equals(application));
    EXPECT_EQ(drawing.get(loaded).name.get(), "loaded");
}

TEST_F(AspectTest, aMergedListBringsBackWhatWasDestroyedMeanwhile) {
    const auto every = application.create<EveryKind>("back");
    application.edit(every).resize<&EveryKind::reals>(3);
    drawing.apply(application.commit(), application);
    Aspect loader(types, ids);
    loader.apply(application.snapshot(), application);
    loader.edit(every).set<&EveryKind::real>(9.0f);
    application.destroy(every);
    application.merge(loader.snapshot(), loader);
    const ChangeList changes = application.commit();
    EXPECT_TRUE(changes.destroyed.empty());
    EXPECT_TRUE(changes.created.empty()) << "the others have it";
    drawing.apply(changes, application);
    EXPECT_TRUE(drawing.equals(application));
    EXPECT_EQ(drawing.get(every).real, 9.0f);
}

TEST_F(AspectTest, untypedEditsRecordLikeTypedOnes) {
    RawEdit raw(drawing);
    const TypeDescriptor& type = types.of<EveryKind>();
    EXPECT_FALSE(raw.create({0}, type));
    EXPECT_TRUE(raw.create({1000}, type));
    EXPECT_FALSE(raw.create({1000}, type));
    EXPECT_EQ(ids.next().value, 1001u);
    const float value = 2.0f;
    raw.setSingle({1000}, 7, std::as_bytes(std::span(&value, 1)));
    raw.setText({1000}, 0, "name");
    raw.resizeMulti({1000}, 20, 5);
    const ChangeList changes = drawing.commit();
    EXPECT_EQ(changes.created.size(), 1u);
    EXPECT_EQ(changes.changed.at(0).fields, FieldMask{1} | FieldMask{1} << 7 | FieldMask{1} << 20);
    EXPECT_TRUE(raw.destroy({1000}));
    EXPECT_FALSE(raw.destroy({1000}));
    EXPECT_FALSE(raw.create({1000}, type)) << "an id is never used again within a list";
    EXPECT_EQ(drawing.commit().destroyed.size(), 1u);
}

TEST_F(AspectTest, textsAreCutWhereTheLimitFallsBetweenCharacters) {
    std::string text(kMaxTextBytes - 1, 'x');
    const auto node = application.create<Node>(text + "\xc3\xa4z");
    EXPECT_EQ(application.get(node).name.get(), text);
    application.edit(node).set<&Node::name>(text + "yz");
    EXPECT_EQ(application.get(node).name.get(), text + "y");
}

struct Base : Container {
    static constexpr std::string_view kTypeName = "T";
    Single<float> a;
    Multi<float> m;
    Single<std::uint32_t> b;
    Single<test::Season> season;
    static void declare(TypeBuilder<Base>& type) { type.field<&Base::a>("a"); }
};
struct OtherKind : Base {
    static void declare(TypeBuilder<OtherKind>& type) { type.field<&OtherKind::b>("a"); }
};
struct OtherName : Base {
    static void declare(TypeBuilder<OtherName>& type) { type.field<&OtherName::a>("b"); }
};
struct IsMulti : Base {
    static void declare(TypeBuilder<IsMulti>& type) { type.field<&IsMulti::m>("a"); }
};
struct Enumeration : Base {
    static void declare(TypeBuilder<Enumeration>& type) { type.field<&Enumeration::season>("a"); }
};
struct Unshipped : Base {
    static constexpr bool kShipped = false;
    static void declare(TypeBuilder<Unshipped>& type) { type.field<&Unshipped::a>("a"); }
};

TEST(TypeRegistry, theSignatureTellsEveryDeclarationApart) {
    std::vector<std::uint64_t> signatures;
    const auto note = [&](auto... added) {
        TypeRegistry types;
        (types.add<typename decltype(added)::type>(), ...);
        signatures.push_back(types.signature());
    };
    note();
    note(std::type_identity<Base>{});
    note(std::type_identity<OtherKind>{});
    note(std::type_identity<OtherName>{});
    note(std::type_identity<IsMulti>{});
    note(std::type_identity<Enumeration>{});
    note(std::type_identity<Unshipped>{});
    note(std::type_identity<Base>{}, std::type_identity<Node>{});
    note(std::type_identity<Node>{}, std::type_identity<Base>{});
    const std::size_t count = signatures.size();
    std::sort(signatures.begin(), signatures.end());
    EXPECT_EQ(std::unique(signatures.begin(), signatures.end()) - signatures.begin(), std::ptrdiff_t(count));
    TypeRegistry first;
    TypeRegistry second;
    registerCoreTypes(first);
    registerCoreTypes(second);
    EXPECT_EQ(first.signature(), second.signature());
    EXPECT_EQ(first.byName("Geometry"), &first.of<Geometry>());
    EXPECT_EQ(first.at(static_cast<std::uint32_t>(first.size())), nullptr);
}

TEST_F(AspectTest, printingShowsWhatIsNotDefaultAndKeepsToOneLine) {
    const auto transform = application.create<Transform>("wheel \n\"1\"");
    EXPECT_EQ(describe(application.get(transform)), "Transform #1 \"wheel \\x0a\\\"1\\\"\" {}");
    application.edit(transform).set<&Transform::translation>({0.0, 1.0, 2.5});
    EXPECT_EQ(describe(application.get(transform)), "Transform #1 \"wheel \\x0a\\\"1\\\"\" {translation: (0, 1, 2.5)}");
    const auto other = application.create<Transform>();
    EXPECT_EQ(describe(application.get(other), true),
              "Transform #2 {linear: ((1, 0, 0), (0, 1, 0), (0, 0, 1)), translation: (0, 0, 0)}");
    EXPECT_EQ(describeDifference(application.get(transform), application.get(other)), "name, translation");
    EXPECT_EQ(describeDifference(application.get(other), application.get(other)), "");
    const auto geometry = application.create<Geometry>();
    application.edit(geometry).assign<&Geometry::indices>({5, 6, 7, 8, 9, 10});
    EXPECT_EQ(describe(application.get(geometry)), "Geometry #3 {indices: 6 [5, 6, 7, 8, ...]}");
    EXPECT_EQ(describeDifference(application.get(geometry), application.get(other)), "type (Geometry and Transform)");
}

}  // namespace
}  // namespace umbriel
