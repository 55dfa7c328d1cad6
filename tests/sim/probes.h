#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace umbriel::sim {

// Rare paths: a run of many seeds that never takes one of them proves less than it seems to.
enum class Probe : std::size_t {
    Late,
    Lost,
    Refused,
    Rejoined,
    Snapshot,
    CatchUp,
    SnapshotInSession,
    ShownLate,
    Fenced,
    NoAnswer,
    KilledDrawing,
    KilledJoining,
    Backpressure,
    NobodyThere,
    OverlappedFrame,
    PixelsMissing,
    StartedIncomplete,
    StaleAnswer,
    WaitEnded,
    BlobFetched,
    ReconnectedTwice,
    Count
};

inline constexpr std::array<std::string_view, static_cast<std::size_t>(Probe::Count)> kProbeNames = {
    "a server is late",
    "a server is lost",
    "a server refuses or cannot be reached",
    "a server is back in step",
    "a snapshot for a server that joins",
    "one frame with the changes of several",
    "a snapshot within a session",
    "a late server shows the frame of the others",
    "a newer session fences the old one",
    "a host does not answer",
    "killed while drawing",
    "killed while joining",
    "bytes wait for a slow reader",
    "a frame with no server there",
    "a frame begins while another is drawn",
    "a frame without some of its pixels",
    "the wall starts without a server",
    "an answer for a session gone by",
    "wait: a lost server ends the cluster",
    "a blob is fetched",
    "one server is reached again twice"};

struct Probes {
    std::array<std::uint64_t, static_cast<std::size_t>(Probe::Count)> counts{};

    void hit(Probe probe) { ++counts[static_cast<std::size_t>(probe)]; }
    void add(const Probes& other) {
        for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += other.counts[i];
    }
};

}  // namespace umbriel::sim
