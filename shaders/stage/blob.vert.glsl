// The body that a blob can darken: a box around the object, drawn out away from the light.
#include "snippet/frame.glsl"
layout(location = 0) in vec4 relative;  // w 0: at infinity
layout(location = 1) in uint blobIndex;
flat out uint blob;

void main() {
    blob = blobIndex;
    gl_Position = frame.clipFromRelative * relative;
}
