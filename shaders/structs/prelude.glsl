// The C++ compiler checks the layout (structs_cpp.h); GLSL's is fixed by std140 and std430.
#define LAYOUT_SIZE(Type, bytes)
#define LAYOUT_OFFSET(Type, member, bytes)
