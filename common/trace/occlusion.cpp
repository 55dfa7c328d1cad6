#include "common/trace/occlusion.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/assert.h"
#include "common/trace/double_hit.h"

namespace umbriel::trace {
namespace {

// In units of the box, whose diagonal is 1 to 2. Rays start this much behind their origin, so that no rounding in
// Embree (about 1e-7 here) hides a triangle that begins right at it.
constexpr double kStartBehind = 4e-6;
// Nearer hits are decided in double; Embree's rounding is far below.
constexpr double kDecidedInDouble = 1e-4;
// A hit nearer than this is the surface the origin lies on, or its coplanar neighbour: double rounds to 1e-16 of the
// coordinates, times ten where the ray is at a grazing angle (sine 0.1), with two orders of magnitude to spare.
constexpr double kNotSelf = 1e-13;
constexpr unsigned kLanes = 8;

}  // namespace

struct OcclusionScene::Scene {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    glm::dvec3 centre{0.0};
    double scale = 1.0;
    double notSelf = kNotSelf;
    std::vector<glm::dvec3> positions;  // moved and scaled
    std::vector<glm::uvec3> corners;
    std::vector<std::uint8_t> mayHaveHoles;
    IsSolid isSolid;

    ~Scene() {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }
    std::array<glm::dvec3, 3> cornersOf(std::uint32_t triangle) const {
        const glm::uvec3& t = corners[triangle];
        return {positions[t.x], positions[t.y], positions[t.z]};
    }
};

namespace {

struct Query {
    RTCIntersectContext context;  // first: Embree hands a pointer to it back
    const void* scene = nullptr;
    glm::dvec3 origin{0.0};
    std::uint32_t own = 0;
    std::array<glm::dvec3, kLanes> directions;  // unit
    std::array<double, kLanes> farDistances;
};

// Barycentric weights of the second and third corner where the ray meets the triangle's plane.
glm::dvec2 weightsAt(const std::array<glm::dvec3, 3>& t, const glm::dvec3& point) {
    const glm::dvec3 e1 = t[1] - t[0], e2 = t[2] - t[0], p = point - t[0];
    const double d11 = glm::dot(e1, e1), d12 = glm::dot(e1, e2), d22 = glm::dot(e2, e2);
    const double d1 = glm::dot(p, e1), d2 = glm::dot(p, e2);
    const double area = d11 * d22 - d12 * d12;
    if (!(area > 0.0)) return glm::dvec2(1.0 / 3.0);
    return glm::clamp(glm::dvec2(d22 * d1 - d12 * d2, d11 * d2 - d12 * d1) / area, 0.0, 1.0);
}

// How far along the ray, whose direction is of unit length, it meets the triangle's plane.
double planeDistance(const glm::dvec3& direction, const std::array<glm::dvec3, 3>& t, const glm::dvec3& origin) {
    const glm::dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    return glm::dot(normal, t[0] - origin) / glm::dot(normal, direction);
}

template <class Scene>
void filter(const RTCFilterFunctionNArguments* arguments) {
    const auto& query = *reinterpret_cast<const Query*>(arguments->context);
    const auto& scene = *static_cast<const Scene*>(query.scene);
    for (unsigned i = 0; i < arguments->N; ++i) {
        if (arguments->valid[i] != -1) continue;
        const unsigned triangle = RTCHitN_primID(arguments->hit, arguments->N, i);
        const unsigned lane = RTCRayN_id(arguments->ray, arguments->N, i);
        if (triangle == query.own) {
            arguments->valid[i] = 0;
            continue;
        }
        const glm::dvec3& direction = query.directions[lane];
        const auto corners = scene.cornersOf(triangle);
        double distance = static_cast<double>(RTCRayN_tfar(arguments->ray, arguments->N, i)) - kStartBehind;
        const bool isNear = distance < kDecidedInDouble;
        const bool endsNear = std::abs(distance - query.farDistances[lane]) < kDecidedInDouble;
        if (isNear || endsNear) {
            const auto exact =
                hitDistance(direction, corners[0] - query.origin, corners[1] - query.origin, corners[2] - query.origin);
            // What touches the ray's end, as the face in which a lamp lies, is not before it.
            const double end = query.farDistances[lane] - scene.notSelf;
            const bool isBefore = exact ? *exact > scene.notSelf && *exact < end
                                        : !isNear && planeDistance(direction, corners, query.origin) < end;
            if (!isBefore) {
                arguments->valid[i] = 0;
                continue;
            }
            if (exact) distance = *exact;
        }
        if (!scene.mayHaveHoles.empty() && scene.mayHaveHoles[triangle] != 0) {
            const glm::dvec2 weights = weightsAt(corners, query.origin + distance * direction);
            if (!scene.isSolid(triangle, weights.x, weights.y)) arguments->valid[i] = 0;
        }
    }
}

}  // namespace

OcclusionScene::OcclusionScene(std::unique_ptr<Scene> scene) : _scene(std::move(scene)) {}
OcclusionScene::~OcclusionScene() = default;

std::size_t OcclusionScene::triangleCount() const {
    return _scene->corners.size();
}

Result<std::unique_ptr<OcclusionScene>> OcclusionScene::create(std::span<const glm::dvec3> positions,
                                                               std::span<const glm::uvec3> corners,
                                                               std::vector<std::uint8_t> mayHaveHoles,
                                                               IsSolid isSolid) {
    UMBRIEL_ASSERT(mayHaveHoles.empty() || (mayHaveHoles.size() == corners.size() && isSolid),
                   "holes are of triangles, and somebody knows where");
    auto scene = std::make_unique<Scene>();
    glm::dvec3 lower(std::numeric_limits<double>::infinity()), upper(-lower);
    for (const glm::dvec3& p : positions) {
        lower = glm::min(lower, p);
        upper = glm::max(upper, p);
    }
    if (!positions.empty()) {
        const double diagonal = glm::length(upper - lower);
        if (!std::isfinite(diagonal)) return badInput("the scene has positions that are not finite");
        scene->centre = lower + 0.5 * (upper - lower);
        if (diagonal > 0.0) scene->scale = std::exp2(-std::floor(std::log2(diagonal)));
        // Positions are rounded where they are, whatever the middle: 2^-53 of the largest coordinate.
        const glm::dvec3 largest = glm::max(glm::abs(lower), glm::abs(upper));
        const double rounding = 1.2e-16 * std::max({largest.x, largest.y, largest.z}) * scene->scale;
        scene->notSelf = std::max(kNotSelf, 100.0 * rounding);
    }
    scene->positions.reserve(positions.size());
    for (const glm::dvec3& p : positions) scene->positions.push_back((p - scene->centre) * scene->scale);
    scene->corners.assign(corners.begin(), corners.end());
    scene->mayHaveHoles = std::move(mayHaveHoles);
    scene->isSolid = std::move(isSolid);

    scene->device = rtcNewDevice("ignore_config_files=1,max_isa=avx2");
    if (!scene->device) return failure("Embree cannot start");
    scene->scene = rtcNewScene(scene->device);
    rtcSetSceneFlags(scene->scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<glm::vec3*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(glm::vec3), scene->positions.size()));
    auto* indices = static_cast<glm::uvec3*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(glm::uvec3), scene->corners.size()));
    if ((!vertices && !scene->positions.empty()) || (!indices && !scene->corners.empty())) {
        rtcReleaseGeometry(geometry);
        return failure("Embree: out of memory for the scene's triangles");
    }
    for (std::size_t i = 0; i < scene->positions.size(); ++i) vertices[i] = glm::vec3(scene->positions[i]);
    std::copy(scene->corners.begin(), scene->corners.end(), indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene->scene);
    if (rtcGetDeviceError(scene->device) != RTC_ERROR_NONE) return failure("Embree cannot build the scene's tree");
    return std::unique_ptr<OcclusionScene>(new OcclusionScene(std::move(scene)));
}

