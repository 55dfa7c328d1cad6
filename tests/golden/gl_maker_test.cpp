// The rasteriser's maps against the exact rays': a bit differs only where a silhouette runs between the centre of its
// pixel and what the rasteriser saw for it, which rays right there find as well.
#include "server/bake/gl_maker.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "common/base/processor_time.h"
#include "common/trace/ray_scene.h"
#include "common/visibility/bake.h"
#include "common/visibility/bake_job.h"
#include "common/visibility/map_maker.h"
#include "common/visibility/raster_plan.h"
#include "server/bake/visibility_jobs.h"
#include "tests/golden/gl_fixture.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel::gl {
namespace {

using namespace visibility;

constexpr double kEndless = std::numeric_limits<double>::infinity();

// The direction of a texel's centre.
glm::dvec3 directionOf(const RasterPlan& plan, std::uint32_t texel) {
    const std::uint32_t row = texel / plan.width;
    for (const RasterView& v : plan.views) {
        if (row < v.bottom || row >= v.bottom + v.height) continue;
        return glm::normalize(v.out + (v.x0 + (v.x1 - v.x0) * (texel % plan.width + 0.5) / v.width) * v.along +
                              (v.y0 + (v.y1 - v.y0) * (row - v.bottom + 0.5) / v.height) * v.up);
    }
    return {};
}

struct GlMakerTest : GlTest {
    struct Difference {
        std::uint64_t bits = 0, differing = 0, apart = 0, blocked = 0;
    };

    Difference compare(const Mesh& loaded, const Mapping& mapping, double farShare, std::uint32_t everyRow) {
        const BakeMesh mesh = *prepare(loaded);
        const double far = farShare * mesh.diagonal;
        const auto maker = require(GlMaker::create(mesh, mapping, far));
        const auto scene = require(trace::RayScene::create(mesh.view(), trace::Guard::Exact, 1));
        trace::RayScene::Tracer tracer(*scene);
        const trace::DirectionPackets set = directionPackets(mapping);
        const MaskPacker packer(set);
        const RasterPlan plan = rasterPlan(mapping);
        const std::uint32_t pixels = pixelCount(mapping);
        std::vector<std::uint8_t> blocked(set.packets()), mask(maskBytes(pixels));
        std::vector<std::uint8_t> all(mesh.rows.size() * mask.size());
        const auto done = maker->masks(0, static_cast<std::uint32_t>(mesh.rows.size()), all);
        EXPECT_TRUE(done) << done.error().message;
        Difference d;
        for (std::uint32_t row = 0; row < mesh.rows.size(); row += everyRow) {
            const trace::Origin o = origin(mesh, row, directionFrame(mapping));
            tracer.blocked(o, mesh.ownTriangles(o.position), set, far, blocked);
            packer.pack(blocked, mask);
            const auto drawn = std::span(all).subspan(row * mask.size(), mask.size());
            for (std::uint32_t p = 0; p < pixels; ++p) {
                ++d.bits;
                d.blocked += !isOpen(mask, p);
                if (isOpen(mask, p) == isOpen(drawn, p)) continue;
                ++d.differing;
                const glm::dvec3 centre = directionOf(plan, plan.texel[p]);
                const bool lower = directionSide(mapping) == DirectionSide::Own && centre.z < 0;
                const double width = (plan.views[0].x1 - plan.views[0].x0) / plan.width;
                if (!someRayFinds(isOpen(drawn, p), tracer, mesh, o, centre, far, kReach * width, lower)) ++d.apart;
            }
        }
        return d;
    }

    // How far from a texel's centre, in texels, the silhouette may run that decides its bit: drivers place corners on a
    // grid of 1/256 texel, and the eye is lifted.
    static constexpr double kReach = 0.02;

    // Whether one of many rays around the direction, up to an angle away from it, finds this.
    static bool someRayFinds(bool open, trace::RayScene::Tracer& tracer, const BakeMesh& mesh, const trace::Origin& o,
                             const glm::dvec3& d, double far, double angle, bool lower) {
        const glm::dvec3 side =
            glm::normalize(glm::cross(d, std::abs(d.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0)));
        const glm::dvec3 other = glm::cross(d, side);
        trace::DirectionPackets around;
        constexpr int kRays = 512;
        for (int i = 0; i < kRays; ++i) {
            const double r = angle * std::sqrt((i + 0.0) / kRays), turn = 2.399963229728653 * i;
            const glm::dvec3 ray = glm::normalize(d + r * (std::cos(turn) * side + std::sin(turn) * other));
            around.x.push_back(float(ray.x)), around.y.push_back(float(ray.y)), around.z.push_back(float(ray.z));
            around.pixel.push_back(static_cast<std::uint32_t>(i));
        }
        around.lowerBegin = lower ? 0 : kRays;
        std::vector<std::uint8_t> blocked(around.packets());
        tracer.blocked(o, mesh.ownTriangles(o.position), around, far, blocked);
        return std::ranges::any_of(blocked, [&](std::uint8_t byte) { return open ? byte != 0xff : byte != 0; });
    }

