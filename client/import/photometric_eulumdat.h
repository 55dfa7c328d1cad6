#pragma once

#include <string_view>

#include "client/import/photometric_import.h"

namespace umbriel {

// Parses EULUMDAT (Stockmar 1990), one field per line. Candela are the values (per 1000 lm of the first set of lamps)
// times its flux / 1000 and the conversion factor.
// Repaired: negative candela (0), decimal commas, a conversion factor of 0 (1), further sets of lamps (ignored), planes
// that do not reach 360 degrees (closed, as the format never repeats the first).
// Bad input: a file that ends early, words that are no numbers where numbers are due, an unknown symmetry or a number
// of planes that does not fit it, counts beyond the limits, angles that do not rise or leave their range, no luminous
// flux.
Result<PhotometricImport> parseEulumdat(std::string_view text, const PhotometricLimits& limits = {});

}  // namespace umbriel
