#include "client/import/gltf_schema.h"

#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "client/import/import_error.h"

namespace umbriel {
namespace {

using nlohmann::json;

enum class Kind {
    Boolean,
    Integer,  // within [low, high]
    Number,   // within [low, high]
    Numbers,  // `count` of them (0: any number), each within [low, high]
    Text,
    Texts,
    OneOf,  // a text or an integer among those in target, separated by |
    Index,  // into the array named by target
    Indices,
    IndexMap,  // an object whose values are indices
    Object,    // of the type named by target
    Objects,   // an array of them
};

constexpr double kLargest = 1e30;  // squares and sums of such numbers are still floats
constexpr double kMaxInteger = 2147483647.0;
constexpr bool kRequired = true;
constexpr bool kOptional = false;

struct Property {
    std::string_view object;
    std::string_view name;
    Kind kind;
    bool required = kOptional;
    std::string_view target = {};
    double low = -kLargest;
    double high = kLargest;
    std::size_t count = 0;
};

constexpr std::string_view kComponents = "5120|5121|5122|5123|5125|5126";
constexpr std::string_view kWraps = "10497|33071|33648";

// glTF 2.0 specification, chapter 5; KHR_lights_punctual, KHR_texture_transform, KHR_materials_emissive_strength,
// KHR_node_visibility. Ranges of material factors are left to the importer, which repairs them.
constexpr Property kSchema[] = {
    {"glTF", "asset", Kind::Object, kRequired, "asset"},
    {"glTF", "extensionsUsed", Kind::Texts},
    {"glTF", "extensionsRequired", Kind::Texts},
    {"glTF", "scene", Kind::Index, kOptional, "scenes"},
    {"glTF", "scenes", Kind::Objects, kOptional, "scene"},
    {"glTF", "nodes", Kind::Objects, kOptional, "node"},
    {"glTF", "meshes", Kind::Objects, kOptional, "mesh"},
    {"glTF", "accessors", Kind::Objects, kOptional, "accessor"},
    {"glTF", "bufferViews", Kind::Objects, kOptional, "bufferView"},
    {"glTF", "buffers", Kind::Objects, kOptional, "buffer"},
    {"glTF", "cameras", Kind::Objects, kOptional, "camera"},
    {"glTF", "materials", Kind::Objects, kOptional, "material"},
    {"glTF", "textures", Kind::Objects, kOptional, "texture"},
    {"glTF", "images", Kind::Objects, kOptional, "image"},
    {"glTF", "samplers", Kind::Objects, kOptional, "sampler"},
    {"glTF", "skins", Kind::Objects, kOptional, "skin"},
    {"glTF", "animations", Kind::Objects, kOptional, "animation"},
    {"glTF", "extensions", Kind::Object, kOptional, "glTF.extensions"},
    {"glTF.extensions", "KHR_lights_punctual", Kind::Object, kOptional, "lights"},
    {"lights", "lights", Kind::Objects, kRequired, "light"},
    {"light", "name", Kind::Text},
    {"light", "type", Kind::OneOf, kRequired, "directional|point|spot"},
    {"light", "color", Kind::Numbers, kOptional, {}, 0.0, kLargest, 3},
    {"light", "intensity", Kind::Number, kOptional, {}, 0.0},
    {"light", "range", Kind::Number, kOptional, {}, 0.0},
    {"light", "spot", Kind::Object, kOptional, "spot"},
    {"spot", "innerConeAngle", Kind::Number, kOptional, {}, 0.0, 1.5708},
    {"spot", "outerConeAngle", Kind::Number, kOptional, {}, 0.0, 1.5708},
    {"asset", "version", Kind::Text, kRequired},
    {"asset", "minVersion", Kind::Text},
    {"scene", "name", Kind::Text},
    {"scene", "nodes", Kind::Indices, kOptional, "nodes"},
    {"node", "name", Kind::Text},
    {"node", "children", Kind::Indices, kOptional, "nodes"},
    {"node", "mesh", Kind::Index, kOptional, "meshes"},
    {"node", "camera", Kind::Index, kOptional, "cameras"},
    {"node", "skin", Kind::Index, kOptional, "skins"},
    {"node", "matrix", Kind::Numbers, kOptional, {}, -kLargest, kLargest, 16},
    {"node", "rotation", Kind::Numbers, kOptional, {}, -kLargest, kLargest, 4},
    {"node", "scale", Kind::Numbers, kOptional, {}, -kLargest, kLargest, 3},
    {"node", "translation", Kind::Numbers, kOptional, {}, -kLargest, kLargest, 3},
    {"node", "weights", Kind::Numbers},
    {"node", "extensions", Kind::Object, kOptional, "node.extensions"},
    {"node.extensions", "KHR_lights_punctual", Kind::Object, kOptional, "nodeLight"},
    {"node.extensions", "KHR_node_visibility", Kind::Object, kOptional, "nodeVisibility"},
    {"nodeLight", "light", Kind::Index, kRequired, "lights"},
    {"nodeVisibility", "visible", Kind::Boolean},
    {"mesh", "name", Kind::Text},
    {"mesh", "primitives", Kind::Objects, kRequired, "primitive"},
    {"mesh", "weights", Kind::Numbers},
    {"primitive", "attributes", Kind::IndexMap, kRequired, "accessors"},
    {"primitive", "indices", Kind::Index, kOptional, "accessors"},
    {"primitive", "material", Kind::Index, kOptional, "materials"},
    {"primitive", "mode", Kind::OneOf, kOptional, "0|1|2|3|4|5|6"},
    {"primitive", "targets", Kind::Objects, kOptional, "target"},
    {"accessor", "bufferView", Kind::Index, kOptional, "bufferViews"},
    {"accessor", "byteOffset", Kind::Integer, kOptional, {}, 0.0, kMaxInteger},
    {"accessor", "componentType", Kind::OneOf, kRequired, kComponents},
    {"accessor", "normalized", Kind::Boolean},
    {"accessor", "count", Kind::Integer, kRequired, {}, 1.0, kMaxInteger},
    {"accessor", "type", Kind::OneOf, kRequired, "SCALAR|VEC2|VEC3|VEC4|MAT2|MAT3|MAT4"},
    {"accessor", "min", Kind::Numbers, kOptional, {}, -1e300, 1e300},
    {"accessor", "max", Kind::Numbers, kOptional, {}, -1e300, 1e300},
    {"accessor", "sparse", Kind::Object, kOptional, "sparse"},
    {"sparse", "count", Kind::Integer, kRequired, {}, 1.0, kMaxInteger},
    {"sparse", "indices", Kind::Object, kRequired, "sparseIndices"},
    {"sparse", "values", Kind::Object, kRequired, "sparseValues"},
    {"sparseIndices", "bufferView", Kind::Index, kRequired, "bufferViews"},
    {"sparseIndices", "byteOffset", Kind::Integer, kOptional, {}, 0.0, kMaxInteger},
    {"sparseIndices", "componentType", Kind::OneOf, kRequired, "5121|5123|5125"},
    {"sparseValues", "bufferView", Kind::Index, kRequired, "bufferViews"},
    {"sparseValues", "byteOffset", Kind::Integer, kOptional, {}, 0.0, kMaxInteger},
    {"bufferView", "buffer", Kind::Index, kRequired, "buffers"},
    {"bufferView", "byteOffset", Kind::Integer, kOptional, {}, 0.0, kMaxInteger},
    {"bufferView", "byteLength", Kind::Integer, kRequired, {}, 1.0, kMaxInteger},
    {"bufferView", "byteStride", Kind::Integer, kOptional, {}, 4.0, 252.0},
    {"buffer", "uri", Kind::Text},
    {"buffer", "byteLength", Kind::Integer, kRequired, {}, 1.0, kMaxInteger},
    {"camera", "name", Kind::Text},
    {"camera", "type", Kind::OneOf, kRequired, "perspective|orthographic"},
    {"camera", "perspective", Kind::Object, kOptional, "perspective"},
    {"camera", "orthographic", Kind::Object, kOptional, "orthographic"},
    {"perspective", "aspectRatio", Kind::Number, kOptional, {}, 0.0},
    {"perspective", "yfov", Kind::Number, kRequired, {}, 0.0},
    {"perspective", "znear", Kind::Number, kRequired, {}, 0.0},
    {"perspective", "zfar", Kind::Number, kOptional, {}, 0.0},
    {"orthographic", "xmag", Kind::Number, kRequired},
    {"orthographic", "ymag", Kind::Number, kRequired},
    {"orthographic", "znear", Kind::Number, kRequired, {}, 0.0},
    {"orthographic", "zfar", Kind::Number, kRequired, {}, 0.0},
    {"material", "name", Kind::Text},
    {"material", "pbrMetallicRoughness", Kind::Object, kOptional, "pbr"},
    {"material", "normalTexture", Kind::Object, kOptional, "textureInfo"},
    {"material", "occlusionTexture", Kind::Object, kOptional, "textureInfo"},
    {"material", "emissiveTexture", Kind::Object, kOptional, "textureInfo"},
    {"material", "emissiveFactor", Kind::Numbers, kOptional, {}, -kLargest, kLargest, 3},
    {"material", "alphaMode", Kind::OneOf, kOptional, "OPAQUE|MASK|BLEND"},
    {"material", "alphaCutoff", Kind::Number},
    {"material", "doubleSided", Kind::Boolean},
    {"material", "extensions", Kind::Object, kOptional, "material.extensions"},
    {"material.extensions", "KHR_materials_emissive_strength", Kind::Object, kOptional, "emissiveStrength"},
    {"material.extensions", "KHR_materials_unlit", Kind::Object, kOptional, "unlit"},
    {"emissiveStrength", "emissiveStrength", Kind::Number, kOptional, {}, 0.0},
    {"pbr", "baseColorFactor", Kind::Numbers, kOptional, {}, -kLargest, kLargest, 4},
    {"pbr", "baseColorTexture", Kind::Object, kOptional, "textureInfo"},
    {"pbr", "metallicFactor", Kind::Number},
    {"pbr", "roughnessFactor", Kind::Number},
    {"pbr", "metallicRoughnessTexture", Kind::Object, kOptional, "textureInfo"},
    {"textureInfo", "index", Kind::Index, kRequired, "textures"},
    {"textureInfo", "texCoord", Kind::Integer, kOptional, {}, 0.0, kMaxInteger},
    {"textureInfo", "scale", Kind::Number},
    {"textureInfo", "strength", Kind::Number},
    {"textureInfo", "extensions", Kind::Object, kOptional, "textureInfo.extensions"},
    {"textureInfo.extensions", "KHR_texture_transform", Kind::Object, kOptional, "textureTransform"},
    {"textureTransform", "offset", Kind::Numbers, kOptional, {}, -kLargest, kLargest, 2},
    {"textureTransform", "rotation", Kind::Number},
    {"textureTransform", "scale", Kind::Numbers, kOptional, {}, -kLargest, kLargest, 2},
    {"textureTransform", "texCoord", Kind::Integer, kOptional, {}, 0.0, kMaxInteger},
    {"texture", "sampler", Kind::Index, kOptional, "samplers"},
    {"texture", "source", Kind::Index, kOptional, "images"},
    {"image", "name", Kind::Text},
    {"image", "uri", Kind::Text},
    {"image", "mimeType", Kind::Text},
    {"image", "bufferView", Kind::Index, kOptional, "bufferViews"},
    {"sampler", "magFilter", Kind::OneOf, kOptional, "9728|9729"},
    {"sampler", "minFilter", Kind::OneOf, kOptional, "9728|9729|9984|9985|9986|9987"},
    {"sampler", "wrapS", Kind::OneOf, kOptional, kWraps},
    {"sampler", "wrapT", Kind::OneOf, kOptional, kWraps},
    {"skin", "joints", Kind::Indices, kRequired, "nodes"},
    {"skin", "skeleton", Kind::Index, kOptional, "nodes"},
    {"skin", "inverseBindMatrices", Kind::Index, kOptional, "accessors"},
    {"animation", "name", Kind::Text},
    {"animation", "channels", Kind::Objects, kRequired, "channel"},
    {"animation", "samplers", Kind::Objects, kRequired, "animationSampler"},
    {"channel", "sampler", Kind::Integer, kRequired, {}, 0.0, kMaxInteger},
    {"channel", "target", Kind::Object, kRequired, "channelTarget"},
    {"channelTarget", "node", Kind::Index, kOptional, "nodes"},
    {"channelTarget", "path", Kind::Text, kRequired},
    {"animationSampler", "input", Kind::Index, kRequired, "accessors"},
    {"animationSampler", "output", Kind::Index, kRequired, "accessors"},
    {"animationSampler", "interpolation", Kind::OneOf, kOptional, "STEP|LINEAR|CUBICSPLINE"},
};

class SchemaCheck {
 public:
    explicit SchemaCheck(json& document) : _document(document) {
        for (const Property& property : kSchema) _properties[property.object].push_back(&property);
    }

