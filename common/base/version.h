#pragma once

namespace umbriel {

// Also in CMakeLists.txt (project version); a test holds the two together.
inline constexpr const char* kVersion = "0.1.0";

}  // namespace umbriel
