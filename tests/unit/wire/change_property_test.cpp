#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tests/unit/wire/twin.h"

namespace umbriel::wire {
namespace {

using test::Random;
using test::RandomEditor;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kSequences = 1000;  // instrumented code is slower; the release build does them all
constexpr int kProperties = 300;
#else
constexpr int kSequences = 10'000;
constexpr int kProperties = 1000;
#endif

// A client whose list of changes reaches a server by bytes, list by list, with parts and blobs as small as can be now
// and then.
struct Session {
    explicit Session(const TypeRegistry& types) : client(types, ids), editor(client) {}

    EncodeOptions options(Random& random) {
        EncodeOptions options;
        options.maxPartBytes = random.below(2) == 0 ? 512 + random.below(4096) : 1024 * 1024;
        options.blobThreshold = random.below(2) == 0 ? 256 : 32 * 1024;
        return options;
    }
    void ship(Twin& server, Random& random) {
        const ChangeList changes = client.commit();
        digest.update(changes, client);
        server.receive(encodeChanges(changes, client, options(random)));
    }

    IdSource ids;
    Aspect client;
    RandomEditor editor;
    StateDigest digest;
};

TypeRegistry allTypes() {
    TypeRegistry types;
    registerCoreTypes(types);
    types.add<test::EveryKind>();
    return types;
}

TEST(ChangeProperty, snapshotAndAnyEditsGiveTheClientsGraph) {
    const TypeRegistry types = allTypes();
    const auto property = [&](std::uint64_t seed, const std::vector<std::uint64_t>& words) {
        Random random(seed);
        Session session(types);
        session.editor.grow(random.below(40), seed);
        Twin early(types);
        session.ship(early, random);
        for (const std::uint64_t word : words) {
            if (word % 8 == 0) session.ship(early, random);
            session.editor.step(word);
        }
        session.ship(early, random);
        RC_ASSERT(difference(session.client, session.digest, early.drawing, early.digest) == "");
        Twin late(types);
        late.receive(encodeChanges(session.client.snapshot(), session.client, session.options(random)));
        RC_ASSERT(difference(session.client, session.digest, late.drawing, late.digest) == "");
    };
    auto params = rc::detail::configuration().testParams;
    params.maxSuccess = std::max(params.maxSuccess, kProperties);
    rc::detail::TestMetadata metadata;
    metadata.id = metadata.description = "ChangeProperty";
    const auto result = rc::detail::checkTestable(property, metadata, params);
    std::ostringstream message;
    rc::detail::printResultMessage(result, message);
    EXPECT_TRUE(result.is<rc::detail::SuccessResult>()) << message.str();
}

// Every sequence: a server joins by snapshot while another one has followed all along; some lists later, both have the
// client's graph of 200 containers and more.
TEST(ChangeProperty, thousandsOfSequencesOnLargerGraphs) {
    const TypeRegistry types = allTypes();
    std::unique_ptr<Session> session;
    std::unique_ptr<Twin> early;
    for (int sequence = 0; sequence < kSequences; ++sequence) {
        Random random(static_cast<std::uint64_t>(sequence));
        if (sequence % 50 == 0) {
            session = std::make_unique<Session>(types);
            session->editor.grow(220, random.next());
            early = std::make_unique<Twin>(types);
            session->ship(*early, random);
        }
        session->editor.grow(200, random.next());
        session->ship(*early, random);
        Twin late(types);
        late.receive(encodeChanges(session->client.snapshot(), session->client, session->options(random)));
        for (std::size_t list = 1 + random.below(3); list > 0; --list) {
            for (std::size_t edit = random.below(30); edit > 0; --edit) session->editor.step(random.next());
            const ChangeList changes = session->client.commit();
            session->digest.update(changes, session->client);
            const EncodedChanges encoded = encodeChanges(changes, session->client, session->options(random));
            early->receive(encoded);
            late.receive(encoded);
        }
        ASSERT_EQ(difference(session->client, session->digest, late.drawing, late.digest), "")
            << "sequence " << sequence;
        ASSERT_EQ(early->digest.total(), session->digest.total()) << "sequence " << sequence;
        ASSERT_TRUE(early->drawing.equals(session->client)) << "sequence " << sequence;
    }
}

}  // namespace
}  // namespace umbriel::wire