    void checkDocument() { checkObject(_document, "glTF", ""); }

 private:
    void checkObject(json& object, std::string_view type, const std::string& place) {
        if (!object.is_object()) throw ImportRefused(place.empty() ? "the document" : place, "is not a JSON object");
        const auto found = _properties.find(type);
        if (found == _properties.end()) return;
        for (const Property* property : found->second) {
            const std::string inside =
                place.empty() ? std::string(property->name) : place + "." + std::string(property->name);
            const auto member = object.find(property->name);
            if (member != object.end())
                checkValue(*member, *property, inside);
            else if (property->required)
                throw ImportRefused(inside, "is missing");
        }
    }

    void checkValue(json& value, const Property& property, const std::string& place) {
        switch (property.kind) {
            case Kind::Boolean:
                if (!value.is_boolean()) throw ImportRefused(place, "is neither true nor false");
                break;
            case Kind::Integer:
                checkInteger(value, property.low, property.high, place);
                break;
            case Kind::Number:
                checkNumber(value, property, place);
                break;
            case Kind::Text:
                checkText(value, place);
                break;
            case Kind::OneOf:
                checkOneOf(value, property.target, place);
                break;
            case Kind::Index:
                checkIndex(value, property.target, place);
                break;
            case Kind::Object:
                checkObject(value, property.target, place);
                break;
            case Kind::IndexMap:
                if (!value.is_object()) throw ImportRefused(place, "is not a JSON object");
                for (auto& [name, index] : value.items()) checkIndex(index, property.target, place + "." + name);
                break;
            case Kind::Numbers:
            case Kind::Texts:
            case Kind::Indices:
            case Kind::Objects:
                checkArray(value, property, place);
                break;
        }
    }

