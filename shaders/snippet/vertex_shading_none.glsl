// Shading in pixels: nothing to do for a vertex.
void shadeVertex() {}
