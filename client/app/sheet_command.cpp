#include "client/app/sheet_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/app/held_tiles.h"
#include "client/app/light_map_servers.h"
#include "client/app/trade_setting.h"
#include "client/session/field_text.h"
#include "client/session/views.h"
#include "common/base/log.h"
#include "common/image/display.h"
#include "common/image/png_io.h"
#include "common/scene/core_types.h"

namespace umbriel {
namespace {

constexpr float kLabelPixels = 16.0f;

// One picture of the sheet: fields of the viewport beside the technique.
struct Cell {
    std::string technique;
    std::vector<std::pair<std::string, std::string>> fields;
    std::string label() const {
        std::string text = technique;
        for (const auto& [field, value] : fields) text += fmt::format(" {}={}", field, value);
        return text;
    }
};

// What is asked for, else every mode there is, and what goes with many of them.
std::vector<Cell> cellsOf(const std::vector<std::string>& techniques) {
    std::vector<Cell> all;
    for (const std::string& technique : techniques) all.push_back({technique, {}});
    if (!all.empty()) return all;
    for (const std::string& mode : drawnShadowModes()) all.push_back({mode, {}});
    all.push_back({"std", {{"gauss", "3"}}});
    all.push_back({"zfail", {{"gauss", "3"}}});
    return all;
}

// The scene under every mode, drawn by the same servers. What cannot be drawn (a light map where no light stays) is
// left out with a warning.
Result<std::vector<FloatImage>> drawAll(const SceneArguments& arguments, const std::vector<std::string>& techniques,
                                        const std::filesystem::path& serverProgram) {
    auto setup = checkSceneArguments(arguments);
    if (!setup) return setup.error();
    TypeRegistry types;
    registerCoreTypes(types);
    auto loaded =
        loadStage(arguments.scene, types, setup->stage, static_cast<double>(setup->wall.width) / setup->wall.height);
    if (!loaded) return loaded.error();
    Aspect& scene = *(*loaded)->scene;
    const Ref<Viewport> viewport = (*loaded)->stage.viewport;
    const Ref<TextForeground> label = scene.create<TextForeground>("label");
    scene.edit(label)
        .set<&TextForeground::lowerLeft>(glm::vec2(4.0f, 4.0f))
        .set<&TextForeground::height>(kLabelPixels)
        .set<&TextForeground::colour>(glm::vec4(1.0f));
    scene.edit(viewport).append<&Viewport::foregrounds>(Ref<Container>(label.id));
    setup->cluster.serverProgram = serverProgram;
    auto cluster = Cluster::connect(setup->cluster, types, setup->tiles);
    if (!cluster) return cluster.error();
    HeldTiles tiles;
    std::vector<FloatImage> pictures;
    const auto draw = [&](const Cell& cell, const Technique& technique) -> Result<FloatImage> {
        if (technique.mode == ShadowMode::LightMap) {
            // The map size is an atlas' too.
            const std::uint32_t size = arguments.mapSize > 0 ? arguments.mapSize : 512;
            if (const auto added = addLightMap(**loaded, size, technique.bakedFrom, serverProgram); !added)
                return added.error();
        }
        auto views = resolveViews(scene, (*loaded)->stage.window, setup->wall);
        if (!views) return views.error();
        views->views.tiles = setup->tileMode;
        views->views.samples = setup->samples;
        views->views.colourPrecision = setup->colourPrecision.value_or(ColourPrecision::Half);
        auto report = (*cluster)->frame(scene, views->views, 0.0, true);
        if (!report) return report.error();
        tiles.take(std::move(report->tiles));
        log::info(fmt::format("{}: {}", arguments.scene, cell.label()));
        return assembleWall(setup->wall, tiles.all(), Eye::Mono).rgba;
    };
    const ShadowFitMode ownFit = scene.get(viewport).shadowFit;
    for (const Cell& cell : cellsOf(techniques)) {
        const auto technique = parseTechnique(cell.technique);
        if (!technique) return technique.error();
        scene.edit(viewport)
            .set<&Viewport::shadowMode>(technique->mode)
            .set<&Viewport::shadowFit>(technique->fit.value_or(ownFit))
            .set<&Viewport::gauss>(0.0f);
        for (const auto& [field, value] : cell.fields)
            if (const auto set = setField(scene, viewport, field, value); !set) return set.error();
        scene.edit(label).set<&TextForeground::text>(cell.label());
        auto picture = draw(cell, *technique);
        if (picture)
            pictures.push_back(std::move(*picture));
        else if (picture.error().kind == Error::Kind::BadInput)
            log::warning(fmt::format("{} is left out: {}", cell.label(), picture.error().message));
        else
            return picture.error();
    }
    return pictures;
}

// Every scene begins a row of its own. No scene has no picture: without shadows all can be drawn.
Result<void> writeSheet(const SheetArguments& arguments, const std::vector<std::vector<FloatImage>>& scenes) {
    const int width = scenes.front().front().width();
    const int height = scenes.front().front().height();
    int columns = 0, rows = 0;
    for (const std::vector<FloatImage>& pictures : scenes) {
        const auto count = static_cast<int>(pictures.size());
        columns = std::max(columns, std::min(arguments.columns, count));
        rows += (count + arguments.columns - 1) / arguments.columns;
    }
    const int sheetWidth = width * columns;
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(sheetWidth) * static_cast<std::size_t>(height * rows) * 3);
    const double step = 255.0 / (arguments.levels - 1);
    const auto place = [&](const FloatImage& picture, int left, int top) {
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (int channel = 0; channel < 3; ++channel) {
                    const int shown = displayByte(picture.pixel(x, y)[channel], 1.0);
                    const auto at = (static_cast<std::size_t>(top + y) * static_cast<std::size_t>(sheetWidth) +
                                     static_cast<std::size_t>(left + x)) *
                                        3 +
                                    static_cast<std::size_t>(channel);
                    bytes[at] = static_cast<std::uint8_t>(std::lround(std::round(shown / step) * step));
                }
    };
    int row = 0;
    for (const std::vector<FloatImage>& pictures : scenes) {
        for (std::size_t i = 0; i < pictures.size(); ++i)
            place(pictures[i], static_cast<int>(i) % arguments.columns * width,
                  (row + static_cast<int>(i) / arguments.columns) * height);
        row += (static_cast<int>(pictures.size()) + arguments.columns - 1) / arguments.columns;
    }
    return writePngBytes(arguments.out, sheetWidth, height * rows, 3, bytes);
}

}  // namespace

