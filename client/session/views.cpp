#include "client/session/views.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "client/session/camera.h"
#include "client/session/light_map_fit.h"
#include "client/session/light_view.h"
#include "client/session/receiver_range.h"
#include "client/session/shadow_fit.h"
#include "client/session/shadow_plane.h"
#include "common/scene/deformation.h"
#include "common/wall/grid.h"
#include "common/wall/shadow_show.h"

namespace umbriel {

namespace {

// What every OpenGL 4.5 driver has at least; larger maps come with maps drawn in parts.
constexpr std::uint32_t kMaxMapSize = 16384;

constexpr std::array<std::string_view, kEnumCount<ShadowMode>> kModeNames = {
    "none",  "std",   "psm",  "lisp",      "trapez",          "pcf",  "ppcf",          "planar", "planar-stencil",
    "zpass", "zfail", "blob", "light-map", "dual-paraboloid", "cube", "visibility-map"};

Error badViewport(const Viewport& viewport, const std::string& what) {
    return badInput(fmt::format(
        "viewport {}: {}",
        viewport.name->empty() ? fmt::format("#{}", viewport.id().value) : fmt::format("\"{}\"", viewport.name.get()),
        what));
}

// What the viewports with one scene have in common.
struct SceneFacts {
    Hierarchy hierarchy;
    Box3d bounds;
};

// Everything that decides about a set of fits but the views.
struct FitGroup {
    std::vector<std::size_t> views;
    const Viewport* viewport = nullptr;
};

std::vector<Ref<Node>> sorted(std::vector<Ref<Node>> nodes) {
    std::sort(nodes.begin(), nodes.end());
    return nodes;
}

bool sameShadows(const Viewport& a, const Viewport& b) {
    std::vector<std::string> messages;
    return a.root.get() == b.root.get() && a.mapSize.get() == b.mapSize.get() &&
           requestOf(a, a.mapSize, messages) == requestOf(b, b.mapSize, messages) &&
           sorted(a.lightNodes.toVector()) == sorted(b.lightNodes.toVector()) &&
           (a.shadowMode.get() != ShadowMode::LightMap ||
            sorted(a.excludeNodes.toVector()) == sorted(b.excludeNodes.toVector()));
}

// Whose volumes are made of both sides of every triangle. Nothing when all that casts is closed.
std::vector<std::string> openCasters(const Aspect& aspect, const Viewport& viewport, GeometryBounds& bounds) {
    const std::vector<Ref<Node>> excluded = viewport.excludeNodes.toVector();
    std::size_t open = 0;
    std::string first;
    traverse(aspect, viewport.root, std::nullopt, [&](const VisitedNode& visited) {
        if (std::find(excluded.begin(), excluded.end(), visited.ref) != excluded.end()) return Descend::No;
        const Geometry* geometry = nullptr;
        if (visited.core && isA<Geometry>(*visited.core)) geometry = static_cast<const Geometry*>(visited.core);
        if (visited.core && isA<DeformedGeometry>(*visited.core))
            geometry = aspect.find(static_cast<const DeformedGeometry*>(visited.core)->geometry.get());
        if (!geometry || bounds.isClosed(*geometry)) return Descend::Yes;
        if (open++ == 0) first = geometry->name->empty() ? visited.node.name.get() : geometry->name.get();
        return Descend::Yes;
    });
    if (open == 0) return {};
    return {fmt::format("shadow volumes: {} of what casts {} no closed surface{}; both sides of its triangles cast",
                        open, open == 1 ? "is" : "are", first.empty() ? "" : " (the first: \"" + first + "\")")};
}

void addOnce(std::vector<std::string>& messages, const std::vector<std::string>& more) {
    for (const std::string& message : more)
        if (std::find(messages.begin(), messages.end(), message) == messages.end()) messages.push_back(message);
}

// Puts what lights see in place of the views that show it. fits: by view, where they are not its own.
void showLights(const Aspect& aspect, const std::map<std::size_t, std::vector<ShadowFit>>& fits,
                ResolvedViews& result) {
    std::vector<View> views;
    for (std::size_t i = 0; i < result.views.views.size(); ++i) {
        View& view = result.views.views[i];
        const Viewport& viewport = *aspect.findAs<Viewport>(view.viewport);
        if (const std::string why = cannotShow(viewport.show, view.fits); !why.empty())
            addOnce(result.warnings, {"show: " + why});
        std::vector<ShadowFit> parts;
        if (viewport.show.get() == ShadowShow::LightView) {
            const auto found = fits.find(i);
            const std::vector<ShadowFit>& all = found == fits.end() ? view.fits : found->second;
            const auto light = shownLight(all, viewport.showLight);
            std::copy_if(all.begin(), all.end(), std::back_inserter(parts),
                         [&](const ShadowFit& fit) { return fit.light == light; });
        }
        if (parts.empty()) {
            views.push_back(std::move(view));
            continue;
        }
        for (View& part : lightViews(view, parts)) views.push_back(std::move(part));
    }
    result.views.views = std::move(views);
}

}  // namespace

Result<PixelRect> resolveRegion(const Viewport& viewport, PixelSize wall) {
    const auto edge = [](float coordinate, std::int32_t pixels) {
        const double value = coordinate;
        return std::floor((value <= 1.0 ? value * pixels : value) + 0.5);
    };
    const glm::vec2 lowerLeft = viewport.lowerLeft;
    const glm::vec2 upperRight = viewport.upperRight;
    for (const float coordinate : {lowerLeft.x, lowerLeft.y, upperRight.x, upperRight.y})
        if (!(coordinate >= 0.0f && coordinate <= static_cast<float>(kMaxWallSide)))
            return badViewport(viewport,
                               fmt::format("a corner coordinate of {}; it must be a fraction from 0 to 1, or up to "
                                           "{} pixels",
                                           coordinate, kMaxWallSide));
    const double left = edge(lowerLeft.x, wall.width), right = edge(upperRight.x, wall.width);
    const double bottom = edge(lowerLeft.y, wall.height), top = edge(upperRight.y, wall.height);
    // A viewport too small for a pixel of this wall is no error, one whose corners are crossed is.
    if (left > right || bottom > top || (lowerLeft == upperRight))
        return badViewport(viewport,
                           fmt::format("its lower left corner ({}, {}) is not below and left of its upper right "
                                       "corner ({}, {})",
                                       lowerLeft.x, lowerLeft.y, upperRight.x, upperRight.y));
    return PixelRect{static_cast<std::int32_t>(left), static_cast<std::int32_t>(bottom),
                     static_cast<std::int32_t>(right - left), static_cast<std::int32_t>(top - bottom)};
}

Result<ResolvedViews> resolveViews(const Aspect& aspect, Ref<Window> windowRef, PixelSize wall,
                                   GeometryBounds* bounds) {
    const auto size = checkedWallSize(wall.width, wall.height);
    if (!size) return size.error();
    const Window* window = aspect.find(windowRef);
    if (!window) return badInput("there is no window to show");

    GeometryBounds ownBounds;
    GeometryBounds& geometryBounds = bounds ? *bounds : ownBounds;
    ResolvedViews result;
    result.views.wall = wall;
    std::map<ContainerId, SceneFacts> scenes;
    std::vector<FitGroup> groups;
    for (const Ref<Viewport> viewportRef : window->viewports.toVector()) {
        const Viewport* viewport = aspect.find(viewportRef);
        if (!viewport || viewport->passive) continue;
        const auto region = resolveRegion(*viewport, wall);
        if (!region) return region.error();
        if (intersect(*region, {0, 0, wall.width, wall.height}).empty()) continue;

        const Ref<Node> root = viewport->root;
        auto facts = scenes.find(root);
        if (facts == scenes.end())
            facts = scenes.emplace(root, SceneFacts{Hierarchy(aspect, root), worldBounds(aspect, root, geometryBounds)})
                        .first;

        View view;
        view.region = *region;
        const bool onlyBackground = !aspect.find(root) && !viewport->camera.get();
        if (!onlyBackground) {
            const auto resolved =
                resolveCamera(aspect, viewport->camera, facts->second.hierarchy, *region, facts->second.bounds);
            if (!resolved) return badViewport(*viewport, resolved.error().message);
            view = *resolved;
        }
        view.viewport = viewportRef;

        const ShadowMode mode = viewport->shadowMode;
        if (mode != ShadowMode::None && !isFitted(mode))
            return badViewport(*viewport, fmt::format("this version has no shadow mode '{}'",
                                                      kModeNames[static_cast<std::size_t>(mode)]));
        if (mode != ShadowMode::None && viewport->shadowOn && !onlyBackground) {
            const auto group = std::find_if(groups.begin(), groups.end(), [&](const FitGroup& other) {
                return viewport->shadowFit.get() != ShadowFitMode::PerView && sameShadows(*other.viewport, *viewport);
            });
            if (group == groups.end())
                groups.push_back({{result.views.views.size()}, viewport});
            else
                group->views.push_back(result.views.views.size());
        }
        result.views.views.push_back(std::move(view));
    }

    std::map<std::size_t, std::vector<ShadowFit>> shown;  // by view, where it is not the view's own fits
    for (const FitGroup& group : groups) {
        const Viewport& viewport = *group.viewport;
        const SceneFacts& facts = scenes.at(viewport.root.get());
        std::vector<View> seen;
        for (std::size_t index : group.views) seen.push_back(result.views.views[index]);
        std::vector<std::string> messages;
        const std::uint32_t mapSize = resolveMapSize(viewport.mapSize, wall, kMaxMapSize, messages);
        ShadowFitRequest request = requestOf(viewport, mapSize, messages);
        const auto lights = lightsInEffect(aspect, viewport.root, facts.hierarchy, viewport.lightNodes.toVector());
        if (isPlanar(request.mode) && request.planeWorld != glm::dvec4(0.0) && !facts.bounds.empty() &&
            !touches(request.planeWorld, facts.bounds)) {
            messages.push_back(
                "shadows: the plane that planeNormal and planeOffset name misses the scene; the plane is found "
                "instead");
            request.planeWorld = glm::dvec4(0.0);
        }
        request.planeWorld = towardsLights(request.planeWorld, lights);
        if (isPlanar(request.mode) && request.planeWorld == glm::dvec4(0.0)) {
            const auto plane = largestLitPlane(aspect, viewport.root, facts.bounds, lights);
            request.planeWorld = plane.value_or(glm::dvec4(0.0));
            if (!plane && !facts.bounds.empty())
                messages.push_back(
                    "shadows: no flat face of the scene is lit, so planar shadows have no plane to fall "
                    "on; name one (planeNormal, planeOffset)");
        }
        if (request.mode == ShadowMode::VolumeZPass || request.mode == ShadowMode::VolumeZFail)
            addOnce(messages, openCasters(aspect, viewport, geometryBounds));
        addOnce(result.warnings, messages);
        ShadowFits fits;
        if (request.mode == ShadowMode::LightMap) {
            const LightMapUse use = useLightMap(aspect, viewport, facts.hierarchy);
            addOnce(result.warnings, use.messages);
            fits = fitWithLightMap(aspect, lights, facts.hierarchy, facts.bounds, seen, request, use);
        } else {
            std::vector<ReceiverRange> receivers;
            if (request.tight) receivers = receiverRanges(partBounds(aspect, viewport.root, geometryBounds), seen);
            fits = fitShadows(aspect, lights, facts.bounds, seen, request, receivers);
        }
        addOnce(result.warnings, fits.messages);
        for (std::size_t index : group.views) {
            result.views.views[index].fits = fits.fits;
            ShadowFitRequest projective = request;
            projective.mode = projectiveMode(request.mode);
            if (aspect.findAs<Viewport>(result.views.views[index].viewport)->show.get() != ShadowShow::LightView ||
                projective.mode == request.mode)
                continue;
            projective.map = ShadowMode::Standard;
            shown[index] = fitShadows(aspect, lights, facts.bounds, seen, projective).fits;
        }
    }
    showLights(aspect, shown, result);
    geometryBounds.sweep();
    return result;
}

}  // namespace umbriel
