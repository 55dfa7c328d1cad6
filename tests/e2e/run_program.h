#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace umbriel::e2e {

struct Outcome {
    int exitCode = -1;       // 128 + signal when a signal ended it
    std::string out;
    std::string err;
};

// Runs a program of this build ("umbriel", "umbriel-server") to its end, or kills it when patience ends (exit code
// 137).
Outcome run(const std::string& program, const std::vector<std::string>& arguments);

// A program that runs beside the test; killed at the end of the scope.
class Background {
   public:
    Background(const std::string& program, const std::vector<std::string>& arguments);
    ~Background();
    Background(const Background&) = delete;
    Background& operator=(const Background&) = delete;
    int pid() const { return _pid; }
    // Asks it to end and waits until it did, or patience ended (the end of the scope kills it then).
    void terminate() const;
    // Everything it printed so far, both outputs.
    std::string printed() const;
    // Waits until it printed the text; false when it ended, or patience did, before.
    bool waitFor(const std::string& text) const;
    // The first whole line it printed that the predicate takes; nothing when it ended, or patience did, before.
    std::optional<std::string> waitForLine(const std::function<bool(const std::string&)>& isWanted) const;
    // HOST:PORT at which a server says that it listens; empty when it does not.
    std::string waitForAddress() const;

 private:
    test::TemporaryFolder _folder;
    std::filesystem::path _log;
    int _pid;
};

// Paths as text, as arguments of programs are.
class TemporaryFolder : public test::TemporaryFolder {
 public:
    std::string operator/(const std::string& name) const { return (path() / name).string(); }
};

// Processes whose parent is the given one (Linux).
std::vector<int> childrenOf(int pid);
bool isZombie(int pid);

std::string readFile(const std::filesystem::path& path);
void writeFile(const std::filesystem::path& path, const std::string& content);

}  // namespace umbriel::e2e
