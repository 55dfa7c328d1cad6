#include "common/scene/core_types.h"

#include "common/scene/animation.h"
#include "common/scene/cameras.h"
#include "common/scene/deformation.h"
#include "common/scene/environment.h"
#include "common/scene/light_map.h"
#include "common/scene/lights.h"
#include "common/scene/materials.h"
#include "common/scene/nodes.h"
#include "common/scene/windows.h"

namespace umbriel {

void registerCoreTypes(TypeRegistry& types) {
    types.add<Node>();
    types.add<Transform>();
    types.add<Switch>();
    types.add<LevelOfDetail>();
    types.add<Geometry>();
    types.add<MaterialGroup>();
    types.add<Skin>();
    types.add<MorphWeights>();
    types.add<DeformedGeometry>();
    types.add<Image>();
    types.add<Texture>();
    types.add<Material>();
    types.add<AmbientLight>();
    types.add<DirectionalLight>();
    types.add<PointLight>();
    types.add<SpotLight>();
    types.add<IntensityTable>();
    types.add<GoniometricLight>();
    types.add<EnvironmentMap>();
    types.add<EnvironmentLight>();
    types.add<PerspectiveCamera>();
    types.add<OrthographicCamera>();
    types.add<MatrixCamera>();
    types.add<StereoCameraDecorator>();
    types.add<TileCameraDecorator>();
    types.add<Fog>();
    types.add<ColourBackground>();
    types.add<GradientBackground>();
    types.add<ImageBackground>();
    types.add<EnvironmentBackground>();
    types.add<ImageForeground>();
    types.add<TextForeground>();
    types.add<Viewport>();
    types.add<Window>();
    types.add<AnimatedPose>();
    types.add<AnimationChannel>();
    types.add<Animation>();
    types.add<LoadedScene>();
    types.add<LightMap>();
}

}  // namespace umbriel
