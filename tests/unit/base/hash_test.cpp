#include "common/base/hash.h"

#include <gtest/gtest.h>

#include <array>

namespace umbriel {
namespace {

std::span<const std::byte> bytesOf(std::string_view text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

// The published XXH3 test value of the empty input (xxHash, doc/xxhash_spec.md): our digests are comparable elsewhere.
TEST(Hash, EmptyInputHasThePublishedValue) { EXPECT_EQ(hash64({}), 0x2d06800538d394c2ULL); }

TEST(Hash, PiecesHashLikeTheWhole) {
    Hasher128 hasher;
    hasher.add(bytesOf("render "));
    hasher.add(bytesOf("server"));
    EXPECT_EQ(hasher.finish(), hash128(bytesOf("render server")));
}

TEST(Hash, HexIsHighWordFirst) { EXPECT_EQ(toHex(Hash128{1, 2}), "00000000000000020000000000000001"); }

}  // namespace
}  // namespace umbriel
