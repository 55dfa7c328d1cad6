#include "common/base/host_port.h"

#include <gtest/gtest.h>

namespace umbriel {
namespace {

TEST(HostPort, AddressesWithColonsStandInBrackets) {
    EXPECT_EQ(hostPortText("render1", 7420), "render1:7420");
    EXPECT_EQ(hostPortText("127.0.0.1", 7420), "127.0.0.1:7420");
    EXPECT_EQ(hostPortText("::1", 5000), "[::1]:5000");
    EXPECT_EQ(hostPortText("fe80::1%eth0", 5000), "[fe80::1%eth0]:5000");
}

TEST(HostPort, WhatIsWrittenIsRead) {
    for (const char* host : {"render1", "127.0.0.1", "::1", "fe80::1%eth0", "::"}) {
        for (const std::uint16_t port : {1, 7420, 65535}) {
            const auto read = parseHostPort(hostPortText(host, port), false);
            ASSERT_TRUE(read) << host;
            EXPECT_EQ(read->host, host);
            EXPECT_EQ(read->port, port);
        }
    }
    EXPECT_FALSE(parseHostPort("[::1]:0", false));
    ASSERT_TRUE(parseHostPort("[::1]:0", true));
    EXPECT_EQ(parseHostPort("[::1]:0", true)->port, 0);
}

TEST(HostPort, OtherFormsAreNone) {
    for (const char* bad : {"",           ":",         "host",         "host:",          ":7420",
                            "host:65536", "host:-1",   "host:+1",      "host:1x",        "host: 1",
                            "::1:5000",   "::1",       "[::1]",        "[::1]5000",      "[]:5000",
                            "[::1:5000",  "::1]:5000", "[[::1]]:5000", "[render1]:5000", "a:b:1"})
        EXPECT_FALSE(parseHostPort(bad, true)) << bad;
}

}  // namespace
}  // namespace umbriel