void OcclusionScene::blocked(const glm::dvec3& origin, std::uint32_t own, std::span<const Ray> rays,
                             std::span<std::uint8_t> blocked) const {
    UMBRIEL_ASSERT(rays.size() == blocked.size(), "an answer for each ray");
    const Scene& scene = *_scene;
    Query query;
    query.scene = &scene;
    query.origin = (origin - scene.centre) * scene.scale;
    query.own = own;
    for (std::size_t first = 0; first < rays.size(); first += kLanes) {
        const auto count = static_cast<unsigned>(std::min<std::size_t>(kLanes, rays.size() - first));
        alignas(32) std::array<int, kLanes> valid{};
        RTCRay8 packet{};
        for (unsigned i = 0; i < count; ++i) {
            const Ray& ray = rays[first + i];
            const double length = glm::length(ray.direction);
            if (!(length > 0.0) || !std::isfinite(length) || !(ray.farDistance > 0.0)) continue;
            valid[i] = -1;
            const glm::dvec3 direction = ray.direction / length;
            query.directions[i] = direction;
            query.farDistances[i] = ray.farDistance * length * scene.scale;
            const glm::vec3 start(query.origin - kStartBehind * direction);
            packet.org_x[i] = start.x;
            packet.org_y[i] = start.y;
            packet.org_z[i] = start.z;
            packet.dir_x[i] = static_cast<float>(direction.x);
            packet.dir_y[i] = static_cast<float>(direction.y);
            packet.dir_z[i] = static_cast<float>(direction.z);
            packet.tnear[i] = 0.0f;
            packet.tfar[i] = static_cast<float>(query.farDistances[i] + 2.0 * kStartBehind);
            packet.mask[i] = ~0u;
            packet.id[i] = i;
        }
        rtcInitIntersectContext(&query.context);
        query.context.filter = filter<Scene>;
        rtcOccluded8(valid.data(), scene.scene, &query.context, &packet);
        // A blocked ray comes back with tfar -infinity.
        for (unsigned i = 0; i < count; ++i) blocked[first + i] = valid[i] != 0 && packet.tfar[i] < 0.0f ? 1 : 0;
    }
}

bool OcclusionScene::blocked(const glm::dvec3& origin, std::uint32_t own, const Ray& ray) const {
    std::uint8_t result = 0;
    blocked(origin, own, std::span(&ray, 1), std::span(&result, 1));
    return result != 0;
}

glm::dvec3 OcclusionScene::onPlaneOf(std::uint32_t triangle, const glm::dvec3& point) const {
    const auto t = _scene->cornersOf(triangle);
    const glm::dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    const double square = glm::dot(normal, normal);
    if (!(square > 0.0)) return point;
    const glm::dvec3 p = (point - _scene->centre) * _scene->scale;
    const glm::dvec3 moved = p - normal * (glm::dot(p - t[0], normal) / square);
    return moved / _scene->scale + _scene->centre;
}

}  // namespace umbriel::trace
