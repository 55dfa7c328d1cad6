#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/animation.h"
#include "common/scene/aspect.h"

namespace umbriel {

// What the import process tells the client through a pipe: messages of
//     u8 kind, u64 length, length bytes
// first warnings, the number of polygons that were split (if there are any), blobs and parts of a change list
// (common/wire/change_codec.h), then the scene's id, which ends the answer; or one error and nothing else. The client
// trusts none of it.
enum class AnswerKind : std::uint8_t {
    Warning = 1,
    Blob = 2,
    Part = 3,
    Done = 4,
    BadInput = 5,
    Failure = 6,
    Polygons = 7
};

// The import process' end. Each function is false when the client is gone.
class AnswerWriter {
 public:
    explicit AnswerWriter(int descriptor) : _descriptor(descriptor) {}

    bool warning(const std::string& text);
    bool error(const Error& error);
    bool polygons(std::uint64_t count);
    // The whole aspect, then the end of the answer.
    bool scene(const Aspect& scene, Ref<LoadedScene> loaded);

 private:
    bool message(AnswerKind kind, std::span<const std::byte> payload);
    bool header(AnswerKind kind, std::uint64_t length);
    bool write(std::span<const std::byte> bytes);

    int _descriptor;
};

// The client's end. Takes the descriptor over.
class AnswerReader {
 public:
    // After the deadline nothing more is read; of more than maxBytes nothing more is kept.
    AnswerReader(int descriptor, std::chrono::steady_clock::time_point deadline, std::uint64_t maxBytes);
    ~AnswerReader();
    AnswerReader(const AnswerReader&) = delete;
    AnswerReader& operator=(const AnswerReader&) = delete;

    enum class End {
        Done,       // the scene is complete
        Error,      // the import process refused the file: error()
        Closed,     // it ended without an answer
        Late,       // the deadline passed
        Malformed,  // it did not keep to the format: error()
    };
    // Reads to the end; the scene goes into an empty aspect. maxContainers bounds it.
    End read(Aspect& into, std::size_t maxContainers);

    Ref<LoadedScene> scene() const { return _scene; }
    const std::vector<std::string>& warnings() const { return _warnings; }
    std::uint64_t polygons() const { return _polygons; }
    const Error& error() const { return _error; }

 private:
    enum class Got { All, Closed, Late };
    Got fill(std::span<std::byte> bytes);
    End malformed(std::string reason);
    class Decoding;
    End readBlob(Decoding& decoding, std::uint64_t length, bool& more);

    int _descriptor;
    std::chrono::steady_clock::time_point _deadline;
    std::uint64_t _bytesLeft;
    Ref<LoadedScene> _scene;
    std::vector<std::string> _warnings;
    std::uint64_t _polygons = 0;
    Error _error;
};

}  // namespace umbriel
