#include "common/net/socket_loop.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sched.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "common/base/assert.h"

namespace umbriel::net {

using protocol::Action;

namespace {

constexpr std::size_t kReadBytes = 256 * 1024;
// What has room elsewhere: a part of a blob, chunk by chunk; and the beginning of the next part behind it.
constexpr std::size_t kPlacesPerRead = 17;
constexpr std::size_t kReadBehindRoom = 4096;
constexpr std::size_t kSegmentsPerWrite = 32;
constexpr int kEventsPerWait = 256;
// What one connection writes before others have their turn.
constexpr std::size_t kBytesPerTurn = 128 * 1024;
// How long a closing connection may take to write its last words and see the peer's end.
constexpr auto kLinger = std::chrono::seconds(1);
// Unacknowledged data for this long means the peer's machine or the way to it is gone.
constexpr unsigned kUserTimeoutMilliseconds = 2000;
// A thread whose wait is over mostly waits again soon, when frames are short: until then nobody need listen.
constexpr auto kBackSoon = std::chrono::microseconds(250);
// Who waits for longer than this has frames that are not short, and is woken sooner by the thread in run(), which a
// busy machine does not keep waiting (askForShortSlices).
constexpr auto kShortWait = std::chrono::milliseconds(4);
// What else epoll knows; connections count from 1.
constexpr std::uint64_t kEvent = 0;
constexpr std::uint64_t kTimer = ~std::uint64_t{0};

std::string textOf(int error) {
    std::string text = std::strerror(error);
    if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
    return text;
}

// Edges only: what was read until it ran short need not be asked about again.
void watch(int epoll, int operation, int descriptor, std::uint64_t number, bool room) {
    epoll_event event{EPOLLIN | EPOLLRDHUP | EPOLLET | (room ? EPOLLOUT : 0u), {.u64 = number}};
    UMBRIEL_ASSERT(::epoll_ctl(epoll, operation, descriptor, &event) == 0, "the kernel has room for a descriptor");
}

ssize_t send(int socket, const protocol::SendQueue& queue) {
    std::array<std::span<const std::byte>, kSegmentsPerWrite> pieces;
    const std::size_t count = queue.gather(pieces);
    if (count == 1) return ::send(socket, pieces[0].data(), pieces[0].size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    std::array<iovec, kSegmentsPerWrite> vectors;
    for (std::size_t i = 0; i < count; ++i) vectors[i] = {const_cast<std::byte*>(pieces[i].data()), pieces[i].size()};
    msghdr message{};
    message.msg_iov = vectors.data();
    message.msg_iovlen = count;
    return ::sendmsg(socket, &message, MSG_DONTWAIT | MSG_NOSIGNAL);
}

std::size_t sizeOf(std::span<const std::span<std::byte>> places) {
    std::size_t size = 0;
    for (const auto place : places) size += place.size();
    return size;
}

ssize_t receive(int socket, std::span<const std::span<std::byte>> places) {
    if (places.size() == 1) return ::recv(socket, places[0].data(), places[0].size(), MSG_DONTWAIT);
    std::array<iovec, kPlacesPerRead + 1> vectors;
    for (std::size_t i = 0; i < places.size(); ++i) vectors[i] = {places[i].data(), places[i].size()};
    msghdr message{};
    message.msg_iov = vectors.data();
    message.msg_iovlen = places.size();
    return ::recvmsg(socket, &message, MSG_DONTWAIT);
}

// As the kernel has it; older C libraries do not declare it.
struct SchedulingAttributes {
    std::uint32_t size;
    std::uint32_t policy;
    std::uint64_t flags;
    std::int32_t nice;
    std::uint32_t priority;
    std::uint64_t runtime;
    std::uint64_t deadline;
    std::uint64_t period;
};

// Dozens of servers that draw on a few cores keep each other's network threads waiting, for more than a second when
// they compile shaders, and a client takes that for silence. A thread that asks for short slices is served early
// (Linux 6.12; others refuse, and nothing is lost). It is no priority: the share of the processor stays what it was.
void askForShortSlices() {
    constexpr std::uint64_t kSlice = 100'000;  // nanoseconds: the least that is taken
    SchedulingAttributes attributes{};
    if (::syscall(SYS_sched_getattr, 0, &attributes, sizeof(attributes), 0) != 0) return;
    if (attributes.policy != SCHED_OTHER) return;
    attributes.size = sizeof(attributes);
    attributes.runtime = kSlice;
    (void)::syscall(SYS_sched_setattr, 0, &attributes, 0);
}

}  // namespace

SocketLoop::SocketLoop(protocol::Endpoint& endpoint, std::function<void(const Action&)> dial)
    : _endpoint(endpoint),
      _dial(std::move(dial)),
      _epoll(::epoll_create1(EPOLL_CLOEXEC)),
      _event(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      _timer(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)),
      _buffer(new std::byte[kReadBytes]) {
    watch(_epoll, EPOLL_CTL_ADD, _event, kEvent, false);
    watch(_epoll, EPOLL_CTL_ADD, _timer, kTimer, false);
}

SocketLoop::~SocketLoop() {
    for (const auto& [id, connection] : _connections) ::close(connection.socket);
    ::close(_timer);
    ::close(_event);
    ::close(_epoll);
}

void SocketLoop::run() {
    askForShortSlices();
    std::unique_lock lock(_mutex);
    while (!_stopped) {
        if (_helper || _clock.now() < _helped + kBackSoon)
            rest(lock);
        else
            listen(lock, Duration::max());
    }
}

// Being called when the other one leaves would cost every short frame a wake.
void SocketLoop::rest(std::unique_lock<std::mutex>& lock) {
    if (_helper)
        _resting.wait_for(lock, kShortWait);
    else
        _resting.wait_until(lock, _helped + kBackSoon);
}

void SocketLoop::listen(std::unique_lock<std::mutex>& lock, Duration limit) {
    std::array<epoll_event, kEventsPerWait> events;
    std::array<std::pair<Id, std::uint32_t>, kEventsPerWait> ready;
    // Whoever is held to be silent must have been listened to: this thread may have waited for a processor or for the
    // lock since it was told of what there was to read. All that had come before this moment will be at hand.
    const TimePoint before = _clock.now();
    const bool due = before >= std::min(_endpoint.deadline(), _closeDue);
    // Rounded up: who waits until then does not come back before.
    const auto patience =
        std::chrono::ceil<std::chrono::milliseconds>(std::min<Duration>(limit, std::chrono::hours(1)));
    const int timeout = due || _turnDue ? 0 : limit == Duration::max() ? -1 : static_cast<int>(patience.count());
    _listening = true;
    lock.unlock();
    const int found = ::epoll_wait(_epoll, events.data(), kEventsPerWait, timeout);
    lock.lock();
    _listening = false;
    if (_stopped) return;
    const auto count = static_cast<std::size_t>(std::max(found, 0));
    for (std::size_t i = 0; i < count; ++i) ready[i] = {Id{events[i].data.u64}, std::uint32_t{events[i].events}};
    _now = _clock.now();
    serve(std::span(ready).first(count), due && count < kEventsPerWait ? std::optional(before) : std::nullopt);
    arm();
    if (!anyMet()) return;
    // Without the lock that the other thread needs.
    lock.unlock();
    _awaited.notify_all();
    lock.lock();
}

// One turn for all that has come by now: the answers of many servers are handled together.
void SocketLoop::serve(std::span<const std::pair<Id, std::uint32_t>> ready, std::optional<TimePoint> listenedUntil) {
    bool changed = std::exchange(_turnDue, false);
    for (const auto& [id, events] : ready) {
        changed = true;
        std::uint64_t ignored = 0;
        if (id == kTimer) {
            (void)!::read(_timer, &ignored, sizeof(ignored));
            _armedFor = TimePoint::max();
            continue;
        }
        if (id == kEvent) {
            (void)!::read(_event, &ignored, sizeof(ignored));
            _woken = false;
            runPosted();
            continue;
        }
        if (events & EPOLLOUT) {
            if (const auto found = _connections.find(id); found != _connections.end()) {
                setBlocked(id, found->second, false);
                write(id);
            }
        }
        if (events & ~EPOLLOUT) read(id, (events & (EPOLLRDHUP | EPOLLHUP | EPOLLERR)) != 0);
    }
    if (listenedUntil) {
        changed = true;
        reached(*listenedUntil);
    }
    if (!changed) return;
    carryOut();
    if (!_hook) return;
    _hook();
    carryOut();
}

// ended: there is an end behind what can be read.
void SocketLoop::read(Id id, bool ended) {
    const auto found = _connections.find(id);
    if (found == _connections.end()) return;
    Connection& connection = found->second;
    std::array<std::span<std::byte>, kPlacesPerRead + 1> places;
    const std::size_t count = connection.closing ? 0 : _endpoint.room(id, std::span(places).first(kPlacesPerRead));
    // With room, little more is read than what belongs there: the next bytes may have room, too.
    places[count] = std::span(_buffer.get(), count > 0 ? kReadBehindRoom : kReadBytes);
    const std::size_t room = sizeOf(std::span(places).first(count));
    const std::size_t most = room + places[count].size();
    const ssize_t result = receive(connection.socket, std::span(places).first(count + 1));
    if (result < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
    if (result <= 0) return close(id, result == 0 ? std::string("the connection was closed") : textOf(errno));
    const auto bytes = static_cast<std::size_t>(result);
    if (!connection.closing) {
        if (room > 0) _endpoint.placed(id, std::min(bytes, room), _now);
        if (bytes > room) _endpoint.received(id, std::span(_buffer.get(), bytes - room), _now);
    }
    // There is more: others have their turn first.
    if (ended || bytes == most) watch(_epoll, EPOLL_CTL_MOD, connection.socket, id, connection.blocked);
}

// What is queued, as far as the socket takes it at once.
void SocketLoop::write(Id id) {
    const auto found = _connections.find(id);
    if (found == _connections.end()) return;
    Connection& connection = found->second;
    if (connection.blocked || connection.broken || connection.shutDown) return;
    std::size_t written = 0;
    for (protocol::SendQueue* queue = _endpoint.output(id); queue && !queue->empty(); queue = _endpoint.output(id)) {
        if (written >= kBytesPerTurn) return setBlocked(id, connection, true);
        const ssize_t count = send(connection.socket, *queue);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return setBlocked(id, connection, true);
        if (count < 0) {
            // Noticed by the read, which may still find what the peer said last.
            connection.broken = true;
            return;
        }
        written += static_cast<std::size_t>(count);
        queue->consumed(static_cast<std::size_t>(count));
        _endpoint.written(id, _now);
    }
    if (!connection.closing) return;
    // The peer must be able to read our last words: end our side only, and wait for its end.
    ::shutdown(connection.socket, SHUT_WR);
    connection.shutDown = true;
}

void SocketLoop::setBlocked(Id id, Connection& connection, bool blocked) {
    connection.blocked = blocked;
    watch(_epoll, EPOLL_CTL_MOD, connection.socket, id, blocked);
}

void SocketLoop::close(Id id, const std::string& reason) {
    const auto found = _connections.find(id);
    ::close(found->second.socket);
    _connections.erase(found);
    _endpoint.closed(id, reason, _now);
}

void SocketLoop::reached(TimePoint time) {
    if (time >= _closeDue) {
        _closeDue = TimePoint::max();
        std::vector<Id> overdue;
        for (const auto& [id, connection] : _connections) {
            if (time >= connection.closeAt)
                overdue.push_back(id);
            else
                _closeDue = std::min(_closeDue, connection.closeAt);
        }
        for (const Id id : overdue) close(id, "the connection was closed");
    }
    if (time >= _endpoint.deadline()) _endpoint.advance(time);
}

bool SocketLoop::collectActions() {
    while (auto action = _endpoint.nextAction()) _actions.push_back(std::move(*action));
    return !_actions.empty();
}

// What the endpoint wants done. Returns whether that was more than writing.
bool SocketLoop::carryOut() {
    bool acted = false;
    do {
        while (collectActions()) {
            acted = true;
            const Action action = std::move(_actions.front());
            _actions.pop_front();
            if (action.kind == Action::Kind::Dial) {
                _dial(action);
            } else if (const auto found = _connections.find(action.connection); found != _connections.end()) {
                found->second.closing = true;
                found->second.closeAt = _now + kLinger;
                _closeDue = std::min(_closeDue, found->second.closeAt);
                write(action.connection);
            }
        }
        while (const auto id = _endpoint.nextOutput()) write(*id);
    } while (collectActions());
    return acted;
}

bool SocketLoop::anyMet() {
    bool helper = false;  // now: one whose wait was over before may not have left yet
    bool others = false;
    std::erase_if(_waiting, [&](Waiting* one) {
        one->met = one->condition();
        if (one->met) (one == _helper ? helper : others) = true;
        return one->met;
    });
    if (!helper && !others) return false;
    _helped = _now;
    if (helper && _listening) wake();
    return others;
}

// The timer is only ever moved forward: deadlines are mostly put off before they are reached, and one that comes too
// early costs less than setting it anew with every message.
void SocketLoop::arm() {
    const TimePoint next = std::min(_endpoint.deadline(), _closeDue);
    if (next >= _armedFor) return;
    _armedFor = next;
    // In the past is at once; 0 would be never.
    const auto at = std::max<std::int64_t>(
        std::chrono::duration_cast<std::chrono::nanoseconds>(next.time_since_epoch()).count(), 1);
    itimerspec timer{};
    timer.it_value = {static_cast<time_t>(at / 1'000'000'000), static_cast<long>(at % 1'000'000'000)};
    ::timerfd_settime(_timer, TFD_TIMER_ABSTIME, &timer, nullptr);
}

void SocketLoop::wake() {
    if (_woken.exchange(true)) return;
    const std::uint64_t one = 1;
    (void)!::write(_event, &one, sizeof(one));
}

void SocketLoop::stop() {
    _stopped = true;
    wake();
}

void SocketLoop::post(std::function<void()> function) {
    // Told under the lock: what was posted may end the loop.
    const std::lock_guard lock(_postMutex);
    _posted.push_back(std::move(function));
    wake();
}

void SocketLoop::runPosted() {
    std::vector<std::function<void()>> posted;
    {
        const std::lock_guard lock(_postMutex);
        posted.swap(_posted);
    }
    for (const auto& function : posted) function();
}

void SocketLoop::enter(const std::function<void()>& function) {
    bool met = false;
    {
        const std::lock_guard lock(_mutex);
        _now = _clock.now();
        function();
        // What the hook should hear of comes with actions: a session's end, above all.
        if (carryOut()) {
            _turnDue = true;
            wake();
        }
        arm();
        met = anyMet();
    }
    if (met) _awaited.notify_all();
}

bool SocketLoop::wait(const std::function<bool()>& condition, Duration limit) {
    std::unique_lock lock(_mutex);
    if (condition()) return true;
    const TimePoint start = _clock.now();
    const TimePoint end = limit < TimePoint::max() - start ? start + limit : TimePoint::max();
    Waiting mine{condition};
    _waiting.push_back(&mine);
    if (!_listening && !_helper) {
        _helper = &mine;
        const TimePoint enough = std::min(end, start + kShortWait);
        for (TimePoint now = start; !mine.met && !_stopped && now < enough; now = _clock.now())
            listen(lock, enough - now);
        _helper = nullptr;
        if (mine.met) {
            _helped = _clock.now();
        } else {
            _helped = TimePoint();
            _resting.notify_one();
        }
    }
    const auto met = [&] { return mine.met; };
    end == TimePoint::max() ? _awaited.wait(lock, met) : void(_awaited.wait_until(lock, end, met));
    if (mine.met) return true;
    std::erase(_waiting, &mine);
    return false;
}

void SocketLoop::adopt(int socket, std::uint64_t tag) {
    const int on = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    const unsigned timeout = kUserTimeoutMilliseconds;
    ::setsockopt(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, &timeout, sizeof(timeout));
    post([this, socket, tag] {
        const Id id = _nextId++;
        watch(_epoll, EPOLL_CTL_ADD, socket, id, false);
        _connections.emplace(id, socket);
        _endpoint.opened(id, tag, _now);
    });
}

void SocketLoop::dialFailed(std::uint64_t tag, const Error& reason) {
    post([this, tag, reason] { _endpoint.dialFailed(tag, reason, _now); });
}

}  // namespace umbriel::net