int runSheet(const SheetArguments& arguments, const std::filesystem::path& serverProgram) {
    if (arguments.scene.shadow != "none" && arguments.scene.shadow != "auto")
        return exitCodeOf(badInput("umbriel sheet draws every shadow mode: --shadow has no place"));
    if (!arguments.scene.stereo.empty() || !arguments.scene.environment.empty() || arguments.scene.latency != 0)
        return exitCodeOf(badInput("umbriel sheet: leave --stereo, --environment and --latency away"));
    if (std::filesystem::path(arguments.out).extension() != ".png")
        return exitCodeOf(badInput(fmt::format("--out '{}': the sheet is a .png", arguments.out)));
    if (arguments.columns < 1 || arguments.columns > 100)
        return exitCodeOf(badInput(fmt::format("--columns {}: expected 1 to 100", arguments.columns)));
    if (arguments.levels < 2 || arguments.levels > 256)
        return exitCodeOf(badInput(fmt::format("--levels {}: expected 2 to 256", arguments.levels)));
    const std::vector<std::string> techniques = listOf(arguments.techniques);
    for (const std::string& technique : techniques)
        if (const auto parsed = parseTechnique(technique); !parsed) return exitCodeOf(parsed.error());
    std::vector<std::string> scenes = {arguments.scene.scene};
    scenes.insert(scenes.end(), arguments.also.begin(), arguments.also.end());
    std::vector<std::vector<FloatImage>> pictures;
    for (const std::string& name : scenes) {
        SceneArguments scene = arguments.scene;
        scene.scene = name;
        scene.shadow = "none";  // not even what is stored for the scene
        auto drawn = drawAll(scene, techniques, serverProgram);
        if (!drawn) return exitCodeOf(drawn.error());
        pictures.push_back(std::move(*drawn));
    }
    if (const auto written = writeSheet(arguments, pictures); !written) return exitCodeOf(written.error());
    return 0;
}

}  // namespace umbriel
