#include "common/protocol/handshake.h"

#include <fmt/format.h>

#include <utility>

#include "common/base/hash.h"

namespace umbriel::protocol {
namespace {

// Less than this of a frame's changes, or of a blob, is no use: a message's part alone may be as long.
constexpr std::uint64_t kLeastLimit = std::uint64_t{1} << 20;

std::string_view nameOf(wire::Role role) { return role == wire::Role::Client ? "client" : "server"; }

// Why one cannot serve the other; empty when it can.
std::string lacking(const wire::Hello& who, const wire::Hello& whom) {
    const std::uint64_t missing = whom.needs & ~who.capabilities;
    if (missing == 0) return {};
    return fmt::format("{} '{}' (build {}) cannot do what {} '{}' needs: {}", nameOf(who.role), who.name, who.build,
                       nameOf(whom.role), whom.name, wire::capabilityNames(missing));
}

}  // namespace

std::string handshakeObjection(const wire::Hello& mine, const wire::Hello& theirs) {
    if (theirs.version != mine.version)
        return fmt::format("protocol version {} (build {}) of the peer does not fit version {} (build {}) of {} '{}': "
                           "install the same version on both machines",
                           theirs.version, theirs.build, mine.version, mine.build, nameOf(mine.role), mine.name);
    if (theirs.role == mine.role)
        return fmt::format("both sides are {}s ('{}' and '{}')", nameOf(mine.role), theirs.name, mine.name);
    if (theirs.typeSignature != mine.typeSignature)
        return fmt::format("scene types {} of {} '{}' (build {}) are not the types {} of {} '{}' (build {}): both programs "
                           "must register the same container types",
                           toHex(theirs.typeSignature), nameOf(theirs.role), theirs.name, theirs.build,
                           toHex(mine.typeSignature), nameOf(mine.role), mine.name, mine.build);
    if (const std::string reason = lacking(theirs, mine); !reason.empty()) return reason;
    if (const std::string reason = lacking(mine, theirs); !reason.empty()) return reason;
    for (const auto& [what, limit] :
         {std::pair("a frame's changes", theirs.maxChangeBytes), std::pair("a blob", theirs.maxBlobBytes)})
        if (limit < kLeastLimit)
            return fmt::format("{} '{}' takes {} bytes of {}, at least {} are needed", nameOf(theirs.role), theirs.name,
                               limit, what, kLeastLimit);
    if (!mine.wantedName.empty() && mine.wantedName != theirs.name)
        return fmt::format("the {} there calls itself '{}', '{}' was expected", nameOf(theirs.role), theirs.name,
                           mine.wantedName);
    if (!theirs.wantedName.empty() && theirs.wantedName != mine.name)
        return fmt::format("this {} is called '{}', not '{}'", nameOf(mine.role), mine.name, theirs.wantedName);
    return {};
}

}  // namespace umbriel::protocol
