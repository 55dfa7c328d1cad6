#include "common/image/tone_mapping.h"

#include <algorithm>
#include <cmath>

namespace umbriel {

double toneMapped(ToneMapping operation, double radiance) {
    if (!(radiance > 0.0)) {  // also NaN
        return 0.0;
    }
    // White for every operator, to rounding; keeps infinity and overflow out of the quotients below.
    constexpr double kWhite = 1e30;
    const double x = std::min(radiance, kWhite);
    switch (operation) {
        case ToneMapping::Clamp:
            break;
        case ToneMapping::Exponential:
            return -std::expm1(-x);
        case ToneMapping::Reinhard:
            return x / (1.0 + x);
        case ToneMapping::AcesNarkowicz:
            return std::min(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 1.0);
    }
    return std::min(x, 1.0);
}

std::optional<ToneMapping> toneMappingNamed(std::string_view name) {
    if (name == "clamp") return ToneMapping::Clamp;
    if (name == "exposure") return ToneMapping::Exponential;
    if (name == "reinhard") return ToneMapping::Reinhard;
    if (name == "aces") return ToneMapping::AcesNarkowicz;
    return std::nullopt;
}

}  // namespace umbriel
