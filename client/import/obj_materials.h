#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/import/import_limits.h"
#include "client/import/source_folder.h"
#include "common/scene/aspect.h"
#include "common/scene/materials.h"

namespace tinyobj {
struct material_t;
struct texture_option_t;
}  // namespace tinyobj

namespace umbriel {

// Materials of MTL libraries, made when they are first used.
class ObjMaterials {
 public:
    ObjMaterials(SourceFolder& folder, Aspect& scene, const ImportLimits& limits, ByteBudget& sceneBytes,
                 ImportWarnings& warnings)
        : _folder(folder), _scene(scene), _limits(limits), _sceneBytes(sceneBytes), _warnings(warnings) {}

    // index -1 (or one that does not exist): the default, a matte grey.
    Ref<Material> material(const std::vector<tinyobj::material_t>& sources, int index);

 private:
    void build(const tinyobj::material_t& source, Ref<Material> target);
    Ref<Texture> texture(std::string name, const tinyobj::texture_option_t& options, const std::string& place,
                         bool isNormalMap = false);
    glm::vec3 colour(const float (&rgb)[3], float high, const std::string& place);

    struct KnownImage {
        Ref<Image> image;
        bool isGrey = false;
    };
    const KnownImage& image(const std::string& name, const std::string& place);

    SourceFolder& _folder;
    Aspect& _scene;
    const ImportLimits& _limits;
    ByteBudget& _sceneBytes;
    ImportWarnings& _warnings;
    std::map<int, Ref<Material>> _materials;
    std::map<std::string, KnownImage> _images;
};

}  // namespace umbriel
