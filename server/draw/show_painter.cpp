#include "server/draw/show_painter.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/wall/shadow_show.h"
#include "server/shadow/shadow_module.h"

namespace umbriel {
namespace {

constexpr auto kDarkness = static_cast<GLuint>(TextureUnit::Darkness);
constexpr auto kPositions = static_cast<GLuint>(TextureUnit::Positions);

std::pair<ContainerId, Eye> keyOf(const ViewScene& scene) {
    return {scene.viewport->id(), scene.view->eye};
}

void fillBlack() {
    const std::array<float, 4> black = {0.0f, 0.0f, 0.0f, 1.0f};
    glClearBufferfv(GL_COLOR, 0, black.data());
}

}  // namespace

Result<void> ShowPainter::beginSeen(const ViewScene& scene) {
    const ShownLight shown = shownLightOf(scene);
    const std::uint32_t side = shown.parts > 0 ? scene.lights.fits[shown.first]->mapSize : 0;
    Seen& seen = _seen[keyOf(scene)];
    if (side == 0) {
        seen = {};
        return {};
    }
    if (seen.side != side || seen.parts != shown.parts) {
        seen = {};
        GLuint id = 0;
        glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &id);
        seen.texture = gl::Name<gl::deleteTexture>(id);
        glTextureStorage3D(id, 1, GL_R8, static_cast<GLsizei>(side), static_cast<GLsizei>(side),
                           static_cast<GLsizei>(shown.parts));
        glCreateFramebuffers(1, &id);
        seen.framebuffer = gl::Name<gl::deleteFramebuffer>(id);
        if (auto checked = gl::checkError("the seen area of a shadow map"); !checked) return checked;
        seen.side = side;
        seen.parts = shown.parts;
    }
    const float nothing = 0.0f;
    glClearTexImage(seen.texture.id(), 0, GL_RED, GL_FLOAT, &nothing);
    return {};
}

Result<void> ShowPainter::addSeen(const ViewScene& scene, const DarknessImages& images, const PixelRect& pixels) {
    const Seen& seen = _seen[keyOf(scene)];
    if (seen.side == 0) return {};
    const ShownLight shown = shownLightOf(scene);
    if (!_noVertices) _noVertices = gl::VertexArray::create();
    images.bindPositions(kPositions);
    images.bindNormals(kDarkness);
    glBindFramebuffer(GL_FRAMEBUFFER, seen.framebuffer.id());
    glViewport(0, 0, static_cast<GLsizei>(seen.side), static_cast<GLsizei>(seen.side));
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_PROGRAM_POINT_SIZE);
    _noVertices.bind();
    for (std::uint32_t part = 0; part < seen.parts; ++part) {
        const ShadowFit& fit = *scene.lights.fits[shown.first + part];
        auto program = _shaders.seen(featuresOf(shadowModule(fit.mode)->features(fit)));
        if (!program) return program.error();
        (*program)->use();
        glProgramUniform4i((*program)->id(), 0, pixels.x, pixels.y, pixels.width, pixels.height);
        glProgramUniform2ui((*program)->id(), 1, shown.first, part);
        const float border = fit.filter.bilinear ? 2.0f : 0.0f;
        (*program)->set(2, fit.filter.maxTexels > 0.0f ? fit.filter.maxTexels + 1.0f + border : 1.0f);
        glNamedFramebufferTextureLayer(seen.framebuffer.id(), GL_COLOR_ATTACHMENT0, seen.texture.id(), 0,
                                       static_cast<GLint>(part));
        glDrawArrays(GL_POINTS, 0, pixels.width * pixels.height);
    }
    glDisable(GL_PROGRAM_POINT_SIZE);
    glEnable(GL_SCISSOR_TEST);
    return {};
}

void ShowPainter::endSeen() {
    glEnable(GL_DEPTH_TEST);
}

Result<void> ShowPainter::show(const ViewScene& scene, const DarknessImages& images) {
    const ShadowShow what = scene.viewport->show;
    const ShownLight shown = shownLightOf(scene);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    const bool isMap = what == ShadowShow::ShadowMap || what == ShadowShow::SeenArea;
    const bool hasMap = shown.parts > 0 && scene.lights.fits[shown.first]->mapSize > 0;
    if ((what == ShadowShow::EdgeMap && !scene.screen.edges) || (isMap && !hasMap) ||
        (what == ShadowShow::FactorMap && shown.parts == 0)) {
        fillBlack();
        return {};
    }
    std::vector<gl::ShaderDefine> defines;
    if (what == ShadowShow::FactorMap) defines.push_back({"SHOW_FACTORS"});
    if (what == ShadowShow::EdgeMap) defines.push_back({"SHOW_EDGES"});
    if (what == ShadowShow::SeenArea) defines.push_back({"SHOW_SEEN"});
    auto program = _shaders.overView("stage/shadow_show.frag.glsl", defines);
    if (!program) return program.error();
    (*program)->use();
    if (what == ShadowShow::FactorMap) {
        images.bind(kDarkness);
        const std::uint32_t light = scene.lights.shadowLights[shown.first];
        (*program)->set(0, static_cast<int>(scene.lights.lights[light].darknessLayer));
    } else if (what == ShadowShow::EdgeMap) {
        images.bindEdges(kDarkness);
    } else {
        if (what == ShadowShow::SeenArea) glBindTextureUnit(kDarkness, _seen[keyOf(scene)].texture.id());
        const ShowLayout layout = showLayoutOf(scene.view->region, static_cast<std::int32_t>(shown.parts));
        glProgramUniform4i((*program)->id(), 0, layout.columns, layout.rows, layout.side,
                           static_cast<GLint>(shown.parts));
        (*program)->set(1, glm::ivec2(layout.x, layout.y));
        (*program)->set(2, static_cast<std::uint32_t>(scene.lights.shadows[shown.first].layer));
    }
    if (!_noVertices) _noVertices = gl::VertexArray::create();
    _noVertices.bind();
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return {};
}

}  // namespace umbriel