    void checkArray(json& array, const Property& property, const std::string& place) {
        if (!array.is_array()) throw ImportRefused(place, "is not a JSON array");
        if (property.count != 0 && array.size() != property.count)
            throw ImportRefused(place, "has " + std::to_string(array.size()) + " elements instead of " +
                                           std::to_string(property.count));
        for (std::size_t i = 0; i < array.size(); ++i) {
            const std::string inside = place + "[" + std::to_string(i) + "]";
            if (property.kind == Kind::Numbers)
                checkNumber(array[i], property, inside);
            else if (property.kind == Kind::Texts)
                checkText(array[i], inside);
            else if (property.kind == Kind::Indices)
                checkIndex(array[i], property.target, inside);
            else
                checkObject(array[i], property.target, inside);
        }
    }

    void checkText(const json& value, const std::string& place) {
        if (!value.is_string()) throw ImportRefused(place, "is not a text");
    }

    void checkNumber(const json& value, const Property& property, const std::string& place) {
        if (!value.is_number()) throw ImportRefused(place, "is not a number");
        const double number = value.get<double>();
        if (!(number >= property.low && number <= property.high))
            throw ImportRefused(place, value.dump() + " is out of range");
    }

    void checkInteger(json& value, double low, double high, const std::string& place) {
        if (!value.is_number()) throw ImportRefused(place, "is not an integer");
        const double number = value.get<double>();
        if (number != std::floor(number)) throw ImportRefused(place, value.dump() + " is not an integer");
        if (number < low || number > high) throw ImportRefused(place, value.dump() + " is out of range");
        if (value.is_number_float()) value = static_cast<std::int64_t>(number);
    }

