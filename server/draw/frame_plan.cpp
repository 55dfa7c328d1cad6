#include "server/draw/frame_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/draw/colour_format.h"

namespace umbriel {
namespace {

struct FeatureName {
    const char* define;
    const char* name;
};
constexpr FeatureName kNames[kFeatureCount] = {
    {"FEATURE_VERTEX_NORMALS", "normals"},
    {"FEATURE_VERTEX_TANGENTS", "tangents"},
    {"FEATURE_VERTEX_COLOURS", "colours"},
    {"FEATURE_TEX_COORDS0", "uv0"},
    {"FEATURE_TEX_COORDS1", "uv1"},
    {"FEATURE_BASE_COLOUR_TEXTURE", "base-colour-map"},
    {"FEATURE_METALLIC_ROUGHNESS_TEXTURE", "metallic-roughness-map"},
    {"FEATURE_NORMAL_TEXTURE", "normal-map"},
    {"FEATURE_OCCLUSION_TEXTURE", "occlusion-map"},
    {"FEATURE_EMISSION_TEXTURE", "emission-map"},
    {"FEATURE_SPECULAR_TEXTURE", "specular-map"},
    {"FEATURE_METALLIC_ROUGHNESS", "metallic-roughness"},
    {"FEATURE_BLINN_PHONG", "blinn-phong"},
    {"FEATURE_LAMBERT", "lambert"},
    {"FEATURE_PHONG", "phong"},
    {"FEATURE_PHONG_GATED", "phong-gated"},
    {"FEATURE_SCHLICK", "schlick"},
    {"FEATURE_NORMALISED_PHONG", "normalised-phong"},
    {"FEATURE_PHONG_BRDF", "phong-brdf"},
    {"FEATURE_TORRANCE_SPARROW", "torrance-sparrow"},
    {"FEATURE_LAFORTUNE", "lafortune"},
    {"FEATURE_PHONG_ORIGINAL", "phong-original"},
    {"FEATURE_GENERAL_SUM", "general-sum"},
    {"FEATURE_OPENGL_SUM", "opengl-sum"},
    {"FEATURE_EMISSION", "emission"},
    {"FEATURE_MATT", "matt"},
    {"FEATURE_ALPHA_MASK", "alpha-mask"},
    {"FEATURE_ALPHA_BLEND", "alpha-blend"},
    {"FEATURE_DOUBLE_SIDED", "double-sided"},
    {"FEATURE_AMBIENT_LIGHTS", "ambient"},
    {"FEATURE_DIRECTIONAL_LIGHTS", "directional"},
    {"FEATURE_POINT_LIGHTS", "point"},
    {"FEATURE_SPOT_LIGHTS", "spot"},
    {"FEATURE_GONIOMETRIC_LIGHTS", "goniometric"},
    {"FEATURE_SPOT_EXPONENTS", "spot-exponent"},
    {"FEATURE_ARTIST_ATTENUATION", "attenuation"},
    {"FEATURE_LIGHT_AMBIENT", "light-ambient"},
    {"FEATURE_LIGHT_HIGHLIGHTS", "light-highlights"},
    {"FEATURE_VERTEX_SHADING", "vertex-shading"},
    {"FEATURE_VERTEX_TABLE", "vertex-table"},
    {"FEATURE_FLAT_SHADING", "flat"},
    {"FEATURE_FLAT_MEAN", "flat-mean"},
    {"FEATURE_FOG_LINEAR", "linear-fog"},
    {"FEATURE_FOG_QUADRATIC", "quadratic-fog"},
    {"FEATURE_FOG_EXPONENTIAL", "exponential-fog"},
    {"FEATURE_FOG_SQUARED_EXPONENTIAL", "squared-exponential-fog"},
    {"FEATURE_ENVIRONMENT", "environment"},
    {"FEATURE_ORTHOGRAPHIC", "orthographic"},
    {"FEATURE_UNWRAPPED", "unwrapped"},
    {"FEATURE_WORLD_AXES", "world-axes"},
    {"FEATURE_FIRST_VERTEX_NORMALS", "first-vertex-normals"},
    {"FEATURE_SHADOW_COLOUR", "shadow-colour"},
    {"FEATURE_ONE_LIGHT", "1-light"},
    {"FEATURE_TWO_LIGHTS", "2-lights"},
    {"FEATURE_THREE_LIGHTS", "3-lights"},
    {"FEATURE_FOUR_LIGHTS", "4-lights"},
    {"FEATURE_PASSED_CONSTANTS", "passed-constants"},
    {"FEATURE_FOREIGN_SHADING", "foreign"},
    {"FEATURE_SHADOWS", "shadows"},
    {"FEATURE_SHADOW_WARP", "warped-maps"},
    {"FEATURE_SHADOW_PERSPECTIVE", "perspective-maps"},
    {"FEATURE_SHADOW_CUBE", "cube-maps"},
    {"FEATURE_SHADOW_HEMISPHERES", "paraboloid-maps"},
    {"FEATURE_SHADOW_FILTER", "filtered-maps"},
    {"FEATURE_SHADOW_SOFT_FILTER", "contact-hardening"},
    {"FEATURE_SHADOW_NEAREST_BLOCKER", "nearest-blocker"},
    {"FEATURE_SHADOW_BILINEAR", "bilinear-samples"},
    {"FEATURE_SHADOW_SKIP", "skipped-samples"},
    {"FEATURE_SHADOW_BOUNDS", "map-bounds"},
    {"FEATURE_SHADOW_VIEW", "view-shadows"},
    {"FEATURE_SHADOW_LIGHT_MAP", "light-map"},
    {"FEATURE_SHADOW_LIGHT_MAP_PAGES", "light-map-pages"},
    {"FEATURE_SHADOW_MIXED", "light-map-beside-maps"},
    {"FEATURE_SHADOW_COPY", "map-copies"},
    {"FEATURE_SHADOW_FILTER_6", "filter-6x6"},
    {"FEATURE_SHADOW_FILTER_8", "filter-8x8"},
    {"FEATURE_SHADOW_SEARCH_6", "search-6x6"},
};

const char* nameOf(PassKind kind) {
    switch (kind) {
        case PassKind::Deform:
            return "deform";
        case PassKind::ShadowMap:
            return "shadow-map";
        case PassKind::Darkness:
            return "darkness";
        case PassKind::Factors:
            return "factors";
        case PassKind::Edges:
            return "edges";
        case PassKind::Gauss:
            return "gauss";
        case PassKind::Seen:
            return "seen";
        case PassKind::Show:
            return "show";
        case PassKind::Background:
            return "background";
        case PassKind::Surfaces:
            return "surfaces";
        case PassKind::Blend:
            return "blend";
        case PassKind::Foreground:
            return "foreground";
        case PassKind::Resolve:
            return "resolve";
        case PassKind::Layers:
            return "layers";
    }
    return "";
}

const char* nameOf(BackgroundKind kind) {
    switch (kind) {
        case BackgroundKind::None:
            return "none";
        case BackgroundKind::Colour:
            return "colour";
        case BackgroundKind::Gradient:
            return "gradient";
        case BackgroundKind::Image:
            return "image";
        case BackgroundKind::Environment:
            return "environment";
    }
    return "";
}

const char* nameOf(ShadowCasters among) {
    switch (among) {
        case ShadowCasters::All:
            return "";
        case ShadowCasters::Fixed:
            return " in the light map";
        case ShadowCasters::Moving:
            return " not in the light map";
    }
    return "";
}

std::uint32_t countIf(const ViewDemand& demand, bool blend) {
    std::uint32_t count = 0;
    for (const auto& [features, items] : demand.surfaces)
        if (has(features, Feature::AlphaBlend) == blend) count += items;
    return count;
}

std::string bytesText(std::uint64_t bytes) {
    if (bytes < 10 * 1024) return fmt::format("{} B", bytes);
    if (bytes < 10 * 1024 * 1024) return fmt::format("{:.1f} KiB", static_cast<double>(bytes) / 1024.0);
    return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / (1024.0 * 1024.0));
}

class Planner {
 public:
    Planner(const WallViews& views, const std::vector<ViewDemand>& demands, std::span<const TileAssignment> tiles)
        : _views(views), _demands(demands), _tiles(tiles) {}

