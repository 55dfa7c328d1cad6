#include "tests/unit/import/gltf_maker.h"

namespace umbriel::test {
namespace {

std::string base64(std::span<const std::byte> bytes) {
    constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k)
            group = group << 8 | (i + k < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

void appendU32(std::string& out, std::size_t value) {
    for (int i = 0; i < 4; ++i) out += static_cast<char>(value >> (8 * i) & 0xff);
}

}  // namespace

int GltfMaker::addView(std::span<const std::byte> data, int stride) {
    _bin.resize((_bin.size() + 3) / 4 * 4);
    nlohmann::json view = {{"buffer", 0}, {"byteOffset", _bin.size()}, {"byteLength", data.size()}};
    if (stride != 0) view["byteStride"] = stride;
    _bin.insert(_bin.end(), data.begin(), data.end());
    document["buffers"] = {{{"byteLength", _bin.size()}}};
    return add("bufferViews", view);
}

int GltfMaker::add(const std::string& array, const nlohmann::json& element) {
    document[array].push_back(element);
    return static_cast<int>(document[array].size()) - 1;
}

int GltfMaker::addMeshNode(const nlohmann::json& primitive) {
    const int mesh = add("meshes", {{"primitives", {primitive}}});
    const int node = add("nodes", {{"mesh", mesh}});
    if (!document.contains("scenes")) document["scenes"] = {{{"nodes", nlohmann::json::array()}}};
    document["scenes"][0]["nodes"].push_back(node);
    return node;
}

std::string GltfMaker::glb() const {
    std::string json = document.dump();
    json.append((4 - json.size() % 4) % 4, ' ');
    std::string bin(reinterpret_cast<const char*>(_bin.data()), _bin.size());
    bin.append((4 - bin.size() % 4) % 4, '\0');
    std::string file = "glTF";
    appendU32(file, 2);
    appendU32(file, 12 + 8 + json.size() + (bin.empty() ? 0 : 8 + bin.size()));
    appendU32(file, json.size());
    file += "JSON" + json;
    if (bin.empty()) return file;
    appendU32(file, bin.size());
    return file + std::string("BIN\0", 4) + bin;
}

std::string GltfMaker::gltf() const {
    return gltfWithUri("data:application/octet-stream;base64," + base64(_bin));
}

std::string GltfMaker::gltfWithUri(const std::string& uri) const {
    nlohmann::json copy = document;
    copy["buffers"][0]["uri"] = uri;
    return copy.dump(1);
}

GltfMaker triangle() {
    GltfMaker maker;
    const int positions = maker.addFloats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    const int indices = maker.addAccessor(std::vector<std::uint16_t>{0, 1, 2}, 5123, "SCALAR");
    maker.addMeshNode({{"attributes", {{"POSITION", positions}}}, {"indices", indices}});
    return maker;
}

Loaded::Loaded(const std::string& path, const ImportLimits& limits) {
    registerCoreTypes(types);
    scene = std::make_unique<Aspect>(types, ids);
    file = loadScene(path, *scene, ids, limits);
}

bool Loaded::warnsOf(const std::string& text) const {
    if (!file) return false;
    for (const std::string& warning : file->warnings)
        if (warning.find(text) != std::string::npos) return true;
    return false;
}

Loaded load(const GltfMaker& maker, const ImportLimits& limits) {
    const TempFolder folder;
    return Loaded(folder.write("scene.glb", maker.glb()), limits);
}

}  // namespace umbriel::test
