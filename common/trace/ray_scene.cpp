#include "common/trace/ray_scene.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/base/assert.h"
#include "common/trace/double_hit.h"
#include "common/trace/enlarged.h"
#include "common/trace/fan.h"

namespace umbriel::trace {
namespace {

// In units of the diagonal. Embree's box and triangle tests err by about 1e-7 across the ray; a box seen at an angle
// whose tangent is 1/100 makes that 1e-5.
constexpr double kMargin = 2e-5;
constexpr double kFastOffset = 1e-6;
// Rays of Exact start where nothing but own triangles can be; far above the rounding at the origin.
constexpr double kLargestStart = 1e-4;
// A hit is sure only where the ray and the triangle's plane form an angle whose sine is above this: below, the error
// across the ray grows by more than the margin allows.
constexpr float kGrazing = 0.05f;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// The widest set that this processor has, up to the wanted one.
std::string available(std::string_view wanted) {
#if defined(__x86_64__) && defined(__GNUC__)
    if (wanted == "avx2" && __builtin_cpu_supports("avx2")) return "avx2";
    if ((wanted == "avx2" || wanted == "avx") && __builtin_cpu_supports("avx")) return "avx";
    if (wanted != "sse2" && __builtin_cpu_supports("sse4.2")) return "sse4.2";
    return "sse2";
#else
    return std::string(wanted);
#endif
}

}  // namespace

struct RayScene::Scene {
    Guard guard = Guard::Exact;
    std::string instructionSet;
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    NormalisedPositions normalised;
    std::vector<glm::uvec3> corners;
    Enlarged enlarged;  // Exact only; its corners are given to Embree and then dropped
    float surelyAhead = 0.0f;

    ~Scene() {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }

