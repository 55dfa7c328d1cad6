#include "client/app/illumination_arguments.h"

#include <fmt/format.h>

#include <array>
#include <string>
#include <vector>

#include "client/app/arguments.h"

namespace umbriel {
namespace {

template <class Value>
struct Named {
    std::string_view name;
    Value value;
};

constexpr std::array kModels = {
    Named<ReflectionModel>{"metallic-roughness", ReflectionModel::MetallicRoughness},
    Named<ReflectionModel>{"torrance-sparrow", ReflectionModel::TorranceSparrow},
    Named<ReflectionModel>{"lambert", ReflectionModel::Lambert},
    Named<ReflectionModel>{"phong", ReflectionModel::Phong},
    Named<ReflectionModel>{"phong-gated", ReflectionModel::PhongGated},
    Named<ReflectionModel>{"blinn-phong", ReflectionModel::BlinnPhong},
    Named<ReflectionModel>{"schlick", ReflectionModel::Schlick},
    Named<ReflectionModel>{"normalised-phong", ReflectionModel::NormalisedPhong},
    Named<ReflectionModel>{"phong-brdf", ReflectionModel::PhongBrdf},
    Named<ReflectionModel>{"lafortune", ReflectionModel::Lafortune},
    Named<ReflectionModel>{"phong-original", ReflectionModel::PhongOriginal},
    Named<ReflectionModel>{"general-sum", ReflectionModel::GeneralSum},
    Named<ReflectionModel>{"opengl-sum", ReflectionModel::OpenGlSum},
    Named<ReflectionModel>{"unlit", ReflectionModel::Unlit},
};
static_assert(kModels.size() == kEnumCount<ReflectionModel>);

constexpr std::array kFrequencies = {
    Named<ShadingFrequency>{"flat", ShadingFrequency::Flat},
    Named<ShadingFrequency>{"flat-mean", ShadingFrequency::FlatMean},
    Named<ShadingFrequency>{"gouraud", ShadingFrequency::Gouraud},
    Named<ShadingFrequency>{"phong", ShadingFrequency::Phong},
};

template <class Table>
auto parseNamed(const Table& table, std::string_view argument, std::string_view text)
    -> Result<std::decay_t<decltype(table[0].value)>> {
    std::string names;
    for (const auto& known : table) {
        if (known.name == text) return known.value;
        names += (names.empty() ? "" : ", ") + std::string(known.name);
    }
    return badInput(fmt::format("{} '{}': expected one of {}", argument, text, names));
}

template <class Table, class Value>
std::string_view findName(const Table& table, Value value) {
    for (const auto& known : table)
        if (known.value == value) return known.name;
    return "";
}

}  // namespace

Result<ReflectionModel> parseReflectionModel(std::string_view text) {
    return parseNamed(kModels, "--model", text);
}

std::string_view nameOf(ReflectionModel model) {
    return findName(kModels, model);
}

Result<ShadingFrequency> parseShading(std::string_view text) {
    return parseNamed(kFrequencies, "--shading", text);
}

std::string_view nameOf(ShadingFrequency frequency) {
    return findName(kFrequencies, frequency);
}

Result<FogArgument> parseFog(std::string_view text) {
    const auto wrong = [&](std::string_view what) {
        return badInput(
            fmt::format("--fog '{}': {}; expected linear:START:END, quadratic:START:END (metres), exp:DENSITY or "
                        "exp2:DENSITY (1/m), "
                        "with an optional @r,g,b",
                        text, what));
    };
    FogArgument fog;
    std::string_view law = text;
    if (const std::size_t at = text.find('@'); at != std::string_view::npos) {
        law = text.substr(0, at);
        const auto colour = parseColour("--fog", text.substr(at + 1));
        if (!colour) return wrong("the colour is not r,g,b, each from 0 to 1e30");
        fog.colour = *colour;
    }
    std::vector<std::string_view> parts;
    for (std::size_t begin = 0; begin <= law.size();) {
        const std::size_t end = std::min(law.find(':', begin), law.size());
        parts.push_back(law.substr(begin, end - begin));
        begin = end + 1;
    }
    const auto number = [&](std::size_t part, float& into) {
        const auto value = parseNumber("--fog", parts[part]);
        if (!value || *value < 0.0 || *value > 1e19) return false;
        into = static_cast<float>(*value);
        return true;
    };
    const bool isLinear = parts[0] == "linear";
    if (isLinear || parts[0] == "quadratic") {
        fog.mode = isLinear ? FogMode::Linear : FogMode::Quadratic;
        if (parts.size() != 3 || !number(1, fog.start) || !number(2, fog.end))
            return wrong("two distances are missing");
        if (fog.end < fog.start) return wrong("it ends before it starts");
        return fog;
    }
    if (parts[0] != "exp" && parts[0] != "exp2") return wrong("there is no such law");
    fog.mode = parts[0] == "exp" ? FogMode::Exponential : FogMode::SquaredExponential;
    if (parts.size() != 2 || !number(1, fog.density)) return wrong("a density of 0 or more is missing");
    return fog;
}

}  // namespace umbriel
