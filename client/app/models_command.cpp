#include "client/app/models_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <sstream>
#include <system_error>

#include "client/app/held_tiles.h"
#include "client/app/picture_truth.h"
#include "client/session/views.h"
#include "common/image/picture_measures.h"
#include "common/image/png_io.h"
#include "common/scene/core_types.h"

namespace umbriel {
namespace {

constexpr int kColumns = 4;
constexpr float kLabelPixels = 16.0f;

// One picture of the sheet. The frequencies are those of Blinn's model, the shortest highlights of the usual ones.
struct Case {
    ReflectionModel model = ReflectionModel::BlinnPhong;
    ShadingFrequency shading = ShadingFrequency::Phong;
    std::string name;
};

std::vector<Case> cases() {
    std::vector<Case> all;
    for (const ShadingFrequency shading :
         {ShadingFrequency::Flat, ShadingFrequency::FlatMean, ShadingFrequency::Gouraud})
        all.push_back({ReflectionModel::BlinnPhong, shading, fmt::format("blinn-phong, {}", nameOf(shading))});
    for (const ReflectionModel model :
         {ReflectionModel::BlinnPhong, ReflectionModel::Phong, ReflectionModel::PhongGated, ReflectionModel::Schlick,
          ReflectionModel::Lambert, ReflectionModel::NormalisedPhong, ReflectionModel::PhongBrdf,
          ReflectionModel::Lafortune, ReflectionModel::MetallicRoughness, ReflectionModel::TorranceSparrow,
          ReflectionModel::PhongOriginal, ReflectionModel::GeneralSum, ReflectionModel::OpenGlSum})
        all.push_back({model, ShadingFrequency::Phong, std::string(nameOf(model))});
    return all;
}

struct Measured {
    Case of;
    FloatImage labelled;
    FloatImage truth;  // per pixel in double, of this model
    double judgedShare = 0.0;
    double maxError = 0.0;  // of radiance, over the judged pixels, against that truth
    double rmse = 0.0;
    double phongRmse = 0.0;  // against the truth of Phong's model
    double overshootMean = 0.0;
    double overshootMax = 0.0;
    double milliseconds = 0.0;     // of the quickest frame
    double cpuMilliseconds = 0.0;  // of a frame, in all threads of the embedded servers
};

// What the processes that this one started have used so far, in milliseconds; 0 where that is not told. Sums over many
// frames only: the kernel counts in steps of 10 ms.
double cpuOfChildren() {
    double ticks = 0.0;
    std::error_code ignored;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", ignored)) {
        std::ifstream children(task.path() / "children");
        for (std::string child; children >> child;) {
            std::ifstream file("/proc/" + child + "/stat");
            std::string text;
            std::getline(file, text);
            // Behind the name in brackets: state, then utime and stime as the 12th and 13th word.
            const std::size_t bracket = text.rfind(')');
            if (bracket == std::string::npos) continue;
            std::istringstream words(text.substr(bracket + 1));
            std::string word;
            for (int i = 0; i < 13 && words >> word; ++i)
                if (i >= 11) ticks += std::strtod(word.c_str(), nullptr);
        }
    }
    return ticks * 1000.0 / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double rmseOf(const FloatImage& a, const FloatImage& b, const std::vector<std::uint8_t>& judged, double* largest) {
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < judged.size(); ++i) {
        if (!judged[i]) continue;
        for (std::size_t channel = 0; channel < 3; ++channel) {
            const double difference =
                static_cast<double>(a.samples()[4 * i + channel]) - static_cast<double>(b.samples()[4 * i + channel]);
            sum += difference * difference;
            if (largest) *largest = std::max(*largest, std::abs(difference));
            ++count;
        }
    }
    return count == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(count));
}

// The scene under one model, drawn by servers of its own: nothing of another model is left.
class Session {
 public:
    static Result<std::unique_ptr<Session>> open(const ModelsArguments& arguments, const Case& which,
                                                 const std::filesystem::path& serverProgram) {
        SceneArguments scene = arguments.scene;
        scene.model = nameOf(which.model);
        scene.shading = nameOf(which.shading);
        scene.shadow = "none";  // not even those that are stored for the scene
        auto setup = checkSceneArguments(scene);
        if (!setup) return setup.error();
        auto session = std::unique_ptr<Session>(new Session);
        registerCoreTypes(session->_types);
        session->_setup = std::move(*setup);
        const PixelSize wall = session->_setup.wall;
        auto loaded = loadStage(scene.scene, session->_types, session->_setup.stage,
                                static_cast<double>(wall.width) / wall.height);
        if (!loaded) return loaded.error();
        session->_loaded = std::move(*loaded);
        session->_setup.cluster.serverProgram = serverProgram;
        auto cluster = Cluster::connect(session->_setup.cluster, session->_types, session->_setup.tiles);
        if (!cluster) return cluster.error();
        session->_cluster = std::move(*cluster);
        return session;
    }