    Result<FramePlan> plan(std::uint32_t factorLights, std::int32_t limit) {
        if (_views.wall.width > kBlockPixels || _views.wall.height > kBlockPixels) _plan.apron = apronOf(_demands);
        const PixelSize work = workSizeOf(_views, _plan.apron);
        if (_views.tiles == TileMode::Exact) {
            if (work.width > limit || work.height > limit)
                return badInput(
                    fmt::format("--tiles exact needs a target of the whole wall, {}x{} pixels ({} at {} sample(s)), "
                                "and this driver "
                                "allows {}; use --tiles offset",
                                work.width, work.height,
                                bytesText(std::uint64_t(work.width) * std::uint64_t(work.height) *
                                          (_colour.pixelBytes + 4) * _views.samples),
                                _views.samples, limit));
        }
        for (std::uint32_t i = 0; i < _demands.size(); ++i) {
            const ViewDemand::Deformed& deformed = _demands[i].deformed;
            if (deformed.geometries == 0) continue;
            add({PassKind::Deform, i, 0, 0, "vertices",
                 fmt::format("{} geometries, {} vertices, {} joints, {} morph targets", deformed.geometries,
                             deformed.vertices, deformed.joints, deformed.morphTargets)});
        }
        for (std::uint32_t i = 0; i < _demands.size(); ++i) {
            planShadows(i);
            planSeen(i);
        }
        addTarget("colour", _colour.name, work, 1, _views.samples, _colour.pixelBytes);
        addTarget("depth", "D32F", work, 1, _views.samples, 4);
        for (std::uint32_t i = 0; i < _demands.size(); ++i) planView(i);
        std::uint32_t layers = 0;
        for (const auto& [view, count] : _darkLayers) layers = std::max(layers, count);
        addTarget("darkness", "R32F", layers > 0 ? work : PixelSize{}, layers, _views.samples, 4);
        const auto sizeIf = [&](bool needed) { return needed ? work : PixelSize{}; };
        addTarget("darkness depth", "D32F", sizeIf(layers > 0 || _surfaces), 1, _views.samples, 4);
        addTarget("darkness positions", "RGBA32F", sizeIf(_darkPositions || _surfaces), 1, _views.samples, 16);
        addTarget("darkness normals", "RGBA16F", sizeIf(_surfaces), 1, _views.samples, 8);
        addTarget("edges", "R8", sizeIf(_edges), 1, _views.samples, 1);
        addTarget("gauss", "R32F", sizeIf(_filter), 1, _views.samples, 4);
        if (_views.samples > 1)
            add({PassKind::Resolve, 0, 0, 0, "tile colour", fmt::format("{} samples", _views.samples)});
        if (!isDrawnInPlace(_views, _tiles))
            addTarget("tile colour", _colour.name, largestTile(), static_cast<std::uint32_t>(_tiles.size()), 1,
                      _colour.pixelBytes);
        planLayers(work, factorLights);
        for (const PlannedTarget& target : _plan.targets) _plan.bytes += target.bytes;
        return std::move(_plan);
    }

