#include "server/draw/backdrop_painter.h"

#include "server/draw/text_font.h"

namespace umbriel {
namespace {

// Relative to the viewport up to 1, pixels above.
float placed(float value, std::int32_t origin, std::int32_t size) {
    return static_cast<float>(origin) + (value <= 1.0f ? value * static_cast<float>(size) : value);
}

}  // namespace

void BackdropPainter::drawScreen() {
    if (!_noVertices) _noVertices = gl::VertexArray::create();
    _noVertices.bind();
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

Result<void> BackdropPainter::drawBackground(const Aspect& scene, const ViewScene& view) {
    const ContainerId id = view.viewport->background.get().id;
    const ImageBackground* image = scene.findAs<ImageBackground>(id);
    glm::vec4 bottom(0.0f);
    glm::vec4 top(0.0f);
    if (const auto* colour = scene.findAs<ColourBackground>(id)) bottom = top = colour->colour.get();
    if (const auto* gradient = scene.findAs<GradientBackground>(id)) {
        bottom = gradient->bottom;
        top = gradient->top;
    }
    if (image) {
        auto texture = _gpuScene.textures().find(scene, image->image.get(), true, false);
        if (!texture) return texture.error();
        if (!*texture)
            image = nullptr;  // an image that is not there is a transparent one
        else {
            (*texture)->bind(0);
            _gpuScene.textures().plainSampler().bind(0);
        }
    }
    std::optional<EnvironmentUse> environment;
    if (const auto* background = scene.findAs<EnvironmentBackground>(id))
        environment = _gpuScene.environmentOf(scene, view, background->light.get().id);
    auto program = _shaders.background(environment ? BackgroundKind::Environment
                                       : image     ? BackgroundKind::Image
                                                   : BackgroundKind::Gradient);
    if (!program) return program.error();
    (*program)->use();
    if (environment) {
        if (auto bound = _gpuScene.environments().bind(scene, *environment, **program); !bound) return bound;
        (*program)->set(2, glm::mat4(glm::inverse(clipFromRelativeOf(*view.view))));
    }
    (*program)->set(0, bottom);
    (*program)->set(1, top);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    drawScreen();
    return {};
}

Result<const gl::Texture2D*> BackdropPainter::textOf(ContainerId id, const std::string& text) {
    auto& [known, texture] = _texts[id];
    if (texture && known == text) return &texture;
    const TextBitmap bitmap = drawText(text);
    auto made = gl::Texture2D::create(GL_R8, {bitmap.width, bitmap.height});
    if (!made) return made.error();
    made->upload(0, GL_RED, GL_UNSIGNED_BYTE, std::as_bytes(std::span(bitmap.coverage)));
    texture = std::move(*made);
    known = text;
    return &texture;
}

Result<void> BackdropPainter::drawForegrounds(const Aspect& scene, const ViewScene& view) {
    const PixelRect& region = view.view->region;
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    const auto& foregrounds = view.viewport->foregrounds;
    for (std::size_t i = 0; i < foregrounds.size(); ++i) {
        const ContainerId id = foregrounds[i].id;
        const gl::Texture2D* texture = nullptr;
        glm::vec4 place(0.0f);
        glm::vec4 tint(1.0f);
        const auto* text = scene.findAs<TextForeground>(id);
        if (text) {
            auto found = textOf(id, text->text.get());
            if (!found) return found.error();
            texture = *found;
            const float pixel = text->height.get() / float{kTextCellHeight};
            const glm::vec2 corner = text->lowerLeft;
            place = {placed(corner.x, region.x, region.width), placed(corner.y, region.y, region.height),
                     pixel * static_cast<float>(texture->size().x), text->height.get()};
            tint = text->colour;
        } else if (const auto* image = scene.findAs<ImageForeground>(id)) {
            auto found = _gpuScene.textures().find(scene, image->image.get(), true, false);
            if (!found) return found.error();
            texture = *found;
            const glm::vec2 corner = image->lowerLeft;
            place = {placed(corner.x, region.x, region.width), placed(corner.y, region.y, region.height),
                     image->size.get().x, image->size.get().y};
        }
        if (!texture || !(place.z > 0.0f) || !(place.w > 0.0f)) continue;
        auto program = _shaders.foreground(text != nullptr);
        if (!program) return program.error();
        (*program)->use();
        (*program)->set(0, place);
        (*program)->set(1, tint);
        texture->bind(0);
        _gpuScene.textures().plainSampler().bind(0);
        drawScreen();
    }
    glDisable(GL_BLEND);
    return {};
}

}  // namespace umbriel
