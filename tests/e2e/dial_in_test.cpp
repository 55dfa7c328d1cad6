#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "tests/e2e/run_program.h"
#include "tests/support/reserved_port.h"

namespace umbriel::e2e {
namespace {

using nlohmann::json;

// A client that waits for servers at an address, and servers that dial it, which may be there first.
struct Waiting {
    void start(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(),
                         {"render", "demo:spheres?n=9", "--size", "64x36", "--listen", address, "--log-level", "info"});
        client = std::make_unique<Background>("umbriel", arguments);
        EXPECT_TRUE(client->waitFor("waiting for servers at " + address)) << client->printed();
    }
    std::unique_ptr<Background> server(const std::string& name) const {
        return std::make_unique<Background>("umbriel-server",
                                            std::vector<std::string>{"--name", name, "--connect", address});
    }
    const test::ReservedPort port;
    const std::string address = "127.0.0.1:" + std::to_string(port.number());
    std::unique_ptr<Background> client;
};

TEST(DialIn, ServersThatDialDrawThePictureOfEmbeddedOnes) {
    const TemporaryFolder folder;
    const Outcome embedded = run("umbriel", {"render", "demo:spheres?n=9", "--size", "64x36", "--grid", "2x1",
                                             "--local", "2", "--out", folder / "embedded.exr"});
    ASSERT_EQ(embedded.exitCode, 0) << embedded.err;
    Waiting wall;
    wall.start(
        {"--grid", "2x1", "--servers", "left,right", "--connect-timeout", "240", "--out", folder / "dialled.exr"});
    const auto right = wall.server("right");  // the order of names counts, not who comes first
    EXPECT_TRUE(right->waitFor("is connected")) << right->printed();
    const auto stranger = wall.server("middle");
    EXPECT_TRUE(stranger->waitFor("does not wait for a server 'middle'")) << stranger->printed();
    const auto twin = wall.server("right");
    EXPECT_TRUE(twin->waitFor("has a server 'right' already")) << twin->printed();
    const Outcome beyond = run("umbriel-server", {"--connect", "192.0.2.1:7421"});
    EXPECT_EQ(beyond.exitCode, 2);
    EXPECT_NE(beyond.err.find("--insecure-lan"), std::string::npos) << beyond.err;
    const auto left = wall.server("left");
    ASSERT_TRUE(wall.client->waitFor("dialled.exr")) << wall.client->printed();
    EXPECT_EQ(json::parse(run("umbriel", {"compare", folder / "embedded.exr", folder / "dialled.exr", "--json"})
                              .out)["bit_differing"],
              0);
}

TEST(DialIn, AServerThatComesLateJoins) {
    Waiting wall;
    // Redialling already: the client's patience, which must end for it to start with one server, has no start to wait
    // for.
    const auto first = wall.server("first");
    EXPECT_TRUE(first->waitFor("refused")) << first->printed();
    wall.start({"--grid", "2x1", "--servers-expected", "2", "--policy", "degrade", "--start-incomplete",
                "--connect-timeout", "10", "--frames", "100000000"});
    EXPECT_TRUE(wall.client->waitFor("server 2 of 2 is not there at the start")) << wall.client->printed();
    {
        const auto second = wall.server("second");
        EXPECT_TRUE(wall.client->waitFor("server 'second' is back in step")) << wall.client->printed();
    }
    EXPECT_TRUE(wall.client->waitFor("server 'second' is gone")) << wall.client->printed();
    const auto again = wall.server("second");
    EXPECT_TRUE(again->waitFor("is connected")) << again->printed();
}

TEST(DialIn, WhatCannotBeMeantIsRefused) {
    const auto refusal = [](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), {"render", "demo:spheres?n=1"});
        const Outcome outcome = run("umbriel", arguments);
        EXPECT_EQ(outcome.exitCode, 2) << outcome.err;
        return outcome.err;
    };
    EXPECT_NE(refusal({"--listen", "127.0.0.1:0"}).find("--servers-expected"), std::string::npos);
    EXPECT_NE(refusal({"--listen", "here", "--servers-expected", "1"}).find("HOST:PORT"), std::string::npos);
    EXPECT_NE(refusal({"--servers-expected", "1"}).find("--listen"), std::string::npos);
    EXPECT_NE(refusal({"--listen", "0.0.0.0:0", "--servers-expected", "1"}).find("--insecure-lan"), std::string::npos);
    EXPECT_NE(refusal({"--listen", "127.0.0.1:0", "--servers-expected", "1", "--local", "1"}).find("--local"),
              std::string::npos);
    EXPECT_NE(refusal({"--servers", "left"}).find("HOST:PORT"), std::string::npos) << "a name alone needs --listen";
}

TEST(DialIn, ServersThatDoNotComeAreNamedInTime) {
    const Outcome outcome = run("umbriel", {"render", "demo:spheres?n=1", "--listen", "127.0.0.1:0", "--servers",
                                            "left", "--connect-timeout", "0.5"});
    EXPECT_EQ(outcome.exitCode, 1);
    EXPECT_NE(outcome.err.find("server 'left' has not dialled within 0.5 s"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace umbriel::e2e
