#include "client/session/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/math/projection.h"
#include "common/math/rotation.h"

namespace umbriel {

namespace {

// Deeper nesting than anybody means; a circle of decorators ends here.
constexpr std::size_t kMaxDecorators = 16;

Error badCamera(const Container& camera, const std::string& what) {
    return badInput(fmt::format(
        "camera {}: {}",
        camera.name->empty() ? fmt::format("#{}", camera.id().value) : fmt::format("\"{}\"", camera.name.get()), what));
}

// The inverse of a rotation.
glm::dmat3 viewFromWorldOf(const BeaconFrame& frame) {
    return glm::transpose(frame.worldFromBeacon);
}

void standAt(View& view, const BeaconFrame& frame) {
    view.eyeWorld = frame.positionWorld;
    view.viewFromWorld = viewFromWorldOf(frame);
}

Result<View> resolvePerspective(const PerspectiveCamera& camera, const BeaconFrame& frame, double regionAspect,
                                const Box3d& sceneBounds) {
    const double fovY = camera.fovY;
    const double aspect = camera.aspect == 0.0 ? regionAspect : camera.aspect.get();
    const double farDistance = camera.farDistance;
    if (!(fovY > 0.0 && fovY < std::numbers::pi))
        return badCamera(
            camera, fmt::format("a field of view of {} degrees; it must lie between 0 and 180", glm::degrees(fovY)));
    if (!(aspect > 0.0) || !std::isfinite(aspect))
        return badCamera(camera, fmt::format("an aspect ratio of {}; it must be positive", aspect));
    View view;
    standAt(view, frame);
    view.nearDistance = camera.nearDistance;
    if (view.nearDistance == 0.0) {
        view.nearDistance = automaticNear(sceneBounds, frame.positionWorld, -frame.worldFromBeacon[2]);
        if (farDistance > 0.0) view.nearDistance = std::min(view.nearDistance, 0.5 * farDistance);
    }
    if (!(view.nearDistance > 0.0) || !std::isfinite(view.nearDistance))
        return badCamera(camera, fmt::format("a near distance of {} m; it must be positive, or 0 to have it chosen",
                                             view.nearDistance));
    if (farDistance != 0.0 && !(farDistance > view.nearDistance && std::isfinite(farDistance)))
        return badCamera(camera, fmt::format("a far distance of {} m does not lie beyond the near one of {} m",
                                             farDistance, view.nearDistance));
    view.clipFromView = farDistance == 0.0 ? reversedPerspective(fovY, aspect, view.nearDistance)
                                           : reversedPerspective(fovY, aspect, view.nearDistance, farDistance);
    return view;
}

Result<View> resolveOrthographic(const OrthographicCamera& camera, const BeaconFrame& frame) {
    const double halfWidth = camera.halfWidth;
    const double halfHeight = camera.halfHeight;
    if (!(halfWidth > 0.0 && halfHeight > 0.0) || !std::isfinite(halfWidth) || !std::isfinite(halfHeight))
        return badCamera(camera,
                         fmt::format("half extents of {} x {} m; both must be positive", halfWidth, halfHeight));
    if (!(camera.farDistance > camera.nearDistance.get()) || !std::isfinite(camera.nearDistance) ||
        !std::isfinite(camera.farDistance))
        return badCamera(camera, fmt::format("a far distance of {} m does not lie beyond the near one of {} m",
                                             camera.farDistance.get(), camera.nearDistance.get()));
    View view;
    standAt(view, frame);
    view.orthographic = true;
    view.nearDistance = camera.nearDistance;
    view.clipFromView =
        reversedOrthographic(-halfWidth, halfWidth, -halfHeight, halfHeight, camera.nearDistance, camera.farDistance);
    return view;
}

Result<View> resolveMatrix(const MatrixCamera& camera, const BeaconFrame& frame) {
    const glm::dmat4& viewFromBeacon = camera.viewFromBeacon;
    const glm::dmat4& clipFromView = camera.clipFromView;
    if (!isFinite(viewFromBeacon) || !isFinite(clipFromView)) return badCamera(camera, "a matrix that is not finite");
    if (glm::dvec4(viewFromBeacon[0].w, viewFromBeacon[1].w, viewFromBeacon[2].w, viewFromBeacon[3].w) !=
        glm::dvec4(0, 0, 0, 1))
        return badCamera(camera, "the view matrix is not affine (its last row must be 0 0 0 1)");
    // What is not a rotation in the view matrix (a scale, a mirror) becomes a part of the projection, so that the view
    // is rigid and the picture the one that the two matrices make.
    const glm::dmat3 linear(viewFromBeacon);
    const auto rotation = orthonormalised(glm::transpose(linear));
    if (!rotation || glm::determinant(linear) == 0.0) return badCamera(camera, "the view matrix is singular");
    const glm::dmat3 rigidFromBeacon = glm::transpose(*rotation);
    const glm::dmat4 givenFromRigid(linear * *rotation);
    View view;
    view.viewFromWorld = rigidFromBeacon * viewFromWorldOf(frame);
    const glm::dvec3 eyeBeacon = -(glm::inverse(linear) * glm::dvec3(viewFromBeacon[3]));
    view.eyeWorld = frame.positionWorld + frame.worldFromBeacon * eyeBeacon;
    view.clipFromView = reversedFromOpenGl(clipFromView) * givenFromRigid;
    view.orthographic = clipFromView[0].w == 0.0 && clipFromView[1].w == 0.0 && clipFromView[2].w == 0.0;
    const glm::dvec4 nearPoint = glm::inverse(view.clipFromView) * glm::dvec4(0.0, 0.0, 1.0, 1.0);
    view.nearDistance = -nearPoint.z / nearPoint.w;
    if (!std::isfinite(view.nearDistance) || (!view.orthographic && !(view.nearDistance > 0.0)))
        return badCamera(camera, "the projection matrix is singular or its near plane is not in front of the eye");
    return view;
}

// The eye moves sideways; a shear about the plane at zeroParallax keeps the picture of that plane where it was. The
// same for off-axis and orthographic projections, and independent of tile decorators inside or outside.
Result<View> applyStereo(const StereoCameraDecorator& decorator, View view) {
    if (decorator.eye == Eye::Mono) return view;
    const double zeroParallax = decorator.zeroParallax;
    if (!(zeroParallax > 0.0) || !std::isfinite(zeroParallax) || !std::isfinite(decorator.separation))
        return badCamera(decorator, "a stereo camera needs a positive distance to its plane of zero parallax");
    const double offset = (decorator.eye == Eye::Left ? -0.5 : 0.5) * decorator.separation;
    const glm::dvec3 rightWorld = glm::transpose(view.viewFromWorld)[0];
    view.eyeWorld += offset * rightWorld;
    glm::dmat4 middleFromEye(1.0);
    middleFromEye[2].x = -offset / zeroParallax;
    view.clipFromView = view.clipFromView * middleFromEye;
    view.eye = decorator.eye;
    return view;
}

Result<View> applyTile(const TileCameraDecorator& decorator, View view) {
    const double left = decorator.left, bottom = decorator.bottom, right = decorator.right, top = decorator.top;
    if (!(left < right && bottom < top) || !std::isfinite(left) || !std::isfinite(right) || !std::isfinite(bottom) ||
        !std::isfinite(top))
        return badCamera(decorator,
                         fmt::format("a tile from ({}, {}) to ({}, {}) has no extent", left, bottom, right, top));
    view.clipFromView = cropped(view.clipFromView, left, bottom, right, top);
    return view;
}

}  // namespace

Result<View> resolveCamera(const Aspect& aspect, Ref<Container> camera, const Hierarchy& hierarchy,
                           const PixelRect& region, const Box3d& sceneBounds) {
    std::vector<const Container*> decorators;  // outermost first
    const Container* base = aspect.find(camera);
    while (base && (isA<StereoCameraDecorator>(*base) || isA<TileCameraDecorator>(*base))) {
        if (decorators.size() == kMaxDecorators)
            return badCamera(
                *base, fmt::format("decorators are nested more than {} deep, perhaps in a circle", kMaxDecorators));
        decorators.push_back(base);
        base = aspect.find(isA<StereoCameraDecorator>(*base)
                               ? static_cast<const StereoCameraDecorator&>(*base).camera.get()
                               : static_cast<const TileCameraDecorator&>(*base).camera.get());
    }
    if (!base && !decorators.empty()) return badCamera(*decorators.back(), "it decorates no camera");
    if (!base) return badInput("the viewport has no camera");

    const double regionAspect = static_cast<double>(region.width) / region.height;
    Result<View> view = badCamera(*base, "it is no camera");
    const auto frameOf = [&](Ref<Node> beacon) { return beaconFrame(aspect, hierarchy, beacon); };
    if (isA<PerspectiveCamera>(*base)) {
        const auto& perspective = static_cast<const PerspectiveCamera&>(*base);
        view = resolvePerspective(perspective, frameOf(perspective.beacon), regionAspect, sceneBounds);
    } else if (isA<OrthographicCamera>(*base)) {
        const auto& orthographic = static_cast<const OrthographicCamera&>(*base);
        view = resolveOrthographic(orthographic, frameOf(orthographic.beacon));
    } else if (isA<MatrixCamera>(*base)) {
        const auto& matrix = static_cast<const MatrixCamera&>(*base);
        view = resolveMatrix(matrix, frameOf(matrix.beacon));
    }
    for (std::size_t i = decorators.size(); view && i-- > 0;)
        view = isA<StereoCameraDecorator>(*decorators[i])
                   ? applyStereo(static_cast<const StereoCameraDecorator&>(*decorators[i]), *view)
                   : applyTile(static_cast<const TileCameraDecorator&>(*decorators[i]), *view);
    if (!view) return view;
    if (!isFinite(view->eyeWorld) || !isFinite(view->clipFromView))
        return badCamera(*base, "its position or projection is not finite");
    view->region = region;
    return view;
}

double automaticNear(const Box3d& sceneBounds, const glm::dvec3& eyeWorld, const glm::dvec3& forwardWorld) {
    if (sceneBounds.empty()) return 0.125;
    double nearest = glm::dot(sceneBounds.corner(0) - eyeWorld, forwardWorld);
    for (int i = 1; i < 8; ++i) nearest = std::min(nearest, glm::dot(sceneBounds.corner(i) - eyeWorld, forwardWorld));
    // A scene of a single point has no diagonal: its distance sets the scale, then 1 m.
    double scale = sceneBounds.diagonal();
    if (!(scale > 0.0)) scale = nearest > 0.0 ? nearest : 1.0;
    const double wanted = std::max(0.9 * nearest, scale / 8192.0);
    return std::exp2(std::floor(std::log2(wanted)));
}

LookAt frameAll(const Box3d& bounds, double fovY, double aspect) {
    Box3d box = bounds;
    if (box.empty()) box = {glm::dvec3(-1.0), glm::dvec3(1.0)};
    if (!(box.diagonal() > 0.0)) box = {box.lower - 1.0, box.upper + 1.0};
    LookAt pose;
    pose.fovY = fovY;
    pose.targetWorld = box.centre();
    const auto worldFromView = rotationLookingAlong({-0.55, -0.4, -1.0}, pose.upWorld);
    const glm::dvec3 backward = (*worldFromView)[2];
    const double tangentY = std::tan(0.5 * fovY);
    const double tangentX = tangentY * aspect;
    double distance = 0.0;
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 corner = glm::transpose(*worldFromView) * (box.corner(i) - pose.targetWorld);
        distance = std::max(distance,
                            corner.z + 1.05 * std::max(std::abs(corner.x) / tangentX, std::abs(corner.y) / tangentY));
    }
    pose.eyeWorld = pose.targetWorld + distance * backward;
    return pose;
}

