#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/scene/digest.h"
#include "common/wire/messages.h"

namespace umbriel::protocol {

// Where a server's state is not the client's.
struct DigestDifference {
    enum class Kind {
        None,       // every container is equal
        Field,      // container and field
        Container,  // the container, but none of its fields: it is of another type
        Missing,    // the server lacks the container
        Extra       // the client has no such container
    };
    Kind kind = Kind::None;
    ContainerId container;
    std::uint32_t field = 0;  // its index
};

// Finds the first container, in the order of ids, in which a server's state is not the expected one, and in it the
// first field: asks for digests page by page until it is known. Believes nothing: a server that answers nonsense only
// gets a wrong name for its own difference, after at most a query per page of the expected containers and two.
class DigestComparison {
 public:
    // expected: of the state that the server must have while it is asked.
    explicit DigestComparison(std::shared_ptr<const StateDigest> expected);

    // The next one to be asked, until difference() is there.
    wire::DigestQuery query() const { return {_field ? _container : ContainerId(), _after}; }
    void answered(const wire::DigestReply& reply);
    const std::optional<DigestDifference>& difference() const { return _difference; }

 private:
    void page(const wire::DigestReply& reply);
    void fields(const wire::DigestReply& reply);

    std::shared_ptr<const StateDigest> _expected;
    std::vector<std::pair<ContainerId, std::uint64_t>> _containers;  // of them
    std::size_t _next = 0;                                           // all before it are equal
    ContainerId _after;
    ContainerId _container;
    bool _field = false;  // the container is known
    std::optional<DigestDifference> _difference;
};

}  // namespace umbriel::protocol
