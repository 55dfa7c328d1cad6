#include "formula/fog.glsl"
#include "snippet/frame.glsl"

#if defined(FEATURE_FOG_LINEAR)
#define FOG_SHARE(meters) fogLinear(meters, frame.fog.x, frame.fog.y)
#elif defined(FEATURE_FOG_QUADRATIC)
#define FOG_SHARE(meters) fogQuadratic(meters, frame.fog.x, frame.fog.y)
#elif defined(FEATURE_FOG_EXPONENTIAL)
#define FOG_SHARE(meters) fogExponential(meters, frame.fog.z)
#elif defined(FEATURE_FOG_SQUARED_EXPONENTIAL)
#define FOG_SHARE(meters) fogSquaredExponential(meters, frame.fog.z)
#endif

// A surface's radiance as it arrives at the eye. relative: eye-relative, metres.
vec3 throughFog(vec3 radiance, vec3 relative) {
#ifdef FOG_SHARE
    return fogMixed(radiance, frame.fogColour.rgb, FOG_SHARE(lengthOf(relative)));
#else
    return radiance;
#endif
}