Result<Ref<PerspectiveCamera>> addCamera(Aspect& aspect, const std::string& name, const LookAt& pose) {
    if (!isFinite(pose.eyeWorld) || !isFinite(pose.targetWorld) || !isFinite(pose.upWorld))
        return badInput(fmt::format("camera \"{}\": eye, target or up is not a finite point", name));
    if (!(pose.fovY > 0.0 && pose.fovY < std::numbers::pi))
        return badInput(fmt::format("camera \"{}\": a field of view of {} degrees; it must lie between 0 and 180", name,
                                    glm::degrees(pose.fovY)));
    const auto worldFromBeacon = rotationLookingAlong(pose.targetWorld - pose.eyeWorld, pose.upWorld);
    if (!worldFromBeacon) return badInput(fmt::format("camera \"{}\": eye and target are the same point", name));
    const auto transform = aspect.create<Transform>();
    aspect.edit(transform)
        .set<&Transform::linear>(glm::mat3(*worldFromBeacon))
        .set<&Transform::translation>(pose.eyeWorld);
    const auto beacon = aspect.create<Node>(name + " beacon");
    aspect.edit(beacon).set<&Node::core>(Ref<Container>(transform.id));
    const auto camera = aspect.create<PerspectiveCamera>(name);
    aspect.edit(camera).set<&PerspectiveCamera::beacon>(beacon).set<&PerspectiveCamera::fovY>(pose.fovY);
    return camera;
}

}  // namespace umbriel
