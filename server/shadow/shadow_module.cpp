#include "server/shadow/shadow_module.h"

#include "server/shadow/hemisphere_module.h"
#include "server/shadow/light_map_module.h"
#include "server/shadow/map_module.h"
#include "server/shadow/view_module.h"

namespace umbriel {

const ShadowModule* shadowModule(ShadowMode mode) {
    static const MapModule standard("standard", 0);
    static const MapModule perspective("perspective", 0);
    static const MapModule lightSpacePerspective("light-space perspective", 0);
    static const MapModule trapezoid("trapezoid", 0);
    static const MapModule cube("cube", 0);
    static const MapModule percentageCloser("percentage closer", bit(ShadowFeature::Filter));
    static const MapModule percentageCloserSoft("percentage closer soft",
                                                bit(ShadowFeature::Filter) | bit(ShadowFeature::SoftFilter));
    static const HemisphereModule dualParaboloid;
    static const LightMapModule lightMap;
    static const ViewModule planar("planar", true);
    static const ViewModule planarStencil("planar, on its plane", true);
    static const ViewModule volumeZPass("volumes, z-pass", false);
    static const ViewModule volumeZFail("volumes, z-fail", false);
    static const ViewModule blob("blob", true);
    switch (mode) {
        case ShadowMode::Standard:
            return &standard;
        case ShadowMode::Perspective:
            return &perspective;
        case ShadowMode::LightSpacePerspective:
            return &lightSpacePerspective;
        case ShadowMode::Trapezoid:
            return &trapezoid;
        case ShadowMode::Cube:
            return &cube;
        case ShadowMode::PercentageCloser:
            return &percentageCloser;
        case ShadowMode::PercentageCloserSoft:
            return &percentageCloserSoft;
        case ShadowMode::DualParaboloid:
            return &dualParaboloid;
        case ShadowMode::Planar:
            return &planar;
        case ShadowMode::PlanarStencil:
            return &planarStencil;
        case ShadowMode::VolumeZPass:
            return &volumeZPass;
        case ShadowMode::VolumeZFail:
            return &volumeZFail;
        case ShadowMode::Blob:
            return &blob;
        case ShadowMode::LightMap:
            return &lightMap;
        default:
            return nullptr;
    }
}

}  // namespace umbriel
