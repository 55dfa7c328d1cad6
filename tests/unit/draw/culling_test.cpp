#include "server/draw/culling.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "server/draw/caster_mask.h"

namespace umbriel {
namespace {

View viewOf(PixelSize wall) {
    View view;
    view.region = {0, 0, wall.width, wall.height};
    view.viewFromWorld = glm::dmat3(glm::lookAt(glm::dvec3(0), glm::dvec3(-1, -0.6, -1.5), glm::dvec3(0, 1, 0)));
    view.clipFromView = glm::dmat4(0.0);
    view.clipFromView[0][0] = 2.0 * wall.height / wall.width;
    view.clipFromView[1][1] = 2.0;
    view.clipFromView[2][3] = -1.0;
    view.clipFromView[3][2] = 0.1;
    return view;
}

glm::dvec3 anyPoint(double reach) {
    const auto coordinate = [&] { return double(*rc::gen::inRange(-100000, 100001)) * reach / 100000; };
    const double x = coordinate(), y = coordinate(), z = coordinate();
    return {x, y, z};
}

Box anyBox(double reach) {
    Box box;
    box.add(glm::vec3(anyPoint(reach)));
    box.add(glm::vec3(anyPoint(reach)));
    return box;
}

// Whether a point is seen through the pixels: the definition, without planes.
bool seen(const View& view, const PixelRect& pixels, const glm::dvec3& relative) {
    const glm::dvec4 clip = clipFromRelativeOf(view) * glm::dvec4(relative, 1.0);
    if (clip.w <= 0.0 || clip.z > clip.w) return false;
    const double x = (clip.x / clip.w * 0.5 + 0.5) * view.region.width;
    const double y = (clip.y / clip.w * 0.5 + 0.5) * view.region.height;
    return x >= pixels.x && x <= pixels.x + pixels.width && y >= pixels.y && y <= pixels.y + pixels.height;
}

// All that is seen of a box lies in its pixels; of one that is before the eye they are no more than a box around it.
RC_GTEST_PROP(Culling, ABoxIsSeenInItsPixelsOnly, ()) {
    const View view = viewOf({640, 360});
    const double far = *rc::gen::inRange(0, 10);
    const glm::dmat4 place = glm::translate(glm::dmat4(1.0), far * glm::dvec3(-1, -0.6, -1.5));
    const Box box = anyBox(2.0);
    const PixelRect pixels = pixelsOf(view, box, place, 1.0);
    for (int i = 0; i < 64; ++i) {
        const glm::dvec3 t = (anyPoint(1.0) + 1.0) * 0.5;
        const glm::dvec3 point(place * glm::dvec4(glm::mix(glm::dvec3(box.minimum), glm::dvec3(box.maximum), t), 1.0));
        if (seen(view, view.region, point)) RC_ASSERT(seen(view, pixels, point));
    }
    if (far >= 5.0) RC_ASSERT(pixels.area() < view.region.area());  // 2 m at 9 m and more
}

RC_GTEST_PROP(Culling, ABoxWithAVisiblePointIsNeverOutside, ()) {
    const View view = viewOf({640, 360});
    const PixelRect tile{*rc::gen::inRange(0, 600), *rc::gen::inRange(0, 300), *rc::gen::inRange(1, 40),
                         *rc::gen::inRange(1, 60)};
    const Box box = anyBox(5.0);
    const ObjectFrustum frustum(tileFrustum(view, tile, 0.0), glm::dmat4(1.0));
    const Overlap overlap = frustum.classify(box);
    for (int i = 0; i < 64; ++i) {
        const glm::dvec3 t = (anyPoint(1.0) + 1.0) * 0.5;
        const glm::dvec3 point = glm::mix(glm::dvec3(box.minimum), glm::dvec3(box.maximum), t);
        if (seen(view, tile, point))
            RC_ASSERT(overlap != Overlap::Outside);
        else
            RC_ASSERT(overlap != Overlap::Inside);
    }
}

TEST(Culling, ATileSeesOnlyItsPart) {
    const View view = viewOf({640, 360});
    Box box;
    box.add(glm::vec3(-0.99f, -0.61f, -1.51f) * 10.0f);
    box.add(glm::vec3(-1.01f, -0.59f, -1.49f) * 10.0f);  // straight ahead
    const auto classify = [&](PixelRect tile) {
        return ObjectFrustum(tileFrustum(view, tile, 0.0), glm::dmat4(1.0)).classify(box);
    };
    EXPECT_EQ(classify({0, 0, 640, 360}), Overlap::Inside);
    EXPECT_EQ(classify({0, 0, 100, 360}), Overlap::Outside);
    EXPECT_EQ(classify({320, 180, 320, 180}), Overlap::Partial);
}

// Its places in the world say nothing about where a surface lies in texture space.
TEST(Culling, NothingIsOutsideOfAnUnwrappedView) {
    View view = viewOf({640, 360});
    view.unwrapped = true;
    view.clipFromView = glm::dmat4(0.0);
    Box box;
    box.add(glm::vec3(1e6f, -3.0f, 7.0f));
    box.add(glm::vec3(2e6f, 3.0f, 9.0f));
    const glm::dmat4 place = glm::scale(glm::translate(glm::dmat4(1.0), {1e7, 0, 0}), {-2.0, 3.0, 0.1});
    const ObjectFrustum frustum(tileFrustum(view, {0, 0, 1, 1}, 0.0), place);
    EXPECT_EQ(frustum.classify(box), Overlap::Inside);
}

TEST(Culling, AnEmptyBoxIsOutside) {
    const ObjectFrustum frustum(tileFrustum(viewOf({64, 64}), {0, 0, 64, 64}, 0.0), glm::dmat4(1.0));
    EXPECT_EQ(frustum.classify(Box{}), Overlap::Outside);
}

ShadowFit fitOf(const glm::dmat4& clipFromWorld, const glm::dmat3& worldFromLight, std::uint32_t mapSize) {
    ShadowFit fit;
    fit.mode = ShadowMode::Standard;
    fit.clipFromWorld = clipFromWorld;
    fit.worldFromLight = worldFromLight;
    fit.mapSize = mapSize;
    fit.normalOffset = 0.35f;
    return fit;
}

// A caster that shades a visible point of a receiver is drawn, whatever the boxes, tile and light.
RC_GTEST_PROP(CasterMask, ACasterOfAVisiblePointIsKept, ()) {
    const View view = viewOf({640, 360});
    const PixelRect tile{*rc::gen::inRange(0, 600), *rc::gen::inRange(0, 300), *rc::gen::inRange(1, 200),
                         *rc::gen::inRange(1, 200)};
    const Frustum frustum = tileFrustum(view, tile, 1.0);
    const glm::dvec3 travels = glm::normalize(anyPoint(1.0) + glm::dvec3(0.0, -2.0, 0.0));
    const glm::dmat4 lightFromRelative = glm::lookAt(-travels * 20.0, glm::dvec3(0), glm::dvec3(1, 0, 0.1));
    glm::dmat4 clipFromLight(1.0);
    clipFromLight[0][0] = clipFromLight[1][1] = 1.0 / 12;
    clipFromLight[2][2] = 1.0 / 40;
    clipFromLight[3][2] = 1.0;  // z from 0 at -40 to 1 at the light
    CasterMask mask(fitOf(clipFromLight * lightFromRelative, glm::transpose(glm::dmat3(lightFromRelative)), 1024),
                    glm::dvec3(0.0));
    // A point seen through the tile, somewhere in a box.
    const glm::dmat4 relativeFromClip = glm::inverse(clipFromRelativeOf(view));
    const double x = (tile.x + 0.5) / 640 * 2 - 1;
    const double y = (tile.y + 0.5) / 360 * 2 - 1;
    const glm::dvec4 unprojected = relativeFromClip * glm::dvec4(x, y, 0.1 / *rc::gen::inRange(1, 8), 1.0);
    const glm::dvec3 point = glm::dvec3(unprojected) / unprojected.w;
    Box receiver;
    receiver.add(glm::vec3(point + (anyPoint(1.0) + 1.0)));
    receiver.add(glm::vec3(point - (anyPoint(1.0) + 1.0)));
    const glm::dmat4 identity(1.0);
    const Overlap overlap = ObjectFrustum(frustum, identity).classify(receiver);
    RC_ASSERT(overlap != Overlap::Outside);
    mask.addReceiver(receiver, identity, frustum, overlap == Overlap::Inside);
    // A box around a point of the ray to the light.
    const glm::dvec3 on = point - travels * (double(*rc::gen::inRange(1, 1000)) / 200);
    Box caster;
    caster.add(glm::vec3(on - 0.01 - 0.5 * (anyPoint(1.0) + 1.0)));
    caster.add(glm::vec3(on + 0.01));
    RC_ASSERT(mask.casts(caster, identity));
    RC_ASSERT(mask.castingWithin(caster, mask.place(identity)) != CasterMask::Casting::False);
}

// What is said of a box holds for every box inside of it.
RC_GTEST_PROP(CasterMask, WhatIsSaidOfABoxHoldsForItsParts, ()) {
    glm::dmat4 clip(0.0);  // light straight down: x to x, z to -y of the map
    clip[0][0] = clip[2][1] = 0.05;
    clip[1][2] = 0.02;
    clip[3] = {0.0, 0.0, 0.5, 1.0};
    CasterMask mask(fitOf(clip, glm::dmat3(1, 0, 0, 0, 0, 1, 0, 1, 0), 512), glm::dvec3(0.0));
    glm::dmat4 relativeFromObject = glm::rotate(glm::dmat4(1.0), 0.3, anyPoint(1.0) + glm::dvec3(0.0, 2.0, 0.0));
    relativeFromObject[0] = -relativeFromObject[0];
    const CasterMask::Placed placed = mask.place(relativeFromObject);
    for (int i = 0; i < 6; ++i) {
        Box receiver;
        const glm::dvec3 at = anyPoint(10.0) * glm::dvec3(1.0, 0.3, 1.0);
        receiver.add(glm::vec3(at));
        receiver.add(glm::vec3(at + 4.0 * (anyPoint(1.0) + 1.0)));
        mask.addReceiver(receiver, placed);
    }
    if (*rc::gen::inRange(0, 2) == 0) {
        Box floor;
        floor.add(glm::vec3(-14.0f, -9.0f, -14.0f));
        floor.add(glm::vec3(14.0f, -8.9f, 14.0f));
        mask.addReceiver(floor, placed);
    }
    const Box whole = anyBox(4.0);
    const CasterMask::Casting casting = mask.castingWithin(whole, placed);
    for (int i = 0; i < 8; ++i) {
        Box part;
        for (int k = 0; k < 2; ++k)
            part.add(
                glm::vec3(glm::mix(glm::dvec3(whole.minimum), glm::dvec3(whole.maximum), (anyPoint(1.0) + 1.0) * 0.5)));
        const bool casts = mask.casts(part, placed);
        if (casting == CasterMask::Casting::True) RC_ASSERT(casts);
        if (casting == CasterMask::Casting::False) RC_ASSERT(!casts);
    }
    RC_CLASSIFY(casting == CasterMask::Casting::True, "all cast");
    RC_CLASSIFY(casting == CasterMask::Casting::False, "none casts");
}

TEST(CasterMask, WhatLiesBehindOrBesideTheReceiversCastsNothingUnlessAFilterAsks) {
    const View view = viewOf({64, 64});
    const Frustum frustum = tileFrustum(view, {0, 0, 64, 64}, 0.0);
    // Light straight down: x to x, z to -y of the map.
    glm::dmat4 clip(0.0);
    clip[0][0] = 0.05;
    clip[2][1] = -0.05;
    clip[1][2] = 0.05;
    clip[3] = {0, 0, 0.5, 1};
    CasterMask mask(fitOf(clip, glm::dmat3(1, 0, 0, 0, 0, -1, 0, 1, 0), 512), glm::dvec3(0.0));
    EXPECT_TRUE(mask.empty());
    Box receiver;
    receiver.add(glm::vec3(-6, -4, -8));
    receiver.add(glm::vec3(-5, -3.5f, -7));
    const glm::dmat4 identity(1.0);
    EXPECT_FALSE(mask.casts(receiver, identity));
    mask.addReceiver(receiver, identity, frustum, true);
    ASSERT_FALSE(mask.empty());
    const auto boxAt = [](glm::vec3 middle) {
        Box box;
        box.add(middle - 0.2f);
        box.add(middle + 0.2f);
        return box;
    };
    EXPECT_TRUE(mask.casts(boxAt({-5.5f, 2, -7.5f}), identity));
    EXPECT_FALSE(mask.casts(boxAt({-5.5f, -5, -7.5f}), identity));  // below
    EXPECT_FALSE(mask.casts(boxAt({-3, 2, -7.5f}), identity));      // beside
    // A filter compares what lies beside the receiver with its plane, which may be steep: however deep, it counts.
    ShadowFit filtered = fitOf(clip, glm::dmat3(1, 0, 0, 0, 0, -1, 0, 1, 0), 512);
    filtered.filter.maxTexels = 4.0f;
    CasterMask wide(filtered, glm::dvec3(0.0));
    wide.addReceiver(receiver, identity, frustum, true);
    EXPECT_TRUE(wide.casts(boxAt({-5.5f, -9, -7.5f}), identity));
    EXPECT_FALSE(wide.casts(boxAt({-3, -9, -7.5f}), identity));
    const PixelRect texels = mask.texels();
    EXPECT_LE(texels.width, 20);  // a metre is 12.8 texels
    EXPECT_GE(texels.width, 13);
}

}  // namespace
}  // namespace umbriel
