#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "client/app/output_files.h"
#include "client/app/stage.h"
#include "client/session/cluster.h"
#include "common/base/result.h"

namespace umbriel {

// What render and view have in common, as typed.
struct SceneArguments {
    std::string scene;                    // a file or "demo:..."
    std::string servers;                  // host:port,...; empty: embedded
    std::optional<int> local;             // embedded servers; none: one per tile, at most kMaxDefaultServers
    std::string grid = "1x1";
    std::string size = "1280x720";        // the whole wall
    std::string camera;
    std::string eye, target, up;
    std::optional<double> fov;            // degrees, vertical
    std::string stereo;                   // "", "left", "right", "pair"
    std::string wallSize;                 // metres, WxH
    std::optional<double> eyeSeparation;  // metres; none: that of StereoArguments; only with stereo
    std::string shadow = "auto";          // auto: what umbriel trade stored beside the scene, else none
    std::optional<double> frameBudget;    // milliseconds
    std::uint32_t mapSize = 512;
    std::vector<std::string> shadowSet;   // FIELD=VALUE of the viewports
    std::string show = "picture";         // a name of ShadowShow
    std::string lightMap;                 // a file; empty: the one beside the scene
    std::vector<std::string> lights;
    std::string background;               // r,g,b
    std::string fog;
    std::string model, shading;  // of every material and geometry; empty: the scene's own
    std::string environment;              // a file, or capture:x,y,z[:times]
    std::string brdf;                     // a file
    int samples = 1;
    std::optional<int> colourBits;  // 8, 16, 32; none: what suits the command's pictures
    std::string tiles = "offset";
    std::string policy = "wait";          // view: degrade
    int latency = 0;
    std::string listen;                    // HOST:PORT where servers dial this client
    std::optional<int> serversExpected;    // of them, whatever their names
    std::optional<double> connectTimeout;  // seconds
    bool startIncomplete = false;
    bool insecureLan = false;
    bool quiet = false;
    std::string logLevel = "warning";
};
inline constexpr int kMaxDefaultServers = 16;

// The command line of `umbriel render`.
struct RenderArguments {
    SceneArguments scene;
    std::vector<std::string> out;
    std::string layers;
    std::uint64_t frames = 1;
    double fps = 25.0;
    double exposure = 0.0;                // EV
    std::string toneMapping = "clamp";
    bool json = false;
    bool explain = false;
};

// Everything checked that can be checked without loading the scene or starting a server.
struct WallSetup {
    PixelSize wall;
    std::vector<TileAssignment> tiles;    // of all eyes that are drawn
    std::vector<Eye> eyes = {Eye::Mono};
    StageOptions stage;
    EnvironmentArgument environment;
    ClusterOptions cluster;
    TileMode tileMode = TileMode::Offset;
    std::uint32_t samples = 1;
    std::optional<ColourPrecision> colourPrecision;  // none: what suits the command's pictures
};
Result<WallSetup> checkSceneArguments(const SceneArguments& arguments);

// For --shadow auto: makes the viewports draw as umbriel trade chose for this scene. Nothing when nothing was stored;
// bad input when it cannot be read.
Result<void> applyStoredShadows(const SceneArguments& arguments, Aspect& scene, Ref<Window> window);

// A loaded scene with its stage, ready for frames.
struct LoadedStage {
    IdSource ids;
    std::unique_ptr<Aspect> scene;
    Ref<LoadedScene> loaded;
    Stage stage;
    std::vector<std::string> warnings;
};
// Loads a file (in a child process) or builds a demo, and sets the stage. Warnings also go to the log.
Result<std::unique_ptr<LoadedStage>> loadStage(const std::string& scene, const TypeRegistry& types,
                                               const StageOptions& options, double aspectRatio);

// Prints the error to the log and gives the exit code of its kind.
int exitCodeOf(const Error& error);

// umbriel render. Exit code 0, 1 or 2 (docs/commands.md).
int runRender(const RenderArguments& arguments, const std::filesystem::path& serverProgram, std::ostream& out);

}  // namespace umbriel
