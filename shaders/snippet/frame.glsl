// What is the same for everything drawn in one view. "Relative" is world axes with the origin at the view's eye.
layout(std140, binding = 0) uniform Frame {
    mat4 clipFromRelative;
    vec4 forward;       // unit, the way the view looks; w: 1 for an orthographic view
    vec4 shadowColour;  // rgb: what remains of a light in full shadow
    vec4 region;        // the viewport on the wall: x, y, width, height in pixels
    vec4 wallOrigin;    // xy: the wall pixel of this target's pixel (0, 0)
    vec4 fog;           // start, end, density
    vec4 fogColour;
} frame;

// Of the pixel's centre, in wall pixels. Never use gl_FragCoord itself: it is the tile's.
#define WALL_PIXEL (gl_FragCoord.xy + frame.wallOrigin.xy)
