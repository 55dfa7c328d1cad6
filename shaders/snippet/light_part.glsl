// Which record of a light with several parts a surface falls into, counted from the light's first.

// Of a cube, by the largest component of the way from the light; ties go to x, then y.
uint cubeFaceOf(vec3 fromLight) {
    vec3 a = abs(fromLight);
    return a.x >= a.y && a.x >= a.z ? (fromLight.x >= 0.0 ? 0u : 1u)
           : a.y >= a.z             ? (fromLight.y >= 0.0 ? 2u : 3u)
                                    : (fromLight.z >= 0.0 ? 4u : 5u);
}

uint hemisphereOf(vec3 fromLight, vec3 axisZ) { return dot(fromLight, axisZ) <= 0.0 ? 0u : 1u; }