    Result<LayeredImage> draw(std::uint32_t layers, double* milliseconds = nullptr) {
        auto views = resolveViews(*_loaded->scene, _loaded->stage.window, _setup.wall);
        if (!views) return views.error();
        views->views.tiles = _setup.tileMode;
        views->views.layers = layers;
        // Colours are judged here, against a truth in double.
        views->views.colourPrecision = _setup.colourPrecision.value_or(ColourPrecision::Float);
        _view = views->views.views.front();
        auto report = _cluster->frame(*_loaded->scene, views->views, 0.0, true);
        if (!report) return report.error();
        if (milliseconds) {
            *milliseconds = 0.0;  // as long as the slowest server
            for (const ServerReport& server : report->servers)
                *milliseconds = std::max(*milliseconds, server.drawMilliseconds);
        }
        _tiles.take(std::move(report->tiles));
        return assembleWall(_setup.wall, _tiles.all(), Eye::Mono);
    }

    void label(const std::string& text) {
        Aspect& scene = *_loaded->scene;
        const Ref<TextForeground> made = scene.create<TextForeground>("label");
        scene.edit(made)
            .set<&TextForeground::text>(text)
            .set<&TextForeground::lowerLeft>(glm::vec2(6.0f, 6.0f))
            .set<&TextForeground::height>(kLabelPixels)
            .set<&TextForeground::colour>(glm::vec4(0.8f, 0.8f, 0.8f, 1.0f));
        scene.edit(_loaded->stage.viewport).append<&Viewport::foregrounds>(Ref<Container>(made.id));
    }

    PictureTruth truth(const LayeredImage& picture) const {
        return truthOf(*_loaded->scene, _loaded->stage.root, _view, picture);
    }

 private:
    Session() = default;
    TypeRegistry _types;
    WallSetup _setup;
    std::unique_ptr<LoadedStage> _loaded;
    std::unique_ptr<Cluster> _cluster;
    HeldTiles _tiles;
    View _view;
};

Result<Measured> measure(const ModelsArguments& arguments, const Case& which,
                         const std::filesystem::path& serverProgram) {
    auto session = Session::open(arguments, which, serverProgram);
    if (!session) return session.error();
    constexpr auto kColour = static_cast<std::uint32_t>(Layer::Colour);
    Measured result;
    result.of = which;
    result.milliseconds = std::numeric_limits<double>::infinity();
    double before = 0.0;
    for (int i = 0; i <= arguments.frames; ++i) {
        double milliseconds = 0.0;
        if (i == 1) before = cpuOfChildren();
        const auto frame = (*session)->draw(kColour, &milliseconds);
        if (!frame) return frame.error();
        // The first frame also uploads and compiles.
        if (i > 0) result.milliseconds = std::min(result.milliseconds, milliseconds);
    }
    result.cpuMilliseconds = (cpuOfChildren() - before) / arguments.frames;
    const auto picture = (*session)->draw(kColour | static_cast<std::uint32_t>(Layer::Ids));
    if (!picture) return picture.error();
    PictureTruth truth = (*session)->truth(*picture);
    result.judgedShare = truth.judgedShare;
    result.rmse = rmseOf(picture->rgba, truth.rgba, truth.judged, &result.maxError);
    const PictureMeasures measures = measurePictures(truth.rgba, picture->rgba);
    result.overshootMean = measures.machBands.overshoot.mean;
    result.overshootMax = measures.machBands.overshoot.max;
    result.truth = std::move(truth.rgba);
    (*session)->label(which.name);
    auto labelled = (*session)->draw(kColour);
    if (!labelled) return labelled.error();
    result.labelled = std::move(labelled->rgba);
    return result;
}

