#pragma once

#include <ostream>

#include "common/base/result.h"

namespace umbriel {

// What a command that fails ends with (docs/commands.md): 2 for wrong usage and bad input, else 1.
inline int exitCode(const Error& error) {
    return error.kind == Error::Kind::BadInput ? 2 : 1;
}

// Ends a command: 0, or what went wrong on `err`, behind the command's name.
inline int endCommand(const char* command, const Result<void>& done, std::ostream& err) {
    if (done) return 0;
    err << command << ": " << done.error().message << '\n';
    return exitCode(done.error());
}

}  // namespace umbriel
