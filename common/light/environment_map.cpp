#include "common/light/environment_map.h"

namespace umbriel {

Ref<EnvironmentMap> addEnvironmentMap(Aspect& scene, const Panorama& panorama, int faceSize) {
    const PrefilteredEnvironment filtered = prefilter(panorama, faceSize);
    const Ref<EnvironmentMap> map = scene.create<EnvironmentMap>("environment");
    auto edit = scene.edit(map);
    edit.set<&EnvironmentMap::faceSize>(static_cast<std::uint32_t>(filtered.faceSize));
    edit.set<&EnvironmentMap::levels>(static_cast<std::uint32_t>(filtered.levels));
    edit.assign<&EnvironmentMap::radiance>(filtered.radiance);
    edit.set<&EnvironmentMap::diffuseSize>(static_cast<std::uint32_t>(filtered.diffuseSize));
    edit.assign<&EnvironmentMap::convolved>(filtered.convolved);
    edit.assign<&EnvironmentMap::mirroredShares>(mirroredShares());
    return map;
}

}  // namespace umbriel
