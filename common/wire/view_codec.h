#pragma once

#include <span>

#include "common/base/result.h"
#include "common/wall/view.h"
#include "common/wire/bytes.h"

namespace umbriel::wire {

inline constexpr std::size_t kMaxViews = 64;
// Of one view: six for each of the 256 lights that a server shades with.
inline constexpr std::size_t kMaxFits = 6 * 256;

// Views and shadow fits as they travel: equal views have equal bytes, so comparing bytes tells whether to send them.
Bytes encodeViews(const WallViews& views);

// Every number is finite, every enum known, every region on the wall; at most kMaxViews views with kMaxFits fits each.
Result<WallViews> decodeViews(std::span<const std::byte> bytes);

}  // namespace umbriel::wire
