#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/app/arguments.h"
#include "client/app/illumination_arguments.h"
#include "common/base/result.h"
#include "common/scene/animation.h"
#include "common/scene/aspect.h"
#include "common/scene/environment.h"
#include "common/scene/windows.h"

namespace umbriel {

// How the user looks at the scene; none of it given: the file's first camera, else the whole scene in view.
struct CameraArguments {
    std::string name;                      // of a camera in the file
    std::optional<glm::dvec3> eye;
    std::optional<glm::dvec3> target;
    std::optional<glm::dvec3> up;
    std::optional<double> fovDegrees;      // vertical
};

// Two eyes side by side before the wall; the screen stands at the plane of zero parallax.
struct StereoArguments {
    double separation = 0.065;             // metres between the eyes
};

// What the command line puts beside a loaded scene: the camera, the lights, what is behind everything.
struct StageOptions {
    CameraArguments camera;
    std::vector<LightArgument> lights;
    bool noLights = false;                 // not even the scene's own
    ShadowMode shadowMode = ShadowMode::None;
    std::uint32_t mapSize = 512;
    std::vector<std::string> shadowSet;   // FIELD=VALUE of the viewports
    ShadowShow show = ShadowShow::Picture;
    std::optional<glm::vec3> background;  // linear; none: the environment, without one transparent black
    std::string environment;              // a panorama's file; empty: none
    std::string brdf;                      // a measured BRDF's file: every surface gets a fit to it; empty: none
    bool captureEnvironment = false;      // the light is there and waits for its map (environment_capture.h)
    std::optional<StereoArguments> stereo;
    std::optional<ReflectionModel> model;     // of every material; none: the scene's own
    std::optional<ShadingFrequency> shading;  // of every geometry
    std::optional<FogArgument> fog;
    std::optional<glm::dvec2> wallSize;    // metres; none: the wall is as far away as its field of view puts it at 1 m
};

// What stands around a loaded scene so that it can be drawn: lights, a camera with its beacon, a background, a viewport
// and the window that holds it.
struct Stage {
    Ref<Window> window;
    Ref<Viewport> viewport;
    Ref<Fog> fog;                          // none: clear air
    Ref<Node> root;                        // of everything that is drawn
    Ref<Node> cameraBeacon;                // where a camera of ours stands; none when the file's camera is used
    Ref<Transform> cameraPose;
    Ref<PerspectiveCamera> ownCamera;
    Ref<EnvironmentLight> environment;     // none when there is none
    std::vector<std::string> notes;        // what was chosen for the user, for the log
    std::vector<std::string> warnings;     // what was put right
};

// The default light, used when neither the file nor the user brings one: a sun from the upper left behind the viewer and a
// weak ambient light.
inline constexpr glm::dvec3 kDefaultSunDirection{0.45, -0.75, -0.55};  // the way it travels, before normalising
inline constexpr float kDefaultAmbientRadiance = 0.15f;                // W/(m^2 sr)

Result<Stage> buildStage(Aspect& scene, Ref<LoadedScene> loaded, const StageOptions& options, double aspectRatio);

// A pose whose -z looks along forward (not zero); when up is parallel to it, another direction is taken.
glm::dmat3 lookingAlong(const glm::dvec3& forward, const glm::dvec3& up);

}  // namespace umbriel
