#include "common/base/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <array>
#include <string>
#include <utility>

namespace umbriel::log {
namespace {

spdlog::level::level_enum toSpdlog(Level level) {
    switch (level) {
        case Level::Trace: return spdlog::level::trace;
        case Level::Debug: return spdlog::level::debug;
        case Level::Info: return spdlog::level::info;
        case Level::Warning: return spdlog::level::warn;
        case Level::Error: return spdlog::level::err;
        case Level::Off: break;
    }
    return spdlog::level::off;
}

// The process-wide log is the one piece of global state the house style allows: it has no influence on results.
spdlog::logger& logger() {
    static spdlog::logger instance = [] {
        spdlog::logger created("umbriel", std::make_shared<spdlog::sinks::stderr_sink_mt>());
        created.set_level(spdlog::level::warn);
        created.set_pattern("%^%l%$: %v");
        return created;
    }();
    return instance;
}

}  // namespace

void setLevel(Level level) { logger().set_level(toSpdlog(level)); }

bool setLevel(std::string_view name) {
    constexpr std::array<std::pair<std::string_view, Level>, 6> kNames{{{"trace", Level::Trace},
                                                                        {"debug", Level::Debug},
                                                                        {"info", Level::Info},
                                                                        {"warning", Level::Warning},
                                                                        {"error", Level::Error},
                                                                        {"off", Level::Off}}};
    for (const auto& [known, level] : kNames) {
        if (known == name) {
            setLevel(level);
            return true;
        }
    }
    return false;
}

void setPrefix(std::string_view prefix) {
    logger().set_pattern(prefix.empty() ? "%^%l%$: %v" : std::string(prefix) + ": %^%l%$: %v");
}

void write(Level level, std::string_view message) {
    logger().log(toSpdlog(level), spdlog::string_view_t(message.data(), message.size()));
}

}  // namespace umbriel::log
