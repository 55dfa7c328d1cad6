#include "server/draw/darkness_painter.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "common/base/log.h"
#include "common/scene/nodes.h"
#include "server/shadow/view_module.h"
#include "shaders/structs_cpp.h"

namespace umbriel {
namespace {

constexpr GLuint kStorage = 3;  // vertices of a caster, or blobs
constexpr double kFlat = 1e-4;  // as in shaders/stage/planar.frag.glsl
// What is flat, or larger than this share of all casters together, is the ground that others stand on: it has no blob.
constexpr double kLargestBlob = 0.25;
// Volumes that no frame has used for so long are let go.
constexpr std::uint64_t kKeptUses = 64;

std::array<glm::dvec3, 8> cornersOf(const Box& box, const glm::dmat4& relativeFromObject) {
    std::array<glm::dvec3, 8> corners = box.corners();
    for (glm::dvec3& corner : corners) corner = glm::dvec3(relativeFromObject * glm::dvec4(corner, 1.0));
    return corners;
}

glm::dvec3 awayFrom(const glm::dvec4& light, const glm::dvec3& point) {
    return light.w * point - glm::dvec3(light);
}

// How often the way from the light to a corner must be added so that nothing of the view lies beyond. An orthographic
// view has no room for infinity: there w is 0 for every point at infinity, and a side between two of them is lost.
// 0: the view is in perspective, and infinity is meant.
double reachOf(const View& view, const std::array<glm::dvec3, 8>& corners, const glm::dvec4& light) {
    if (!view.orthographic) return 0.0;
    const glm::dmat4 relativeFromClip = glm::inverse(clipFromRelativeOf(view));
    double farthest = 0.0;
    for (int i = 0; i < 8; ++i) {
        const glm::dvec4 corner =
            relativeFromClip * glm::dvec4(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : 0.0, 1.0);
        for (const glm::dvec3& own : corners)
            farthest = std::max(farthest, glm::length(glm::dvec3(corner) / corner.w - own));
    }
    double shortest = std::numeric_limits<double>::infinity();  // way from the light
    glm::dvec3 lower = corners[0];
    glm::dvec3 upper = corners[0];
    for (const glm::dvec3& corner : corners) {
        lower = glm::min(lower, corner);
        upper = glm::max(upper, corner);
        shortest = std::min(shortest, glm::length(awayFrom(light, corner)));
    }
    if (light.w != 0.0) shortest = glm::length(glm::dvec3(light) - glm::clamp(glm::dvec3(light), lower, upper));
    return 2.0 * farthest / std::max(shortest, 1e-4 * farthest);
}

DrawList listAllCasters(const ViewScene& view) {
    DrawList list;
    for (std::uint32_t i = 0; i < view.items.size(); ++i) {
        const SurfaceItem& item = view.items[i];
        if (!item.castsShadow) continue;
        const auto clusters = item.geometry->clusters();
        for (std::uint32_t c = 0; c < clusters.size(); ++c) list.addCluster(i, clusters[c], c);
    }
    return list;
}

// The corners of [-1, 1]^3 as a closed mesh.
const std::array<glm::vec3, 8> kCube = {glm::vec3(-1, -1, -1), {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                                        {-1, -1, 1},           {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};
constexpr std::array<std::uint32_t, 36> kCubeIndices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                                        2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};

struct BlobVertex {
    glm::vec4 relative;
    std::uint32_t blob;
};

}  // namespace

bool shadowMisses(const Frustum& frustum, const Box& box, const glm::dmat4& relativeFromObject,
                  const glm::dvec4& light) {
    if (box.empty()) return true;
    const auto corners = cornersOf(box, relativeFromObject);
    // Not the near plane: what lies before it counts as well.
    for (std::size_t i = 0; i < 4; ++i) {
        const Plane& plane = frustum.planes[i];
        if (std::all_of(corners.begin(), corners.end(), [&](const glm::dvec3& corner) {
                return glm::dot(glm::dvec3(plane), corner) + plane.w < 0.0 &&
                       glm::dot(glm::dvec3(plane), awayFrom(light, corner)) <= 0.0;
            }))
            return true;
    }
    return false;
}

bool mayCoverEye(const Frustum& wholeView, const Box& box, const glm::dmat4& relativeFromObject,
                 const glm::dvec4& light) {
    if (box.empty()) return false;
    const auto& near = wholeView.nearCorners;
    const auto corners = cornersOf(box, relativeFromObject);
    const glm::dvec3 middle = 0.25 * (near[0] + near[1] + near[2] + near[3]);
    // The body between the light and the near rectangle: outside of any of its planes is outside.
    const auto isOutside = [&](glm::dvec3 normal, const glm::dvec3& through, const glm::dvec3& inner) {
        const double side = glm::dot(normal, inner);
        if (!(std::abs(side) > 0.0)) return false;
        if (side > 0.0) normal = -normal;
        const double slack = 1e-9 * glm::length(normal) * (glm::length(through) + glm::length(middle));
        return std::all_of(corners.begin(), corners.end(),
                           [&](const glm::dvec3& corner) { return glm::dot(normal, corner - through) > slack; });
    };
    for (std::size_t i = 0; i < 4; ++i) {
        const glm::dvec3 towards = glm::dvec3(light) - light.w * near[i];
        if (isOutside(glm::cross(near[(i + 1) % 4] - near[i], towards), near[i], middle - near[i])) return false;
    }
    const glm::dvec3 across = glm::cross(near[1] - near[0], near[3] - near[0]);
    if (isOutside(across, near[0], glm::dvec3(light) - light.w * near[0])) return false;
    return true;
}

Result<DarknessPainter::Volume*> DarknessPainter::volumeOf(const SurfaceItem& item, const ShadowFit& fit,
                                                           const glm::dvec4& lightRelative, bool finite) {
    const auto shape = item.geometry->casterShape();
    glm::dvec4 light = glm::inverse(item.relativeFromObject) * lightRelative;
    if (lightRelative.w == 0.0) light = glm::dvec4(glm::normalize(glm::dvec3(light)), 0.0);
    // Rounded, so that the eye's place, which is in both factors, does not make a volume new.
    const glm::vec4 lightObject(glm::vec3(light), static_cast<float>(lightRelative.w));
    Volume& volume = _volumes[{item.node, fit.light}];
    volume.lastUse = _use;
    if (volume.shape == shape && volume.lightObject == lightObject && volume.finite == finite &&
        (volume.buffer || volume.corners == 0))
        return &volume;
    volume.shape = shape;
    volume.lightObject = lightObject;
    volume.finite = finite;
    const ShadowVolume made =
        shadowVolume(volume.shape->topology, volume.shape->positions, glm::dvec4(lightObject), true, finite);
    std::vector<std::uint32_t> corners = made.sides;
    corners.insert(corners.end(), made.lightCap.begin(), made.lightCap.end());
    corners.insert(corners.end(), made.darkCap.begin(), made.darkCap.end());
    volume.sides = static_cast<GLsizei>(made.sides.size());
    volume.lightCap = static_cast<GLsizei>(made.lightCap.size());
    volume.corners = static_cast<GLsizei>(corners.size());
    if (corners.empty()) return &volume;
    auto buffer = gl::Buffer::create(std::as_bytes(std::span(corners)));
    if (!buffer) return buffer.error();
    volume.buffer = std::move(*buffer);
    volume.vertexArray = gl::VertexArray::create();
    volume.vertexArray.attribute({.location = 0, .components = 1, .type = GL_UNSIGNED_INT, .integer = true});
    volume.vertexArray.vertexBuffer(0, volume.buffer, 0, sizeof(std::uint32_t));
    return &volume;
}

Result<void> DarknessPainter::paintSurfaces(const Aspect& scene, const ViewScene& view, const DrawList& visible,
                                            const DrawEntries& drawEntries) {
    std::uint32_t layers = 0;
    for (const ShadowFit* fit : view.lights.fits)
        if (shadowModule(fit->mode)->demand(*fit).positions) layers |= static_cast<std::uint32_t>(Layer::Position);
    if (view.screen.surfaces)
        layers |= static_cast<std::uint32_t>(Layer::Position) | static_cast<std::uint32_t>(Layer::Normal);
    _images.beginSurfaces();
    const gl::Program* current = nullptr;
    const GpuMaterial* material = nullptr;
    return drawEntries(visible, 0, visible.opaqueEntries, [&](const SurfaceItem& item) -> Result<void> {
        auto program = _shaders.layers(item.casterFeatures, layers, 0);
        if (!program) return program.error();
        if (*program != current) (*program)->use();
        current = *program;
        current->set(0, glm::mat4(item.relativeFromObject));
        if (view.screen.surfaces) {
            current->set(1, item.normalFromObject);
            item.geometry->faceNormals().bind(static_cast<GLuint>(TextureUnit::FaceNormals));
        }
        setSides(item);
        if (item.casterFeatures == 0 || material == item.material) return {};
        material = item.material;
        return _gpuScene.materials().bind(scene, *material, _gpuScene.textures());
    });
}

Result<void> DarknessPainter::paintVolumes(const Aspect& scene, const ViewScene& view, const ShadowFit& fit,
                                           const Frustum& frustum, const Frustum& wholeView) {
    auto program = _shaders.volume();
    if (!program) return program.error();
    (*program)->use();
    glDisable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
    const glm::dvec4 light = lightRelative(fit, view.view->eyeWorld);
    for (const SurfaceItem& item : view.items) {
        if (!item.castsShadow || shadowMisses(frustum, item.geometry->box(), item.relativeFromObject, light)) continue;
        if (has(item.casterFeatures, Feature::AlphaMask) && _namedCutOuts.insert(item.node).second) {
            const Node* node = scene.findAs<Node>(item.node);
            const std::string name =
                node && !node->name.get().empty() ? node->name.get() : std::to_string(item.node.value);
            log::warning(
                fmt::format("shadow volumes take '{}' for whole, which a texture cuts out: maps and flattened "
                            "casters (--shadow std, planar) have its holes",
                            name));
        }
        auto volume = volumeOf(item, fit, light, view.view->orthographic);
        if (!volume) return volume.error();
        if ((*volume)->corners == 0) continue;
        // From infinity behind the surface towards it (z-fail): right wherever the eye is. From the eye towards the
        // surface (z-pass): cheaper, as no caps are drawn, and right when the eye is in no volume and no way leads into
        // one through the caster itself, as where its faces are not drawn from behind, or have holes.
        const bool isSeenThrough = item.casterFeatures != 0 || (!has(item.material->features, Feature::DoubleSided) &&
                                                                !(*volume)->shape->topology.isClosed);
        const bool fromBehind = fit.mode == ShadowMode::VolumeZFail || isSeenThrough ||
                                mayCoverEye(wholeView, item.geometry->box(), item.relativeFromObject, light);
        glDepthFunc(fromBehind ? GL_LEQUAL : GL_GREATER);
        (*program)->set(2, fromBehind ? glm::vec2(-1.0f, 1.0f) : glm::vec2(1.0f, -1.0f));
        (*program)->set(0, glm::mat4(item.relativeFromObject));
        (*program)->set(1, (*volume)->lightObject);
        // In the object's space a directional light's way is of unit length.
        const auto corners = cornersOf(item.geometry->box(), item.relativeFromObject);
        const double unit = light.w == 0.0
                                ? glm::length(glm::dmat3(item.relativeFromObject) * glm::dvec3((*volume)->lightObject))
                                : 1.0;
        (*program)->set(3, static_cast<float>(reachOf(*view.view, corners, light) / unit));
        glFrontFace(item.isMirrored ? GL_CW : GL_CCW);
        item.geometry->positions().bindBase(GL_SHADER_STORAGE_BUFFER, kStorage);
        (*volume)->vertexArray.bind();
        const GLsizei drawn = fromBehind ? (*volume)->corners : (*volume)->sides;
        // The light cap lies on the visible surface to the bit only if the near plane cuts both: not clamped, what of
        // it is nearer is before all that is visible and does not count. Beyond the far plane it does.
        const auto isBeyond = [&](const Plane& plane) {
            return std::any_of(corners.begin(), corners.end(), [&](const glm::dvec3& corner) {
                return glm::dot(glm::dvec3(plane), corner) + plane.w < 0.0;
            });
        };
        if (fromBehind && isBeyond(wholeView.planes[4]) && !isBeyond(wholeView.planes[5])) {
            const GLsizei capEnd = (*volume)->sides + (*volume)->lightCap;
            glDrawArrays(GL_TRIANGLES, 0, (*volume)->sides);
            glDrawArrays(GL_TRIANGLES, capEnd, drawn - capEnd);
            glDisable(GL_DEPTH_CLAMP);
            glDrawArrays(GL_TRIANGLES, (*volume)->sides, (*volume)->lightCap);
            glEnable(GL_DEPTH_CLAMP);
        } else {
            glDrawArrays(GL_TRIANGLES, 0, drawn);
        }
        _triangles += static_cast<std::uint64_t>(drawn) / 3;
    }
    glFrontFace(GL_CCW);
    return {};
}

Result<void> DarknessPainter::paintPlanar(const Aspect& scene, const ViewScene& view, const ShadowFit& fit,
                                          const DrawEntries& drawEntries) {
    const glm::dvec3 eye = view.view->eyeWorld;
    const glm::dvec4 light = lightRelative(fit, eye);
    const glm::dvec3 normal(fit.planeWorld);
    const glm::dvec4 plane(normal, fit.planeWorld.w + glm::dot(normal, eye));
    const auto flatten = flattening(plane, light);
    if (!flatten) return {};
    // Between the light and the plane: nearer to the plane than the light is.
    const double above = glm::dot(plane, light);
    const glm::dvec4 belowLight = glm::dvec4(0, 0, 0, 1) - light.w / above * plane;
    _images.bindPositions(static_cast<GLuint>(TextureUnit::Positions));
    glDisable(GL_CULL_FACE);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_CLIP_DISTANCE0);
    glEnable(GL_CLIP_DISTANCE1);
    const DrawList casters = listAllCasters(view);
    const gl::Program* current = nullptr;
    const GpuMaterial* material = nullptr;
    auto drawn = drawEntries(casters, 0, casters.entries.size(), [&](const SurfaceItem& item) -> Result<void> {
        auto program = _shaders.planar(item.casterFeatures);
        if (!program) return program.error();
        if (*program != current) (*program)->use();
        current = *program;
        current->set(4, glm::vec4(plane));
        current->set(5, fit.mode == ShadowMode::PlanarStencil ? 1.0f : 0.0f);
        const glm::dmat4& relative = item.relativeFromObject;
        // What lies on the plane is what the shadow falls on.
        const double reach = glm::length(glm::dvec3(relative * glm::dvec4(item.geometry->box().centre(), 1.0)));
        current->set(0, glm::mat4(*flatten * relative));
        current->set(1, glm::vec4((plane - glm::dvec4(0, 0, 0, kFlat * reach)) * relative));
        current->set(2, glm::vec4(belowLight * relative));
        if (item.casterFeatures == 0 || material == item.material) return {};
        material = item.material;
        return _gpuScene.materials().bind(scene, *material, _gpuScene.textures());
    });
    glDisable(GL_CLIP_DISTANCE0);
    glDisable(GL_CLIP_DISTANCE1);
    _triangles += casters.triangles;
    return drawn;
}

Result<void> DarknessPainter::paintBlobs(const ViewScene& view, const ShadowFit& fit, const Frustum& frustum) {
    const glm::dvec4 light = lightRelative(fit, view.view->eyeWorld);
    static const CasterTopology cube = casterTopology(kCube, kCubeIndices);
    std::vector<gpu::GpuBlob> blobs;
    std::vector<BlobVertex> vertices;
    glm::dvec3 lower(std::numeric_limits<double>::infinity());
    glm::dvec3 upper = -lower;
    for (const SurfaceItem& item : view.items) {
        if (!item.castsShadow || item.geometry->box().empty()) continue;
        for (const glm::dvec3& corner : cornersOf(item.geometry->box(), item.relativeFromObject)) {
            lower = glm::min(lower, corner);
            upper = glm::max(upper, corner);
        }
    }
    const double largest = kLargestBlob * glm::length(upper - lower);
    const auto casters =
        std::count_if(view.items.begin(), view.items.end(), [](const SurfaceItem& item) { return item.castsShadow; });
    for (const SurfaceItem& item : view.items) {
        const Box& box = item.geometry->box();
        if (!item.castsShadow || box.empty()) continue;
        const auto corners = cornersOf(box, item.relativeFromObject);
        const glm::dvec3 centre(item.relativeFromObject * glm::dvec4(box.centre(), 1.0));
        const glm::dvec3 away = awayFrom(light, centre);
        if (!(glm::length(away) > 0.0)) continue;
        const glm::dvec3 along = glm::normalize(away);
        double radius = 0.0;
        for (const glm::dvec3& corner : corners) {
            const glm::dvec3 d = corner - centre;
            radius = std::max(radius, glm::length(d - glm::dot(d, along) * along));
        }
        // Half the box's diagonal, whichever way the light comes.
        const glm::dvec3 extent = glm::dvec3(box.maximum) - glm::dvec3(box.minimum);
        const bool isFlat = std::min({extent.x, extent.y, extent.z}) < 1e-3 * glm::length(extent);
        const bool isGround = casters > 1 && (isFlat || glm::length(corners[7] - corners[0]) > 2.0 * largest);
        radius *= fit.blobSize;
        if (!(radius > 0.0) || isGround) continue;
        // A box that holds the blob, whichever way the light comes.
        glm::dmat4 place(radius);
        place[3] = glm::dvec4(centre, 1.0);
        const Box unit{glm::vec3(-1.0f), glm::vec3(1.0f)};
        if (shadowMisses(frustum, unit, place, light)) continue;
        const double reach = light.w > 0.0 ? glm::length(away) : 0.0;
        if (light.w > 0.0 && reach <= 1.7321 * radius) continue;  // the light is within it: no side has a shadow
        const glm::dvec4 lightCube = light.w > 0.0 ? glm::dvec4(-away / radius, 1.0) : glm::dvec4(-along, 0.0);
        const ShadowVolume volume = shadowVolume(cube, kCube, lightCube, true, view.view->orthographic);
        const double viewReach = reachOf(*view.view, cornersOf(unit, place), light);
        const auto index = static_cast<std::uint32_t>(blobs.size());
        for (const auto* list : {&volume.sides, &volume.lightCap, &volume.darkCap})
            for (const std::uint32_t corner : *list) {
                const glm::dvec3 at = glm::dvec3(kCube[corner & ~kExtruded]);
                const glm::dvec3 there = centre + radius * at;
                glm::dvec4 stands(there, 1.0);
                if (corner & kExtruded)
                    stands = viewReach > 0.0 ? stands + glm::dvec4(viewReach * awayFrom(light, there), 0.0)
                                             : glm::dvec4(awayFrom(light, there), 0.0);
                vertices.push_back({glm::vec4(stands), index});
            }
        // The item's own box as the cube of [-1, 1].
        const glm::dvec3 half = 0.5 * (glm::dvec3(box.maximum) - glm::dvec3(box.minimum));
        glm::dmat4 boxFromRelative = glm::inverse(item.relativeFromObject);
        boxFromRelative[3] -= glm::dvec4(box.centre(), 0.0);
        gpu::GpuBlob blob{};
        blob.light = light.w > 0.0 ? glm::vec4(light) : glm::vec4(-along, 0.0f);
        blob.centre = glm::vec3(centre);
        blob.radius = static_cast<float>(radius);
        glm::vec4* rows[] = {&blob.boxFromX, &blob.boxFromY, &blob.boxFromZ};
        for (int i = 0; i < 3; ++i)
            *rows[i] = glm::vec4(
                glm::dvec4(boxFromRelative[0][i], boxFromRelative[1][i], boxFromRelative[2][i], boxFromRelative[3][i]) /
                std::max(half[i], 1e-3 * glm::length(half)));
        blobs.push_back(blob);
    }
    if (blobs.empty()) return {};
    auto program = _shaders.blob();
    if (!program) return program.error();
    auto vertexBuffer = gl::Buffer::create(std::as_bytes(std::span(vertices)));
    if (!vertexBuffer) return vertexBuffer.error();
    auto blobBuffer = gl::Buffer::create(std::as_bytes(std::span(blobs)));
    if (!blobBuffer) return blobBuffer.error();
    _blobVertices = std::move(*vertexBuffer);
    _blobs = std::move(*blobBuffer);
    gl::VertexArray vertexArray = gl::VertexArray::create();
    vertexArray.attribute({.location = 0, .components = 4});
    vertexArray.attribute({.location = 1,
                           .components = 1,
                           .type = GL_UNSIGNED_INT,
                           .integer = true,
                           .offset = offsetof(BlobVertex, blob)});
    vertexArray.vertexBuffer(0, _blobVertices, 0, sizeof(BlobVertex));
    (*program)->use();
    _blobs.bindBase(GL_SHADER_STORAGE_BUFFER, kStorage);
    _images.bindPositions(static_cast<GLuint>(TextureUnit::Positions));
    vertexArray.bind();
    // Back faces alone: there is one behind every pixel of the body, also when the eye is inside.
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_CULL_FACE);
    glCullFace(GL_FRONT);
    glFrontFace(GL_CCW);
    glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices.size()));
    _triangles += vertices.size() / 3;
    return {};
}

