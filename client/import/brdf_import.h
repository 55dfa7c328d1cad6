#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/math/brdf_table.h"

namespace umbriel {

// Measured BRDFs from files of two kinds:
// - `.binary`, as the MERL database has them (Matusik et al. 2003, "A Data-Driven Reflectance Model"): three 32-bit
//   integers 90 90 180, then doubles for red, green and blue over the angles of Rusinkiewicz 1998; looked up at the
//   angles of our table.
// - text: a line for each pair of directions, `theta_in theta_out phi r g b`, angles in degrees and values in 1/sr, in
//   any order, over a full grid; `#` starts a comment.
// notes: what was repaired (MERL marks what could not be measured with negative values; they count as 0). Bad input:
// cannot be read, another size, no number where one is needed, not a full grid, values that checkBrdfTable() refuses.
Result<BrdfTable> loadBrdf(const std::string& file, std::vector<std::string>& notes);

// The two formats, from memory; messages name no file.
Result<BrdfTable> parseMerl(std::string_view bytes, std::vector<std::string>& notes);
Result<BrdfTable> parseBrdfText(std::string_view text);

}  // namespace umbriel
