#include "server/draw/shader_library.h"

#include "common/wall/view.h"
#include "server/draw/reflection_models.h"

namespace umbriel {
namespace {

constexpr std::string_view kVertexShading = "snippet/vertex_shading.glsl";
constexpr std::string_view kPixelShading = "snippet/vertex_shading_none.glsl";

constexpr std::string_view kPassesConstants = "snippet/pass_constants.glsl";
constexpr std::string_view kPassesNone = "snippet/pass_constants_none.glsl";

// A file to be included by the name of a define.
gl::ShaderDefine including(std::string name, std::string_view file) {
    return {std::move(name), '"' + std::string(file) + '"'};
}

}  // namespace

Result<const gl::Program*> ShaderLibrary::find(const Stages& stages, const std::vector<gl::ShaderDefine>& defines) {
    std::string key = stages.vertex + "|" + stages.fragment + "|" + stages.compute + "|" + stages.control;
    for (const gl::ShaderDefine& define : defines) key += "|" + define.name + "=" + define.value;
    const auto [found, isNew] = _programs.try_emplace(key);
    if (!isNew) return &found->second;
    std::vector<gl::ShaderStage> composed;
    const auto add = [&](GLenum stage, const std::string& file) -> Result<void> {
        auto source = gl::composeShader(file, defines);
        if (!source) return source.error();
        composed.push_back({stage, file, std::move(*source)});
        return {};
    };
    auto added = stages.compute.empty() ? add(GL_VERTEX_SHADER, stages.vertex) : add(GL_COMPUTE_SHADER, stages.compute);
    if (added && !stages.control.empty()) added = add(GL_TESS_CONTROL_SHADER, stages.control);
    if (added && !stages.evaluation.empty()) added = add(GL_TESS_EVALUATION_SHADER, stages.evaluation);
    if (added && !stages.fragment.empty()) added = add(GL_FRAGMENT_SHADER, stages.fragment);
    Result<gl::Program> program = added ? gl::Program::link(composed) : Result<gl::Program>(added.error());
    if (!program) {
        _programs.erase(found);
        return program.error();
    }
    found->second = std::move(*program);
    return &found->second;
}

std::vector<gl::ShaderDefine> ShaderLibrary::withSamples(std::vector<gl::ShaderDefine> defines) const {
    if (_samples > 1) defines.push_back({"SEVERAL_SAMPLES"});
    return defines;
}

std::vector<gl::ShaderDefine> ShaderLibrary::definesOf(FeatureSet features) const {
    std::vector<gl::ShaderDefine> defines;
    for (std::uint32_t i = 0; i < kFeatureCount; ++i)
        if (has(features, static_cast<Feature>(i))) defines.push_back({defineOf(static_cast<Feature>(i))});
    return has(features, Feature::ShadowView) ? withSamples(std::move(defines)) : defines;
}

Result<const gl::Program*> ShaderLibrary::surface(FeatureSet features) {
    std::vector<gl::ShaderDefine> defines = definesOf(features);
    defines.push_back(including("REFLECTION_MODEL", reflectionSnippet(features)));
    if (_halfColours) defines.push_back({"HALF_COLOURS"});
    const bool interpolates = has(features, Feature::VertexShading) && !has(features, Feature::VertexTable);
    defines.push_back(including("VERTEX_SHADING", interpolates ? kVertexShading : kPixelShading));
    const bool passes = has(features, Feature::PassedConstants);
    defines.push_back(including("PASSED_CONSTANTS", passes ? kPassesConstants : kPassesNone));
    return find({"stage/surface.vert.glsl", "stage/surface.frag.glsl", ""}, defines);
}

Result<const gl::Program*> ShaderLibrary::vertexTable(FeatureSet features) {
    std::vector<gl::ShaderDefine> defines = definesOf(features);
    defines.push_back(including("REFLECTION_MODEL", reflectionSnippet(features)));
    defines.push_back(including("VERTEX_SHADING", kVertexShading));
    defines.push_back(including("PASSED_CONSTANTS", kPassesNone));
    return find({"stage/surface.vert.glsl", "", ""}, defines);
}

Result<const gl::Program*> ShaderLibrary::layers(FeatureSet features, std::uint32_t layers,
                                                 std::uint32_t factorImages) {
    std::vector<gl::ShaderDefine> defines = definesOf(features);
    if (factorImages > 0) {
        defines.push_back({"LAYER_FACTORS", std::to_string(factorImages)});
    } else {
        std::uint32_t location = 0;
        const std::pair<Layer, const char*> names[] = {{Layer::Depth, "LAYER_DEPTH"},
                                                       {Layer::Position, "LAYER_POSITION"},
                                                       {Layer::Normal, "LAYER_NORMAL"},
                                                       {Layer::Ids, "LAYER_IDS"}};
        for (const auto& [layer, name] : names)
            if (layers & static_cast<std::uint32_t>(layer)) defines.push_back({name, std::to_string(location++)});
    }
    defines.push_back(including("VERTEX_SHADING", kPixelShading));
    defines.push_back(including("PASSED_CONSTANTS", kPassesNone));
    return find({"stage/surface.vert.glsl", "stage/layers.frag.glsl", ""}, defines);
}

Result<const gl::Program*> ShaderLibrary::caster(FeatureSet features, bool hemisphere) {
    const bool hasHoles = has(features, Feature::AlphaMask);
    std::vector<gl::ShaderDefine> defines = definesOf(features);
    Stages stages{"stage/caster.vert.glsl", hasHoles ? "stage/caster.frag.glsl" : "", ""};
    if (hemisphere) {
        defines.push_back({"CASTER_HEMISPHERE"});
        if (!hasHoles) {
            defines.push_back({"CASTER_TESSELLATED"});
            stages.control = "stage/caster.tesc.glsl";
            stages.evaluation = "stage/caster.tese.glsl";
        }
    }
    return find(stages, defines);
}

Result<const gl::Program*> ShaderLibrary::darkness(FeatureSet features, std::uint32_t place) {
    std::vector<gl::ShaderDefine> defines = definesOf(features);
    constexpr FeatureSet kConstants =
        bit(Feature::OneLight) | bit(Feature::TwoLights) | bit(Feature::ThreeLights) | bit(Feature::FourLights);
    defines.push_back({"LAYER_DARKNESS", std::to_string((features & kConstants) != 0 ? place : 0) + 'u'});
    defines.push_back(including("VERTEX_SHADING", kPixelShading));
    defines.push_back(including("PASSED_CONSTANTS", kPassesNone));
    return find({"stage/surface.vert.glsl", "stage/layers.frag.glsl", ""}, defines);
}

Result<const gl::Program*> ShaderLibrary::screen(const std::string& fragment) {
    return find({"stage/screen.vert.glsl", fragment, ""}, {});
}

Result<const gl::Program*> ShaderLibrary::overView(const std::string& fragment,
                                                   const std::vector<gl::ShaderDefine>& defines) {
    return find({"stage/screen.vert.glsl", fragment, ""}, withSamples(defines));
}

Result<const gl::Program*> ShaderLibrary::seen(FeatureSet features) {
    return find({"stage/shadow_seen.vert.glsl", "stage/shadow_seen.frag.glsl"}, withSamples(definesOf(features)));
}

Result<const gl::Program*> ShaderLibrary::volume() {
    return find({"stage/volume.vert.glsl", "stage/volume.frag.glsl"}, {});
}

Result<const gl::Program*> ShaderLibrary::planar(FeatureSet features) {
    return find({"stage/planar.vert.glsl", "stage/planar.frag.glsl"}, withSamples(definesOf(features)));
}

Result<const gl::Program*> ShaderLibrary::blob() {
    return find({"stage/blob.vert.glsl", "stage/blob.frag.glsl"}, withSamples({}));
}

Result<const gl::Program*> ShaderLibrary::background(BackgroundKind kind) {
    std::vector<gl::ShaderDefine> defines;
    if (kind == BackgroundKind::Image) defines.push_back({"BACKGROUND_IMAGE"});
    if (kind == BackgroundKind::Environment) defines.push_back({"BACKGROUND_ENVIRONMENT"});
    if (_halfColours) defines.push_back({"HALF_COLOURS"});
    return find({"stage/screen.vert.glsl", "stage/background.frag.glsl", ""}, defines);
}

Result<const gl::Program*> ShaderLibrary::foreground(bool isText) {
    std::vector<gl::ShaderDefine> defines;
    if (isText) defines.push_back({"FOREGROUND_TEXT"});
    return find({"stage/screen.vert.glsl", "stage/foreground.frag.glsl", ""}, defines);
}

Result<const gl::Program*> ShaderLibrary::compute(const std::string& stage,
                                                  const std::vector<gl::ShaderDefine>& defines) {
    return find({"", "", stage}, defines);
}

}  // namespace umbriel
