layout(location = 2) uniform vec2 count;  // what a face adds: x one that is seen from outside, y from inside
layout(location = 0) out float darknessOut;

void main() {
    darknessOut = gl_FrontFacing ? count.x : count.y;
}
