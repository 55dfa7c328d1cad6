#pragma once

#include "client/session/shadow_body.h"

namespace umbriel {

// Warps: homographies of the plane across the light that give near receivers more of the map. Each returns the identity
// where its technique has nothing to gain or to say; fitMap() makes a map of any of them. Light order, casters behind
// the viewer and depth are no concern of theirs (docs/shadows.md).

// Light-space perspective (Wimmer, Scherzer & Purgathofer 2004): w grows across the light, from 1 at the body's near
// end to 1 + d / n at its far end, in the direction in which what is seen there gets farther from the eye. The paper
// takes the view's own direction and the depths z0 and z1 of both ends, for which n = d (z0 + sqrt(z0 z1)) / (z1 - z0)
// makes the texels of both equally long on the picture, and their mean as short as can be. Here the mean goes over all
// body.places; of two ends alone it has the same n. Where depth has no direction across the light n is infinite, and on
// the way there the warp fades out. request.lispFactor multiplies n: infinity is the uniform map, small values tend to
// the perspective shadow map.
glm::dmat3 lispWarp(const LightBody& body, const ShadowFitRequest& request);

// Trapezoid (Martin & Tan 2004): the first `range` of the body's length lambda across the light gets 80 % of the map,
// by a centre of projection at eta = lambda d' (1 + xi) / (lambda - 2 d' - lambda xi) before it, xi = -0.6, d' = range
// lambda. d' towards 0.8 lambda sends eta to infinity. Moved further back while the sides open wider than maxSideAngle
// (thesis 6.3.3), and when view and light grow parallel, where the paper's trapezoid does not exist (6.3.1). Its axis
// is that of lispWarp().
glm::dmat3 trapezoidWarp(const LightBody& body, const ShadowFitRequest& request);

// Perspective shadow map (Stamminger & Drettakis 2002): the plane across the light as the light sees it after the
// perspective of a virtual camera around the body. The camera slides back from the eye until the plane at infinity lies
// beyond 1.5 and no ray of light to the body comes near that plane.
glm::dmat3 perspectiveWarp(const LightBody& body, const ShadowFitRequest& request);

}  // namespace umbriel