    glm::dvec3 relative(std::uint32_t corner, std::uint32_t origin) const {
        return glm::dvec3(normalised.positions[corner]) - glm::dvec3(normalised.positions[origin]);
    }
    bool owns(std::uint32_t triangle, std::uint32_t position) const {
        const glm::uvec3& t = corners[triangle];
        return t.x == position || t.y == position || t.z == position;
    }
    std::optional<double> distance(std::uint32_t triangle, std::uint32_t origin, const glm::dvec3& direction) const {
        const glm::uvec3& t = corners[triangle];
        return hitDistance(direction, relative(t.x, origin), relative(t.y, origin), relative(t.z, origin));
    }
};

namespace {

// What the filter needs beside the ray.
struct Query {
    RTCIntersectContext context;  // first: Embree hands a pointer to it back
    const void* scene = nullptr;
    std::uint32_t origin = 0;
    double farDistance = 0.0;
};

}  // namespace

namespace {

// Accepts a candidate of Exact or turns it down; Embree then looks on.
template <class Scene>
void filterExact(const RTCFilterFunctionNArguments* arguments) {
    const auto& query = *reinterpret_cast<const Query*>(arguments->context);
    const auto& scene = *static_cast<const Scene*>(query.scene);
    const unsigned n = arguments->N;
    RTCRayN* ray = arguments->ray;
    RTCHitN* hit = arguments->hit;
    for (unsigned i = 0; i < n; ++i) {
        if (arguments->valid[i] != -1) continue;
        const unsigned primitive = RTCHitN_primID(hit, n, i);
        const std::uint32_t triangle = scene.enlarged.original[primitive];
        if (scene.owns(triangle, query.origin)) {
            arguments->valid[i] = 0;
            continue;
        }
        const float u = RTCHitN_u(hit, n, i), v = RTCHitN_v(hit, n, i);
        const glm::vec3 d(RTCRayN_dir_x(ray, n, i), RTCRayN_dir_y(ray, n, i), RTCRayN_dir_z(ray, n, i));
        const float distance = RTCRayN_tfar(ray, n, i);
        if (std::min(std::min(u, v), 1.0f - u - v) >= scene.enlarged.sure[primitive] && distance > scene.surelyAhead &&
            distance < static_cast<float>(query.farDistance) * 0.99999f) {
            const glm::vec3 g(RTCHitN_Ng_x(hit, n, i), RTCHitN_Ng_y(hit, n, i), RTCHitN_Ng_z(hit, n, i));
            const float cosine = glm::dot(g, d);
            if (cosine * cosine > kGrazing * kGrazing * glm::dot(g, g)) continue;
        }
        const auto exact = scene.distance(triangle, query.origin, glm::dvec3(d));
        if (!exact || *exact > query.farDistance) arguments->valid[i] = 0;
    }
}

// The distance, not below the truth by more than rounding, from a point to a triangle.
double pointTriangleDistance(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    // Ericson 2005, 5.1.5, with the region tests left to the minimum over edges.
    const auto toEdge = [&](const glm::dvec3& from, const glm::dvec3& to) {
        const glm::dvec3 e = to - from;
        const double square = glm::dot(e, e);
        const double s = square > 0.0 ? std::clamp(glm::dot(p - from, e) / square, 0.0, 1.0) : 0.0;
        return glm::length(p - (from + e * s));
    };
    double nearest = std::min({toEdge(a, b), toEdge(b, c), toEdge(c, a)});
    const glm::dvec3 n = glm::cross(b - a, c - a);
    const double length = glm::length(n);
    if (length > 0.0) {
        const bool above = glm::dot(glm::cross(b - a, n), p - a) <= 0.0 &&
                           glm::dot(glm::cross(c - b, n), p - b) <= 0.0 && glm::dot(glm::cross(a - c, n), p - c) <= 0.0;
        if (above) nearest = std::min(nearest, std::abs(glm::dot(p - a, n)) / length);
    }
    return nearest;
}

template <class Scene>
struct NearQuery {
    const Scene* scene = nullptr;
    std::uint32_t origin = 0;
    double nearest = 0.0;
};

template <class Scene>
bool nearCallback(RTCPointQueryFunctionArguments* arguments) {
    auto& query = *static_cast<NearQuery<Scene>*>(arguments->userPtr);
    const std::uint32_t triangle = query.scene->enlarged.original[arguments->primID];
    if (query.scene->owns(triangle, query.origin)) return false;
    const glm::uvec3& t = query.scene->corners[triangle];
    const double distance =
        pointTriangleDistance(glm::dvec3(0.0), query.scene->relative(t.x, query.origin),
                              query.scene->relative(t.y, query.origin), query.scene->relative(t.z, query.origin));
    query.nearest = std::min(query.nearest, distance);
    return false;  // the radius stays: it is small
}

}  // namespace

RayScene::RayScene(std::unique_ptr<Scene> scene) : _scene(std::move(scene)) {}
RayScene::~RayScene() = default;
Guard RayScene::guard() const {
    return _scene->guard;
}
double RayScene::diagonal() const {
    return _scene->normalised.diagonal / _scene->normalised.scale;
}

std::string RayScene::description() const {
    const auto version = rtcGetDeviceProperty(_scene->device, RTC_DEVICE_PROPERTY_VERSION);
    return fmt::format("Embree {}.{}.{} {}", version / 10000, version / 100 % 100, version % 100,
                       _scene->instructionSet);
}

Result<std::unique_ptr<RayScene>> RayScene::create(const Triangles& triangles, Guard guard, int threads,
                                                   std::string_view instructionSet) {
    UMBRIEL_ASSERT(!triangles.corners.empty(), "a ray scene without triangles");
    auto scene = std::make_unique<Scene>();
    scene->guard = guard;
    scene->normalised = normalise(triangles.positions);
    scene->corners.assign(triangles.corners.begin(), triangles.corners.end());
    scene->surelyAhead = static_cast<float>(1e-5 * scene->normalised.diagonal);
    scene->instructionSet = available(instructionSet);
    const std::string config = fmt::format("ignore_config_files=1,max_isa={}{}", scene->instructionSet,
                                           threads > 0 ? fmt::format(",threads={}", threads) : "");
    scene->device = rtcNewDevice(config.c_str());
    if (!scene->device) return failure("the ray tracer (Embree) does not start on this machine");
    scene->scene = rtcNewScene(scene->device);
    rtcSetSceneBuildQuality(scene->scene, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    const auto buffer = [&](RTCBufferType type, RTCFormat format, std::size_t count) {
        return rtcSetNewGeometryBuffer(geometry, type, 0, format, 12, count);
    };
    bool allocated = false;
    if (guard == Guard::Exact) {
        for (std::uint32_t t = 0; t < scene->corners.size(); ++t) {
            const glm::uvec3& c = scene->corners[t];
            const auto& p = scene->normalised.positions;
            appendEnlarged(glm::dvec3(p[c.x]), glm::dvec3(p[c.y]), glm::dvec3(p[c.z]), t,
                           kMargin * scene->normalised.diagonal, scene->enlarged);
        }
        auto& soup = scene->enlarged.corners;
        void* vertices = buffer(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, soup.size());
        auto* indices = static_cast<std::uint32_t*>(buffer(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, soup.size() / 3));
        allocated = vertices && indices;
        if (allocated) {
            std::copy_n(soup.data(), soup.size(), static_cast<glm::vec3*>(vertices));
            for (std::uint32_t i = 0; i < soup.size(); ++i) indices[i] = i;
            std::vector<glm::vec3>().swap(soup);
            rtcSetGeometryOccludedFilterFunction(geometry, filterExact<Scene>);
            rtcSetGeometryIntersectFilterFunction(geometry, filterExact<Scene>);
            rtcSetGeometryPointQueryFunction(geometry, nearCallback<Scene>);
        }
    } else {
        const auto& p = scene->normalised.positions;
        void* vertices = buffer(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, p.size());
        void* indices = buffer(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, scene->corners.size());
        allocated = vertices && indices;
        if (allocated) {
            std::copy_n(p.data(), p.size(), static_cast<glm::vec3*>(vertices));
            std::copy_n(scene->corners.data(), scene->corners.size(), static_cast<glm::uvec3*>(indices));
        }
    }
    if (allocated) {
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene->scene, geometry);
    }
    rtcReleaseGeometry(geometry);
    if (allocated) rtcCommitScene(scene->scene);
    if (const RTCError error = rtcGetDeviceError(scene->device); !allocated || error != RTC_ERROR_NONE) {
        return failure(fmt::format("the ray tracer (Embree, error {}) has no memory for {} triangles",
                                   static_cast<int>(error), triangles.corners.size()));
    }
    return std::unique_ptr<RayScene>(new RayScene(std::move(scene)));
}

struct RayScene::Tracer::State {
    const Scene& scene;
    Fan fan;
    std::vector<glm::dvec3> edges;
    std::vector<std::uint8_t> fanBlocked;

