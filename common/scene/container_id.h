#pragma once

#include <atomic>
#include <compare>
#include <cstdint>
#include <functional>

namespace umbriel {

// Names a field container, the same in every aspect and on every server. 0 names nothing. 64 bits, never reused: at a
// million creations a second they last for half a million years, so there is no wrap-around to handle.
struct ContainerId {
    std::uint64_t value = 0;

    explicit operator bool() const { return value != 0; }
    friend auto operator<=>(const ContainerId&, const ContainerId&) = default;
};

// A ContainerId that remembers what it points to. Ref<Container> points to anything; Ref<T> converts to it.
template <class T>
struct Ref {
    ContainerId id;

    Ref() = default;
    explicit Ref(ContainerId container) : id(container) {}

    explicit operator bool() const { return static_cast<bool>(id); }
    operator ContainerId() const { return id; }
    friend auto operator<=>(const Ref&, const Ref&) = default;
};

// Hands out ids; shared by all aspects of one scene, from any thread.
class IdSource {
   public:
    // The first id handed out; an import child process is given a range of its own this way.
    explicit IdSource(std::uint64_t first = 1) : _next(first) {}

    ContainerId next() { return {_next.fetch_add(1, std::memory_order_relaxed)}; }
    // Never hand out this id or a smaller one: it came from elsewhere (a loaded file, a peer).
    void skipPast(ContainerId id);

   private:
    std::atomic<std::uint64_t> _next;
};

}  // namespace umbriel

template <>
struct std::hash<umbriel::ContainerId> {
    std::size_t operator()(umbriel::ContainerId id) const noexcept { return std::hash<std::uint64_t>{}(id.value); }
};
