#include "formula/shadow.glsl"
#include "structs/blob.glsl"
#include "snippet/view_images.glsl"
layout(std430, binding = 3) readonly buffer Blobs { GpuBlob blobs[]; };
layout(binding = 15) uniform VIEW_IMAGE positions;
flat in uint blob;
layout(location = 0) out float darknessOut;

void main() {
    vec4 surface = texelFetch(positions, ivec2(gl_FragCoord.xy), SAMPLE_INDEX);
    if (surface.w == 0.0) discard;
    GpuBlob own = blobs[blob];
    vec3 inBox = vec3(dot(own.boxFromX, surface), dot(own.boxFromY, surface), dot(own.boxFromZ, surface));
    if (all(lessThanEqual(abs(inBox), vec3(1.001)))) discard;
    // Along the ray through the blob's centre, from the light.
    vec3 fromLight = own.centre * own.light.w - own.light.xyz;
    float reach = length(fromLight);
    vec3 along = fromLight / reach;
    vec3 fromCentre = surface.xyz - own.centre;
    float beyond = dot(fromCentre, along);
    float growth = own.light.w > 0.5 ? 1.0 + beyond / reach : 1.0;
    if (beyond <= 0.0) discard;
    darknessOut = blobDarkness(length(fromCentre - beyond * along) / (own.radius * growth));
}