Result<void> writeSheet(const std::filesystem::path& path, const std::vector<Measured>& all) {
    const int width = all.front().labelled.width();
    const int height = all.front().labelled.height();
    const int rows = (static_cast<int>(all.size()) + kColumns - 1) / kColumns;
    FloatImage sheet = makeRgbaImage(width * kColumns, height * rows);
    for (std::size_t i = 0; i < all.size(); ++i) {
        const int left = static_cast<int>(i) % kColumns * width;
        const int top = static_cast<int>(i) / kColumns * height;
        for (int y = 0; y < height; ++y)
            std::copy_n(all[i].labelled.pixel(0, y), static_cast<std::size_t>(width) * 4, sheet.pixel(left, top + y));
    }
    return writePng(path, sheet);
}

nlohmann::ordered_json toJson(const Measured& one) {
    return {{"model", std::string(nameOf(one.of.model))},
            {"shading", std::string(nameOf(one.of.shading))},
            {"max_error", one.maxError},
            {"rmse", one.rmse},
            {"rmse_to_phong", one.phongRmse},
            {"mach_band_mean", one.overshootMean},
            {"mach_band_max", one.overshootMax},
            {"draw_ms", one.milliseconds},
            {"cpu_ms", one.cpuMilliseconds},
            {"judged", one.judgedShare}};
}

}  // namespace

int runModels(const ModelsArguments& arguments, const std::filesystem::path& serverProgram, std::ostream& out) {
    if (!arguments.scene.model.empty() || !arguments.scene.shading.empty())
        return exitCodeOf(
            badInput("umbriel models draws every model and frequency: --model and --shading have no place"));
    const bool hasShadows = arguments.scene.shadow != "none" && arguments.scene.shadow != "auto";
    if (hasShadows || !arguments.scene.fog.empty() || !arguments.scene.stereo.empty() ||
        !arguments.scene.environment.empty() || arguments.scene.samples != 1 || arguments.scene.latency != 0)
        return exitCodeOf(
            badInput("umbriel models compares with a truth that has no shadows, fog, environment, second "
                     "eye, further samples or latency: leave those options away"));
    if (arguments.frames < 1 || arguments.frames > 1000)
        return exitCodeOf(badInput(fmt::format("--frames {}: expected 1 to 1000", arguments.frames)));
    if (!arguments.out.empty() && std::filesystem::path(arguments.out).extension() != ".png")
        return exitCodeOf(badInput(fmt::format("--out '{}': the sheet is a .png", arguments.out)));
    std::vector<Measured> all;
    for (const Case& which : cases()) {
        auto measured = measure(arguments, which, serverProgram);
        if (!measured) return exitCodeOf(measured.error());
        all.push_back(std::move(*measured));
    }
    const auto phong = std::find_if(all.begin(), all.end(),
                                    [](const Measured& one) { return one.of.model == ReflectionModel::Phong; });
    const std::vector<std::uint8_t> everywhere(phong->truth.pixelCount(), 1);
    for (Measured& one : all) one.phongRmse = rmseOf(one.truth, phong->truth, everywhere, nullptr);
    if (!arguments.out.empty())
        if (const auto written = writeSheet(arguments.out, all); !written) return exitCodeOf(written.error());
    if (arguments.json) {
        nlohmann::ordered_json rows = nlohmann::ordered_json::array();
        for (const Measured& one : all) rows.push_back(toJson(one));
        out << nlohmann::ordered_json(
                   {{"scene", arguments.scene.scene}, {"size", arguments.scene.size}, {"cases", rows}})
                   .dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace)
            << '\n';
        return out.good() ? 0 : 1;
    }
    out << "| model | shading | max error | RMSE | RMSE to Phong | Mach bands: mean | max | draw ms | CPU ms |\n"
           "|---|---|---|---|---|---|---|---|---|\n";
    for (const Measured& one : all)
        out << fmt::format("| {} | {} | {:.2g} | {:.2g} | {:.2g} | {:.2g} | {:.2g} | {:.1f} | {:.1f} |\n",
                           nameOf(one.of.model), nameOf(one.of.shading), one.maxError, one.rmse, one.phongRmse,
                           one.overshootMean, one.overshootMax, one.milliseconds, one.cpuMilliseconds);
    out << fmt::format("judged: {:.1f} % of the pixels that show a surface\n", 100.0 * all.front().judgedShare);
    if (!arguments.out.empty() && !arguments.scene.quiet) out << arguments.out << '\n';
    return out.good() ? 0 : 1;
}

}  // namespace umbriel
