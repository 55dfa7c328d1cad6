// Casters on a paraboloid map; relative is in the light's frame, which looks along -z.
layout(location = 1) uniform vec4 hemisphere;  // places per unit of the paraboloid's plane, near, far (metres), map size

vec4 onHemisphere(vec3 relative) {
    float far = length(relative);
    vec3 d = relative / max(far, 1e-30);
    // At the pole behind, where the plane is infinite, only something finite is needed: it is clipped.
    vec2 place = d.xy / max(1.0 - d.z, 1e-3) * hemisphere.x;
    float depth = (hemisphere.z - far) / (hemisphere.z - hemisphere.y);
    return vec4(place, depth, 1.0);
}

// A little of the other half stays, for the texels around the rim.
float hemisphereClip(vec3 relative) { return 0.05 * length(relative) - relative.z; }
