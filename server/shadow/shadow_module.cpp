#include "server/shadow/shadow_module.h"

#include "server/shadow/map_module.h"

namespace umbriel {

const ShadowModule* shadowModule(ShadowMode mode) {
    static const MapModule standard("standard", 0);
    switch (mode) {
        case ShadowMode::Standard:
            return &standard;
        default:
            return nullptr;
    }
}

}  // namespace umbriel
