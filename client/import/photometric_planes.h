#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/import/photometric_import.h"

namespace umbriel {

// What the two photometric formats share. Angles are in degrees here.

// Which planes a file states; the others follow.
enum class PhotometricSymmetry {
    None,
    Rotational,  // one plane for all
    AcrossC0,    // the plane C0-C180 is a mirror; given: 0 to 180
    AcrossC90,   // the plane C90-C270 is a mirror; given: 90 to 270, in EULUMDAT from 270 over 0 to 90
    Quadrant     // both; given: 0 to 90
};

// Luminous intensity as the formats of lamps give it, type C: angles in degrees, vertical ones from 0, straight down.
struct PhotometricTable {
    std::vector<double> vertical;    // gamma
    std::vector<double> horizontal;  // C, of the planes that are given, modulo 360
    PhotometricSymmetry symmetry = PhotometricSymmetry::None;
    std::vector<double> values;  // horizontal.size() planes of vertical.size()
    double candelaPerValue = 1.0;
};

// Spreads the planes over the circle, closes it, and turns values into candela. Negative values become 0 and a repair
// says how many. Bad input: vertical angles that do not rise or leave 0..180, values beyond what a float holds.
Result<PhotometricWeb> webOf(const PhotometricTable& table, std::vector<std::string>& repairs);

// Bad input unless each angle is above the one before; `what` names the axis.
Result<void> expectRising(const std::vector<double>& angles, std::string_view what);

// A finite decimal number and nothing else, with or without a leading '+'.
std::optional<double> numberIn(std::string_view word);

// A count within the limit, or bad input that says what there are too many of.
Result<std::size_t> countIn(double number, std::string_view what, std::size_t limit);

}  // namespace umbriel
