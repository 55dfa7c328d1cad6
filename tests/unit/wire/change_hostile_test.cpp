#include <gtest/gtest.h>

#include "tests/unit/wire/twin.h"

namespace umbriel::wire {
namespace {

using test::EveryKind;
using test::Season;

// What a peer may send instead of change lists: everything ends in an error that says where and why, or in valid edits.
struct HostileChanges : testing::Test {
    HostileChanges() {
        registerCoreTypes(types);
        types.add<EveryKind>();
    }

    // The message of the error that the bytes give in an aspect that has one Node (#1) and one EveryKind (#2).
    std::string refusal(const Bytes& part, const DecodeLimits& limits = {}) {
        IdSource ids;
        Aspect aspect(types, ids);
        aspect.create<Node>();
        const auto every = aspect.create<EveryKind>();
        aspect.edit(every).resize<&EveryKind::reals>(10);
        aspect.commit();
        const auto applied = applyChanges(part, aspect, blobs, limits);
        return applied ? "" : applied.error().message;
    }
    std::uint32_t every() const { return types.of<EveryKind>().index; }
    std::uint32_t field(std::string_view name) const {
        const auto& fields = types.of<EveryKind>().fields;
        std::uint32_t i = 0;
        while (fields[i].name != name) ++i;
        return i;
    }
    // A part that starts a change of field `name` of the EveryKind.
    Bytes changing(std::string_view name, std::initializer_list<std::uint64_t> varints) {
        Bytes part;
        Writer writer(part);
        for (const std::uint64_t value : {std::uint64_t{0}, std::uint64_t{4 << 2 | 1}, std::uint64_t{every()}})
            writer.varint(value);
        writer.varint(FieldMask{1} << field(name));
        for (const std::uint64_t value : varints) writer.varint(value);
        return part;
    }
    static Bytes varints(std::initializer_list<std::uint64_t> values) {
        Bytes part;
        for (const std::uint64_t value : values) Writer(part).varint(value);
        return part;
    }
    static Bytes with(Bytes part, std::size_t zeros) {
        part.resize(part.size() + zeros);
        return part;
    }

