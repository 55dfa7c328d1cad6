#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/import/gltf_file.h"

namespace umbriel {

// Reads accessors: every component type, normalised or not, interleaved or not, sparse or not, with or without data.
class GltfAccessors {
 public:
    GltfAccessors(GltfFile& file, ByteBudget& sceneBytes) : _file(file), _sceneBytes(sceneBytes) {}

    std::size_t count(int accessor) const;
    // 1, 2, 3, 4 for SCALAR to VEC4, 16 for MAT4, otherwise 0.
    int components(int accessor) const;
    bool isFloat(int accessor) const;
    // Integers that are not marked as normalised.
    bool isPlainInteger(int accessor) const;

    // False when the file leaves the accessor's data to others (a buffer without uri).
    bool hasData(int accessor) const;
    // Checks that every accessor, used or not, keeps within its buffer view, and every view within its buffer, without
    // reading anything. Throws ImportRefused.
    void checkLayouts() const;

    // count x components numbers; normalised integers become [0, 1] or [-1, 1] (glTF 2.0, section 3.11).
    // forceNormalised reads plain integers so, too. Throws ImportRefused.
    std::vector<float> floats(int accessor, bool forceNormalised = false);
    // Must be unsigned SCALARs; place says who uses the accessor.
    std::vector<std::uint32_t> indices(int accessor, const std::string& place);

 private:
    void checkLayout(std::size_t index) const;
    // count x components elements, packed, as they lie in the file.
    std::vector<std::byte> packed(int accessor);
    void replaceSparse(int accessor, std::size_t elementBytes, std::vector<std::byte>& elements);

    GltfFile& _file;
    ByteBudget& _sceneBytes;
};

// "accessors[7]"
std::string gltfPlace(const char* array, std::size_t index);

}  // namespace umbriel