Result<std::uint64_t> DarknessPainter::paint(const Aspect& scene, const ViewScene& view, const DrawList& visible,
                                             const Frustum& frustum, const Frustum& wholeView,
                                             const DrawEntries& drawEntries) {
    ++_use;
    _triangles = 0;
    if (auto painted = paintSurfaces(scene, view, visible, drawEntries); !painted) return painted.error();
    for (std::size_t i = 0; i < view.lights.fits.size(); ++i) {
        const ShadowFit& fit = *view.lights.fits[i];
        if (!shadowModule(fit.mode)->demand(fit).inView) continue;
        _images.beginLayer(view.lights.lights[view.lights.shadowLights[i]].darknessLayer);
        Result<void> painted;
        switch (fit.mode) {
            case ShadowMode::VolumeZPass:
            case ShadowMode::VolumeZFail:
                painted = paintVolumes(scene, view, fit, frustum, wholeView);
                break;
            case ShadowMode::Planar:
            case ShadowMode::PlanarStencil:
                painted = paintPlanar(scene, view, fit, drawEntries);
                break;
            default:
                painted = paintBlobs(view, fit, frustum);
        }
        if (!painted) return painted.error();
    }
    _images.end();
    std::erase_if(_volumes, [&](const auto& entry) { return _use - entry.second.lastUse > kKeptUses; });
    return _triangles;
}

