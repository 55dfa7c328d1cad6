#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "common/image/image.h"
#include "tests/support/temporary_folder.h"

namespace umbriel::test {

// Address sanitizer reserves terabytes of address space: no RLIMIT_AS there.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

inline std::string contentOf(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

inline void writeContent(const std::filesystem::path& path, const std::string& content) {
    std::ofstream(path, std::ios::binary) << content;
}

// Runs `body` in a forked child; what it returns is the child's exit code. The answer is a waitpid() status.
inline int statusOfChild(const std::function<int()>& body) {
    const pid_t child = ::fork();
    if (child == 0) {
        ::_exit(body());
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return status;
}

// Any 32 bits: NaNs with payloads, infinities, denormals and both zeros among them.
inline std::uint32_t anyFloatBits(std::mt19937_64& random) {
    static constexpr std::uint32_t kSpecial[] = {0x7fc00000, 0x7f800001, 0xffc12345, 0x7f800000, 0xff800000,
                                                 0x00000001, 0x80000001, 0x007fffff, 0x80000000, 0x00000000};
    const std::uint64_t word = random();
    return (word & 3) == 0 ? kSpecial[(word >> 8) % std::size(kSpecial)] : static_cast<std::uint32_t>(word >> 32);
}

template <class T>
void fillWithAnyBits(BasicImage<T>& image, std::mt19937_64& random) {
    for (T& sample : image.samples()) {
        const std::uint32_t bits = anyFloatBits(random);
        std::memcpy(&sample, &bits, sizeof sample);
    }
}

template <class T>
bool sameBits(const BasicImage<T>& a, const BasicImage<T>& b) {
    return a.width() == b.width() && a.height() == b.height() && a.channels() == b.channels() &&
           std::memcmp(a.samples().data(), b.samples().data(), a.samples().size() * sizeof(T)) == 0;
}

}  // namespace umbriel::test