    void expectSilhouettesOnly(const char* what, const Mesh& mesh, const Mapping& mapping, double farShare,
                               double share, std::uint32_t everyRow = 3) {
        const bool isLong = std::getenv("UMBRIEL_LONG") != nullptr;
        const Difference d = compare(mesh, mapping, farShare, isLong ? 1 : everyRow);
        if (isLong) {
            std::printf("%s, %s %u: %.2f %% blocked, %llu of %llu bits differ, %llu of them apart from silhouettes\n",
                        what, std::string(name(mapping.kind)).c_str(), mapping.size,
                        100.0 * static_cast<double>(d.blocked) / static_cast<double>(d.bits),
                        static_cast<unsigned long long>(d.differing), static_cast<unsigned long long>(d.bits),
                        static_cast<unsigned long long>(d.apart));
        }
        EXPECT_GT(d.blocked, 0u) << what;
        EXPECT_EQ(d.apart, 0u) << what;
        EXPECT_LE(static_cast<double>(d.differing), share * static_cast<double>(d.bits)) << what;
    }
};

// Planes are drawn as they are: what remains is the driver's grid of 1/256 pixel and the lift of the eye.
TEST_F(GlMakerTest, PlanesDifferFromRaysOnlyAtSilhouettes) {
    for (const Mapping& m : {Mapping{MappingKind::HemiCube, 16}, Mapping{MappingKind::SinglePlane, 32, 2.4},
                             Mapping{MappingKind::Cube, 12}}) {
        expectSilhouettesOnly("cloth", test::cloth(40, 20), m, kEndless, 1e-3);
        // Its right angles put many edges exactly onto centres of pixels, where either answer is right.
        expectSilhouettesOnly("accordion", test::accordion(6, 8, 0.2f), m, kEndless, 1e-2);
    }
}

// Others copy the nearest texel of a cube.
TEST_F(GlMakerTest, CopiesDifferFromRaysOnlyAtSilhouettes) {
    for (const Mapping& m : {Mapping{MappingKind::HemiSphere, 16}, Mapping{MappingKind::Octahedral, 24},
                             Mapping{MappingKind::Fibonacci, 300}}) {
        expectSilhouettesOnly("cloth", test::cloth(40, 20), m, kEndless, 0.05);
    }
}

TEST_F(GlMakerTest, CullingRadiusCutsWhereRaysEnd) {
    for (const double far : {0.05, 0.3}) {
        expectSilhouettesOnly("far", test::cloth(40, 20), {MappingKind::HemiCube, 16}, far, 1e-3);
    }
}

TEST_F(GlMakerTest, PlacesFarFromTheOriginDrawTheSame) {
    expectSilhouettesOnly("moved by 100 diagonals", test::moved(test::cloth(40, 20), {260.0, 180.0, -230.0}),
                          {MappingKind::HemiCube, 16}, kEndless, 1e-3);
}

TEST_F(GlMakerTest, GarmentsOfTheSharedDataDifferOnlyAtSilhouettes) {
    const auto mesh = test::loadShared("cloth/tshirt1900-triFolded.obj");
    if (!mesh) GTEST_SKIP() << "UMBRIEL_SHARED does not lead to data/cloth";
    expectSilhouettesOnly("folded shirt", *mesh, {MappingKind::HemiCube, 16}, kEndless, 1e-3, 16);
    expectSilhouettesOnly("folded shirt", *mesh, {MappingKind::HemiSphere, 32}, kEndless, 0.05, 16);
    if (!std::getenv("UMBRIEL_LONG")) return;
    const auto dress = test::loadShared("cloth/dress-v5k-f10k.obj");
    expectSilhouettesOnly("dress", *dress, {MappingKind::HemiCube, 16}, kEndless, 1e-3);
    expectSilhouettesOnly("dress", *dress, {MappingKind::HemiSphere, 32}, kEndless, 0.05);
}

TEST_F(GlMakerTest, PlateAndConvexMeshBlockNothingAndABoxBlocksAll) {
    for (const Mapping& m : {Mapping{MappingKind::HemiCube, 16}, Mapping{MappingKind::HemiSphere, 16}}) {
        const auto open = [&](const Mesh& loaded) {
            const BakeMesh mesh = *prepare(loaded);
            const auto maker = require(GlMaker::create(mesh, m, kEndless));
            const std::uint32_t rows = static_cast<std::uint32_t>(mesh.rows.size());
            std::vector<std::uint8_t> masks(rows * maskBytes(pixelCount(m)));
            EXPECT_TRUE(maker->masks(0, rows, masks));
            std::uint64_t count = 0;
            for (std::uint32_t row = 0; row < rows; ++row) {
                for (std::uint32_t p = 0; p < pixelCount(m); ++p)
                    count += isOpen(std::span(masks).subspan(row * maskBytes(pixelCount(m))), p);
            }
            return static_cast<double>(count) / (static_cast<double>(rows) * pixelCount(m));
        };
        EXPECT_EQ(open(test::plate(16)), 1.0);
        EXPECT_EQ(open(test::sphere(4)), 1.0);
        EXPECT_EQ(open(test::box(5, true)), 0.0);
    }
}

TEST_F(GlMakerTest, BitsDoNotDependOnWhichRowsAreDrawnTogether) {
    const BakeMesh mesh = *prepare(test::cloth(30, 20));
    const Mapping m{MappingKind::HemiSphere, 16};
    const auto maker = require(GlMaker::create(mesh, m, kEndless));
    const std::uint32_t rows = static_cast<std::uint32_t>(mesh.rows.size());
    const std::size_t bytes = maskBytes(pixelCount(m));
    std::vector<std::uint8_t> all(rows * bytes), one(bytes), some(7 * bytes);
    ASSERT_TRUE(maker->masks(0, rows, all));
    for (std::uint32_t row = 0; row + 7 < rows; row += 61) {
        ASSERT_TRUE(maker->masks(row, 1, one));
        EXPECT_TRUE(std::equal(one.begin(), one.end(), all.begin() + row * bytes)) << row;
        ASSERT_TRUE(maker->masks(row, 7, some));
        EXPECT_TRUE(std::equal(some.begin(), some.end(), all.begin() + row * bytes)) << row;
    }
}

// The thread of the job only waits: what a shard costs is what all threads of the process took, the driver's too.
TEST_F(GlMakerTest, AShardCostsWhatAllThreadsTook) {
    class Work final : public JobWork {
     public:
        Bytes description;
        std::vector<wire::Blob> contents;
        Duration cost{};
        std::span<const std::byte> payload() const override { return description; }
        std::span<const wire::Blob> blobs() const override { return contents; }
        bool alive(float) override { return true; }
        void setProcessorTime(Duration time) override { cost = time; }
    };
    const auto blobOf = [](const auto& elements, std::uint64_t name) {
        wire::Blob blob{{}, MultiStorage(sizeof(elements[0]))};
        blob.data.resize(elements.size());
        blob.data.write(0, std::as_bytes(std::span(elements)));
        blob.ref = {{name, 0}, sizeof(elements[0]), blob.data.byteSize()};
        return blob;
    };
    const Mesh loaded = test::cloth(30, 20);
    const BakeMesh mesh = *prepare(loaded);
    BakeJob job;
    job.settings.mapping = {MappingKind::HemiCube, 16};
    job.settings.maker = MapMaker::Gl;
    job.meshHash = mesh.hash;
    job.directionHash = directionHash(job.settings.mapping);
    job.rowCount = mesh.rows.size();
    Work work;
    work.description = encodeBakeJob(job);
    work.contents = {blobOf(loaded.positions, 1), blobOf(loaded.indices, 2)};
    auto handlers = visibilityJobs(1);
    const auto ready = handlers.at(kPrepareJob)(work);
    ASSERT_TRUE(ready) << ready.error().message;
    const Duration before = processorTime();
    const auto shard = handlers.at(kShardJob)(work);
    const Duration all = processorTime() - before;
    ASSERT_TRUE(shard) << shard.error().message;
    EXPECT_LE(work.cost, all);
    EXPECT_GE(toSeconds(work.cost), 0.9 * toSeconds(all));
}

TEST_F(GlMakerTest, CullingLeavesMostTrianglesOut) {
    const BakeMesh mesh = *prepare(test::cloth(80, 40));
    const auto maker = require(GlMaker::create(mesh, {MappingKind::HemiCube, 16}, kEndless));
    std::vector<std::uint8_t> masks(200 * maskBytes(3 * 16 * 16));
    ASSERT_TRUE(maker->masks(0, 200, masks));
    const double all = 200.0 * 5 * static_cast<double>(mesh.triangles.size());
    EXPECT_LT(static_cast<double>(maker->statistics().triangles), 0.4 * all);
    EXPECT_EQ(maker->statistics().rows, 200u);
}

}  // namespace
}  // namespace umbriel::gl
