// The words of the shared subset (README.md), as GLSL. formula_cpp.h says the same in C++.
#define Real float
#define Vec2 vec2
#define Vec3 vec3
#define REAL(x) x
#define FORMULA_FN
#define FORMULA_CONST const
#define OUT(T) out T
