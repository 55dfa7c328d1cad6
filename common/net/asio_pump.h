#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/protocol/endpoint.h"

namespace umbriel::net {

// Connects an endpoint to TCP: accepts, dials, reads and writes for it, and tells it the time. Everything the endpoint
// is asked happens on the one thread that is in run(). Plain TCP carries no protection, so it stays on loopback unless
// insecureLan says otherwise, which is warned about every minute.
class AsioPump {
 public:
    AsioPump(protocol::Endpoint& endpoint, bool insecureLan);
    ~AsioPump();
    AsioPump(const AsioPump&) = delete;
    AsioPump& operator=(const AsioPump&) = delete;

    // Accepts connections there, before run(). port 0: one that is free. Returns the port.
    Result<std::uint16_t> listen(const std::string& host, std::uint16_t port);

    // Called on the pump's thread after everything that may have changed the endpoint, before its actions are taken.
    // Set before run().
    void onTurn(std::function<void()> hook);

    // Pumps until stop().
    void run();
    // From any thread.
    void stop();
    // Runs the function on the pump's thread, then takes a turn. From any thread.
    void post(std::function<void()> function);

    struct Implementation;

 private:
    std::unique_ptr<Implementation> _implementation;
};

}  // namespace umbriel::net
