#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/protocol/cluster_client.h"

namespace umbriel {

// Lines for the log out of what happens to servers. A server that is late and back in every other frame would write a
// line with each: of one kind and server there is one line in ten seconds, and then one with the count of the others.
class IncidentLog {
 public:
    static constexpr Duration kQuiet = std::chrono::seconds(10);

    struct Line {
        bool isWarning = true;
        std::string text;
    };

    void add(const protocol::ServerIncident& incident, TimePoint now);
    // What is to be written now.
    std::vector<Line> take(TimePoint now);

 private:
    using Kind = protocol::ServerIncident::Kind;
    struct Recent {
        TimePoint written;
        std::size_t suppressed = 0;
        std::string last;  // of those
    };
    std::map<std::pair<std::size_t, Kind>, Recent> _recent;
    std::vector<Line> _lines;
};

}  // namespace umbriel
