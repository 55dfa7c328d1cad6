#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace umbriel {

// Where a TCP service is: a name or an address without brackets, and its port.
struct HostPort {
    std::string host;
    std::uint16_t port = 0;
};

// "HOST:PORT", of an IPv6 address "[HOST]:PORT" (RFC 3986, 3.2.2): what parseHostPort() reads.
std::string hostPortText(std::string_view host, std::uint16_t port);

// Nothing when the text is not of that form. An IPv6 address must have its brackets: without them nobody can tell where
// the port begins. Port 0 counts only where one that is free will do.
std::optional<HostPort> parseHostPort(std::string_view text, bool mayBeZero);

}  // namespace umbriel
