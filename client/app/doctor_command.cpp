#include "client/app/doctor_command.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <thread>
#include <vector>

#include "client/app/window.h"
#include "common/base/clock.h"
#include "common/net/loopback_probe.h"

namespace umbriel {
namespace {

struct Finding {
    std::string what;
    bool works = false;
    std::vector<std::string> details;
    bool needed = false;  // for off-screen rendering
};

struct Output {
    int exitCode = -1;
    std::vector<std::string> lines;
};

// Runs a program with one argument and collects what it prints; both outputs.
Output run(const std::filesystem::path& program, const char* argument) {
    int fds[2];
    if (::pipe(fds) != 0) return {};
    const pid_t child = ::fork();
    if (child < 0) {
        ::close(fds[0]);
        ::close(fds[1]);
        return {};
    }
    if (child == 0) {
        ::dup2(fds[1], STDOUT_FILENO);
        ::dup2(fds[1], STDERR_FILENO);
        ::close(fds[0]);
        ::close(fds[1]);
        ::execl(program.c_str(), program.c_str(), argument, static_cast<char*>(nullptr));
        ::_exit(127);
    }
    ::close(fds[1]);
    std::string text;
    std::array<char, 4096> buffer;
    for (ssize_t got; (got = ::read(fds[0], buffer.data(), buffer.size())) > 0;)
        if (text.size() < (1 << 20)) text.append(buffer.data(), static_cast<std::size_t>(got));
    ::close(fds[0]);
    int status = 0;
    ::waitpid(child, &status, 0);
    Output output;
    output.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        if (end > begin) output.lines.push_back(text.substr(begin, end - begin));
        begin = end + 1;
    }
    return output;
}

Finding serverFinding(const std::filesystem::path& program) {
    Finding finding{"off-screen rendering (umbriel-server --doctor)", false, {}, true};
    if (::access(program.c_str(), X_OK) != 0) {
        finding.details = {fmt::format("there is no program {}; build it, or keep both programs in one folder", program.string())};
        return finding;
    }
    Output output = run(program, "--doctor");
    finding.works = output.exitCode == 0;
    finding.details = std::move(output.lines);
    if (!finding.works) finding.details.push_back(fmt::format("{} --doctor ended with {}", program.string(), output.exitCode));
    return finding;
}

Finding windowFinding() {
    Finding finding{"windows (umbriel view)", false, {}, false};
    const Result<std::string> windows = probeWindows();
    finding.works = windows.has_value();
    finding.details = {windows ? *windows : windows.error().message};
    return finding;
}

Finding portFinding() {
    Finding finding{"loopback ports", false, {}, true};
    const Result<std::string> probe = net::probeLoopback();
    finding.works = probe.has_value();
    finding.details = {probe ? *probe : probe.error().message};
    return finding;
}

Finding clockFinding() {
    const SteadyClock clock;
    Duration smallest = std::chrono::seconds(1);
    bool monotonic = true;
    TimePoint last = clock.now();
    for (int i = 0; i < 10000; ++i) {
        const TimePoint now = clock.now();
        monotonic = monotonic && now >= last;
        if (now > last) smallest = std::min<Duration>(smallest, now - last);
        last = now;
    }
    return {"clock", monotonic && smallest < std::chrono::milliseconds(1),
            {fmt::format("monotonic, smallest step seen {} ns", smallest.count())}, true};
}

}  // namespace

int runDoctor(const DoctorOptions& options, const std::filesystem::path& serverProgram, std::ostream& out) {
    const std::vector<Finding> findings = {serverFinding(serverProgram), portFinding(), clockFinding(), windowFinding()};
    bool works = true;
    for (const Finding& finding : findings) works = works && (finding.works || !finding.needed);

    if (options.json) {
        nlohmann::json list = nlohmann::json::array();
        for (const Finding& finding : findings)
            list.push_back({{"what", finding.what}, {"works", finding.works}, {"details", finding.details}});
        out << nlohmann::json({{"version", UMBRIEL_VERSION},
                               {"works", works},
                               {"processors", std::thread::hardware_concurrency()},
                               {"findings", list}})
                   .dump(2, ' ', false, nlohmann::json::error_handler_t::replace)
            << '\n';
    } else {
        out << "umbriel " << UMBRIEL_VERSION << ", " << std::thread::hardware_concurrency() << " processors\n";
        for (const Finding& finding : findings) {
            out << (finding.works ? "works    " : "MISSING  ") << finding.what << '\n';
            for (const std::string& detail : finding.details) out << "           " << detail << '\n';
        }
        out << "keys: none; TLS is not in this version, servers beyond this machine need --insecure-lan\n";
    }
    return works ? 0 : 1;
}

}  // namespace umbriel
