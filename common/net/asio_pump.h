#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/protocol/endpoint.h"

namespace umbriel::net {

// Connects an endpoint to TCP: accepts, dials, reads and writes for it, and tells it the time. The endpoint is asked by
// one thread at a time: the one that is in run(), or one that is in enter() or wait(). Plain TCP carries no protection,
// so it stays on loopback unless insecureLan says otherwise, which is warned about every minute.
class AsioPump {
 public:
    AsioPump(protocol::Endpoint& endpoint, bool insecureLan);
    ~AsioPump();
    AsioPump(const AsioPump&) = delete;
    AsioPump& operator=(const AsioPump&) = delete;

    // Accepts connections there, before run(). port 0: one that is free. Returns the port.
    Result<std::uint16_t> listen(const std::string& host, std::uint16_t port);

    // Called on the pump's thread after everything that may have changed the endpoint, when what that left in the
    // queues was written. It may change the endpoint again. Set before run().
    void onTurn(std::function<void()> hook);

    // Pumps until stop().
    void run();
    // From any thread.
    void stop();
    // Runs the function on the thread that pumps, then takes a turn. From any thread.
    void post(std::function<void()> function);
    // Runs the function on this thread, alone with the endpoint, and writes what it queues as far as the sockets take
    // it at once: nobody is waited for, and no other thread is woken. Not from the hook or another such function.
    void enter(const std::function<void()>& function);
    // Waits on this thread until the condition holds, which is asked as in enter(), never again after it held. False:
    // it does not after this time. One thread at a time pumps while it waits, hook and all.
    bool wait(const std::function<bool()>& condition, Duration limit);

    struct Implementation;

 private:
    std::unique_ptr<Implementation> _implementation;
};

}  // namespace umbriel::net
