#pragma once

#include <string_view>

namespace umbriel::log {

enum class Level { Trace, Debug, Info, Warning, Error, Off };

// Logs go to stderr; results of commands go to stdout. Format messages with fmt::format at the call: this header stays
// cheap to include.
void setLevel(Level level);
// "trace", "debug", "info", "warning", "error", "off"; false when the name is none of them.
bool setLevel(std::string_view name);
// A word in front of every message, for example the server's name.
void setPrefix(std::string_view prefix);

void write(Level level, std::string_view message);

inline void debug(std::string_view message) { write(Level::Debug, message); }
inline void info(std::string_view message) { write(Level::Info, message); }
inline void warning(std::string_view message) { write(Level::Warning, message); }
inline void error(std::string_view message) { write(Level::Error, message); }

}  // namespace umbriel::log
