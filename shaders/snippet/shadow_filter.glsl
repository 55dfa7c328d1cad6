#include "snippet/shadow_nearest.glsl"

// Percentage-closer filtering (Reeves, Salesin & Cook 1987) over squares of texels, with samples on a regular grid around
// the surface's place: no pattern depends on the pixel, so tiles agree.
//
// Loops run zero times where the result is known before: software renderers execute both sides of a branch, but leave a
// loop when no pixel of a group is in it.

// Depths within this of a plane are not decided by it: the planes are sums of rounded numbers, unlike what is compared.
const float kUndecided = 1e-6;
// Texels that a block holds beyond its stride, on each side; as in stage/shadow_bounds.frag.glsl.
const float kBoundsMargin = 6.0;

// 1: nothing within radius texels can darken the place. 0: everything does. Else 2. Blocks overlap: the one whose middle is
// nearest holds all texels within half of what it is larger than their distance.
float decidedAround(sampler2DArray bounds, GpuShadow shadow, ShadowPlace place, vec2 radius) {
    float stride = float(shadow.boundsBlock);
    vec2 block = clamp(floor(place.texel / stride), vec2(0.0), floor((vec2(shadow.mapSize) - 1.0) / stride));
    vec4 planes = texelFetch(bounds, ivec3(ivec2(block), int(shadow.layer)), 0);
    // To the centre of the farthest texel.
    vec2 reach = radius + 0.5;
    float apart = dot(abs(place.slope - planes.xy), reach) + kUndecided;
    float here = place.stored - dot(planes.xy, place.texel - (block + 0.5) * stride);
    float decided = here - planes.w >= apart ? 1.0 : planes.z - here > apart ? 0.0 : 2.0;
    return max(reach.x, reach.y) <= kBoundsMargin ? decided : 2.0;
}

#ifdef FEATURE_SHADOW_BILINEAR
const float kBilinearReach = 1.0;
#else
const float kBilinearReach = 0.0;
#endif

#if defined(FEATURE_SHADOW_COPY) && !defined(VERTEX_STAGE)
#define HAS_COPY
// The maps, layer after layer, row after row: llvmpipe (Mesa 22.3) reads a texel of it by 20 instructions, and one of an
// array of images by a call of 120, as each of its pixels may ask for a mip level of its own.
layout(binding = 0, r32f) uniform readonly imageBuffer shadowCopies;
#if defined(FEATURE_SHADOW_FILTER_6)
#define FILTER_SIDE 6
#elif defined(FEATURE_SHADOW_FILTER_8)
#define FILTER_SIDE 8
#endif

// What the rows of a layer begin with.
struct CopyPlace {
    float last;  // row and column
    int side;
    int above;  // rows of the layers before
};
CopyPlace copyPlaceOf(GpuShadow shadow) {
    int side = int(shadow.mapSize);
    return CopyPlace(shadow.mapSize - 1.0, side, int(shadow.layer) * side);
}
#endif

float storedAt(sampler2DArray maps, GpuShadow shadow, ivec2 texel) {
#ifdef HAS_COPY
    int side = int(shadow.mapSize);
    return imageLoad(shadowCopies, (int(shadow.layer) * side + texel.y) * side + texel.x).r;
#else
    return texelFetch(maps, ivec3(texel, int(shadow.layer)), 0).r;
#endif
}

float compareAt(sampler2DArray maps, GpuShadow shadow, ShadowPlace place, vec2 texel) {
    ivec2 nearest = clamp(ivec2(floor(texel)), ivec2(0), ivec2(int(shadow.mapSize) - 1));
    float stored = storedAt(maps, shadow, nearest);
    return shadowCompare(-stored, -(place.stored + dot(place.slope, vec2(nearest) + 0.5 - place.texel)));
}

float sampleAt(sampler2DArray maps, GpuShadow shadow, ShadowPlace place, vec2 texel) {
#ifdef FEATURE_SHADOW_BILINEAR
    vec2 corner = floor(texel - 0.5) + 0.5;
    vec2 share = texel - corner;
    return shadowMix2x2(compareAt(maps, shadow, place, corner), compareAt(maps, shadow, place, corner + vec2(1.0, 0.0)),
                        compareAt(maps, shadow, place, corner + vec2(0.0, 1.0)),
                        compareAt(maps, shadow, place, corner + vec2(1.0)), share.x, share.y);
#else
    return compareAt(maps, shadow, place, texel);
#endif
}

