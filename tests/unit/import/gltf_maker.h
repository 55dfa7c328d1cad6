#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "client/import/load_scene.h"
#include "common/scene/core_types.h"
#include "tests/support/temporary_folder.h"

namespace umbriel::test {

// Paths as text, as the importer takes and prints them.
class TempFolder {
 public:
    std::string path(const std::string& name) const { return (_folder / name).string(); }
    // Writes a file and returns its path.
    std::string write(const std::string& name, const std::string& content) const {
        return _folder.write(name, content).string();
    }

 private:
    TemporaryFolder _folder;
};

// Puts a glTF document and its binary data together.
class GltfMaker {
 public:
    nlohmann::json document = {{"asset", {{"version", "2.0"}}}};

    // Appends data, aligned to four bytes, with a view of it.
    int addView(std::span<const std::byte> data, int stride = 0);
    template <class T>
    int addAccessor(const std::vector<T>& values, int componentType, const std::string& type, bool normalized = false) {
        const int components = type == "SCALAR" ? 1 : type == "VEC2" ? 2 : type == "VEC3" ? 3 : 4;
        nlohmann::json accessor = {{"bufferView", addView(std::as_bytes(std::span(values)))},
                                   {"componentType", componentType},
                                   {"count", values.size() / static_cast<std::size_t>(components)},
                                   {"type", type}};
        if (normalized) accessor["normalized"] = true;
        return add("accessors", accessor);
    }
    int addFloats(const std::vector<float>& values, const std::string& type) { return addAccessor(values, 5126, type); }
    // Appends to an array of the document and returns the index.
    int add(const std::string& array, const nlohmann::json& element);
    // A node with a mesh of one primitive, in the scene.
    int addMeshNode(const nlohmann::json& primitive);

    std::string glb() const;
    // As text with a data URI.
    std::string gltf() const;
    // As text whose buffer is the file of this name.
    std::string gltfWithUri(const std::string& uri) const;
    const std::vector<std::byte>& bin() const { return _bin; }

 private:
    std::vector<std::byte> _bin;
};

// The triangle (0,0,0) (1,0,0) (0,1,0) with 16-bit indices, in the scene.
GltfMaker triangle();

// A loaded file with the scene around it.
struct Loaded {
    TypeRegistry types;
    IdSource ids{100};
    std::unique_ptr<Aspect> scene;
    Result<LoadedFile> file = badInput("not loaded");

    explicit Loaded(const std::string& path, const ImportLimits& limits = {});
    const LoadedScene& root() const { return scene->get(file->scene); }
    // The only (or the first) container of a type, ascending by id; fails the test when there is none.
    template <class T>
    const T& only(std::size_t index = 0) const {
        for (const ContainerId id : scene->ids())
            if (const T* found = scene->findAs<T>(id); found && index-- == 0) return *found;
        UMBRIEL_ASSERT(false, "the file has no such container");
    }
    template <class T>
    std::size_t count() const {
        std::size_t found = 0;
        for (const ContainerId id : scene->ids()) found += isA<T>(*scene->find(id)) ? 1 : 0;
        return found;
    }
    bool warnsOf(const std::string& text) const;
    // The error's message; empty when it loaded.
    std::string error() const { return file ? "" : file.error().message; }
};

// Writes the document as .glb and loads it.
Loaded load(const GltfMaker& maker, const ImportLimits& limits = {});

}  // namespace umbriel::test
