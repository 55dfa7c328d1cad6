#include "client/session/incident_log.h"

#include <fmt/format.h>

namespace umbriel {

void IncidentLog::add(const protocol::ServerIncident& incident, TimePoint now) {
    const auto [place, isFirst] = _recent.try_emplace({incident.server, incident.kind}, Recent{now, 0, {}});
    Recent& recent = place->second;
    if (!isFirst && (recent.suppressed > 0 || now - recent.written < kQuiet)) {
        ++recent.suppressed;
        recent.last = incident.text;
        return;
    }
    recent.written = now;
    _lines.push_back({incident.kind != Kind::Rejoined, incident.text});
}

std::vector<IncidentLog::Line> IncidentLog::take(TimePoint now) {
    for (auto& [key, recent] : _recent) {
        if (recent.suppressed == 0 || now - recent.written < kQuiet) continue;
        std::string text = std::move(recent.last);
        if (recent.suppressed > 1)
            text += fmt::format(" (and {} times more since the last line)", recent.suppressed - 1);
        _lines.push_back({key.second != Kind::Rejoined, std::move(text)});
        recent = {now, 0, {}};
    }
    return std::exchange(_lines, {});
}

}  // namespace umbriel