Result<void> DarknessPainter::paintFactors(const Aspect& scene, const ViewScene& view, const DrawList& visible,
                                           const BindLights& bindLights, const DrawEntries& drawEntries) {
    if (auto painted = paintSurfaces(scene, view, visible, drawEntries); !painted) return painted;
    for (std::uint32_t layer = 0; layer < view.lights.darkLights.size(); ++layer) {
        const std::uint32_t light = view.lights.darkLights[layer];
        _images.beginFactors(layer);
        const gl::Program* current = nullptr;
        const GpuMaterial* material = nullptr;
        auto painted = drawEntries(visible, 0, visible.opaqueEntries, [&](const SurfaceItem& item) -> Result<void> {
            const LightList::Run& run = view.lights.runs[item.run];
            const auto reaching = view.lights.lightsOf(item.run);
            const auto place =
                static_cast<std::uint32_t>(std::find(reaching.begin(), reaching.end(), light) - reaching.begin());
            // What the light does not reach stays lit in its layer.
            const bool isReached = place < run.count;
            const GLboolean writes = isReached ? GL_TRUE : GL_FALSE;
            glColorMask(writes, writes, writes, writes);
            auto program =
                isReached ? _shaders.darkness(item.factorFeatures, place) : _shaders.layers(item.casterFeatures, 0, 0);
            if (!program) return program.error();
            if (*program != current) (*program)->use();
            current = *program;
            if (isReached) {
                bindLights(*current, run);
                if (has(item.factorFeatures, Feature::ShadowLightMap)) bindLightMap(view, item);
                if (!run.block) current->set(5, place);
            }
            current->set(0, glm::mat4(item.relativeFromObject));
            current->set(1, item.normalFromObject);
            item.geometry->faceNormals().bind(static_cast<GLuint>(TextureUnit::FaceNormals));
            setSides(item);
            if (item.casterFeatures == 0 || material == item.material) return {};
            material = item.material;
            return _gpuScene.materials().bind(scene, *material, _gpuScene.textures());
        });
        glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        if (!painted) return painted;
    }
    _images.end();
    return {};
}

