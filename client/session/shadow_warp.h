#pragma once

#include "client/session/shadow_body.h"

namespace umbriel {

// Warps: homographies of the plane across the light that give near receivers more of the map. Each returns the identity
// where its technique has nothing to gain or to say; fitMap() makes a map of any of them. Light order, casters behind
// the viewer and depth are no concern of theirs (docs/shadows.md).

// Light-space perspective (Wimmer, Scherzer & Purgathofer 2004): w grows along the view's direction across the light,
// from 1 at the body's near end to 1 + d / n at its far end. The near distance n is the one for which the worst ratio
// of a texel's length to the eye's distance, over the body's corners, is smallest; when two corners decide, at both
// ends, that is the paper's n = d (z0 + sqrt(z0 z1)) / (z1 - z0). The corners of a body seen along the light make it
// infinite, without a threshold. request.lispFactor multiplies it: infinity is the uniform map, small values tend to
// the perspective shadow map.
glm::dmat3 lispWarp(const LightBody& body, const ShadowFitRequest& request);

// Trapezoid (Martin & Tan 2004): the first `range` of the body's length lambda across the light gets 80 % of the map,
// by a centre of projection at eta = lambda d' (1 + xi) / (lambda - 2 d' - lambda xi) before it, xi = -0.6, d' = range
// lambda. d' towards 0.8 lambda sends eta to infinity. Moved further back while the sides open wider than maxSideAngle
// (thesis 6.3.3), and when view and light grow parallel, where the paper's trapezoid does not exist (6.3.1).
glm::dmat3 trapezoidWarp(const LightBody& body, const ShadowFitRequest& request);

// Perspective shadow map (Stamminger & Drettakis 2002): the plane across the light as the light sees it after the
// perspective of a virtual camera around the body. The camera slides back from the eye until the plane at infinity lies
// beyond 1.5 and no ray of light to the body comes near that plane.
glm::dmat3 perspectiveWarp(const LightBody& body, const ShadowFitRequest& request);

}  // namespace umbriel
