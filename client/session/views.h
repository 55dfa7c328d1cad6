#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/aspect.h"
#include "common/scene/traversal.h"
#include "common/scene/windows.h"
#include "common/wall/view.h"

namespace umbriel {

// What servers need to draw a window, and what could not be done as the scene asks for it.
struct ResolvedViews {
    WallViews views;
    std::vector<std::string> warnings;  // for people, for example about lights without shadows; each once
};

// A viewport's rectangle on the wall. A corner's coordinate is a fraction of the wall when <= 1, pixels above;
// fractions are rounded to the nearest pixel, so viewports that share a border in fractions share it in pixels. Parts
// beyond the wall are not shown. An error for negative, infinite or crossed corners, and beyond kMaxWallSide pixels.
Result<PixelRect> resolveRegion(const Viewport& viewport, PixelSize wall);

// From the window's viewports to views, back to front, with the cameras resolved and the shadow maps fitted. Passive
// viewports, and those that cover no pixel of the wall, have no view; one without a scene and without a camera still
// has its background. Viewports with the same scene share their fits in mode Union, so that the eyes of a stereo pair
// see the same shadows. Errors name the viewport: impossible corners, cameras, and shadow modes that this version does
// not have.
//
// bounds: kept by the caller between frames, it saves looking at every vertex again.
Result<ResolvedViews> resolveViews(const Aspect& aspect, Ref<Window> window, PixelSize wall,
                                   GeometryBounds* bounds = nullptr);

}  // namespace umbriel
