#include "common/wire/messages.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/wire/view_codec.h"

namespace umbriel::wire {
namespace {

Bytes bytesOf(std::initializer_list<int> values) {
    Bytes bytes;
    for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
    return bytes;
}

Hello sampleHello() {
    Hello hello;
    hello.build = "0.1.0";
    hello.role = Role::Server;
    hello.channel = Channel::Bulk;
    hello.name = "left";
    hello.wantedName = "wall";
    hello.token = {1, 2};
    hello.epoch = 3;
    hello.typeSignature = 4;
    hello.capabilities = ~std::uint64_t{0};
    hello.glRenderer = "llvmpipe";
    hello.glVersion = "4.5";
    hello.cpu = "some processor";
    return hello;
}

Assign sampleAssign() { return {{1277, 719}, {{0, {0, 0, 638, 719}, Eye::Left}, {1, {638, 0, 639, 719}, Eye::Right}}}; }

// Every prefix of a message that has a fixed end is an error, and so is a byte too much.
template <class Message>
void expectExactLength(const Message& message) {
    Bytes bytes = encode(message);
    ASSERT_TRUE(decode<Message>(bytes));
    for (std::size_t size = 0; size < bytes.size(); ++size)
        EXPECT_FALSE(decode<Message>(std::span(bytes).first(size))) << "cut to " << size;
    bytes.push_back(std::byte{0});
    EXPECT_FALSE(decode<Message>(bytes));
}

TEST(Messages, EndWhereTheirTypeSays) {
    expectExactLength(sampleHello());
    expectExactLength(sampleAssign());
    expectExactLength(Welcome{});
    expectExactLength(Heartbeat{});
    expectExactLength(Explain{});
    expectExactLength(Goodbye{"because"});
    expectExactLength(ExplainReply{"a plan\nof two lines"});
    expectExactLength(Ready{1, 2, 3.0, 4000, 5, 0.5f, 100.0f, {}});
    expectExactLength(Swap{300});
    expectExactLength(Failed{300, "out of memory"});
    expectExactLength(BlobWanted{{{1, 2}, {3, 4}}});
    expectExactLength(DigestQuery{{1}, {2}});
    expectExactLength(DigestReply{true, {{1, 2}, {3, 4}}});
    expectExactLength(JobLease{1, 2, 0.5f});
    expectExactLength(JobCancel{1, 2});
    expectExactLength(JobDone{1, 2, JobStatus::Failed, "no", {3, 4}, 5, 6000});
}

TEST(Messages, TimesOfHeartbeatsLeaveRoomForSumsOfThem) {
    Heartbeat heartbeat;
    heartbeat.sent = std::int64_t{1} << 60;
    heartbeat.echo = Heartbeat::Echo{-heartbeat.sent, 0};
    heartbeat.swaps = {{1, heartbeat.sent}};
    EXPECT_TRUE(decode<Heartbeat>(encode(heartbeat)));
    for (std::int64_t* time :
         {&heartbeat.sent, &heartbeat.echo->sent, &heartbeat.echo->received, &heartbeat.swaps[0].at}) {
        const std::int64_t before = std::exchange(*time, (std::int64_t{1} << 60) + 1);
        EXPECT_FALSE(decode<Heartbeat>(encode(heartbeat)));
        *time = std::numeric_limits<std::int64_t>::min();
        EXPECT_FALSE(decode<Heartbeat>(encode(heartbeat)));
        *time = before;
    }
}

TEST(Messages, ThatEndInDataSurviveBeingCut) {
    const Bytes data(100, std::byte{7});
    const auto cut = [](const auto& message) {
        using Message = std::decay_t<decltype(message)>;
        const Bytes bytes = encode(message);
        for (std::size_t size = 0; size <= bytes.size(); ++size) {
            const auto decoded = decode<Message>(std::span(bytes).first(size));
            if (!decoded) continue;
            EXPECT_EQ(encode(*decoded), Bytes(bytes.begin(), bytes.begin() + static_cast<long>(size)));
        }
    };
    cut(Frame{5, true, false, false, 1.5, std::span(data).first(10), data});
    cut(BlobData{{1, 2}, 1000, 10, data});
    cut(TileData{1, 2, 0, 1, Layer::Colour, "colour", 4, ComponentType::Float, 1000, 0, data});
    cut(JobOffer{1, 2, 3, "bake", data, {}});
    cut(JobOffer{1, 2, 3, "bake", data, {{{1, 2}, 12, 24}, {{3, 4}, 4, 8}}});
}

TEST(Messages, ComeBackAsTheyWere) {
    const auto hello = decode<Hello>(encode(sampleHello()));
    ASSERT_TRUE(hello);
    EXPECT_EQ(encode(*hello), encode(sampleHello()));
    EXPECT_EQ(hello->name, "left");
    EXPECT_EQ(hello->channel, Channel::Bulk);
    const auto assign = decode<Assign>(encode(sampleAssign()));
    ASSERT_TRUE(assign);
    EXPECT_EQ(assign->tiles[1].pixels, (PixelRect{638, 0, 639, 719}));
    EXPECT_EQ(assign->tiles[1].eye, Eye::Right);
}

TEST(Messages, AHelloOfAnotherVersionStillTellsItsVersionAndBuild) {
    Hello other = sampleHello();
    other.version = kProtocolVersion + 1;
    Bytes bytes = encode(other);
    bytes.resize(bytes.size() / 2);  // who knows how it goes on
    const auto hello = decode<Hello>(bytes);
    ASSERT_TRUE(hello);
    EXPECT_EQ(hello->version, kProtocolVersion + 1);
    EXPECT_EQ(hello->build, "0.1.0");
    EXPECT_TRUE(hello->name.empty());
}

TEST(Messages, ANameWithControlCharactersIsRefused) {
    Hello hello = sampleHello();
    hello.name = "left\x1b[2J";
    EXPECT_FALSE(decode<Hello>(encode(hello)));
}

TEST(Messages, LongestHelloFitsBeforeTheWelcome) {
    Hello hello = sampleHello();
    for (std::string* text : {&hello.build, &hello.name, &hello.wantedName}) text->assign(Hello::kMaxName, 'x');
    for (std::string* text : {&hello.glRenderer, &hello.glVersion, &hello.cpu}) text->assign(Hello::kMaxText, 'x');
    const Bytes bytes = encode(hello);
    EXPECT_LE(bytes.size() + kHeaderBytes, 4096u);
    EXPECT_TRUE(decode<Hello>(bytes));
    hello.cpu += 'x';
    EXPECT_FALSE(decode<Hello>(encode(hello)));
}

TEST(Messages, LimitsHoldAtOneBelowAtAndOneAbove) {
    BlobWanted wanted;
    for (const std::size_t count : {BlobWanted::kMaxHashes - 1, BlobWanted::kMaxHashes}) {
        wanted.hashes.resize(count);
        EXPECT_TRUE(decode<BlobWanted>(encode(wanted)));
    }
    wanted.hashes.resize(BlobWanted::kMaxHashes + 1);
    Bytes tooMany;
    Writer writer(tooMany);
    wanted.write(writer);
    EXPECT_FALSE(decode<BlobWanted>(tooMany));

    DigestReply reply;
    reply.digests.resize(DigestReply::kMaxEntries);
    EXPECT_TRUE(decode<DigestReply>(encode(reply)));

    const Bytes most(kMaxInlineChangeBytes + 1);
    for (const std::size_t size : {kMaxInlineChangeBytes - 1, kMaxInlineChangeBytes, kMaxInlineChangeBytes + 1}) {
        Frame frame;
        frame.changes = std::span(most).first(size);
        EXPECT_EQ(static_cast<bool>(decode<Frame>(encode(frame))), size <= kMaxInlineChangeBytes) << size;
    }

    Assign assign{{100, 100}, {{0, {50, 50, 50, 50}, Eye::Mono}}};
    EXPECT_TRUE(decode<Assign>(encode(assign)));
    assign.tiles[0].pixels.width = 51;
    EXPECT_FALSE(decode<Assign>(encode(assign)));
    assign.tiles[0].pixels.width = 0;
    EXPECT_FALSE(decode<Assign>(encode(assign)));
}

TEST(Messages, ACountThatCannotFitIsRefusedBeforeAnythingIsReserved) {
    EXPECT_FALSE(decode<BlobWanted>(bytesOf({0xff, 0x1f, 1, 2, 3})));
    EXPECT_FALSE(decode<DigestReply>(bytesOf({0, 0xff, 0x3f})));
    EXPECT_FALSE(decode<Assign>(bytesOf({1, 1, 0xff, 0x07})));
}

TEST(Messages, EveryTypeHasARule) {
    EXPECT_EQ(ruleOf(std::uint8_t{0}), nullptr);
    EXPECT_EQ(ruleOf(static_cast<std::uint8_t>(kMessageTypes + 1)), nullptr);
    for (std::uint8_t type = 1; type <= kMessageTypes; ++type) {
        const MessageRule& rule = *ruleOf(type);
        EXPECT_FALSE(rule.name.empty());
        EXPECT_TRUE(rule.fromClient || rule.fromServer) << rule.name;
        EXPECT_TRUE(rule.onControl || rule.onBulk) << rule.name;
        EXPECT_LE(rule.limit, 2u << 20) << rule.name;
    }
    EXPECT_EQ(ruleOf(MessageType::JobDone).name, "JobDone");
    EXPECT_EQ(ruleOf(MessageType::TileData).name, "TileData");
}

TEST(WireBudget, AnIdleFrameAndItsSwapTakeAtMost64Bytes) {
    Frame frame;
    frame.number = ~std::uint64_t{0};
    const Swap swap{frame.number};
    EXPECT_LE(2 * kHeaderBytes + encode(frame).size() + encode(swap).size(), 64u);
    frame.time = 1.0;  // also when time goes on
    EXPECT_LE(2 * kHeaderBytes + encode(frame).size() + encode(swap).size(), 64u);
    frame.number = 1'000'000;
    frame.time.reset();
    EXPECT_EQ(2 * kHeaderBytes + encode(frame).size() + encode(Swap{frame.number}).size(), 33u);
}

RC_GTEST_PROP(WireBudget, ReadyTakesAtMost40Bytes, (std::uint16_t frame, std::uint64_t digest, std::uint64_t a, std::uint64_t b)) {
    const auto milliseconds = static_cast<double>(*rc::gen::arbitrary<std::uint32_t>());
    const Ready ready{frame, digest, milliseconds, a, b, 0.1f, 1e30f, {}};
    const Bytes bytes = encode(ready);
    RC_ASSERT(kHeaderBytes + bytes.size() <= 40u);
    const auto back = decode<Ready>(bytes);
    RC_ASSERT(static_cast<bool>(back));
    RC_ASSERT(back->frame == frame);
    RC_ASSERT(back->digest == digest);
    RC_ASSERT(back->triangles == std::min(a, (std::uint64_t{1} << 35) - 1));
}

TEST(Ready, BringsTheCostWhenThereIsOne) {
    Ready ready{1, 2, 3.0, 4000, 5, 0.5f, 100.0f, {}};
    EXPECT_FALSE(decode<Ready>(encode(ready))->cost.has_value());
    ready.cost = FrameCost{12.34, 5.67, std::uint64_t{1} << 33};
    EXPECT_EQ(decode<Ready>(encode(ready))->cost, ready.cost);
    // What is beyond a field's range is shown as its end, in as many bytes as the type allows.
    ready = {65535, ~0ull, 1e30, ~0ull, ~0ull, 0.1f, 1e30f, {}};
    ready.cost = FrameCost{1e30, 1e30, ~0ull};
    const Bytes bytes = encode(ready);
    EXPECT_EQ(bytes.size(), ruleOf(Ready::kType).limit);
    EXPECT_NEAR(decode<Ready>(bytes)->cost->cpuMilliseconds, 335544.31, 0.01);
}

TEST(Ready, RoundsDepthsOutwardsByLessThanAPercent) {
    for (const float depth : {1e-6f, 0.1f, 1.0f, 1.00001f, 3.14159f, 1234.5f, 1e20f}) {
        const auto back = decode<Ready>(encode(Ready{0, 0, 0, 0, 0, depth, depth, {}}));
        ASSERT_TRUE(back);
        EXPECT_LE(back->nearestDepth, depth);
        EXPECT_GE(back->nearestDepth, depth * 0.992f);
        EXPECT_GE(back->farthestDepth, depth);
        EXPECT_LE(back->farthestDepth, depth * 1.008f);
    }
}

RC_GTEST_PROP(Header, ComesBackAsItWas, (std::uint32_t length, std::uint8_t type, std::uint32_t epoch, std::uint32_t sequence)) {
    std::array<std::byte, kHeaderBytes> bytes;
    encodeHeader({length, type, epoch, sequence}, bytes);
    const Header header = decodeHeader(bytes);
    RC_ASSERT(header.length == length && header.type == type && header.epoch == epoch && header.sequence == sequence);
}

// Whatever bytes a peer sends: an answer, never more.
RC_GTEST_PROP(Messages, ArbitraryBytesAreDecodedOrRefused, (const std::vector<std::uint8_t>& values)) {
    Bytes bytes;
    for (const std::uint8_t value : values) bytes.push_back(std::byte{value});
    (void)decode<Hello>(bytes);
    (void)decode<Assign>(bytes);
    (void)decode<Frame>(bytes);
    (void)decode<Ready>(bytes);
    (void)decode<BlobWanted>(bytes);
    (void)decode<BlobData>(bytes);
    (void)decode<TileData>(bytes);
    (void)decode<DigestReply>(bytes);
    (void)decode<JobOffer>(bytes);
    (void)decode<JobDone>(bytes);
    const auto views = decodeViews(bytes);
    if (views) RC_ASSERT(encodeViews(*views) == bytes);
}

WallViews sampleViews() {
    WallViews views;
    views.wall = {1280, 720};
    views.tiles = TileMode::Exact;
    views.samples = 4;
    views.layers = 5;
    View view;
    view.viewport = {12};
    view.region = {10, 20, 1000, 600};
    view.eyeWorld = {1e6, 2.0, -3.0};
    view.clipFromView[3][2] = 0.25;
    ShadowFit fit;
    fit.light = {7};
    fit.mode = ShadowMode::Standard;
    fit.mapSize = 1024;
    fit.texelSize = 0.01;
    view.fits.push_back(fit);
    views.views.push_back(view);
    return views;
}

TEST(Views, EqualViewsHaveEqualBytesAndComeBack) {
    const Bytes bytes = encodeViews(sampleViews());
    const auto back = decodeViews(bytes);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(encodeViews(*back), bytes);
    EXPECT_EQ(back->views[0].eyeWorld, glm::dvec3(1e6, 2.0, -3.0));
    EXPECT_EQ(back->views[0].fits[0].mapSize, 1024u);
    for (std::size_t size = 0; size < bytes.size(); ++size)
        EXPECT_FALSE(decodeViews(std::span(bytes).first(size))) << "cut to " << size;
}

// As many lights as servers shade with, each with the six maps of a cube, seen by two eyes.
TEST(Views, ShadowMapsOfAllLightsOfAStereoPairTravel) {
    WallViews views = sampleViews();
    views.views.resize(1);
    views.views[0].fits.resize(6 * 256, views.views[0].fits.at(0));
    views.views.push_back(views.views[0]);
    const Bytes bytes = encodeViews(views);
    EXPECT_LE(bytes.size(), kMaxViewBytes);
    const auto back = decodeViews(bytes);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(encodeViews(*back), bytes);
    views.views[1].fits.push_back(views.views[0].fits[0]);
    EXPECT_FALSE(decodeViews(encodeViews(views)));
}

TEST(Views, NumbersThatAreNotFiniteAreRefused) {
    WallViews views = sampleViews();
    views.views[0].eyeWorld.x = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(decodeViews(encodeViews(views)));
    views = sampleViews();
    views.views[0].fits[0].clipFromWorld[1][1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(decodeViews(encodeViews(views)));
}

TEST(Views, TheKindOfAViewComesBackAndOthersAreRefused) {
    WallViews views = sampleViews();
    const Bytes plain = encodeViews(views);
    std::vector<std::size_t> differing;
    for (const int kind : {1, 2}) {
        views.views[0].orthographic = kind == 1;
        views.views[0].unwrapped = kind == 2;
        Bytes bytes = encodeViews(views);
        const auto back = decodeViews(bytes);
        ASSERT_TRUE(back) << back.error().message;
        EXPECT_EQ(back->views[0].orthographic, kind == 1);
        EXPECT_EQ(back->views[0].unwrapped, kind == 2);
        ASSERT_EQ(bytes.size(), plain.size());
        for (std::size_t i = 0; i < bytes.size(); ++i)
            if (bytes[i] != plain[i]) differing.push_back(i);
        ASSERT_EQ(differing.size(), static_cast<std::size_t>(kind));
        bytes[differing.back()] = std::byte{3};
        EXPECT_FALSE(decodeViews(bytes));
    }
    EXPECT_EQ(differing[0], differing[1]);
}

TEST(Views, ThePrecisionOfColoursComesBackAndOthersAreRefused) {
    WallViews views = sampleViews();
    for (const auto precision : {ColourPrecision::Float, ColourPrecision::Half, ColourPrecision::Byte}) {
        views.colourPrecision = precision;
        const auto back = decodeViews(encodeViews(views));
        ASSERT_TRUE(back) << back.error().message;
        EXPECT_EQ(back->colourPrecision, precision);
    }
    views.colourPrecision = static_cast<ColourPrecision>(3);
    EXPECT_FALSE(decodeViews(encodeViews(views)));
}

// Nobody reads ids as floats, or factors as bytes, because a peer says so.
TEST(Messages, LayersHaveComponentsOfTheirKindOnly) {
    const Bytes pixels(16);
    const auto isTaken = [&](Layer layer, int components) {
        const TileData sent{1, 2, 0, 1, layer, "x", 1, static_cast<ComponentType>(components), 16, 0, pixels};
        const auto back = decode<TileData>(encode(sent));
        if (back) EXPECT_EQ(back->components, sent.components);
        return back.has_value();
    };
    for (int components = 0; components < 6; ++components) {
        const auto type = static_cast<ComponentType>(components);
        const bool isColour =
            type == ComponentType::Float || type == ComponentType::Half || type == ComponentType::Byte;
        EXPECT_EQ(isTaken(Layer::Colour, components), isColour) << components;
        EXPECT_EQ(isTaken(Layer::Ids, components), type == ComponentType::Uint) << components;
        for (const Layer layer : {Layer::Depth, Layer::Position, Layer::Normal, Layer::LightFactors})
            EXPECT_EQ(isTaken(layer, components), type == ComponentType::Float) << components;
    }
}

TEST(Views, RegionsOffTheWallAreRefused) {
    WallViews views = sampleViews();
    views.views[0].region.width = 1271;
    EXPECT_FALSE(decodeViews(encodeViews(views)));
}

}  // namespace
}  // namespace umbriel::wire
