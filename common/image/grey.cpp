#include "common/image/grey.h"

#include "common/image/display.h"
#include "common/image/tone_mapping.h"

namespace umbriel {

FloatImage displayGrey(const FloatImage& rgba, double scale) {
    UMBRIEL_ASSERT(rgba.channelCount() == 4, "a picture's colour is not R, G, B, A");
    FloatImage grey(rgba.width(), rgba.height(), {"Y"});
    const float* from = rgba.samples().data();
    for (float& to : grey.samples()) {
        const auto shown = [&](int c) { return toneMapped(ToneMapping::Clamp, static_cast<double>(from[c]) * scale); };
        to = static_cast<float>(srgbFromLinear(0.2126 * shown(0) + 0.7152 * shown(1) + 0.0722 * shown(2)));
        from += 4;
    }
    return grey;
}

}  // namespace umbriel
