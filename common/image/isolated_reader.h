#pragma once

#include <chrono>
#include <filesystem>

#include "common/base/result.h"
#include "common/image/image.h"

namespace umbriel {

// What decoding a picture in a process of its own may cost; beyond, the picture is refused.
struct IsolationLimits {
    ImageLimits image;
    // Address space of the decoding process beyond what this process has now and the decoded samples.
    std::uint64_t workingBytes = std::uint64_t{256} << 20;
    // Processor time for a small file; 1 s more for every 8 MiB of file. Waiting ends after twice that.
    std::chrono::seconds processorTime{4};
};

// readImage() for files that others made: decodes in a forked child under limits of memory, processor and waiting time
// and takes nothing but checked samples back, so that whatever a hostile file does to a decoder ends as an error of
// this call. (OpenEXR 3.1.5 of Debian 12 is the reason: some of its known memory errors are fixed in later series
// only.)
//
// Forks: call it where no other thread holds a lock a decoder needs, best from a program that has no threads yet. The
// child keeps no file or socket of this process but its pipe.
Result<LayeredImage> readImageIsolated(const std::filesystem::path& path, const IsolationLimits& limits = {});

}  // namespace umbriel
