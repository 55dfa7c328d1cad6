#include "client/app/environment_capture.h"

#include <algorithm>
#include <numbers>

#include "client/app/output_files.h"
#include "client/session/views.h"
#include "common/light/environment_map.h"
#include "common/wall/grid.h"

namespace umbriel {
namespace {

constexpr PixelSize kWall{3 * kCaptureSide, 2 * kCaptureSide};

// Three columns, two rows from below.
PixelRect placeOf(int face) {
    return {(face % 3) * kCaptureSide, (face / 3) * kCaptureSide, kCaptureSide, kCaptureSide};
}

// The pose of a view of one face. Faces of a cube map are seen from inside: their columns run against the view's right.
glm::dmat3 worldFromFace(int face) {
    const glm::dvec3 forward(cubeDirection(face, {0.5f, 0.5f}));
    const glm::dvec3 up = glm::dvec3(cubeDirection(face, {0.5f, 0.0f})) - forward;
    return {glm::cross(forward, up), up, -forward};
}

// Six viewports with their cameras; gone with this object.
class CaptureWindow {
 public:
    CaptureWindow(Aspect& scene, const Stage& stage, const glm::dvec3& position) : _scene(scene) {
        window = make<Window>();
        std::vector<Ref<Viewport>> viewports;
        const Viewport& shown = scene.get(stage.viewport);
        for (int face = 0; face < 6; ++face) {
            const auto transform = make<Transform>();
            scene.edit(transform).set<&Transform::translation>(position).set<&Transform::linear>(
                glm::mat3(worldFromFace(face)));
            const auto beacon = make<Node>();
            scene.edit(beacon).set<&Node::core>(Ref<Container>(transform.id));
            const auto camera = make<PerspectiveCamera>();
            scene.edit(camera)
                .set<&PerspectiveCamera::beacon>(beacon)
                .set<&PerspectiveCamera::fovY>(0.5 * std::numbers::pi)
                .set<&PerspectiveCamera::aspect>(1.0);
            const auto viewport = make<Viewport>();
            const PixelRect place = placeOf(face);
            const glm::vec2 corner(place.x, place.y);
            scene.edit(viewport)
                .set<&Viewport::root>(stage.root)
                .set<&Viewport::camera>(Ref<Container>(camera.id))
                .set<&Viewport::lowerLeft>(corner)
                .set<&Viewport::upperRight>(corner + glm::vec2(kCaptureSide))
                .set<&Viewport::background>(shown.background.get())
                .set<&Viewport::shadowMode>(shown.shadowMode.get())
                .set<&Viewport::mapSize>(shown.mapSize.get());
            viewports.push_back(viewport);
        }
        scene.edit(window).assign<&Window::viewports>(viewports);
    }
    ~CaptureWindow() {
        for (const ContainerId id : _made) _scene.destroy(id);
    }
    CaptureWindow(const CaptureWindow&) = delete;
    CaptureWindow& operator=(const CaptureWindow&) = delete;

    Ref<Window> window;

 private:
    template <class T>
    Ref<T> make() {
        const Ref<T> made = _scene.create<T>("capture");
        _made.push_back(made.id);
        return made;
    }
    Aspect& _scene;
    std::vector<ContainerId> _made;
};

Panorama panoramaOf(const FloatImage& wall) {
    std::vector<std::vector<glm::vec3>> faces(6);
    for (int face = 0; face < 6; ++face) {
        const PixelRect place = turnedOver(placeOf(face), kWall.height);
        for (int row = 0; row < kCaptureSide; ++row)
            for (int column = kCaptureSide - 1; column >= 0; --column) {
                const float* pixel = wall.pixel(place.x + column, place.y + row);
                faces[static_cast<std::size_t>(face)].push_back({pixel[0], pixel[1], pixel[2]});
            }
    }
    return panoramaFromFaces(faces, kCaptureSide);
}

}  // namespace

Result<std::uint64_t> captureEnvironment(Cluster& cluster, Aspect& scene, const Stage& stage,
                                         const EnvironmentArgument& argument) {
    const auto tiles = gridTiles(kWall, 3, 2);
    if (!tiles) return tiles.error();
    if (const auto assigned = cluster.assign(*tiles); !assigned) return assigned.error();
    const CaptureWindow capture(scene, stage, argument.position);
    std::uint64_t frames = 0;
    for (int i = 0; i < argument.times; ++i) {
        const auto views = resolveViews(scene, capture.window, kWall);
        if (!views) return views.error();
        auto report = cluster.frame(scene, views->views, 0.0, true);
        if (!report) return report.error();
        std::vector<TilePixels> pixels = std::move(report->tiles);
        frames = std::max(frames, report->frame);
        // With latency 1 the picture comes with the end of the frame.
        auto last = cluster.finish();
        if (!last) return last.error();
        if (last->has_value()) {
            pixels = std::move((*last)->tiles);
            frames = std::max(frames, (*last)->frame);
        }
        Panorama panorama = panoramaOf(assembleWall(kWall, pixels, Eye::Mono).rgba);
        repair(panorama);
        const Ref<EnvironmentMap> before = scene.get(stage.environment).map;
        scene.edit(stage.environment)
            .set<&EnvironmentLight::map>(addEnvironmentMap(scene, panorama, kCapturedFaceSize));
        if (scene.find(before)) scene.destroy(before.id);
    }
    return frames;
}

}  // namespace umbriel
