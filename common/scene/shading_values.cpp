#include "common/scene/shading_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "common/scene/lights.h"
#include "common/scene/materials.h"
#include "common/scene/windows.h"

namespace umbriel {
namespace {

// The largest radiance, intensity or irradiance: products of two still fit a float when one of them is a reflectance.
constexpr float kStrongest = 1e30f;
constexpr float kFarthest = 1e19f;  // metres: beyond, squares leave the range of float
constexpr float kLargestExponent = 1e6f;
constexpr float kLargestLobeExponent = 1e4f;

// The domain of one field of one type.
struct Domain {
    std::string_view field;
    float low;
    float high;
};

constexpr Domain kMaterialDomains[] = {
    {"baseColour", 0, kStrongest},
    {"metallic", 0, 1},
    {"roughness", 0, 1},
    {"specular", 0, kStrongest},
    {"shininess", 0, kLargestExponent},
    {"ambient", 0, kStrongest},
    {"ambientShare", 0, 1},
    {"lobeAlbedos", 0, kStrongest},
    {"lobeAxes", -2, 2},
    {"lobeExponents", 0, kLargestLobeExponent},
    {"normalScale", -1e6f, 1e6f},
    {"occlusionStrength", 0, 1},
    {"emission", 0, kStrongest},
    {"alphaCutoff", 0, kStrongest},
};
constexpr Domain kLightDomains[] = {
    {"irradiance", 0, kStrongest},
    {"intensity", 0, kStrongest},
    {"radiance", 0, kStrongest},
    {"range", 0, kFarthest},
    {"radius", 0, kFarthest},
    {"innerAngle", 0, std::numbers::pi_v<float>},
    {"outerAngle", 0, std::numbers::pi_v<float>},
    {"attenuation", 0, kStrongest},
    {"exponent", 0, kLargestExponent},
    {"ambientShare", 0, kStrongest},
    {"highlightShare", 0, kStrongest},
    {"shares", 0, kStrongest},
};
constexpr Domain kFogDomains[] = {{"colour", 0, kStrongest},
                                  {"start", -kFarthest, kFarthest},
                                  {"end", -kFarthest, kFarthest},
                                  {"density", 0, kStrongest}};

std::span<const Domain> domainsOf(const Container& container) {
    if (isA<Material>(container)) return kMaterialDomains;
    if (isA<AmbientLight>(container) || isA<DirectionalLight>(container) || isA<PointLight>(container) ||
        isA<SpotLight>(container) || isA<GoniometricLight>(container) || isA<IntensityTable>(container))
        return kLightDomains;
    if (isA<Fog>(container)) return kFogDomains;
    return {};
}

std::string textOf(const Container& container) {
    const std::string& name = container.name.get();
    return fmt::format("{} {}", container.type().name,
                       name.empty() ? fmt::format("#{}", container.id().value) : "'" + name + "'");
}

class Repair {
 public:
    Repair(const Container& container, std::vector<std::string>& messages)
        : _container(container), _messages(messages) {}

    // Holds the floats of one field; true when one of them changed. fallbacks: for what is no number, in turn.
    bool hold(const Domain& domain, std::span<float> values, std::span<const float> fallbacks) {
        bool changed = false;
        for (std::size_t i = 0; i < values.size(); ++i) {
            const float given = values[i];
            if (given >= domain.low && given <= domain.high) continue;
            const float fallback = fallbacks.empty() ? domain.low : fallbacks[i % fallbacks.size()];
            values[i] = std::isnan(given) ? fallback : std::clamp(given, domain.low, domain.high);
            // A table of ten thousand wrong numbers is one thing that is wrong.
            if (!changed) {
                _messages.push_back(fmt::format("{}: its {} {} is out of range ({} to {}) and taken as {}",
                                                textOf(_container), domain.field, given, domain.low, domain.high,
                                                values[i]));
            }
            changed = true;
        }
        return changed;
    }

 private:
    const Container& _container;
    std::vector<std::string>& _messages;
};

bool isFloats(ElementKind kind) {
    return kind == ElementKind::F32 || kind == ElementKind::Vec2 || kind == ElementKind::Vec3 ||
           kind == ElementKind::Vec4;
}

std::vector<float> floatsOf(std::span<const std::byte> bytes) {
    std::vector<float> values(bytes.size() / sizeof(float));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(float));
    return values;
}

// A goniometric light without a table that fits cannot be mended: it stays dark, which somebody should know.
void reportTable(const Aspect& scene, const Container& container, std::vector<std::string>& messages) {
    if (!isA<GoniometricLight>(container)) return;
    const auto& light = static_cast<const GoniometricLight&>(container);
    const IntensityTable* table = scene.find(light.table.get());
    const bool fits = table && table->columns >= 1 && table->rows >= 2 && table->columns <= IntensityTable::kMaxSide &&
                      table->rows <= IntensityTable::kMaxSide &&
                      std::size_t{table->columns} * table->rows == table->shares.size();
    if (!fits)
        messages.push_back(fmt::format("{} is dark: its table is missing or not columns x rows", textOf(container)));
}

}  // namespace

std::vector<std::string> repairShadingValues(Aspect& scene) {
    std::vector<std::string> messages;
    RawEdit edit(scene);
    for (const ContainerId id : scene.ids()) {
        const Container& container = *scene.find(id);
        reportTable(scene, container, messages);
        for (const Domain& domain : domainsOf(container)) {
            const auto& fields = container.type().fields;
            const auto field = std::find_if(fields.begin(), fields.end(), [&](const FieldDescriptor& candidate) {
                return candidate.name == domain.field;
            });
            if (field == fields.end() || !isFloats(field->kind)) continue;
            Repair repair(container, messages);
            const auto index = static_cast<std::uint32_t>(field - fields.begin());
            if (field->isMulti) {
                const MultiStorage& storage = field->multi(container);
                std::vector<std::byte> bytes(storage.size() * storage.elementSize());
                storage.read(0, bytes);
                std::vector<float> values = floatsOf(bytes);
                if (repair.hold(domain, values, {})) edit.writeMulti(id, index, 0, std::as_bytes(std::span(values)));
            } else {
                const auto size = infoOf(field->kind).size;
                const auto bytesIn = [&](const Container& of) {
                    return std::span(static_cast<const std::byte*>(field->address_(of)), size);
                };
                std::vector<float> values = floatsOf(bytesIn(container));
                const std::vector<float> defaults = floatsOf(bytesIn(*container.type().prototype));
                if (repair.hold(domain, values, defaults)) edit.setSingle(id, index, std::as_bytes(std::span(values)));
            }
        }
    }
    return messages;
}

}  // namespace umbriel
