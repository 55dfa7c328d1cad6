#pragma once

#include <boost/system/result.hpp>
#include <string>

namespace umbriel {

// What went wrong, in words a user understands: what, where, and what to do.
struct Error {
    // The kind decides the exit code of a command: BadInput 2, Failure 1 (docs/commands.md).
    enum class Kind { BadInput, Failure };

    Kind kind = Kind::Failure;
    std::string message;
};

// The file, the arguments or the peer's bytes are wrong.
Error badInput(std::string message);
// The input is sound, yet it could not be done: disk, network, driver, memory.
Error failure(std::string message);

// Value or Error. Anything a peer, file, driver or disk can cause is returned this way; exceptions never cross a
// module border.
template <class T>
using Result = boost::system::result<T, Error>;

// Called by Result::value() on an error: that is a programming error, so it ends the process.
[[noreturn]] void throw_exception_from_error(const Error& error, const boost::source_location& location);

}  // namespace umbriel
