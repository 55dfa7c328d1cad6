#pragma once

#include <string>
#include <vector>

#include "client/import/import_limits.h"

namespace umbriel {

// The import process: parses one file under limits of the operating system and answers through a pipe. It is this
// program started anew (`umbriel import-child ARGUMENTS...`, a hidden command), so that a file that breaks a parser
// breaks only this process.
struct ImportChildOptions {
    std::vector<std::string> arguments;  // as made by importChildArguments(): none begins with a dash
};

// What to put behind ImportLimits::childCommand. answerDescriptor: the pipe's end to write to, open in the process.
std::vector<std::string> importChildArguments(const std::string& file, const ImportLimits& limits,
                                              int answerDescriptor);

// The main function of the import process; returns its exit code. Sets limits for the whole process it is called in.
int runImportChild(const ImportChildOptions& options);

}  // namespace umbriel
