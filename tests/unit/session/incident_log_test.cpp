#include "client/session/incident_log.h"

#include <gtest/gtest.h>

namespace umbriel {
namespace {

using namespace std::chrono_literals;
using protocol::ServerIncident;
using Kind = ServerIncident::Kind;

ServerIncident incident(Kind kind, std::size_t server, std::string text) {
    return {kind, server, std::move(text), {}};
}

TEST(IncidentLog, aServerThatIsLateInEveryOtherFrameWritesTwoLinesInTenSeconds) {
    IncidentLog log;
    TimePoint now{};
    std::vector<std::string> warnings;
    std::vector<std::string> others;
    const auto take = [&] {
        for (const auto& line : log.take(now)) (line.isWarning ? warnings : others).push_back(line.text);
    };
    for (int frame = 0; frame < 600; ++frame, now += 16ms) {
        log.add(incident(frame % 2 ? Kind::Rejoined : Kind::Late, 0, "event " + std::to_string(frame)), now);
        take();
    }
    EXPECT_EQ(warnings, std::vector<std::string>{"event 0"});
    EXPECT_EQ(others, std::vector<std::string>{"event 1"});
    now += 10s;
    take();
    ASSERT_EQ(warnings.size(), 2u);
    EXPECT_EQ(warnings[1], "event 598 (and 298 times more since the last line)") << "299 were suppressed";
    ASSERT_EQ(others.size(), 2u);
    now += 60s;
    take();
    EXPECT_EQ(warnings.size() + others.size(), 4u) << "silence is not news";
}

TEST(IncidentLog, whatIsRareIsWrittenAtOnceForEveryServerAndKind) {
    IncidentLog log;
    const TimePoint now{};
    log.add(incident(Kind::Late, 0, "a"), now);
    log.add(incident(Kind::Late, 1, "b"), now);
    log.add(incident(Kind::Lost, 0, "c"), now);
    EXPECT_EQ(log.take(now).size(), 3u);
    log.add(incident(Kind::Late, 0, "d"), now + 11s);
    const auto lines = log.take(now + 11s);
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0].text, "d");
}

}  // namespace
}  // namespace umbriel
