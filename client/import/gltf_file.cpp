#include "client/import/gltf_file.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>

#include "client/import/gltf_schema.h"
#include "client/import/import_error.h"

namespace umbriel {
namespace {

using nlohmann::json;

constexpr int kMaxJsonDepth = 64;

constexpr std::array<std::string_view, 6> kSupportedExtensions = {"KHR_lights_punctual",
                                                                  "KHR_materials_unlit",
                                                                  "KHR_texture_transform",
                                                                  "KHR_mesh_quantization",
                                                                  "KHR_materials_emissive_strength",
                                                                  "KHR_node_visibility"};

bool isSupported(std::string_view extension) {
    return std::find(kSupportedExtensions.begin(), kSupportedExtensions.end(), extension) != kSupportedExtensions.end();
}

// Readers of JSON recurse. (A callback of nlohmann::json could count, too, but makes its parser quadratic in the length
// of arrays.)
void requireShallow(std::string_view text) {
    int depth = 0;
    bool inString = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (inString) {
            if (c == '\\')
                ++i;
            else if (c == '"')
                inString = false;
        } else if (c == '"') {
            inString = true;
        } else if (c == '[' || c == '{') {
            if (++depth > kMaxJsonDepth) throw ImportRefused("the JSON document is nested too deeply");
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
}

std::uint32_t littleU32(const std::vector<std::byte>& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (int i = 3; i >= 0; --i) value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
    return value;
}

void checkVersion(const json& asset, ImportWarnings& warnings) {
    const std::string version = asset.at("version").get<std::string>();
    if (version.compare(0, 2, "2.") != 0)
        throw ImportRefused("asset.version", "glTF " + version + " is not supported; export the scene as glTF 2.0");
    const std::string minVersion = asset.value("minVersion", "2.0");
    if (minVersion.compare(0, 2, "2.") != 0 || minVersion > version)
        throw ImportRefused("asset.minVersion", "needs glTF " + minVersion + ", the file is " + version);
    if (version != "2.0") warnings.add("the file is glTF " + version + ", what is newer than 2.0 is ignored");
}

// Properties that another property of the same object asks for.
void checkVariants(const json& document) {
    const auto require = [](const json& object, const std::string& name, const std::string& place) {
        if (!object.contains(name)) throw ImportRefused(place + "." + name, "is missing");
    };
    if (document.contains("cameras"))
        for (std::size_t i = 0; i < document.at("cameras").size(); ++i) {
            const json& camera = document.at("cameras")[i];
            require(camera, camera.at("type").get<std::string>(), "cameras[" + std::to_string(i) + "]");
        }
    const json::json_pointer path("/extensions/KHR_lights_punctual/lights");
    if (!document.contains(path)) return;
    const json& lights = document.at(path);
    for (std::size_t i = 0; i < lights.size(); ++i)
        if (lights[i].at("type") == "spot")
            require(lights[i], "spot", "extensions.KHR_lights_punctual.lights[" + std::to_string(i) + "]");
}

void checkExtensions(const json& document, ImportWarnings& warnings) {
    const auto list = [&](const char* name) {
        return document.contains(name) ? document.at(name).get<std::vector<std::string>>() : std::vector<std::string>();
    };
    const std::vector<std::string> required = list("extensionsRequired");
    for (std::size_t i = 0; i < required.size(); ++i)
        if (!isSupported(required[i]))
            throw ImportRefused("extensionsRequired[" + std::to_string(i) + "]",
                                "the file requires " + required[i] + ", which this version does not support");
    for (const std::string& used : list("extensionsUsed"))
        if (!isSupported(used)) warnings.add(used + " is not supported and ignored");
}

// tinygltf would read every buffer and image at once, and refuses valid files that name some it cannot have; it is
// given stand-ins instead, and GltfFile reads what is needed.
std::vector<std::string> takeUris(json& document, const char* array, const char* standIn) {
    std::vector<std::string> uris;
    if (!document.contains(array)) return uris;
    for (json& element : document.at(array)) {
        uris.push_back(element.contains("uri") ? element.at("uri").get<std::string>() : std::string());
        if (element.contains("uri") && element.at("uri").get_ref<const std::string&>().empty())
            throw ImportRefused(std::string(array) + "[" + std::to_string(uris.size() - 1) + "].uri", "is empty");
        element["uri"] = standIn;
    }
    return uris;
}

bool ignoreImage(tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*, int, void*) {
    return true;
}

}  // namespace

GltfFile::GltfFile(SourceFolder& folder, ImportWarnings& warnings)
    : _folder(folder), _model(std::make_unique<tinygltf::Model>()) {
    parseJson(parseContainer(folder.readMain()), warnings);
}

GltfFile::~GltfFile() = default;

// glTF 2.0 specification, section 4.4 (binary glTF): header, JSON chunk, optional BIN chunk.
std::string GltfFile::parseContainer(const std::vector<std::byte>& file) {
    const auto textOf = [&](std::size_t first, std::size_t size) {
        return std::string(reinterpret_cast<const char*>(file.data()) + first, size);
    };
    if (file.empty()) throw ImportRefused("the file is empty");
    if (file.size() < 4 || std::memcmp(file.data(), "glTF", 4) != 0) return textOf(0, file.size());
    if (file.size() < 20) throw ImportRefused("byte 0: the binary glTF header is truncated");
    if (littleU32(file, 4) != 2)
        throw ImportRefused("byte 4: binary glTF version " + std::to_string(littleU32(file, 4)) + " is not supported");
    const std::size_t length = littleU32(file, 8);
    if (length > file.size())
        throw ImportRefused("byte 8: the file is truncated: it says " + std::to_string(length) + " bytes and has " +
                            std::to_string(file.size()));
    std::string text;
    std::size_t at = 12;
    for (int chunk = 0; at < length; ++chunk) {
        const std::string place = "byte " + std::to_string(at) + ", chunk " + std::to_string(chunk);
        if (length - at < 8) throw ImportRefused(place, "the chunk header is truncated");
        const std::size_t size = littleU32(file, at);
        const std::string type = textOf(at + 4, 4);
        if (size > length - at - 8) throw ImportRefused(place, "the chunk is longer than the file");
        if (chunk == 0) {
            if (type != "JSON") throw ImportRefused(place, "the first chunk is not JSON");
            text = textOf(at + 8, size);
        } else if (type == std::string("BIN\0", 4) && !_hasBinChunk) {
            _hasBinChunk = true;
            _binChunk.assign(file.begin() + static_cast<std::ptrdiff_t>(at + 8),
                             file.begin() + static_cast<std::ptrdiff_t>(at + 8 + size));
        }
        at += 8 + size;
    }
    return text;
}

void GltfFile::parseJson(const std::string& text, ImportWarnings& warnings) {
    requireShallow(text);
    json document;
    try {
        document = json::parse(text);
    } catch (const json::exception& error) {
        const std::string reason = error.what();
        const std::size_t end = reason.find("] ");
        throw ImportRefused("the JSON document", end == std::string::npos ? reason : reason.substr(end + 2));
    }
    checkGltfSchema(document);
    checkVersion(document.at("asset"), warnings);
    checkVariants(document);
    checkExtensions(document, warnings);

    _bufferUris = takeUris(document, "buffers", "data:application/octet-stream;base64,AA==");
    _buffers.resize(_bufferUris.size());
    for (std::size_t i = 0; i < _bufferUris.size(); ++i) {
        json& byteLength = document.at("buffers")[i].at("byteLength");
        _bufferSizes.push_back(byteLength.get<std::size_t>());
        byteLength = 1;
    }
    // An image with a buffer view keeps it and gets no URI: the schema allows one of the two.
    if (document.contains("images"))
        for (std::size_t i = 0; i < document.at("images").size(); ++i) {
            json& image = document.at("images")[i];
            if (image.contains("uri") && image.contains("bufferView"))
                throw ImportRefused("images[" + std::to_string(i) + "]", "has both a uri and a bufferView");
        }
    const json images = document.contains("images") ? document.at("images") : json::array();
    _imageUris = takeUris(document, "images", "data:image/png;base64,AA==");
    for (std::size_t i = 0; i < images.size(); ++i)
        if (images[i].contains("bufferView")) document.at("images")[i].erase("bufferView");

    // tinygltf wants a buffer view for indices, which may do without one (zeros, sparse values).
    std::vector<std::size_t> withoutView;
    const std::size_t standInView = document.contains("bufferViews") ? document.at("bufferViews").size() : 0;
    if (document.contains("accessors"))
        for (std::size_t i = 0; i < document.at("accessors").size(); ++i) {
            json& accessor = document.at("accessors")[i];
            if (accessor.contains("bufferView")) continue;
            accessor["bufferView"] = standInView;
            withoutView.push_back(i);
        }
    if (!withoutView.empty()) document["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 1}});

    const std::string normalised = document.dump();
    tinygltf::TinyGLTF loader;
    loader.SetImageLoader(ignoreImage, nullptr);
    // Nothing is left to read from files; without callbacks it cannot.
    loader.SetFsCallbacks(tinygltf::FsCallbacks{nullptr, nullptr, nullptr, nullptr, nullptr});
    std::string error;
    std::string ignored;
    if (!loader.LoadASCIIFromString(_model.get(), &error, &ignored, normalised.data(),
                                    static_cast<unsigned int>(normalised.size()), ""))
        throw ImportRefused("the JSON document", error.empty() ? "cannot be understood" : error);
    for (std::size_t i = 0; i < images.size(); ++i)
        _model->images[i].bufferView = images[i].contains("bufferView") ? images[i].at("bufferView").get<int>() : -1;
    for (const std::size_t i : withoutView) _model->accessors[i].bufferView = -1;
    _model->bufferViews.resize(standInView);
}

bool GltfFile::isPlaceholder(int bufferView) const {
    const int buffer = _model->bufferViews[static_cast<std::size_t>(bufferView)].buffer;
    return _bufferUris[static_cast<std::size_t>(buffer)].empty() && (buffer != 0 || !_hasBinChunk);
}

std::vector<std::byte> GltfFile::dataUri(const std::string& uri, const std::string& place) {
    const std::size_t marker = uri.find(";base64,");
    if (marker == std::string::npos) throw ImportRefused(place, "is a data URI without base64 data");
    std::vector<unsigned char> decoded;
    std::string mimeType;
    const std::string known = "data:application/octet-stream;base64," + uri.substr(marker + 8);
    if (!tinygltf::DecodeDataURI(&decoded, mimeType, known, 0, false))
        throw ImportRefused(place, "the base64 data cannot be decoded");
    const auto bytes = std::as_bytes(std::span(decoded));
    return {bytes.begin(), bytes.end()};
}

const std::vector<std::byte>& GltfFile::buffer(int index) {
    const std::size_t i = static_cast<std::size_t>(index);
    if (_buffers[i]) return *_buffers[i];
    const std::string place = "buffers[" + std::to_string(index) + "]";
    const std::string& uri = _bufferUris[i];
    std::vector<std::byte> bytes;
    if (uri.empty()) {
        if (index != 0 || !_hasBinChunk) throw ImportRefused(place, "has no uri, and there is no BIN chunk for it");
        bytes = std::move(_binChunk);
    } else if (uri.compare(0, 5, "data:") == 0) {
        bytes = dataUri(uri, place + ".uri");
    } else {
        bytes = _folder.read(uri, place + ".uri", true);
    }
    if (bytes.size() < _bufferSizes[i])
        throw ImportRefused(place + ".byteLength", "says " + std::to_string(_bufferSizes[i]) + " bytes, there are " +
                                                       std::to_string(bytes.size()));
    _buffers[i] = std::move(bytes);
    return *_buffers[i];
}

std::span<const std::byte> GltfFile::bufferView(int index) {
    const tinygltf::BufferView& view = _model->bufferViews[static_cast<std::size_t>(index)];
    checkBufferView(index);
    return std::span(buffer(view.buffer)).subspan(view.byteOffset, view.byteLength);
}

void GltfFile::checkBufferView(int index) const {
    const tinygltf::BufferView& view = _model->bufferViews[static_cast<std::size_t>(index)];
    const std::size_t size = _bufferSizes[static_cast<std::size_t>(view.buffer)];
    if (view.byteOffset > size || view.byteLength > size - view.byteOffset)
        throw ImportRefused("bufferViews[" + std::to_string(index) + "]",
                            "ends at byte " + std::to_string(view.byteOffset + view.byteLength) + " of buffer " +
                                std::to_string(view.buffer) + ", which has " + std::to_string(size));
}

std::vector<std::byte> GltfFile::imageBytes(int index) {
    const std::string place = "images[" + std::to_string(index) + "]";
    const int view = _model->images[static_cast<std::size_t>(index)].bufferView;
    if (view >= 0) {
        const auto bytes = bufferView(view);
        return {bytes.begin(), bytes.end()};
    }
    const std::string& uri = _imageUris[static_cast<std::size_t>(index)];
    if (uri.empty()) throw ImportRefused(place, "has neither a uri nor a bufferView");
    if (uri.compare(0, 5, "data:") == 0) return dataUri(uri, place + ".uri");
    return _folder.read(uri, place + ".uri", true);
}

}  // namespace umbriel
