#include "tests/e2e/run_program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tests/support/wait_until.h"

namespace umbriel::e2e {
namespace {

namespace fs = std::filesystem;

pid_t start(const std::string& program, const std::vector<std::string>& arguments, const fs::path& out, const fs::path& err) {
    const std::string path = (fs::path(UMBRIEL_BIN_DIR) / program).string();  // an absolute program stays itself
    std::vector<char*> argv{const_cast<char*>(path.c_str())};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    const pid_t pid = ::fork();
    if (pid != 0) return pid;
    ::setpgid(0, 0);
    const int outFile = ::open(out.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    const int errFile = ::open(err.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    const int in = ::open("/dev/null", O_RDONLY);
    ::dup2(in, 0);
    ::dup2(outFile, 1);
    ::dup2(errFile, 2);
    ::execv(path.c_str(), argv.data());
    ::_exit(127);
}

}  // namespace

Outcome run(const std::string& program, const std::vector<std::string>& arguments) {
    const TemporaryFolder folder;
    const pid_t pid = start(program, arguments, folder / "out", folder / "err");
    if (pid < 0) throw std::runtime_error("fork failed");
    int status = 0;
    if (!test::waitUntil([&] { return ::waitpid(pid, &status, WNOHANG) != 0; })) {
        ::kill(-pid, SIGKILL);
        ::waitpid(pid, &status, 0);
    }
    Outcome outcome;
    outcome.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    outcome.out = readFile(folder / "out");
    outcome.err = readFile(folder / "err");
    return outcome;
}

Background::Background(const std::string& program, const std::vector<std::string>& arguments)
    : _log(_folder / "log"), _pid(start(program, arguments, _log, _log)) {}

Background::~Background() {
    if (_pid > 0) {
        ::kill(-_pid, SIGKILL);
        ::waitpid(_pid, nullptr, 0);
    }
}

void Background::terminate() const {
    ::kill(_pid, SIGTERM);
    (void)test::waitUntil([&] { return isZombie(_pid); });
}

std::string Background::printed() const { return readFile(_log); }

bool Background::waitFor(const std::string& text) const {
    bool found = false;
    (void)test::waitUntil([&] {
        const bool hasEnded = isZombie(_pid);  // asked before reading: what it printed last is seen
        found = printed().find(text) != std::string::npos;
        return found || hasEnded;
    });
    return found;
}

std::optional<std::string> Background::waitForLine(const std::function<bool(const std::string&)>& isWanted) const {
    std::optional<std::string> found;
    (void)test::waitUntil([&] {
        const bool hasEnded = isZombie(_pid);  // asked before reading
        std::istringstream lines(printed());
        // A line without its end may still grow.
        for (std::string line; !found && std::getline(lines, line) && !lines.eof();)
            if (isWanted(line)) found = line;
        return found || hasEnded;
    });
    return found;
}

std::string Background::waitForAddress() const {
    const std::string announced = "listening on ";
    const auto line = waitForLine([&](const std::string& text) { return text.find(announced) != std::string::npos; });
    return line ? line->substr(line->find(announced) + announced.size()) : std::string();
}

std::vector<int> childrenOf(int pid) {
    std::vector<int> children;
    for (const auto& thread : fs::directory_iterator("/proc/" + std::to_string(pid) + "/task")) {
        std::istringstream list(readFile(thread.path() / "children"));
        for (int child = 0; list >> child;) children.push_back(child);
    }
    return children;
}

bool isZombie(int pid) {
    const std::string status = readFile("/proc/" + std::to_string(pid) + "/stat");
    const std::size_t name = status.rfind(')');
    return name == std::string::npos || status.compare(name, 4, ") Z ") == 0;
}

std::string readFile(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream content;
    content << file.rdbuf();
    return content.str();
}

void writeFile(const fs::path& path, const std::string& content) {
    std::ofstream(path, std::ios::binary) << content;
}

}  // namespace umbriel::e2e