    // Everything about a vertex that its packets share.
    struct Start {
        glm::vec3 upper;  // origin of lanes on the normal's side
        glm::vec3 lower;
        float nearDistance = 0.0f;
        float farDistance = kInfinity;
        Query query;
    };

    Start prepare(const Origin& origin, std::span<const std::uint32_t> own, double farDistance);
    double startDistance(const Origin& origin);
    template <class Ray>
    void fill(const Start& start, const Origin& origin, const DirectionPackets& set, std::size_t packet, Ray& ray);
};

RayScene::Tracer::Tracer(const RayScene& scene) : _state(new State{*scene._scene, {}, {}, {}}) {}
RayScene::Tracer::~Tracer() = default;

double RayScene::Tracer::State::startDistance(const Origin& origin) {
    // Rays of Exact start beyond their own triangles' rounding and before anything else. The radius is small, so this
    // touches little more than the leaf the point lies in.
    NearQuery<Scene> nearest{&scene, origin.position, kLargestStart * scene.normalised.diagonal};
    const glm::vec3& p = scene.normalised.positions[origin.position];
    RTCPointQuery query{p.x, p.y, p.z, 0.0f, static_cast<float>(nearest.nearest)};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene.scene, &query, &context, nullptr, &nearest);
    return 0.5 * nearest.nearest;
}

RayScene::Tracer::State::Start RayScene::Tracer::State::prepare(const Origin& origin,
                                                                std::span<const std::uint32_t> own,
                                                                double farDistance) {
    Start start;
    const glm::vec3& p = scene.normalised.positions[origin.position];
    start.upper = start.lower = p;
    start.query.scene = &scene;
    start.query.origin = origin.position;
    start.query.farDistance = farDistance * scene.normalised.scale;
    start.farDistance = static_cast<float>(start.query.farDistance);
    rtcInitIntersectContext(&start.query.context);
    start.query.context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    if (scene.guard == Guard::Exact) {
        start.nearDistance = static_cast<float>(startDistance(origin));
        start.farDistance *= 1.00001f;  // the filter decides what is too far
    } else {
        const glm::vec3 lift = origin.normal * static_cast<float>(kFastOffset * scene.normalised.diagonal);
        start.upper = p + lift;
        start.lower = p - lift;
    }
    edges.clear();
    if (scene.guard != Guard::Fast) {
        for (const std::uint32_t triangle : own) {
            const glm::uvec3& t = scene.corners[triangle];
            const int apex = t.x == origin.position ? 0 : t.y == origin.position ? 1 : 2;
            edges.push_back(scene.relative(t[(apex + 1) % 3], origin.position));
            edges.push_back(scene.relative(t[(apex + 2) % 3], origin.position));
        }
    }
    fan.reset(origin, edges);
    return start;
}

