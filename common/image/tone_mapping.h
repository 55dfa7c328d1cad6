#pragma once

#include <optional>
#include <string_view>

namespace umbriel {

// How radiance is brought into the display's [0, 1]. Only at the display end: PNG files and windows; EXR and Radiance
// files stay linear and unbounded. Operators work on each channel by itself, after exposure and before sRGB encoding,
// so each is one curve: 0 at 0, rising, never above 1.
//
// Here and not among the formulas of shaders/, because pictures are turned into display codes on the client, which
// knows nothing of shaders; there is one copy, this one.
enum class ToneMapping {
    Clamp,         // min(x, 1): exact below white
    Exponential,   // 1 - exp(-x): the photographic exposure curve; 1 is approached, slope 1 at 0
    Reinhard,      // x / (1 + x): Reinhard et al. 2002, "Photographic Tone Reproduction", eq. 3, on each channel
    AcesNarkowicz  // Narkowicz 2015, "ACES Filmic Tone Mapping Curve": a fit to the ACES reference transforms; white
                   // is reached at about 12.6
};

// `radiance` (exposed, linear) as a linear display value in [0, 1]. NaN and everything below 0 give 0, +inf gives 1.
double toneMapped(ToneMapping operation, double radiance);

// "clamp", "exposure", "reinhard", "aces".
std::optional<ToneMapping> toneMappingNamed(std::string_view name);
constexpr std::string_view kToneMappingNames = "clamp, exposure, reinhard, aces";

}  // namespace umbriel
