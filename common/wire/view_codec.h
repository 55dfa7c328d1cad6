#pragma once

#include <span>

#include "common/base/result.h"
#include "common/wall/view.h"
#include "common/wire/bytes.h"

namespace umbriel::wire {

// Views and shadow fits as they travel: equal views have equal bytes, so comparing bytes tells whether to send them.
Bytes encodeViews(const WallViews& views);

// Every number is finite, every enum known, every region on the wall; at most 64 views with 1024 fits each.
Result<WallViews> decodeViews(std::span<const std::byte> bytes);

}  // namespace umbriel::wire