 private:
    PixelSize largestTile() const {
        PixelSize size;
        for (const TileAssignment& tile : _tiles) {
            size.width = std::max(size.width, tile.pixels.width);
            size.height = std::max(size.height, tile.pixels.height);
        }
        return size;
    }
    void add(PlannedPass pass) { _plan.passes.push_back(std::move(pass)); }
    void addTarget(std::string name, std::string format, PixelSize size, std::uint32_t count, std::uint32_t samples,
                   std::uint64_t bytesPerTexel) {
        const std::uint64_t bytes =
            std::uint64_t(size.width) * std::uint64_t(size.height) * count * samples * bytesPerTexel;
        if (bytes > 0) _plan.targets.push_back({std::move(name), std::move(format), size, count, samples, bytes});
    }

    void planShadows(std::uint32_t view) {
        const ViewDemand& demand = _demands[view];
        std::uint32_t largest = 0;
        std::uint32_t block = 0;
        std::uint32_t maps = 0;
        if (demand.lightMap.size > 0)
            _plan.targets.push_back(
                {fmt::format("light map {}", view),
                 "R8 and charts",
                 {static_cast<std::int32_t>(demand.lightMap.size), static_cast<std::int32_t>(demand.lightMap.size)},
                 demand.lightMap.lights,
                 1,
                 demand.lightMap.bytes});
        for (std::uint32_t i = 0; i < demand.shadows.size(); ++i) {
            const ViewDemand::Shadow& shadow = demand.shadows[i];
            const ShadowDemand& wanted = shadow.demand;
            if (wanted.mapTexels == 0) continue;
            ++maps;
            largest = std::max(largest, wanted.mapTexels);
            block = std::max(block, wanted.boundsBlock);
            add({PassKind::ShadowMap, view, i, 0, fmt::format("shadow maps {}", view),
                 fmt::format("{}: {}{}{}, {} texels, {} casters{}{}", shadow.light, wanted.module,
                             wanted.part.empty() ? "" : " ", wanted.part, wanted.mapTexels, shadow.casters,
                             shadow.maskedCasters ? fmt::format(" ({} cut out)", shadow.maskedCasters) : "",
                             nameOf(shadow.among))});
        }
        if (largest > 0)
            addTarget(fmt::format("shadow maps {}", view), "D32F",
                      {static_cast<std::int32_t>(largest), static_cast<std::int32_t>(largest)}, maps, 1, 4);
        if (largest > 0 && demand.copiedMaps)
            addTarget(fmt::format("shadow map copies {}", view), "R32F buffer",
                      {static_cast<std::int32_t>(largest), static_cast<std::int32_t>(largest)}, maps, 1, 4);
        if (block > 0) {
            const auto blocks = static_cast<std::int32_t>((largest + block - 1) / block);
            addTarget(fmt::format("shadow bounds {}", view), "RGBA32F", {blocks, blocks}, maps, 1, 16);
            const auto tiles = static_cast<std::int32_t>((largest + 1) / 4 + 1);
            addTarget(fmt::format("shadow tiles {}", view), "RGBA32F", {tiles, tiles}, 1, 1, 16);
        }
    }

