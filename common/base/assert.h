#pragma once

namespace umbriel {

// Ends the process with the condition, the place and the reason.
[[noreturn]] void assertionFailed(const char* condition, const char* reason, const char* file, int line);

}  // namespace umbriel

// A broken assertion is a programming error of ours, never something a peer, a file or a driver can cause: those
// are Result values (result.h). Stays on in release builds.
#define UMBRIEL_ASSERT(condition, reason) \
    ((condition) ? static_cast<void>(0) : ::umbriel::assertionFailed(#condition, reason, __FILE__, __LINE__))
