#pragma once

#include <nlohmann/json_fwd.hpp>

namespace umbriel {

// Checks a glTF document against the parts of the glTF 2.0 schema that this program reads: types, required properties,
// value ranges, and that every index names something that exists. Integers written as 3.0 become 3. Throws
// ImportRefused with the place in JSON ("meshes[3].primitives[0].indices: accessor 7 does not exist").
//
// The library that reads the document afterwards replaces what it does not understand by defaults without a word, which
// is why this comes first.
void checkGltfSchema(nlohmann::json& document);

}  // namespace umbriel
