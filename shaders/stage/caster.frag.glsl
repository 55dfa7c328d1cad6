// Only casters with holes have a fragment stage.
#define VARYING in
#include "snippet/caster_holes.glsl"

void main() {
    if (isHole()) discard;
}
