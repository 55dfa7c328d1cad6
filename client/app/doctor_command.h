#pragma once

#include <filesystem>
#include <iosfwd>

namespace umbriel {

// The command line of `umbriel doctor`.
struct DoctorOptions {
    bool json = false;
};

// umbriel doctor: what works on this machine, line by line: the server program and what its GL says, windows, ports, the
// clock. Exit code 0 when off-screen rendering works, 1 when it does not.
int runDoctor(const DoctorOptions& options, const std::filesystem::path& serverProgram, std::ostream& out);

}  // namespace umbriel
