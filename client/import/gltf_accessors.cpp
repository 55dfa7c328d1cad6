#include "client/import/gltf_accessors.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <cstring>

#include "client/import/import_error.h"

namespace umbriel {
namespace {

template <class T>
void widen(const std::vector<std::byte>& elements, float scale, std::vector<float>& out) {
    for (std::size_t i = 0; i < out.size(); ++i) {
        T value;
        std::memcpy(&value, elements.data() + i * sizeof(T), sizeof(T));
        // glTF 2.0, section 3.11: f = max(c / 127, -1); scale is 1 for plain integers.
        const float number = static_cast<float>(value);
        out[i] = scale == 1.0f ? number : std::max(number / scale, -1.0f);
    }
}

template <class T>
void widen(const std::vector<std::byte>& elements, std::vector<std::uint32_t>& out) {
    for (std::size_t i = 0; i < out.size(); ++i) {
        T value;
        std::memcpy(&value, elements.data() + i * sizeof(T), sizeof(T));
        out[i] = value;
    }
}

// Copies count elements of elementBytes each that lie stride apart.
void gather(std::span<const std::byte> source, std::size_t stride, std::size_t elementBytes,
            std::vector<std::byte>& out) {
    if (stride == elementBytes) {
        std::memcpy(out.data(), source.data(), out.size());
        return;
    }
    for (std::size_t at = 0, from = 0; at < out.size(); at += elementBytes, from += stride)
        std::memcpy(out.data() + at, source.data() + from, elementBytes);
}

// Columns of matrices start at multiples of four bytes (glTF 2.0, section 3.6.2.4).
std::size_t elementBytesOf(int type, std::size_t componentBytes) {
    const auto matrix = [&](std::size_t side) { return side * ((side * componentBytes + 3) / 4 * 4); };
    switch (type) {
        case TINYGLTF_TYPE_SCALAR:
            return componentBytes;
        case TINYGLTF_TYPE_VEC2:
            return 2 * componentBytes;
        case TINYGLTF_TYPE_VEC3:
            return 3 * componentBytes;
        case TINYGLTF_TYPE_VEC4:
            return 4 * componentBytes;
        case TINYGLTF_TYPE_MAT2:
            return matrix(2);
        case TINYGLTF_TYPE_MAT3:
            return matrix(3);
        default:
            return matrix(4);
    }
}

}  // namespace

std::string gltfPlace(const char* array, std::size_t index) {
    return std::string(array) + "[" + std::to_string(index) + "]";
}

std::size_t GltfAccessors::count(int accessor) const {
    return _file.model().accessors[static_cast<std::size_t>(accessor)].count;
}

int GltfAccessors::components(int accessor) const {
    switch (_file.model().accessors[static_cast<std::size_t>(accessor)].type) {
        case TINYGLTF_TYPE_SCALAR:
            return 1;
        case TINYGLTF_TYPE_VEC2:
            return 2;
        case TINYGLTF_TYPE_VEC3:
            return 3;
        case TINYGLTF_TYPE_VEC4:
            return 4;
        case TINYGLTF_TYPE_MAT4:
            return 16;  // its columns are never padded
        default:
            return 0;
    }
}

bool GltfAccessors::isFloat(int accessor) const {
    return _file.model().accessors[static_cast<std::size_t>(accessor)].componentType == TINYGLTF_COMPONENT_TYPE_FLOAT;
}

bool GltfAccessors::isPlainInteger(int accessor) const {
    return !isFloat(accessor) && !_file.model().accessors[static_cast<std::size_t>(accessor)].normalized;
}

bool GltfAccessors::hasData(int index) const {
    const tinygltf::Accessor& accessor = _file.model().accessors[static_cast<std::size_t>(index)];
    if (accessor.bufferView >= 0 && _file.isPlaceholder(accessor.bufferView)) return false;
    return !accessor.sparse.isSparse || (!_file.isPlaceholder(accessor.sparse.indices.bufferView) &&
                                         !_file.isPlaceholder(accessor.sparse.values.bufferView));
}

void GltfAccessors::checkLayouts() const {
    for (std::size_t i = 0; i < _file.model().bufferViews.size(); ++i) _file.checkBufferView(static_cast<int>(i));
    for (std::size_t i = 0; i < _file.model().accessors.size(); ++i) checkLayout(i);
}

void GltfAccessors::checkLayout(std::size_t index) const {
    const tinygltf::Accessor& accessor = _file.model().accessors[index];
    const std::string place = gltfPlace("accessors", index);
    if (accessor.bufferView < 0) return;
    const std::size_t componentBytes =
        static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType)));
    const std::size_t elementBytes = elementBytesOf(accessor.type, componentBytes);
    const tinygltf::BufferView& view = _file.model().bufferViews[static_cast<std::size_t>(accessor.bufferView)];
    const std::size_t stride = view.byteStride != 0 ? view.byteStride : elementBytes;
    if (stride < elementBytes || stride % componentBytes != 0)
        throw ImportRefused(
            gltfPlace("bufferViews", static_cast<std::size_t>(accessor.bufferView)) + ".byteStride",
            std::to_string(stride) + " does not suit the elements of accessor " + std::to_string(index));
    if ((view.byteOffset + accessor.byteOffset) % componentBytes != 0)
        throw ImportRefused(place + ".byteOffset", "the data is not aligned to its component type");
    const std::size_t needed = accessor.byteOffset + stride * (accessor.count - 1) + elementBytes;
    if (needed > view.byteLength)
        throw ImportRefused(place, "needs " + std::to_string(needed) + " bytes of buffer view " +
                                       std::to_string(accessor.bufferView) + ", which has " +
                                       std::to_string(view.byteLength));
}