void DarknessPainter::fill() {
    if (!_noVertices) _noVertices = gl::VertexArray::create();
    _noVertices.bind();
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

Result<void> DarknessPainter::paintEdges(const Aspect& scene, const ViewScene& view, const DrawList& visible,
                                         bool withSurfaces, const DrawEntries& drawEntries) {
    if (withSurfaces)
        if (auto painted = paintSurfaces(scene, view, visible, drawEntries); !painted) return painted;
    auto program = _shaders.overView("stage/shadow_edges.frag.glsl", {});
    if (!program) return program.error();
    (*program)->use();
    (*program)->set(0, view.screen.edgeThreshold);
    _images.bindPositions(static_cast<GLuint>(TextureUnit::Positions));
    _images.bindNormals(static_cast<GLuint>(TextureUnit::Darkness));
    _images.beginEdges();
    fill();
    _images.end();
    return {};
}

Result<void> DarknessPainter::filter(const ViewScene& view) {
    const std::vector<float> weights = gaussWeights(view.screen.radius);
    const auto count = static_cast<int>(weights.size());
    const auto pass = [&](bool across, std::uint32_t layer) -> Result<void> {
        std::vector<gl::ShaderDefine> defines;
        if (across) defines.push_back({"FROM_LAYER"});
        if (view.screen.edges) defines.push_back({"WITH_EDGES"});
        auto program = _shaders.overView("stage/shadow_gauss.frag.glsl", defines);
        if (!program) return program.error();
        (*program)->use();
        glProgramUniform4i((*program)->id(), 0, across ? 1 : 0, across ? 0 : 1, static_cast<GLint>(layer), count - 1);
        glProgramUniform1fv((*program)->id(), 1, count, weights.data());
        fill();
        return {};
    };
    if (view.screen.edges) _images.bindEdges(static_cast<GLuint>(TextureUnit::Positions));
    for (std::uint32_t layer = 0; layer < view.lights.darkLights.size(); ++layer) {
        _images.bind(static_cast<GLuint>(TextureUnit::Darkness));
        _images.beginBetween();
        if (auto done = pass(true, layer); !done) return done;
        _images.bindBetween(static_cast<GLuint>(TextureUnit::Darkness));
        _images.beginFiltered(layer);
        if (auto done = pass(false, layer); !done) return done;
    }
    _images.end();
    return {};
}

}  // namespace umbriel
