#include "client/import/gltf_import.h"

#include <tiny_gltf.h>

#include "client/import/gltf_builder.h"

namespace umbriel {

Ref<LoadedScene> importGltf(const std::string& file, Aspect& scene, const ImportLimits& limits,
                            ImportWarnings& warnings) {
    ByteBudget fileBytes(limits.fileBytes, "file and those it names");
    ByteBudget sceneBytes(limits.sceneBytes, "scene");
    SourceFolder folder(file, fileBytes);
    GltfFile source(folder, warnings);
    GltfContext context{source, scene, limits, warnings, sceneBytes, GltfAccessors(source, sceneBytes)};
    context.accessors.checkLayouts();
    GltfMaterials materials(context);
    GltfMeshes meshes(context, materials);
    GltfNodes nodes(context, meshes);
    const Ref<Node> root = nodes.build(folder.fileName());
    const std::vector<Ref<Container>> cameras = nodes.cameras();
    const std::vector<Ref<Animation>> animations = GltfAnimations(context, nodes).build();

    const Ref<LoadedScene> loaded = scene.create<LoadedScene>(folder.fileName());
    auto edit = scene.edit(loaded);
    edit.set<&LoadedScene::root>(root);
    edit.assign<&LoadedScene::cameras>(cameras);
    edit.assign<&LoadedScene::animations>(animations);
    return loaded;
}

}  // namespace umbriel