std::vector<float> GltfAccessors::floats(int index, bool forceNormalised) {
    const tinygltf::Accessor& accessor = _file.model().accessors[static_cast<std::size_t>(index)];
    const std::size_t numbers = accessor.count * static_cast<std::size_t>(components(index));
    _sceneBytes.take(numbers * sizeof(float), gltfPlace("accessors", static_cast<std::size_t>(index)));
    const std::vector<std::byte> elements = packed(index);
    std::vector<float> out(numbers);
    const bool normalised = accessor.normalized || forceNormalised;
    switch (accessor.componentType) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            widen<std::int8_t>(elements, normalised ? 127.0f : 1.0f, out);
            break;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            widen<std::uint8_t>(elements, normalised ? 255.0f : 1.0f, out);
            break;
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            widen<std::int16_t>(elements, normalised ? 32767.0f : 1.0f, out);
            break;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            widen<std::uint16_t>(elements, normalised ? 65535.0f : 1.0f, out);
            break;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            widen<std::uint32_t>(elements, 1.0f, out);
            break;
        default:
            widen<float>(elements, 1.0f, out);
            break;
    }
    return out;
}

std::vector<std::uint32_t> GltfAccessors::indices(int index, const std::string& place) {
    const tinygltf::Accessor& accessor = _file.model().accessors[static_cast<std::size_t>(index)];
    const std::string name = "accessor " + std::to_string(index);
    if (accessor.type != TINYGLTF_TYPE_SCALAR) throw ImportRefused(place, name + " is not of type SCALAR");
    _sceneBytes.take(accessor.count * sizeof(std::uint32_t), place);
    const std::vector<std::byte> elements = packed(index);
    std::vector<std::uint32_t> out(accessor.count);
    switch (accessor.componentType) {
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            widen<std::uint8_t>(elements, out);
            break;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            widen<std::uint16_t>(elements, out);
            break;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            widen<std::uint32_t>(elements, out);
            break;
        default:
            throw ImportRefused(place, name + " does not hold unsigned integers");
    }
    return out;
}

std::vector<std::byte> GltfAccessors::packed(int index) {
    const tinygltf::Accessor& accessor = _file.model().accessors[static_cast<std::size_t>(index)];
    const std::string place = gltfPlace("accessors", static_cast<std::size_t>(index));
    const std::size_t componentBytes =
        static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType)));
    const std::size_t elementBytes = componentBytes * static_cast<std::size_t>(components(index));
    if (elementBytes == 0) throw ImportRefused(place, "holds matrices where numbers or vectors are needed");
    if (accessor.bufferView < 0) {  // zeros, usually with sparse values on top; the budget has been asked for them
        std::vector<std::byte> zeros(accessor.count * elementBytes);
        replaceSparse(index, elementBytes, zeros);
        return zeros;
    }
    const tinygltf::BufferView& view = _file.model().bufferViews[static_cast<std::size_t>(accessor.bufferView)];
    checkLayout(static_cast<std::size_t>(index));
    const std::size_t stride = view.byteStride != 0 ? view.byteStride : elementBytes;
    const std::span<const std::byte> bytes = _file.bufferView(accessor.bufferView);
    std::vector<std::byte> elements(accessor.count * elementBytes);
    gather(bytes.subspan(accessor.byteOffset), stride, elementBytes, elements);
    replaceSparse(index, elementBytes, elements);
    return elements;
}

void GltfAccessors::replaceSparse(int index, std::size_t elementBytes, std::vector<std::byte>& elements) {
    const tinygltf::Accessor& accessor = _file.model().accessors[static_cast<std::size_t>(index)];
    if (!accessor.sparse.isSparse) return;
    const auto& sparse = accessor.sparse;
    const std::string place = gltfPlace("accessors", static_cast<std::size_t>(index)) + ".sparse";
    const std::size_t count = static_cast<std::size_t>(sparse.count);
    if (count > accessor.count) throw ImportRefused(place + ".count", "is larger than the accessor's count");
    const std::size_t indexBytes = static_cast<std::size_t>(
        tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(sparse.indices.componentType)));
    const auto bytesOf = [&](int view, int offset, std::size_t size, const char* part) {
        const std::span<const std::byte> bytes = _file.bufferView(view);
        const std::size_t first = static_cast<std::size_t>(offset);
        if (first > bytes.size() || size > bytes.size() - first)
            throw ImportRefused(place + part, "reaches beyond buffer view " + std::to_string(view));
        return bytes.subspan(first, size);
    };
    const auto indices = bytesOf(sparse.indices.bufferView, sparse.indices.byteOffset, count * indexBytes, ".indices");
    const auto values = bytesOf(sparse.values.bufferView, sparse.values.byteOffset, count * elementBytes, ".values");
    for (std::size_t i = 0; i < count; ++i) {
        std::uint32_t target = 0;
        std::memcpy(&target, indices.data() + i * indexBytes, indexBytes);  // little-endian, so narrow ones fit
        if (target >= accessor.count)
            throw ImportRefused(place + ".indices", "element " + std::to_string(i) + " is " + std::to_string(target) +
                                                        ", the accessor has " + std::to_string(accessor.count));
        std::memcpy(elements.data() + target * elementBytes, values.data() + i * elementBytes, elementBytes);
    }
}

}  // namespace umbriel
