#pragma once

#include <map>
#include <string>
#include <vector>

#include "server/draw/frame_plan.h"
#include "server/gl/program.h"
#include "server/gl/shader_source.h"

namespace umbriel {

// Compiled shader variants, each made when it is first needed and kept.
class ShaderLibrary {
 public:
    // Of the images that shadows are made in in the view, from now on.
    void setSamples(std::uint32_t samples) { _samples = samples; }
    // Colours go into 16-bit floats: what such cannot hold must not become infinite, as blending makes NaN of that.
    void setHalfColours(bool half) { _halfColours = half; }
    // Errors carry the driver's message; they are bugs of ours or of the driver.
    Result<const gl::Program*> surface(FeatureSet features);
    // Of a surface with VertexTable: what fills the table, a vertex stage alone.
    Result<const gl::Program*> vertexTable(FeatureSet features);
    // layers: bits of Layer without Colour; factorImages: RGBA images of light factors, in a pass of their own.
    Result<const gl::Program*> layers(FeatureSet features, std::uint32_t layers, std::uint32_t factorImages);
    // hemisphere: the projection of CasterStage; tessellated, unless the caster has holes.
    Result<const gl::Program*> caster(FeatureSet features, bool hemisphere);
    // 1 minus the shadow factor of a light, for visible surfaces: the place-th of those that reach the item; where they
    // come as a list, uniform 5 tells the place.
    Result<const gl::Program*> darkness(FeatureSet features, std::uint32_t place);
    // A fragment stage over the whole viewport; one that reads the images that shadows are made in in the view.
    Result<const gl::Program*> screen(const std::string& fragment);
    Result<const gl::Program*> overView(const std::string& fragment, const std::vector<gl::ShaderDefine>& defines);
    // Marks what of a map with these features is read.
    Result<const gl::Program*> seen(FeatureSet features);
    Result<const gl::Program*> volume();
    // features: of the caster (SurfaceItem::casterFeatures).
    Result<const gl::Program*> planar(FeatureSet features);
    Result<const gl::Program*> blob();
    Result<const gl::Program*> background(BackgroundKind kind);
    Result<const gl::Program*> foreground(bool isText);

    Result<const gl::Program*> compute(const std::string& stage, const std::vector<gl::ShaderDefine>& defines);

    std::size_t variantCount() const { return _programs.size(); }

 private:
    struct Stages {
        std::string vertex;
        std::string fragment;  // empty: depth only
        std::string compute = {};  // then no others
        std::string control = {};  // of tessellation; empty: none
        std::string evaluation = {};
    };
    Result<const gl::Program*> find(const Stages& stages, const std::vector<gl::ShaderDefine>& defines);

    std::vector<gl::ShaderDefine> definesOf(FeatureSet features) const;
    // Of what reads those images.
    std::vector<gl::ShaderDefine> withSamples(std::vector<gl::ShaderDefine> defines) const;

    std::uint32_t _samples = 1;
    bool _halfColours = false;
    std::map<std::string, gl::Program> _programs;  // by stage and defines
};

}  // namespace umbriel