    void checkOneOf(json& value, std::string_view choices, const std::string& place) {
        if (value.is_number()) checkInteger(value, -kMaxInteger, kMaxInteger, place);
        const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
        for (std::size_t begin = 0; begin <= choices.size();) {
            const std::size_t end = std::min(choices.find('|', begin), choices.size());
            const std::string_view choice = choices.substr(begin, end - begin);
            const bool numeric = choice.front() >= '0' && choice.front() <= '9';
            if (choice == text && value.is_string() != numeric) return;
            begin = end + 1;
        }
        throw ImportRefused(place, text + " is none of the values glTF 2.0 knows");
    }

    void checkIndex(json& value, std::string_view array, const std::string& place) {
        checkInteger(value, -kMaxInteger, kMaxInteger, place);
        const std::int64_t index = value.get<std::int64_t>();
        if (index < 0 || static_cast<std::size_t>(index) >= sizeOf(array)) {
            const std::string_view one = array == "meshes" ? "mesh" : array.substr(0, array.size() - 1);
            throw ImportRefused(place, std::string(one) + " " + std::to_string(index) + " does not exist");
        }
    }

    std::size_t sizeOf(std::string_view array) {
        const auto known = _sizes.find(array);
        if (known != _sizes.end()) return known->second;
        const json::json_pointer path(array == "lights" ? "/extensions/KHR_lights_punctual/lights"
                                                        : "/" + std::string(array));
        const bool exists = _document.contains(path) && _document.at(path).is_array();
        return _sizes[array] = exists ? _document.at(path).size() : 0;
    }

    json& _document;
    std::map<std::string_view, std::vector<const Property*>> _properties;
    std::map<std::string_view, std::size_t> _sizes;
};

}  // namespace

void checkGltfSchema(json& document) {
    SchemaCheck(document).checkDocument();
}

}  // namespace umbriel
