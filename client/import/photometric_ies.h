#pragma once

#include <string_view>

#include "client/import/photometric_import.h"

namespace umbriel {

// Parses ANSI/IESNA LM-63, editions 1986 (no first line of its own), 1991, 1995 and 2002; what a later edition's first
// line says is read as 2002.
//
// Candela are the values times the multiplier and the ballast factor, and until 1991 the ballast-lamp factor (a field
// of another meaning since). TILT=INCLUDE: the factor of the untilted luminaire applies and a repair says so, as lights
// know no mounting. Symmetry follows from the horizontal angles: one plane, 0 to 90, 0 to 180, 90 to 270, 0 to 360.
// Repaired: negative candela (0), a ballast factor of 0 (1), planes that stop short of 360 degrees (closed), words
// behind the end (ignored).
// Bad input: no TILT line, TILT that names a file, photometry of type A or B, counts beyond the limits, a file that
// ends early, words that are no numbers, angles that do not rise or leave their range, a multiplier that is not
// positive.
Result<PhotometricImport> parseIes(std::string_view text, const PhotometricLimits& limits = {});

}  // namespace umbriel