    TypeRegistry types;
    BlobStore blobs;
};

TEST_F(HostileChanges, everyRefusalSaysWhereAndWhy) {
    const std::uint64_t e = every();
    const std::string one = "change list, entry 1";
    EXPECT_EQ(refusal({}), "change list, blob table: the message ends too early");
    EXPECT_EQ(refusal(varints({0})), "");
    EXPECT_EQ(refusal(varints({0, 2})), one + ": its container id is impossible") << "id 0";
    EXPECT_EQ(refusal(varints({0, 1 << 2 | 2})), one + ": its container id is impossible") << "id -1";
    EXPECT_EQ(refusal(varints({0, ~std::uint64_t{0}})), one + ": its container id is impossible");
    EXPECT_EQ(refusal(varints({0, 6 << 2 | 3})), one + ", container #3: it neither creates, changes nor destroys");
    EXPECT_EQ(refusal(varints({0, 6 << 2 | 0, 999})), one + ", container #3: its type is unknown here");
    EXPECT_EQ(refusal(varints({0, 6 << 2 | 0, types.size()})), one + ", container #3: its type is unknown here");
    EXPECT_EQ(refusal(varints({0, 6 << 2 | 0, types.byName("Animation")->index})),
              one + ", container #3 (Animation): its type must not travel");
    EXPECT_EQ(refusal(varints({0, 2 << 2 | 0, 0})),
              one + ", container #1 (Node): what it creates exists, or has been destroyed just now");
    EXPECT_EQ(refusal(varints({0, 6 << 2 | 2})), one + ", container #3: what it destroys does not exist");
    EXPECT_EQ(refusal(varints({0, 2 << 2 | 2, 0 << 2 | 0, 0})),
              "change list, entry 2, container #1 (Node): what it creates exists, or has been destroyed just now");
    EXPECT_EQ(refusal(varints({0, 6 << 2 | 1, e, 1})),
              one + ", container #3 (EveryKind): what it changes does not exist");
    EXPECT_EQ(refusal(varints({0, 2 << 2 | 1, e, 1})),
              one + ", container #1 (EveryKind): the container is of another type");
    EXPECT_EQ(refusal(varints({0, 4 << 2 | 1, e, 0})), one + ", container #2 (EveryKind): it changes no field");
    EXPECT_EQ(refusal(varints({0, 4 << 2 | 1, e, std::uint64_t{1} << 60})),
              one + ", container #2 (EveryKind): it changes a field that the type does not have");
    DecodeLimits few;
    few.maxContainers = 2;
    EXPECT_EQ(refusal(varints({0, 6 << 2 | 0, 0}), few),
              one + ", container #3 (Node): there are more containers than the limit");

    const std::string in = one + ", container #2 (EveryKind), field ";
    EXPECT_EQ(refusal(changing("flag", {1})), "");
    EXPECT_EQ(refusal(changing("flag", {2})), in + "\"flag\": a flag is neither 0 nor 1");
    EXPECT_EQ(refusal(with(changing("season", {3}), 3)), "");
    EXPECT_EQ(refusal(with(changing("season", {4}), 3)),
              in + "\"season\": it has a value that its enumeration does not have");
    EXPECT_EQ(refusal(with(changing("mat4", {}), 63)), in + "\"mat4\": the message ends too early");
    EXPECT_EQ(refusal(with(changing("text", {5}), 4)), in + "\"text\": the message ends too early");
    EXPECT_EQ(refusal(with(changing("text", {65536}), 65536)), "");
    EXPECT_EQ(refusal(with(changing("text", {65537}), 65537)), in + "\"text\": a text is too long");

    EXPECT_EQ(refusal(changing("reals", {3, 0})), "") << "cut to three elements";
    EXPECT_EQ(refusal(changing("reals", {3, 3})), in + "\"reals\": its form is unknown");
    EXPECT_EQ(refusal(changing("reals", {11, 0})), in + "\"reals\": it grows by elements that do not come with it");
    EXPECT_EQ(refusal(with(changing("reals", {20, 1 << 2, 11, 9}), 36)),
              in + "\"reals\": it grows by elements that do not come with it")
        << "element 10 is missing";
    EXPECT_EQ(refusal(with(changing("reals", {20, 1 << 2, 10, 9}), 36)),
              in + "\"reals\": it grows by elements that do not come with it")
        << "element 19 is missing";
    EXPECT_EQ(refusal(with(changing("reals", {20, 1 << 2, 10, 10}), 40)), "");
    EXPECT_EQ(refusal(with(changing("reals", {20, 1 << 2 | 2, 10, 4}), 16)), "");
    EXPECT_EQ(refusal(with(changing("reals", {20, 1 << 2 | 2, 11, 4}), 16)),
              in + "\"reals\": it grows by elements that do not come with it");
    EXPECT_EQ(refusal(with(changing("reals", {10, 1 << 2, 10, 1}), 4)),
              in + "\"reals\": a range lies outside the field");
    EXPECT_EQ(refusal(changing("reals", {10, 1 << 2, 11, 1})), in + "\"reals\": a range lies outside the field");
    EXPECT_EQ(refusal(changing("reals", {10, 1 << 2, 2, 0})), in + "\"reals\": its ranges are empty or not joined");
    EXPECT_EQ(refusal(with(changing("reals", {10, 2 << 2, 0, 1}), 6)),
              in + "\"reals\": its ranges are empty or not joined");
    EXPECT_EQ(refusal(changing("reals", {10, 2000 << 2})), in + "\"reals\": it has too many ranges");
    EXPECT_EQ(refusal(changing("reals", {std::uint64_t{1} << 60, 0})),
              in + "\"reals\": it is larger than a field may be");
    EXPECT_EQ(refusal(changing("reals", {~std::uint64_t{0}, 0})), in + "\"reals\": it is larger than a field may be");
    EXPECT_EQ(refusal(changing("reals", {std::uint64_t{1} << 30, 1 << 2, 0, std::uint64_t{1} << 30})),
              in + "\"reals\": the message ends too early")
        << "a GiB claimed, nothing sent";
    EXPECT_EQ(refusal(with(changing("seasons", {1, 1 << 2, 0, 1, 4}), 3)),
              in + "\"seasons\": it has a value that its enumeration does not have");
    DecodeLimits small;
    small.maxMultiBytes = 60;
    EXPECT_EQ(refusal(with(changing("reals", {15, 1 << 2, 10, 5}), 20), small), "");
    EXPECT_EQ(refusal(with(changing("reals", {16, 1 << 2, 10, 6}), 24), small),
              in + "\"reals\": the multi fields of the scene are larger than the limit");
    EXPECT_EQ(refusal(changing("reals", {10, 5 << 2 | 1})),
              in + "\"reals\": it refers to a blob that the part does not name");
}

TEST_F(HostileChanges, blobsMustBeThereAndFit) {
    IdSource ids;
    Aspect client(types, ids);
    client.create<Node>();
    const auto every = client.create<EveryKind>();
    client.commit();
    client.edit(every).assign<&EveryKind::seasons>(std::vector<Season>(10'000, Season::Winter));
    const ChangeList changes = client.commit();
    const EncodedChanges encoded = encodeChanges(changes, client);
    ASSERT_EQ(encoded.blobs.size(), 1u);
    const std::string in = "change list, entry 1, container #2 (EveryKind), field \"seasons\": ";
    EXPECT_EQ(refusal(encoded.parts[0]), in + "its blob has not come");
    blobs.put(encoded.blobs[0]);
    EXPECT_EQ(refusal(encoded.parts[0]), "");
    DecodeLimits limits;
    limits.maxFieldBytes = 39'999;
    EXPECT_EQ(refusal(encoded.parts[0], limits), "change list, blob table: a blob is larger than a field may be");
    EXPECT_FALSE(blobsReferenced(encoded.parts[0], limits).has_value());
    limits = {};
    limits.maxMultiBytes = 40'039;
    EXPECT_EQ(refusal(encoded.parts[0], limits), in + "the multi fields of the scene are larger than the limit");
    // A store that was given something else under this name, by a fault of ours: noticed all the same.
    MultiStorage shorter(4);
    shorter.resize(9999);
    blobs.put({encoded.blobs[0].ref, shorter});
    EXPECT_EQ(refusal(encoded.parts[0]), in + "its blob is not what its name says");
    MultiStorage wrong(4);
    wrong.resize(10'000);
    const std::uint32_t four = 4;
    wrong.write(7777, std::as_bytes(std::span(&four, 1)));
    blobs.put({encoded.blobs[0].ref, wrong});
    EXPECT_EQ(refusal(encoded.parts[0]), in + "it has a value that its enumeration does not have");

    Bytes part;
    Writer writer(part);
    const auto table = [&](std::uint64_t elementSize, std::uint64_t bytes) {
        part.clear();
        writer.varint(1);
        writer.u64(1);
        writer.u64(2);
        writer.varint(elementSize);
        writer.varint(bytes);
    };
    const std::string start = "change list, blob table: ";
    table(0, 0);
    EXPECT_EQ(refusal(part), start + "a blob's size is no multiple of its element size");
    table(12, 25);
    EXPECT_EQ(refusal(part), start + "a blob's size is no multiple of its element size");
    table(20'000, 20'000);
    EXPECT_EQ(refusal(part), start + "a blob's element size is impossible");
    EXPECT_EQ(refusal(varints({1'000'000})), start + "a count is larger than its message can hold");
    const Bytes change = changing("reals", {5, 0 << 2 | 1});
    table(4, 24);
    part.insert(part.end(), change.begin() + 1, change.end());
    EXPECT_EQ(refusal(part),
              "change list, entry 1, container #2 (EveryKind), field \"reals\": its blob is of another size "
              "or for other elements");
}

// A list with every kind of entry and field, in one part.
EncodedChanges sample(const TypeRegistry& types) {
    IdSource ids;
    Aspect client(types, ids);
    const auto node = client.create<Node>("first");
    const auto gone = client.create<Node>();
    client.commit();
    const auto every = client.create<EveryKind>("name");
    RawEdit raw(client);
    const TypeDescriptor& type = types.of<EveryKind>();
    for (std::uint32_t i = 0; i < type.fields.size(); ++i) {
        const std::uint32_t size = infoOf(type.fields[i].kind).size;
        if (type.fields[i].isMulti)
            raw.resizeMulti(every.id, i, 3);
        else if (type.fields[i].kind == ElementKind::String)
            raw.setText(every.id, i, "some text");
        else
            raw.setSingle(every.id, i, std::vector<std::byte>(size));
    }
    client.edit(every).assign<&EveryKind::wides>(std::vector<double>(60, 1.5));
    client.edit(node).append<&Node::children>(node);
    client.destroy(gone);
    EncodeOptions options;
    options.blobThreshold = 400;
    return encodeChanges(client.commit(), client, options);
}

TEST_F(HostileChanges, everyTruncationAndEveryFlippedBitIsRefusedOrValid) {
    const EncodedChanges encoded = sample(types);
    ASSERT_EQ(encoded.parts.size(), 1u);
    ASSERT_EQ(encoded.blobs.size(), 1u);
    const Bytes& good = encoded.parts.front();
    const auto decode = [&](std::span<const std::byte> part) {
        IdSource ids;
        Aspect aspect(types, ids);
        aspect.create<Node>();
        aspect.create<Node>();
        aspect.commit();
        BlobStore store;
        store.put(encoded.blobs.front());
        (void)blobsReferenced(part);
        const auto applied = applyChanges(part, aspect, store);
        // What was taken must be sound: it can be committed, digested and printed.
        StateDigest digest;
        digest.update(aspect.commit(), aspect);
        std::uint64_t bytes = 0;
        for (const ContainerId id : aspect.ids()) {
            const Container& container = *aspect.find(id);
            EXPECT_FALSE(describe(container, true).empty());
            for (const FieldDescriptor& field : container.type().fields)
                if (field.isMulti) bytes += field.multi(container).byteSize();
        }
        EXPECT_LE(bytes, part.size() + encoded.blobs.front().ref.bytes * 40) << "memory is bounded by what came";
        EXPECT_TRUE(applied || applied.error().message.starts_with("change list, "));
        return applied.has_value();
    };
    EXPECT_TRUE(decode(good));
    std::size_t valid = 0;
    for (std::size_t size = 0; size < good.size(); ++size) valid += decode(std::span(good).first(size));
    EXPECT_LE(valid, encoded.entries) << "only between entries is a shorter list a list";
    std::size_t refused = 0;
    for (std::size_t i = 0; i < good.size(); ++i)
        for (int bit = 0; bit < 8; ++bit) {
            Bytes bad = good;
            bad[i] ^= static_cast<std::byte>(1 << bit);
            refused += !decode(bad);
        }
    EXPECT_GT(refused, 500u);
    // And longer garbage, most of which is refused early.
    test::Random random(7);
    for (int i = 0; i < 3000; ++i) {
        Bytes bad = i % 2 ? random.bytes(random.below(200)) : good;
        for (std::size_t n = random.below(6); n > 0 && !bad.empty(); --n)
            bad[random.below(bad.size())] = static_cast<std::byte>(random.next());
        decode(bad);
    }
}

}  // namespace
}  // namespace umbriel::wire
