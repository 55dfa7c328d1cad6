#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/app/render_command.h"
#include "client/app/trade_setting.h"
#include "client/trade/shadow_scene.h"
#include "client/trade/shadow_truth.h"

namespace umbriel {

// How a scene is measured for the trade of error against cost.
struct TradeBenchOptions {
    std::optional<double> lightSize;  // metres, directional: radians; of all lights, for soft truth
    TruthOptions truth;
    std::string judgeNode;       // only surfaces of nodes with this name, or below one; empty: all
    bool bothSides = false;      // surfaces lit from behind are judged as if light shone through
    int flickerFrames = 0;       // of a slow move to the side; fewer than 2: none
    double flickerStep = 0.002;  // of a move, as a share of the distance to what is in view
};

// A scene on its servers, where settings are measured against truth and against each other. Lives on one thread.
class TradeBench {
 public:
    static Result<std::unique_ptr<TradeBench>> open(const SceneArguments& arguments,
                                                    const std::filesystem::path& serverProgram,
                                                    const TradeBenchOptions& options);

    Aspect& scene() { return *_loaded->scene; }
    const Stage& stage() const { return _loaded->stage; }
    PixelSize wall() const { return _setup.wall; }

    // Looks through a camera of the file from now on; look() must follow.
    Result<void> useCamera(const std::string& name);
    // Draws what is in view and makes its truth; before measure(), and again after the scene changed.
    Result<void> look();
    // What is judged from now on; look() must follow.
    void judge(const std::string& node, bool bothSides);

    // The errors of a setting; its costs are left as they were.
    Result<void> measure(TradeRow& row);
    // The costs of settings, drawn in turns of a few frames each so that what else runs on the machine meets all of
    // them. At least `frames` frames each.
    Result<void> time(std::vector<TradeRow>& rows, int frames);

    // Scene, machine, truth; no rows.
    TradeResult describe() const;

 private:
    // What one eye sees in one frame.
    struct Look {
        Eye eye = Eye::Mono;
        View view;
        SurfacePoints points;
        std::vector<std::vector<float>> truth;          // by light
        std::vector<std::vector<std::uint8_t>> judged;  // by light
    };
    struct Drawn {
        WallViews views;
        std::vector<LayeredImage> pictures;  // by eye
    };
    TradeBench() = default;
    Result<Drawn> draw(std::uint32_t layers, bool wantPixels, FrameReport* report = nullptr);
    Result<std::vector<Look>> lookNow();
    // The factors of each light in each look, after a setting was applied.
    Result<std::vector<std::vector<std::vector<float>>>> factorsNow();
    // Applies a setting; a light map of its map size, baked from what it says, is made when there is none yet.
    Result<void> apply(const TradeSetting& setting);
    Result<void> movePath(int frame);
    // Mean change of the same surface points from frame to frame along the path, less the truth's.
    Result<double> flickerNow();
    // Where a row is judged: everywhere that truth is, planar modes on the plane of their fit.
    std::vector<std::uint8_t> judgedBy(const Look& look, std::size_t light, std::span<const ShadowFit> fits) const;
    Result<void> buildScene();

    // One light's factors as a picture.
    static FloatImage factorImage(const SurfacePoints& points, const std::vector<float>& factors);

    WallSetup _setup;
    TradeBenchOptions _options;
    std::string _sceneName;
    std::unique_ptr<TypeRegistry> _types;
    std::unique_ptr<LoadedStage> _loaded;
    std::optional<SettingSwitch> _settings;
    std::unique_ptr<Cluster> _cluster;
    std::unique_ptr<ShadowScene> _shadowScene;
    std::vector<Look> _looks;              // by eye
    std::vector<std::vector<Look>> _path;  // by frame
    std::vector<double> _pathTruth;        // the truth's own change, by pair of frames
    double _eyesTruth = 0.0;
    std::vector<std::string> _machine;
    GeometryBounds _bounds;
    // By what it is baked from and by size, of the scene as it was looked at.
    std::map<std::pair<std::optional<ShadowMode>, std::uint32_t>, Ref<LightMap>> _lightMaps;
};

}  // namespace umbriel
