#include "formula/goniometric.glsl"
#include "structs/light.glsl"

// Tables of all goniometric lights, one after the other: shares of the brightest direction, row by row.
layout(std430, binding = 5) readonly buffer PhotometricWebs { float webEntries[]; };

// The share of its brightest that a goniometric light radiates into a direction.
float webShare(GpuLight light, vec3 fromLight) {
    vec3 up = -light.direction;
    vec3 directionLight =
        vec3(dot(fromLight, light.axisX), dot(fromLight, cross(up, light.axisX)), dot(fromLight, up));
    WebPlace place = webPlace(directionLight, int(light.webColumns), int(light.webRows));
    uint row0 = light.webFirst + uint(place.row0) * light.webColumns;
    uint row1 = light.webFirst + uint(place.row1) * light.webColumns;
    return webIntensity(webEntries[row0 + uint(place.column0)], webEntries[row0 + uint(place.column1)],
                        webEntries[row1 + uint(place.column0)], webEntries[row1 + uint(place.column1)], place.across,
                        place.down);
}
