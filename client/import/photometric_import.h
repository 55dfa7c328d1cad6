#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/math/photometric_web.h"

namespace umbriel {

// A luminaire out of an IES LM-63 (.ies) or EULUMDAT (.ldt) file.
struct PhotometricImport {
    PhotometricWeb web;
    // Luminous flux of the lamps in lumens, as the file says; 0: it does not (absolute photometry). The web holds
    // candela either way.
    double lampLumens = 0.0;
    // The luminaire's name, printable.
    std::string name;
    // What was put right, one sentence each; empty for a sound file.
    std::vector<std::string> repairs;
};

// What a photometric file may hold; checked before memory is asked for.
struct PhotometricLimits {
    std::size_t fileBytes = std::size_t{64} << 20;
    std::size_t angles = 10000;                 // on either axis
    std::size_t values = std::size_t{1} << 22;  // candela values in the file
};

// Reads either kind, told apart by the name's suffix, else by content. Bad input: no such file, not a regular file,
// neither kind, beyond the limits, or what the parsers refuse (photometric_ies.h, photometric_eulumdat.h). Every
// message names the file.
Result<PhotometricImport> readPhotometricFile(const std::filesystem::path& path, const PhotometricLimits& limits = {});

}  // namespace umbriel
