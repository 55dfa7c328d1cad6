#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "client/import/import_error.h"

namespace umbriel {

// The text of an OBJ file in the form that tinyobjloader reads rightly: it takes what is no number for 0, leaves out
// faces with wrong corners, ends names at blanks, and knows neither byte order marks nor lines that go on. Checks all
// numbers and indices, where the line is known. Names of materials and libraries come out as joinedName() makes them.
// Throws ImportRefused for what is no OBJ text, and for a face of more than mostCorners corners.
std::string readableObj(std::string_view bytes, std::size_t mostCorners, ImportWarnings& warnings);

// The text of an MTL library likewise, named for warnings. Values that are no finite numbers become 0, with a warning:
// a library costs its materials, never the scene. Throws ImportRefused for what is no text.
std::string readableMtl(std::string_view bytes, const std::string& name, ImportWarnings& warnings);

// A name without blanks at its ends, and with kJoint for those within.
std::string joinedName(std::string_view name);
// With its blanks again.
std::string spacedName(std::string name);

// Takes the place of a blank in a name: never in a text file.
constexpr char kJoint = '\x01';

}  // namespace umbriel
