#pragma once

#include <string>
#include <vector>

#include "common/wall/view.h"

namespace umbriel {

// What a light sees of the scene, in place of a view: a view for each part of the light's map (fits of its light, in
// order), projected as the map is, warp and all, and laid out as showLayoutOf() says within the view's region.
// Viewport, eye and fits stay the view's.
std::vector<View> lightViews(const View& view, const std::vector<ShadowFit>& fits);

// Fits as light views need them: of modules whose maps no projection makes, those of a module whose maps one does.
ShadowMode projectiveMode(ShadowMode mode);

// What cannot be shown with these shadows, for people; empty: all of it can.
std::string cannotShow(ShadowShow show, const std::vector<ShadowFit>& fits);

}  // namespace umbriel
