// What a client concludes from a server's answers, whatever they are: where its clock stands, from heartbeats, and in
// what its state differs, from pages of digests. The first byte says which.

#include <algorithm>
#include <memory>

#include "common/base/assert.h"
#include "common/protocol/clock_estimate.h"
#include "common/protocol/digest_comparison.h"
#include "common/scene/core_types.h"
#include "common/scene/digest.h"
#include "common/scene/nodes.h"
#include "common/wire/messages.h"

namespace umbriel {
namespace {

// Messages one after the other, each behind its length.
std::span<const std::byte> nextPayload(wire::Reader& input) {
    const std::size_t size = input.u8();
    return input.raw(std::min(size, input.remaining()));
}

void clocks(wire::Reader& input) {
    protocol::ClockEstimate estimate;
    TimePoint now{};
    while (input.ok() && !input.atEnd()) {
        const Duration way = std::chrono::microseconds(input.u16());
        const auto heartbeat = wire::decode<wire::Heartbeat>(nextPayload(input));
        if (!heartbeat) continue;
        now += way;
        const std::size_t before = estimate.count();
        if (heartbeat->echo)
            estimate.add({TimePoint(Duration(heartbeat->echo->sent)), TimePoint(Duration(heartbeat->echo->received)),
                          TimePoint(Duration(heartbeat->sent)), now});
        UMBRIEL_ASSERT(estimate.count() <= before + 1, "an exchange counts once");
        for (const wire::Heartbeat::Swap& swap : heartbeat->swaps) {
            const auto time = estimate.ours(TimePoint(Duration(swap.at)));
            UMBRIEL_ASSERT(time.has_value() == (estimate.count() > 0), "a time is known after the first exchange");
            UMBRIEL_ASSERT(!time || time->bound > Duration(0), "no estimate is exact");
        }
    }
}

void digests(wire::Reader& input) {
    static const std::shared_ptr<const StateDigest> expected = [] {
        static TypeRegistry types;
        registerCoreTypes(types);
        static IdSource ids;
        static Aspect scene(types, ids);
        for (int i = 0; i < 5; ++i) scene.create<Transform>();
        auto digest = std::make_shared<StateDigest>();
        digest->update(scene.commit(), scene);
        return digest;
    }();
    protocol::DigestComparison comparison(expected);
    // Pages that bring it further hold a container each at least; one for its fields, and one that ends it.
    const std::size_t most = expected->containers().size() + 2;
    std::size_t asked = 0;
    const bool knows = input.u8() & 1;  // what is right, and answers with it until its input says otherwise
    while (!comparison.difference()) {
        const wire::DigestQuery query = comparison.query();
        UMBRIEL_ASSERT(++asked <= most, "a comparison that does not end");
        wire::DigestReply reply;
        if (knows && (input.u8() & 1) != 0 && !query.container) {
            for (const auto& [id, digest] : expected->containers(query.after, 1 + input.u8() % 3))
                reply.digests.emplace_back(id.value, digest);
            reply.more = true;
        } else if (const auto said = wire::decode<wire::DigestReply>(nextPayload(input))) {
            reply = *said;
        }
        comparison.answered(reply);
    }
    const auto kind = comparison.difference()->kind;
    UMBRIEL_ASSERT(kind != protocol::DigestDifference::Kind::None || !comparison.difference()->container,
                   "what is equal is not named");
}

}  // namespace
}  // namespace umbriel

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace umbriel;
    wire::Reader input(std::as_bytes(std::span(data, size)));
    if (input.u8() & 1)
        clocks(input);
    else
        digests(input);
    return 0;
}
