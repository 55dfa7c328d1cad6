#include "common/protocol/handshake.h"

#include <fmt/format.h>

#include "common/base/hash.h"

namespace umbriel::protocol {
namespace {

std::string_view nameOf(wire::Role role) { return role == wire::Role::Client ? "client" : "server"; }

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
    if (!mine.wantedName.empty() && mine.wantedName != theirs.name)
        return fmt::format("the {} there calls itself '{}', '{}' was expected", nameOf(theirs.role), theirs.name,
                           mine.wantedName);
    if (!theirs.wantedName.empty() && theirs.wantedName != mine.name)
        return fmt::format("this {} is called '{}', not '{}'", nameOf(mine.role), mine.name, theirs.wantedName);
    return {};
}

}  // namespace umbriel::protocol
