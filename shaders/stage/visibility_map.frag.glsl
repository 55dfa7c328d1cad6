// Blocked pixels of visibility maps.
layout(location = 0) out float blocked;
#ifdef FEATURE_FAR
in vec3 fromOrigin;
layout(location = 0) uniform float farDistance;
#endif

void main() {
#ifdef FEATURE_FAR
    if (dot(fromOrigin, fromOrigin) > farDistance * farDistance) discard;
#endif
    blocked = 1.0;
}
