#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace umbriel::e2e {

struct Outcome {
    int exitCode = -1;       // 128 + signal when a signal ended it
    std::string out;
    std::string err;
    std::chrono::milliseconds duration{0};
};

// Runs a program of this build ("umbriel", "umbriel-server") to its end, or kills it after the limit (exit code 137).
Outcome run(const std::string& program, const std::vector<std::string>& arguments,
            std::chrono::seconds limit = std::chrono::seconds(60));

// A program that runs beside the test; killed at the end of the scope.
class Background {
   public:
    Background(const std::string& program, const std::vector<std::string>& arguments);
    ~Background();
    Background(const Background&) = delete;
    Background& operator=(const Background&) = delete;
    int pid() const { return _pid; }
    // Asks it to end and waits until it did, or until the limit passed (the end of the scope kills it then).
    void terminate(std::chrono::seconds limit = std::chrono::seconds(5)) const;
    // Everything it printed so far, both outputs.
    std::string printed() const;
    // Waits until it printed the text; false when it did not within the limit.
    bool waitFor(const std::string& text, std::chrono::seconds limit = std::chrono::seconds(20)) const;
    // The first whole line it printed that the predicate takes; nothing when it ended or the limit passed before.
    std::optional<std::string> waitForLine(const std::function<bool(const std::string&)>& isWanted,
                                           std::chrono::seconds limit = std::chrono::seconds(20)) const;

   private:
    int _pid = -1;
    std::filesystem::path _log;
};

// An empty folder of this test's own, removed with its content at the end of the scope.
class TemporaryFolder {
   public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    std::string operator/(const std::string& name) const { return (_path / name).string(); }
    const std::filesystem::path& path() const { return _path; }
    std::vector<std::string> names() const;  // of the files in it, sorted

   private:
    std::filesystem::path _path;
};

// Processes whose parent is the given one (Linux).
std::vector<int> childrenOf(int pid);
bool isZombie(int pid);

std::string readFile(const std::filesystem::path& path);
void writeFile(const std::filesystem::path& path, const std::string& content);

}  // namespace umbriel::e2e