// The mean of samples x samples comparisons over a rectangle of `width` texels, or of those in the ellipse
// within it; `known` (0
// or 1) where that is the answer already.
float averageOver(sampler2DArray maps, GpuShadow shadow, ShadowPlace place, vec2 width, bool isDisc, float known) {
    int count = int(shadow.filterSamples);
    int taps = known < 1.5 ? 0 : count * count;
    vec2 step = width / float(count);
    float half_ = 0.5 * float(count);
    float farthest = isDisc ? half_ * half_ : 1e30;
    vec2 offset = vec2(0.5 - half_);  // from the middle, in steps
    float sum = 0.0;
    float weight = 0.0;
    for (int i = 0; i < taps; ++i) {
        float isIn = dot(offset, offset) <= farthest ? 1.0 : 0.0;
        sum += isIn * sampleAt(maps, shadow, place, place.texel + offset * step);
        weight += isIn;
        offset.x += 1.0;
        if (offset.x > half_) offset = vec2(0.5 - half_, offset.y + 1.0);
    }
    return known < 1.5 ? known : sum / weight;
}

#ifdef FILTER_SIDE
// Both below for a number of samples that the compiler knows, which it writes out within a row and within a quarter. The
// samples are those of averageOver() to the bit, and sums of zeros and ones are the same in any order.

float compareCopied(CopyPlace copy, int start, ShadowPlace place, vec2 texel) {
    float here = place.stored + dot(place.slope, texel + 0.5 - place.texel);
    return shadowCompare(-imageLoad(shadowCopies, start + int(texel.x)).r, -here);
}

float averageOverRectangle(GpuShadow shadow, ShadowPlace place, vec2 width, float known) {
    const float half_ = 0.5 * float(FILTER_SIDE);
    int rows = known < 1.5 ? 0 : FILTER_SIDE;
    vec2 step = width / float(FILTER_SIDE);
    CopyPlace copy = copyPlaceOf(shadow);
    // Of the columns, the same in every row.
    int columns[FILTER_SIDE];
    float rises[FILTER_SIDE];
    for (int k = 0; k < FILTER_SIDE; ++k) {
        float column = clamp(floor(place.texel.x + (float(k) + 0.5 - half_) * step.x), 0.0, copy.last);
        columns[k] = int(column);
        rises[k] = place.slope.x * (column + 0.5 - place.texel.x);
    }
    float sum = 0.0;
    float y = 0.5 - half_;
    for (int i = 0; i < rows; ++i) {
        float row = clamp(floor(place.texel.y + y * step.y), 0.0, copy.last);
        int start = (copy.above + int(row)) * copy.side;
        float rise = place.slope.y * (row + 0.5 - place.texel.y);
        for (int k = 0; k < FILTER_SIDE; ++k)
            sum += shadowCompare(-imageLoad(shadowCopies, start + columns[k]).r, -(place.stored + (rises[k] + rise)));
        y += 1.0;
    }
    return known < 1.5 ? known : sum / float(FILTER_SIDE * FILTER_SIDE);
}

float averageOverEllipse(GpuShadow shadow, ShadowPlace place, vec2 width, float known) {
    const int half_ = FILTER_SIDE / 2;
    int quarters = known < 1.5 ? 0 : 4;
    vec2 step = width / float(FILTER_SIDE);
    CopyPlace copy = copyPlaceOf(shadow);
    float sum = 0.0;
    float weight = 0.0;
    for (int quarter = 0; quarter < quarters; ++quarter) {
        vec2 away = vec2((quarter & 1) == 0 ? step.x : -step.x, (quarter & 2) == 0 ? step.y : -step.y);
        weight = 0.0;
        for (int y = 0; y < half_; ++y) {
            float row = clamp(floor(place.texel.y + (float(y) + 0.5) * away.y), 0.0, copy.last);
            int start = (copy.above + int(row)) * copy.side;
            for (int x = 0; x < half_; ++x) {
                vec2 offset = vec2(x, y) + 0.5;
                if (dot(offset, offset) > float(half_ * half_)) continue;
                float column = clamp(floor(place.texel.x + (float(x) + 0.5) * away.x), 0.0, copy.last);
                sum += compareCopied(copy, start, place, vec2(column, row));
                weight += 4.0;
            }
        }
    }
    return known < 1.5 ? known : sum / weight;
}
#endif

// A width across the light in texels of either side, none more than the widest.
vec2 texelsOf(GpuShadow shadow, ShadowPlace place, float metres) {
    vec2 sides = max(place.texelMetres, vec2(1e-30));
    return min(metres, shadow.maxTexels * min(sides.x, sides.y)) / sides;
}

float filterPercentageCloser(sampler2DArray maps, sampler2DArray bounds, GpuShadow shadow, ShadowPlace place) {
    vec2 width = shadow.filterMetres > 0.0 ? texelsOf(shadow, place, shadow.filterMetres) : vec2(shadow.filterTexels);
    float known = place.isOn ? 2.0 : 1.0;
#ifdef FEATURE_SHADOW_BOUNDS
    float decided = decidedAround(bounds, shadow, place, 0.5 * width + kBilinearReach);
    if (place.isOn) known = decided;
#endif
#ifdef FILTER_SIDE
    return averageOverRectangle(shadow, place, width, known);
#else
    return averageOver(maps, shadow, place, width, false, known);
#endif
}

