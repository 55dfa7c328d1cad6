#include "common/base/host_port.h"

#include <fmt/format.h>

#include <charconv>

namespace umbriel {

std::string hostPortText(std::string_view host, std::uint16_t port) {
    return host.find(':') == std::string_view::npos ? fmt::format("{}:{}", host, port)
                                                    : fmt::format("[{}]:{}", host, port);
}

std::optional<HostPort> parseHostPort(std::string_view text, bool mayBeZero) {
    const std::size_t colon = text.rfind(':');
    if (colon == std::string_view::npos) return std::nullopt;
    const std::string_view digits = text.substr(colon + 1);
    std::uint16_t port = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
    if (error != std::errc() || end != digits.data() + digits.size() || (port == 0 && !mayBeZero)) return std::nullopt;
    std::string_view host = text.substr(0, colon);
    const bool hasBrackets = host.size() > 1 && host.front() == '[' && host.back() == ']';
    if (hasBrackets) host = host.substr(1, host.size() - 2);
    if (host.empty() || host.find_first_of("[]") != std::string_view::npos) return std::nullopt;
    // Brackets are for addresses with colons, and for those alone.
    if ((host.find(':') != std::string_view::npos) != hasBrackets) return std::nullopt;
    return HostPort{std::string(host), port};
}

}  // namespace umbriel