    // Shadows that are made in the view.
    void planDarkness(std::uint32_t view) {
        const ViewDemand& demand = _demands[view];
        std::string lights;
        for (const ViewDemand::Shadow& shadow : demand.shadows) {
            if (!shadow.demand.inView) continue;
            lights += fmt::format("{}{}: {}, {} casters", lights.empty() ? "" : "; ", shadow.light,
                                  shadow.demand.module, shadow.casters);
            ++_darkLayers[view];
            _darkPositions = _darkPositions || shadow.demand.positions;
        }
        if (!lights.empty()) add({PassKind::Darkness, view, 0, 0, "darkness", lights});
        planScreen(view, !lights.empty());
    }

    // Factors of maps, and the filter over all that was made in the view.
    void planScreen(std::uint32_t view, bool inView) {
        const ViewDemand& demand = _demands[view];
        const ScreenShadow& screen = demand.screen;
        const auto lights = static_cast<std::uint32_t>(demand.darkLights.size());
        if (screen.factors && !inView && lights > 0) {
            std::string names;
            for (const std::string& light : demand.darkLights) names += (names.empty() ? "" : ", ") + light;
            add({PassKind::Factors, view, 0, 0, "darkness",
                 fmt::format("{}: {} items", names, countIf(demand, false))});
            _darkLayers[view] = lights;
        }
        const std::uint32_t layers = _darkLayers[view];
        _surfaces = _surfaces || screen.surfaces;
        if (screen.edges) {
            add({PassKind::Edges, view, layers > 0 ? 0u : 1u, 1, "edges",
                 fmt::format("beyond {} of the distance", screen.edgeThreshold)});
            _edges = true;
        }
        if (!(screen.radius > 0.0f) || layers == 0) return;
        add({PassKind::Gauss, view, 0, screen.reach(), "darkness",
             fmt::format("{} lights, radius {} px{}", layers, screen.radius, screen.edges ? "" : ", across edges")});
        _filter = true;
    }

