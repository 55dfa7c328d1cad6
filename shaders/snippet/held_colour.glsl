// What a target holds of a colour: no infinity where its largest number is small, as blending makes NaN of 0 times that.
vec3 heldColour(vec3 radiance) {
#ifdef HALF_COLOURS
    return min(radiance, vec3(65504.0));  // the largest 16-bit float
#else
    return radiance;
#endif
}