#ifdef FEATURE_SHADOW_SOFT_FILTER
// The width of the penumbra at the place behind an edge at this distance from the light, by similar triangles, in texels.
vec2 penumbraTexels(GpuShadow shadow, ShadowPlace place, float blocker) {
    float behind = max(place.distance - blocker, 0.0) * shadow.lightSize;
    float metres = shadow.isPerspective > 0.5 ? behind / max(blocker, 1e-6 * place.distance) : behind;
    return texelsOf(shadow, place, metres);
}

// Counts what is stored at a texel's centre where it lies before the place.
void addBlocker(GpuShadow shadow, ShadowPlace place, float stored, vec2 centre, inout float sum, inout float found) {
    if (stored > place.stored + dot(place.slope, centre - place.texel)) {
        float blocker = distanceOf(shadow, stored, centre);
#ifdef FEATURE_SHADOW_NEAREST_BLOCKER
        sum = found > 0.0 ? min(sum, blocker) : blocker;
        found = 1.0;
#else
        sum += blocker;
        found += 1.0;
#endif
    }
}

// Contact-hardening shadows (Fernando 2005): the mean distance of what blocks the light around the place gives the width
// of its penumbra. Distances are linear, light and penumbra in metres; without a blocker the place is lit.
float filterSoft(sampler2DArray maps, sampler2DArray bounds, GpuShadow shadow, ShadowPlace place) {
    float known = place.isOn ? 2.0 : 1.0;
    // A light without extent casts hard shadows: no search, and one sample decides.
    bool isHard = !(shadow.lightSize > 0.0);
    // Blockers at the light's side of the map lie within the widest penumbra there can be.
    float nearest = shadow.isPerspective > 0.5 ? shadow.depthScale / (1.0 + shadow.depthOffset) : 0.0;
    vec2 widest = penumbraTexels(shadow, place, nearest);
#ifdef FEATURE_SHADOW_BOUNDS
    float decided = decidedAround(bounds, shadow, place, 0.5 * widest + kBilinearReach);
    if (place.isOn) known = decided;
#endif
    int count = int(shadow.blockerSamples);
    vec2 step = widest / float(count);
    vec2 first = place.texel - 0.5 * widest + 0.5 * step;
    float sum = 0.0;
    float found = 0.0;
#ifdef HAS_COPY
    // As the loop below, row by row.
#ifdef FEATURE_SHADOW_SEARCH_6
    const int along = 6;
#else
    int along = count;
#endif
    CopyPlace copy = copyPlaceOf(shadow);
    int rows = known < 1.5 || isHard ? 0 : along;
    vec2 at = first;
    for (int i = 0; i < rows; ++i) {
        float row = clamp(floor(at.y), 0.0, copy.last);
        int start = (copy.above + int(row)) * copy.side;
        at.x = first.x;
        for (int k = 0; k < along; ++k) {
            vec2 texel = vec2(clamp(floor(at.x), 0.0, copy.last), row);
            addBlocker(shadow, place, imageLoad(shadowCopies, start + int(texel.x)).r, texel + 0.5, sum, found);
            at.x += step.x;
        }
        at.y += step.y;
    }
#else
    int taps = known < 1.5 || isHard ? 0 : count * count;
    vec2 at = first;
    int column = 0;
    for (int i = 0; i < taps; ++i) {
        vec2 centre = clamp(floor(at), vec2(0.0), vec2(shadow.mapSize - 1.0)) + 0.5;
        float stored = texelFetch(maps, ivec3(ivec2(centre), int(shadow.layer)), 0).r;
        addBlocker(shadow, place, stored, centre, sum, found);
        ++column;
        at.x += step.x;
        if (column == count) {
            column = 0;
            at = vec2(first.x, at.y + step.y);
        }
    }
#endif
    // Without a blocker the place is lit.
    float outcome = known < 1.5 ? known : found == 0.0 ? 1.0 : 2.0;
    vec2 width = penumbraTexels(shadow, place, sum / max(found, 1.0));
#ifdef FILTER_SIDE
    float soft = averageOverEllipse(shadow, place, width, isHard ? 1.0 : outcome);
#elif defined(FEATURE_SHADOW_SKIP)
    float soft = averageOver(maps, shadow, place, width, true, isHard ? 1.0 : outcome);
#else
    // The plain loop, for comparison: every sample is taken.
    float soft = averageOver(maps, shadow, place, width, true, known);
    if (found == 0.0) soft = 1.0;
#endif
    return isHard ? filterNearest(maps, shadow, place) : soft;
}
#endif
