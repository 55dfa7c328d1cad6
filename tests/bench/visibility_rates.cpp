// What a bake costs beside the bare ray caster, in one run on one mesh with the same directions: CPU seconds of
// rtcOccluded8 alone, of the makers, and of maker, packing and file. See docs/umvis.md for how to run it.
#include <embree3/rtcore.h>
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "common/visibility/bake.h"
#include "common/visibility/mesh.h"
#include "tests/unit/visibility/test_meshes.h"

namespace {

using namespace umbriel;

double cpu() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double median(std::vector<double> values) {
    std::ranges::sort(values);
    return values[values.size() / 2];
}

// The plain loop: offset 1e-4 of the diagonal along the normal, vertices as they come in the rows, one thread.
struct Bare {
    RTCDevice device;
    RTCScene scene;
    explicit Bare(const visibility::BakeMesh& mesh, const char* config)
        : device(rtcNewDevice(config)), scene(rtcNewScene(device)) {
        rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* v = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size());
        std::copy(mesh.positions.begin(), mesh.positions.end(), static_cast<glm::vec3*>(v));
        auto* i = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size());
        std::copy(mesh.triangles.begin(), mesh.triangles.end(), static_cast<glm::uvec3*>(i));
        rtcCommitGeometry(g);
        rtcAttachGeometry(scene, g);
        rtcReleaseGeometry(g);
        rtcCommitScene(scene);
    }
    std::size_t run(const visibility::BakeMesh& mesh, const trace::DirectionPackets& set, std::uint32_t firstRow,
                    std::uint32_t rows) const {
        std::size_t hits = 0;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
        alignas(32) int valid[8];
        std::fill_n(valid, 8, -1);
        for (std::uint32_t row = firstRow; row < firstRow + rows; ++row) {
            const trace::Origin o = visibility::origin(mesh, row, visibility::DirectionFrame::Vertex);
            const glm::vec3 from = mesh.positions[o.position] + o.normal * static_cast<float>(mesh.diagonal * 1e-4);
            for (std::size_t lane = 0; lane < set.lanes(); lane += 8) {
                RTCRay8 ray;
                for (int i = 0; i < 8; ++i) {
                    const glm::vec3 d = trace::worldDirection(o, set.x[lane + i], set.y[lane + i], set.z[lane + i]);
                    ray.org_x[i] = from.x, ray.org_y[i] = from.y, ray.org_z[i] = from.z;
                    ray.dir_x[i] = d.x, ray.dir_y[i] = d.y, ray.dir_z[i] = d.z;
                    ray.tnear[i] = 0, ray.tfar[i] = std::numeric_limits<float>::infinity(), ray.mask[i] = ~0u;
                    ray.flags[i] = 0, ray.time[i] = 0, ray.id[i] = static_cast<unsigned>(i);
                }
                rtcOccluded8(valid, scene, &context, &ray);
                for (int i = 0; i < 8; ++i) hits += ray.tfar[i] < 0;
            }
        }
        return hits;
    }
};

}  // namespace

int main(int count, char** arguments) {
    if (count < 2) {
        std::fprintf(stderr, "usage: bench_visibility MESH [SIZE=32] [RUNS=5] [MAXROWS]\n");
        return 2;
    }
    const auto mesh = arguments[1] == std::string("cloth3k")    ? visibility::test::cloth(80, 40)
                      : arguments[1] == std::string("cloth35k") ? visibility::test::cloth(280, 125)
                                                                : visibility::test::load(arguments[1]);
    if (!mesh) {
        std::fprintf(stderr, "%s: cannot be read\n", arguments[1]);
        return 2;
    }
    const auto prepared = visibility::prepare(*mesh);
    if (!prepared) {
        std::fprintf(stderr, "%s\n", prepared.error().message.c_str());
        return 2;
    }
    const visibility::Mapping mapping{visibility::MappingKind::HemiSphere,
                                      static_cast<std::uint32_t>(count > 2 ? std::atoi(arguments[2]) : 32)};
    const int runs = count > 3 ? std::atoi(arguments[3]) : 5;
    std::uint32_t rows = std::min<std::uint32_t>(static_cast<std::uint32_t>(prepared->rows.size()),
                                                 count > 4 ? static_cast<std::uint32_t>(std::atoi(arguments[4])) : ~0u);
    const trace::DirectionPackets set = visibility::directionPackets(mapping);
    if (rows < prepared->rows.size()) rows = rows / visibility::kRowsPerBlock * visibility::kRowsPerBlock;
    const double rays = static_cast<double>(rows) * visibility::pixelCount(mapping);
    std::printf("%s: %zu vertices, %zu triangles, %zu rows; %u rows x %u directions\n", arguments[1],
                mesh->positions.size(), mesh->indices.size() / 3, prepared->rows.size(), rows,
                visibility::pixelCount(mapping));
    const Bare bare(*prepared, "threads=1"), bareAvx2(*prepared, "threads=1,max_isa=avx2");
    std::vector<std::unique_ptr<visibility::Baker>> bakers;
    for (const trace::Guard guard : {trace::Guard::Exact, trace::Guard::Fast, trace::Guard::FastFan}) {
        visibility::BakeSettings settings;
        settings.mapping = mapping;
        settings.guard = guard;
        const double start = cpu();
        bakers.push_back(std::move(*visibility::Baker::create(*prepared, settings)));
        std::printf("guard %d: built in %.3f CPU s\n", static_cast<int>(guard), cpu() - start);
    }
    std::vector<std::vector<double>> seconds(2 + bakers.size());
    std::size_t hits = 0;
    for (int run = 0; run < runs; ++run) {
        double start = cpu();
        hits += bare.run(*prepared, set, 0, rows);
        seconds[0].push_back(cpu() - start);
        start = cpu();
        hits += bareAvx2.run(*prepared, set, 0, rows);
        seconds[1].push_back(cpu() - start);
        for (std::size_t i = 0; i < bakers.size(); ++i) {
            start = cpu();
            // Rays, packing, compression, checksums, and the file on disk.
            const auto shard = bakers[i]->shard(0, rows);
            std::ofstream("/tmp/visibility_rates.umvis", std::ios::binary)
                .write(reinterpret_cast<const char*>(shard->data()), static_cast<std::streamsize>(shard->size()));
            seconds[2 + i].push_back(cpu() - start);
            if (run == 0) std::printf("%.1f bytes a row in the file\n", static_cast<double>(shard->size()) / rows);
        }
    }
    const char* names[] = {"bare rtcOccluded8", "bare, avx2", "exact", "fast", "fast + fan"};
    for (std::size_t i = 0; i < seconds.size(); ++i) {
        const double s = median(seconds[i]);
        std::printf("%-18s %8.3f CPU s  %6.2f M rays/core-s  %5.1f %%\n", names[i], s, rays / s * 1e-6,
                    100.0 * median(seconds[0]) / s);
    }
    return hits == 0;
}
