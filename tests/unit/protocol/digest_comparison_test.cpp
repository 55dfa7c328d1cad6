#include "common/protocol/digest_comparison.h"

#include <gtest/gtest.h>

#include "common/scene/nodes.h"
#include "tests/support/random_scene.h"

namespace umbriel::protocol {
namespace {

using Kind = DigestDifference::Kind;

// A client's and a server's aspect with their digests; the server answers in pages of four.
struct Comparison : testing::Test {
    Comparison() {
        test::RandomEditor(client).grow(60, 1);
        server.apply(client.commit(), client);
    }
    wire::DigestReply answer(const wire::DigestQuery& query) const {
        StateDigest digest;
        digest.update(server.snapshot(), server);
        wire::DigestReply reply;
        if (const Container* container = server.find(query.container)) {
            for (std::uint32_t i = 0; i < container->type().fields.size(); ++i)
                reply.digests.emplace_back(i, digest.ofField(query.container, i));
            return reply;
        }
        for (const auto& [id, value] : digest.containers(query.after, 5)) reply.digests.emplace_back(id.value, value);
        reply.more = reply.digests.size() == 5;
        if (reply.more) reply.digests.pop_back();
        return reply;
    }
    DigestDifference compare() {
        auto digest = std::make_shared<StateDigest>();
        digest->update(client.snapshot(), client);
        DigestComparison comparison(digest);
        for (int queries = 0; !comparison.difference(); ++queries) {
            EXPECT_LE(queries, 60);
            if (queries > 60) return {};
            comparison.answered(answer(comparison.query()));
        }
        return *comparison.difference();
    }
    static TypeRegistry allTypes() {
        TypeRegistry types;
        registerCoreTypes(types);
        types.add<test::EveryKind>();
        return types;
    }
    TypeRegistry types = allTypes();
    IdSource ids;
    Aspect client{types, ids};
    Aspect server{types, ids};
};

TEST_F(Comparison, equalStatesHaveNoDifference) {
    EXPECT_EQ(compare().kind, Kind::None);
}

TEST_F(Comparison, everyFieldOfEveryContainerIsNamed) {
    std::size_t named = 0;
    for (const ContainerId id : client.ids()) {
        const auto* every = server.findAs<test::EveryKind>(id);
        if (!every) continue;
        Ref<test::EveryKind> ref(id);
        const bool before = every->flag;
        server.edit(ref).set<&test::EveryKind::flag>(!before);
        const DigestDifference difference = compare();
        ASSERT_EQ(difference.kind, Kind::Field);
        EXPECT_EQ(difference.container, id);
        EXPECT_EQ(every->type().fields[difference.field].name, "flag");
        server.edit(ref).set<&test::EveryKind::flag>(before);
        ++named;
    }
    EXPECT_GT(named, 5u);
}

TEST_F(Comparison, aMissingAndAnExtraContainerAreNamed) {
    const auto all = client.ids();
    server.destroy(all.back());
    DigestDifference difference = compare();
    EXPECT_EQ(difference.kind, Kind::Missing);
    EXPECT_EQ(difference.container, all.back());
    const auto extra = server.create<Transform>();
    difference = compare();
    EXPECT_EQ(difference.kind, Kind::Missing) << "the first in order";
    server.destroy(extra.id);
    server.destroy(all[7]);
    difference = compare();
    EXPECT_EQ(difference.container, all[7]);
}

TEST_F(Comparison, nonsenseEndsIt) {
    auto digest = std::make_shared<StateDigest>();
    digest->update(client.snapshot(), client);
    DigestComparison comparison(digest);
    wire::DigestReply reply;
    reply.more = true;  // for ever, of nothing
    comparison.answered(reply);
    EXPECT_TRUE(comparison.difference());
    DigestComparison again(digest);
    reply.digests = {{1'000'000, 1}};
    again.answered(reply);
    EXPECT_TRUE(again.difference());
}

}  // namespace
}  // namespace umbriel::protocol
