#pragma once

#include <string>

#include "common/wire/messages.h"

namespace umbriel::protocol {

// Why one program cannot work with another that says this hello: version, schema, names. Empty when it can. Both sides
// ask it about each other, so both can say what is wrong.
std::string handshakeObjection(const wire::Hello& mine, const wire::Hello& theirs);

}  // namespace umbriel::protocol