    // Drawn once a frame, over the whole wall.
    void planSeen(std::uint32_t view) {
        const ViewDemand& demand = _demands[view];
        if (demand.show != ShadowShow::SeenArea || demand.shownTexels == 0) return;
        const auto side = static_cast<std::int32_t>(demand.shownTexels);
        add({PassKind::Seen, view, 0, 0, "seen", demand.shownLight});
        addTarget(fmt::format("seen {}", view), "R8", {side, side}, demand.shownParts, 1, 1);
    }

    void planView(std::uint32_t view) {
        const ViewDemand& demand = _demands[view];
        if (demand.unwrapped) return;
        planDarkness(view);
        if (isOverlay(demand.show)) {
            constexpr const char* kShows[kEnumCount<ShadowShow>] = {
                "picture", "light-view", "shadow-map", "color-map", "factor-map", "edge-map", "seen-area"};
            add({PassKind::Show, view, 0, 0, "colour",
                 fmt::format("{} {}", kShows[static_cast<std::uint32_t>(demand.show)], demand.shownLight)});
            if (demand.foregrounds > 0)
                add({PassKind::Foreground, view, 0, 0, "colour", fmt::format("{} items", demand.foregrounds)});
            return;
        }
        for (const auto& [features, count] : demand.surfaces) _plan.variants[features] += count;
        if (demand.background != BackgroundKind::None)
            add({PassKind::Background, view, 0, 0, "colour", nameOf(demand.background)});
        if (const std::uint32_t count = countIf(demand, false))
            add({PassKind::Surfaces, view, 0, 0, "colour, depth",
                 fmt::format("{} items, {} lights", count, demand.lights)});
        if (const std::uint32_t count = countIf(demand, true))
            add({PassKind::Blend, view, 0, 0, "colour, depth", fmt::format("{} items, back to front", count)});
        if (demand.foregrounds > 0)
            add({PassKind::Foreground, view, 0, 0, "colour", fmt::format("{} items", demand.foregrounds)});
    }

    void planLayers(PixelSize work, std::uint32_t lights) {
        const auto wants = [&](Layer layer) { return (_views.layers & static_cast<std::uint32_t>(layer)) != 0; };
        std::string names;
        std::uint64_t perTexel = 0;
        const auto layer = [&](Layer which, const char* name, std::uint64_t bytes) {
            if (!wants(which)) return;
            names += names.empty() ? name : std::string(", ") + name;
            perTexel += bytes;
        };
        layer(Layer::Depth, "depth", 4);
        layer(Layer::Position, "position", 16);
        layer(Layer::Normal, "normal", 16);
        layer(Layer::Ids, "ids", 8);
        const bool factors = wants(Layer::LightFactors) && lights > 0;
        if (names.empty() && !factors) return;
        if (!names.empty()) addTarget("layers", names, work, 1, 1, perTexel);
        if (factors)
            addTarget("light factors", "RGBA32F", work, (std::min(lights, kFactorLayersPerPass) + 3) / 4, 1, 16);
        if (_views.samples > 1) addTarget("layer depth", "D32F", work, 1, 1, 4);
        for (std::uint32_t view = 0; view < _demands.size(); ++view) {
            if (countIf(_demands[view], false) == 0) continue;
            if (!names.empty()) add({PassKind::Layers, view, kNoFactors, 0, "layers", names + ", 1 sample"});
            if (!factors) continue;
            for (std::uint32_t first = 0; first < lights; first += kFactorLayersPerPass)
                add({PassKind::Layers, view, first, 0, "light factors",
                     fmt::format("lights {}..{}", first, std::min(first + kFactorLayersPerPass, lights) - 1)});
        }
    }

