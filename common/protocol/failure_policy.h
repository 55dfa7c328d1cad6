#pragma once

namespace umbriel::protocol {

// What happens to a frame for which a server is late.
enum class FailurePolicy {
    Wait,    // no deadline while heartbeats come; a lost server ends the cluster
    Strict,  // the wall waits for it for 2 s, then goes on without it
    Degrade  // the wall waits for it for about three frames, then goes on without it
};

}  // namespace umbriel::protocol
