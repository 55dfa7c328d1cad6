#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/import/source_folder.h"

namespace tinygltf {
class Model;
}

namespace umbriel {

// A .gltf or .glb file: its container, its checked JSON as tinygltf's model, and the bytes it refers to, which are read
// when they are first asked for. A valid file may name buffers that cannot be had as long as nothing needs them.
class GltfFile {
 public:
    // Throws ImportRefused.
    GltfFile(SourceFolder& folder, ImportWarnings& warnings);
    ~GltfFile();
    GltfFile(const GltfFile&) = delete;
    GltfFile& operator=(const GltfFile&) = delete;

    const tinygltf::Model& model() const { return *_model; }
    // Throws ImportRefused when the buffer view does not fit its buffer; reads nothing.
    void checkBufferView(int index) const;
    // The file leaves the data of this buffer view to others: its buffer has neither a uri nor a BIN chunk.
    bool isPlaceholder(int bufferView) const;
    // The bytes of a buffer view. Throws ImportRefused when it does not fit its buffer or the buffer cannot be had.
    std::span<const std::byte> bufferView(int index);
    // The encoded bytes of an image (PNG, JPEG, ...). Throws ImportRefused.
    std::vector<std::byte> imageBytes(int index);

 private:
    const std::vector<std::byte>& buffer(int index);
    std::vector<std::byte> dataUri(const std::string& uri, const std::string& place);
    std::string parseContainer(const std::vector<std::byte>& file);
    void parseJson(const std::string& text, ImportWarnings& warnings);

    SourceFolder& _folder;
    std::unique_ptr<tinygltf::Model> _model;
    std::vector<std::byte> _binChunk;  // until it is buffer 0
    bool _hasBinChunk = false;
    std::vector<std::string> _bufferUris;
    std::vector<std::size_t> _bufferSizes;
    std::vector<std::optional<std::vector<std::byte>>> _buffers;
    std::vector<std::string> _imageUris;
};

}  // namespace umbriel
