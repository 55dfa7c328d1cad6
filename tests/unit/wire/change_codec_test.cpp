#include "common/wire/change_codec.h"

#include <gtest/gtest.h>

#include <set>

#include "common/scene/animation.h"
#include "tests/unit/wire/twin.h"

namespace umbriel::wire {
namespace {

using test::EveryKind;
using test::Season;

struct ChangeCodec : testing::Test {
    ChangeCodec() {
        registerCoreTypes(types);
        types.add<EveryKind>();
    }
    EncodedChanges ship(Twin& server, const EncodeOptions& options = {}) {
        const ChangeList changes = client.commit();
        digest.update(changes, client);
        EncodedChanges encoded = encodeChanges(changes, client, options);
        server.receive(encoded);
        return encoded;
    }
    std::string differenceTo(const Twin& server) const {
        return difference(client, digest, server.drawing, server.digest);
    }

    TypeRegistry types;
    IdSource ids;
    Aspect client{types, ids};
    StateDigest digest;
};

glm::mat3 turned(float angle) {
    return glm::mat3(std::cos(angle), std::sin(angle), 0, -std::sin(angle), std::cos(angle), 0, 0, 0, 1);
}

TEST_F(ChangeCodec, aTypeAddedByItsDeclarationAloneIsEditedTrackedShippedDigestedAndPrinted) {
    const auto every = client.create<EveryKind>("added");
    const auto node = client.create<Node>();
    {
        auto edit = client.edit(every);
        edit.set<&EveryKind::flag>(false).set<&EveryKind::byte>(200).set<&EveryKind::word>(60000);
        edit.set<&EveryKind::dword>(4000000000u).set<&EveryKind::integer>(-5).set<&EveryKind::qword>(1ull << 63);
        edit.set<&EveryKind::real>(0.1f).set<&EveryKind::wide>(0.1).set<&EveryKind::vec2>({8, 9});
        edit.set<&EveryKind::vec3>({8, 9, 10}).set<&EveryKind::vec4>({8, 9, 10, 11}).set<&EveryKind::dvec3>({1, 2, 4});
        edit.set<&EveryKind::mat3>(glm::mat3(2))
            .set<&EveryKind::mat4>(glm::mat4(3))
            .set<&EveryKind::dmat4>(glm::dmat4(4));
        edit.set<&EveryKind::id>(node.id).set<&EveryKind::text>("a \"text\"\n").set<&EveryKind::season>(Season::Winter);
        edit.set<&EveryKind::node>(node);
        edit.assign<&EveryKind::bytes>({1, 2}).assign<&EveryKind::words>({3}).assign<&EveryKind::dwords>({4u});
        edit.assign<&EveryKind::integers>({-1}).assign<&EveryKind::qwords>({5}).assign<&EveryKind::reals>({6.0f});
        edit.assign<&EveryKind::wides>({7.0}).assign<&EveryKind::vec2s>({{1, 2}}).assign<&EveryKind::vec3s>(
            {{1, 2, 3}});
        edit.assign<&EveryKind::vec4s>({{1, 2, 3, 4}}).assign<&EveryKind::dvec3s>({{1, 2, 3}});
        edit.assign<&EveryKind::mat3s>({glm::mat3(1)}).assign<&EveryKind::mat4s>({glm::mat4(1)});
        edit.assign<&EveryKind::dmat4s>({glm::dmat4(1)}).assign<&EveryKind::ids>({node.id});
        edit.assign<&EveryKind::seasons>({Season::Summer}).append<&EveryKind::nodes>(node);
    }
    const std::size_t fieldCount = types.of<EveryKind>().fields.size();
    const ChangeList changes = client.commit();
    ASSERT_EQ(changes.changed.size(), 1u);
    EXPECT_EQ(changes.changed[0].fields, (FieldMask{1} << fieldCount) - 1) << "every field is tracked";
    digest.update(changes, client);

    Twin server(types);
    server.receive(encodeChanges(changes, client));
    EXPECT_EQ(differenceTo(server), "");
    EXPECT_EQ(describe(server.drawing.get(every)),
              "EveryKind #1 \"added\" {flag: false, byte: 200, word: 60000, dword: 4000000000, integer: -5, "
              "qword: 9223372036854775808, real: 0.1, wide: 0.1, vec2: (8, 9), vec3: (8, 9, 10), vec4: (8, 9, 10, 11), "
              "dvec3: (1, 2, 4), mat3: ((2, 0, 0), (0, 2, 0), (0, 0, 2)), "
              "mat4: ((3, 0, 0, 0), (0, 3, 0, 0), (0, 0, 3, 0), (0, 0, 0, 3)), "
              "dmat4: ((4, 0, 0, 0), (0, 4, 0, 0), (0, 0, 4, 0), (0, 0, 0, 4)), id: #2, text: \"a \\\"text\\\"\\x0a\", "
              "season: 3, node: #2, bytes: 2 [1, 2], words: 1 [3], dwords: 1 [4], integers: 1 [-1], qwords: 1 [5], "
              "reals: 1 [6], wides: 1 [7], vec2s: 1 [(1, 2)], vec3s: 1 [(1, 2, 3)], vec4s: 1 [(1, 2, 3, 4)], "
              "dvec3s: 1 [(1, 2, 3)], mat3s: 1 [((1, 0, 0), (0, 1, 0), (0, 0, 1))], "
              "mat4s: 1 [((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))], "
              "dmat4s: 1 [((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))], ids: 1 [#2], seasons: 1 [1], "
              "nodes: 1 [#2]}");

    // Each field alone is noticed by the digest, and travels alone.
    for (std::uint32_t i = 0; i < fieldCount; ++i) {
        const std::uint64_t before = digest.total();
        RawEdit edit(client);
        const FieldDescriptor& field = types.of<EveryKind>().fields[i];
        if (field.isMulti)
            edit.resizeMulti(every.id, i, 3);
        else if (field.kind == ElementKind::String)
            edit.setText(every.id, i, "other");
        else
            edit.setSingle(every.id, i, std::vector<std::byte>(infoOf(field.kind).size, std::byte{0}));
        if (field.name == "flag") client.edit(every).set<&EveryKind::flag>(true);
        const EncodedChanges encoded = ship(server);
        EXPECT_EQ(encoded.entries, 1u) << field.name;
        EXPECT_NE(digest.total(), before) << field.name;
        EXPECT_EQ(differenceTo(server), "") << field.name;
    }
}

TEST_F(ChangeCodec, aMovedTransformTakesAtMost72Bytes) {
    Twin server(types);
    std::vector<Ref<Transform>> transforms;
    for (int i = 0; i < 10'000; ++i) transforms.push_back(client.create<Transform>());
    ship(server);
    client.edit(transforms.back()).set<&Transform::linear>(turned(1)).set<&Transform::translation>({1.0, 2.0, 3.0});
    EncodedChanges encoded = ship(server);
    EXPECT_EQ(encoded.entries, 1u);
    EXPECT_LE(encoded.bytes(), 72u);
    EXPECT_EQ(encoded.bytes(), 60u + 1 + 3 + 1 + 1) << "blob table, id and operation, type, mask";

    for (std::size_t i = 0; i < transforms.size(); ++i) {
        const double t = static_cast<double>(i);
        client.edit(transforms[i])
            .set<&Transform::linear>(turned(float(i) + 2))
            .set<&Transform::translation>({t, 1.0, 0.5});
    }
    encoded = ship(server);
    EXPECT_EQ(encoded.entries, 10'000u);
    EXPECT_LE(encoded.bytes(), 10'000u * 68);
    EXPECT_LE(encoded.bytes(), 10'000u * 63 + 16) << "neighbouring ids take one byte";
    EXPECT_EQ(differenceTo(server), "");

    client.edit(transforms[5]).set<&Transform::translation>({9.0, 9.0, 9.0});
    EXPECT_LE(ship(server).bytes(), 24u + 12) << "only what moved travels";
    EXPECT_EQ(ship(server).parts.size(), 0u) << "nothing is nothing";
}

TEST_F(ChangeCodec, oneVertexOfAMillionTakesLittle) {
    Twin server(types);
    const auto geometry = client.create<Geometry>();
    client.edit(geometry).assign<&Geometry::positions>(std::vector<glm::vec3>(1'000'000, glm::vec3(1)));
    const EncodedChanges whole = ship(server);
    EXPECT_EQ(whole.blobs.size(), 1u);
    EXPECT_EQ(whole.blobs.front().ref.bytes, 12'000'000u);
    EXPECT_LT(whole.bytes(), 64u);
    client.edit(geometry).setElement<&Geometry::positions>(654'321, glm::vec3(2));
    const EncodedChanges one = ship(server);
    EXPECT_LT(one.bytes(), 200u);
    EXPECT_EQ(one.bytes(), 12u + 12) << "blob table 1, head 1, type 1, mask 1, size 3, form 1, gap 3, count 1";
    EXPECT_EQ(differenceTo(server), "");
    // The client still has what the blob was, and the server one chunk less.
    const auto unshared = [](const MultiStorage& a, const MultiStorage& b) {
        std::size_t count = 0;
        for (std::size_t i = 0; i < a.chunkCount(); ++i) count += !a.sharesChunk(i, b);
        return count;
    };
    EXPECT_EQ(unshared(client.get(geometry).positions.storage(), whole.blobs.front().data), 1u);
    EXPECT_EQ(unshared(server.drawing.get(geometry).positions.storage(), *server.blobs.find(whole.blobs[0].ref.hash)),
              1u);
    EXPECT_EQ(
        unshared(server.drawing.get(geometry).positions.storage(), server.waiting.get(geometry).positions.storage()),
        0u);
}

TEST_F(ChangeCodec, theSharedWheelCrossesOnce) {
    Twin server(types);
    const std::vector<glm::vec3> vertices(400, glm::vec3(1.5f, 2.5f, 3.5f));
    const auto wheel = client.create<Geometry>("wheel");
    client.edit(wheel).assign<&Geometry::positions>(vertices);
    for (int i = 0; i < 4; ++i) client.edit(client.create<Node>()).set<&Node::core>(wheel);
    const EncodedChanges inlined = ship(server);
    EXPECT_GE(inlined.bytes(), vertices.size() * 12);
    EXPECT_LT(inlined.bytes(), vertices.size() * 12 + 200);
    EXPECT_EQ(differenceTo(server), "");

    // As a blob, the same content in another geometry is not sent again.
    EncodeOptions blobs;
    blobs.blobThreshold = 1024;
    const auto copy = client.create<Geometry>("the same wheel, loaded twice");
    const auto again = client.create<Geometry>("and again");
    client.edit(copy).assign<&Geometry::positions>(vertices);
    client.edit(again).assign<&Geometry::positions>(vertices);
    const EncodedChanges referred = ship(server, blobs);
    EXPECT_EQ(referred.blobs.size(), 1u);
    ASSERT_EQ(referred.parts.size(), 1u);
    const auto refs = blobsReferenced(referred.parts.front());
    ASSERT_TRUE(refs.has_value());
    EXPECT_EQ(refs.value(), std::vector<BlobRef>{referred.blobs.front().ref});
    EXPECT_LT(referred.bytes(), 150u);
    EXPECT_EQ(differenceTo(server), "");
    EXPECT_EQ(server.blobBytes, vertices.size() * 12);
}

TEST_F(ChangeCodec, partsAreBoundedWhateverTheListHolds) {
    const auto every = client.create<EveryKind>(std::string(3000, 'n'));
    std::vector<std::uint32_t> values(500'000);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint32_t>(i * 7);
    client.edit(every).assign<&EveryKind::dwords>(values).assign<&EveryKind::dmat4s>(std::vector<glm::dmat4>(5));
    for (const std::size_t limit : {std::size_t{4096}, std::size_t{100'000}, std::size_t{1024 * 1024}}) {
        EncodeOptions options;
        options.maxPartBytes = limit;
        options.blobThreshold = ~std::size_t{0};
        const EncodedChanges encoded = encodeChanges(client.snapshot(), client, options);
        EXPECT_GE(encoded.parts.size(), 2'000'000 / limit);
        EXPECT_LE(encoded.parts.size(), 2'000'000 / limit * 11 / 10 + 2) << "parts are filled";
        EXPECT_EQ(encoded.entries, 2u);
        for (const Bytes& part : encoded.parts) EXPECT_LE(part.size(), limit);
        Twin server(types);
        server.receive(encoded);
        EXPECT_TRUE(server.drawing.equals(client));
    }
    // A long write that also cuts the field, and keeps what it does not touch.
    Twin server(types);
    ship(server);
    std::fill_n(values.begin(), 200'000, 1u);
    client.edit(every)
        .write<&EveryKind::dwords>(0, std::span(values).first(200'000))
        .resize<&EveryKind::dwords>(400'000);
    EncodeOptions options;
    options.maxPartBytes = 4096;
    ship(server, options);
    EXPECT_EQ(differenceTo(server), "");
}

TEST_F(ChangeCodec, whatStaysOnTheClientIsNotShipped) {
    Twin server(types);
    const auto pose = client.create<AnimatedPose>();
    const auto node = client.create<Node>();
    client.edit(pose).set<&AnimatedPose::translation>({1.0, 2.0, 3.0});
    EXPECT_EQ(ship(server).entries, 1u);
    EXPECT_EQ(server.drawing.containerCount(), 1u);
    EXPECT_EQ(digest.total(), server.digest.total());
    client.destroy(pose);
    EXPECT_EQ(ship(server).entries, 0u);

    // Unless both ends want it: the import process hands over all it has read.
    client.create<AnimatedPose>();
    EncodeOptions options;
    options.includeUnshipped = true;
    const EncodedChanges all = encodeChanges(client.snapshot(), client, options);
    IdSource otherIds;
    Aspect refusing(types, otherIds);
    Aspect accepting(types, otherIds);
    DecodeLimits limits;
    EXPECT_FALSE(applyChanges(all.parts.front(), refusing, BlobStore(), limits).has_value());
    limits.acceptUnshipped = true;
    EXPECT_TRUE(applyChanges(all.parts.front(), accepting, BlobStore(), limits).has_value());
    EXPECT_TRUE(accepting.equals(client));
    EXPECT_GT(otherIds.next().value, 3u) << "ids that came from elsewhere are not handed out again";
    EXPECT_TRUE(node.id);
}

TEST_F(ChangeCodec, blobsArePutTogetherFromPiecesOfAnySize) {
    MultiStorage data(12);
    data.resize(5000);
    test::Random random(1);
    data.write(0, random.bytes(60'000));
    const Blob blob{{hashOfBlob(data), 12, 60'000}, data};
    std::vector<std::byte> content(60'000);
    data.read(0, content);
    for (const std::size_t piece : {1u, 7u, 12u, 16'384u, 60'000u}) {
        BlobAssembler assembler(blob.ref, 60'000);
        for (std::size_t at = 0; at < content.size(); at += piece)
            ASSERT_TRUE(
                assembler.add(std::span(content).subspan(at, std::min(piece, content.size() - at))).has_value());
        ASSERT_TRUE(assembler.complete());
        const auto finished = assembler.finish();
        ASSERT_TRUE(finished.has_value());
        EXPECT_TRUE(finished.value().data.equals(data));
    }
    BlobAssembler tooLong(blob.ref, 60'000);
    ASSERT_TRUE(tooLong.add(content).has_value());
    EXPECT_EQ(tooLong.add(std::span(content).first(1)).error().message,
              "blob " + toHex(blob.ref.hash) + ": more than its 60000 bytes came");
    content[100] ^= std::byte{1};
    BlobAssembler wrong(blob.ref, 60'000);
    ASSERT_TRUE(wrong.add(content).has_value());
    EXPECT_EQ(wrong.finish().error().message, "blob " + toHex(blob.ref.hash) + ": what came is something else");
    EXPECT_FALSE(BlobAssembler(blob.ref, 59'999).add(content).has_value());
    EXPECT_FALSE(BlobAssembler({{}, 0, 10}, 100).add({}).has_value());
    EXPECT_FALSE(BlobAssembler({{}, 12, 10}, 100).add({}).has_value());
}

TEST_F(ChangeCodec, theNameOfAContentFollowsEveryEdit) {
    const auto every = client.create<EveryKind>();
    client.edit(every).assign<&EveryKind::dwords>(std::vector<std::uint32_t>(100'000, 5u));
    const MultiStorage& data = client.get(every).dwords.storage();
    std::set<Hash128> names = {hashOfBlob(data)};
    for (std::uint32_t i = 0; i < 20; ++i) {
        client.edit(every).setElement<&EveryKind::dwords>(i * 5000, i + 10);
        if (i % 3 == 0) client.commit();
        MultiStorage fresh(4);
        fresh.resize(data.size());
        const auto values = client.get(every).dwords.toVector();
        fresh.write(0, std::as_bytes(std::span(values)));
        EXPECT_EQ(hashOfBlob(data), hashOfBlob(fresh));
        EXPECT_TRUE(names.insert(hashOfBlob(data)).second);
    }
    // Zeros are counted: a content is not the same with one more.
    MultiStorage longer(4);
    MultiStorage shorter(4);
    longer.resize(9);
    shorter.resize(8);
    EXPECT_NE(hashOfBlob(longer), hashOfBlob(shorter));
    // Equal bytes cut into other elements are another blob.
    MultiStorage bytes(1);
    MultiStorage words(2);
    bytes.resize(64);
    words.resize(32);
    EXPECT_NE(hashOfBlob(bytes), hashOfBlob(words));
}

}  // namespace
}  // namespace umbriel::wire