template <class Ray>
void RayScene::Tracer::State::fill(const Start& start, const Origin& origin, const DirectionPackets& set,
                                   std::size_t packet, Ray& ray) {
    const std::size_t lane = packet * kPacket;
    const glm::vec3& from = lane >= set.lowerBegin ? start.lower : start.upper;
    const float* x = &set.x[lane];
    const float* y = &set.y[lane];
    const float* z = &set.z[lane];
    const glm::mat3& a = origin.axes;
    for (std::size_t i = 0; i < kPacket; ++i) {
        // worldDirection(), eight at a time.
        ray.dir_x[i] = (a[0].x * x[i] + a[1].x * y[i]) + a[2].x * z[i];
        ray.dir_y[i] = (a[0].y * x[i] + a[1].y * y[i]) + a[2].y * z[i];
        ray.dir_z[i] = (a[0].z * x[i] + a[1].z * y[i]) + a[2].z * z[i];
        ray.org_x[i] = from.x;
        ray.org_y[i] = from.y;
        ray.org_z[i] = from.z;
        ray.tnear[i] = start.nearDistance;
        ray.tfar[i] = start.farDistance;
        ray.time[i] = 0.0f;
        ray.mask[i] = ~0u;
        ray.id[i] = 0;
        ray.flags[i] = 0;
    }
}

void RayScene::Tracer::blocked(const Origin& origin, std::span<const std::uint32_t> own, const DirectionPackets& set,
                               double farDistance, std::span<std::uint8_t> blocked) {
    State& s = *_state;
    State::Start start = s.prepare(origin, own, farDistance);
    s.fan.blocked(set, blocked);
    for (std::size_t packet = 0; packet < set.packets(); ++packet) {
        alignas(32) int valid[kPacket];
        unsigned wanted = 0;
        for (std::size_t i = 0; i < kPacket; ++i) {
            const bool used = set.pixel[packet * kPacket + i] != kNoPixel;
            const bool trace = used && (blocked[packet] >> i & 1) == 0;
            valid[i] = trace ? -1 : 0;
            wanted |= static_cast<unsigned>(trace) << i;
            if (!used) blocked[packet] &= static_cast<std::uint8_t>(~(1u << i));
        }
        if (wanted == 0) continue;
        RTCRay8 ray;
        s.fill(start, origin, set, packet, ray);
        rtcOccluded8(valid, s.scene.scene, &start.query.context, &ray);
        unsigned hit = 0;
        for (std::size_t i = 0; i < kPacket; ++i) hit |= static_cast<unsigned>(ray.tfar[i] < 0.0f) << i;
        blocked[packet] |= static_cast<std::uint8_t>(hit & wanted);
    }
}

void RayScene::Tracer::distances(const Origin& origin, std::span<const std::uint32_t> own, const DirectionPackets& set,
                                 double farDistance, std::span<float> distances) {
    State& s = *_state;
    State::Start start = s.prepare(origin, own, farDistance);
    s.fanBlocked.resize(set.packets());
    s.fan.blocked(set, s.fanBlocked);
    const double unit = 1.0 / s.scene.normalised.scale;
    for (std::size_t packet = 0; packet < set.packets(); ++packet) {
        alignas(32) int valid[kPacket];
        for (std::size_t i = 0; i < kPacket; ++i) {
            const std::size_t lane = packet * kPacket + i;
            const bool fanned = (s.fanBlocked[packet] >> i & 1) != 0;
            valid[i] = set.pixel[lane] != kNoPixel && !fanned ? -1 : 0;
            distances[lane] = fanned ? 0.0f : kInfinity;
        }
        RTCRayHit8 hit;
        s.fill(start, origin, set, packet, hit.ray);
        for (std::size_t i = 0; i < kPacket; ++i) hit.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect8(valid, s.scene.scene, &start.query.context, &hit);
        for (std::size_t i = 0; i < kPacket; ++i) {
            if (valid[i] == 0 || hit.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
            const std::size_t lane = packet * kPacket + i;
            double distance = hit.ray.tfar[i];
            if (s.scene.guard == Guard::Exact) {
                const glm::dvec3 d(hit.ray.dir_x[i], hit.ray.dir_y[i], hit.ray.dir_z[i]);
                const auto exact = s.scene.distance(s.scene.enlarged.original[hit.hit.primID[i]], origin.position, d);
                if (exact) distance = *exact;
            }
            distances[lane] = static_cast<float>(distance * unit);
        }
    }
}

}  // namespace umbriel::trace