    const WallViews& _views;
    const ColourFormat _colour = colourFormatOf(_views.colourPrecision);
    const std::vector<ViewDemand>& _demands;
    std::span<const TileAssignment> _tiles;
    FramePlan _plan;
    std::map<std::uint32_t, std::uint32_t> _darkLayers;  // by view
    bool _darkPositions = false;
    bool _surfaces = false;
    bool _edges = false;
    bool _filter = false;
};

}  // namespace

const char* defineOf(Feature feature) {
    return kNames[static_cast<std::uint32_t>(feature)].define;
}

std::string describe(FeatureSet set) {
    std::string text;
    for (std::uint32_t i = 0; i < kFeatureCount; ++i)
        if (has(set, static_cast<Feature>(i))) text += (text.empty() ? "" : " ") + std::string(kNames[i].name);
    return text.empty() ? "plain" : text;
}

std::int32_t FramePlan::reachOf(std::uint32_t view) const {
    std::int32_t reach = 0;
    for (const PlannedPass& pass : passes)
        if (pass.view == view) reach = std::max(reach, pass.reach);
    return reach;
}

bool FramePlan::hasPass(PassKind kind) const {
    return std::any_of(passes.begin(), passes.end(), [&](const PlannedPass& pass) { return pass.kind == kind; });
}

std::string FramePlan::explain() const {
    std::string text = fmt::format("passes: {}\n", passes.size());
    for (const PlannedPass& pass : passes)
        text += fmt::format("  view {} {:<11} reach {} px -> {}: {}\n", pass.view, nameOf(pass.kind), pass.reach,
                            pass.target, pass.detail);
    text += fmt::format("targets: {} ({})\n", targets.size(), bytesText(bytes));
    for (const PlannedTarget& target : targets)
        text +=
            fmt::format("  {}: {} {}x{}{}{} {}\n", target.name, target.format, target.size.width, target.size.height,
                        target.count > 1 ? fmt::format(" x{}", target.count) : "",
                        target.samples > 1 ? fmt::format(" {} samples", target.samples) : "", bytesText(target.bytes));
    text += fmt::format("shader variants: {}\n", variants.size());
    for (const auto& [features, items] : variants) text += fmt::format("  {} items: {}\n", items, describe(features));
    return text;
}

std::int32_t apronOf(const std::vector<ViewDemand>& demands) {
    std::int32_t reach = 0;
    for (const ViewDemand& demand : demands) reach = std::max(reach, demand.screen.reach());
    return (reach + 1) / 2 * 2;
}

PixelSize workSizeOf(const WallViews& views, std::int32_t apron) {
    if (views.tiles == TileMode::Exact) return views.wall;
    return {std::min(views.wall.width, kBlockPixels) + 2 * apron,
            std::min(views.wall.height, kBlockPixels) + 2 * apron};
}

bool isDrawnInPlace(const WallViews& views, std::span<const TileAssignment> tiles) {
    if (tiles.size() != 1 || views.samples > 1) return false;
    if (views.tiles == TileMode::Exact) return true;
    const PixelRect& pixels = tiles.front().pixels;
    return pixels.x / kBlockPixels == (pixels.x + pixels.width - 1) / kBlockPixels &&
           pixels.y / kBlockPixels == (pixels.y + pixels.height - 1) / kBlockPixels;
}

Result<FramePlan> planFrame(const WallViews& views, const std::vector<ViewDemand>& demands,
                            std::span<const TileAssignment> tiles, std::uint32_t factorLights, std::int32_t limit) {
    return Planner(views, demands, tiles).plan(factorLights, limit);
}

}  // namespace umbriel
