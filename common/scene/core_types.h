#pragma once

#include "common/scene/type_descriptor.h"

namespace umbriel {

// Registers every type of this folder, in an order that both ends of the protocol share. An application's own types are
// added after it, on the client and on its servers.
void registerCoreTypes(TypeRegistry& types);

}  // namespace umbriel
