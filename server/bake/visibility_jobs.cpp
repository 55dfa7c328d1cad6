#include "server/bake/visibility_jobs.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "common/visibility/bake.h"
#include "common/visibility/bake_job.h"
#include "common/visibility/map_maker.h"
#include "common/visibility/mesh.h"
#include "server/bake/gl_worker.h"
#include "server/bake/process_meter.h"

namespace umbriel {
namespace {

using visibility::BakeJob;
using visibility::Baker;
using visibility::kRowsPerBlock;

struct Prepared {
    visibility::BakeMesh mesh;
    std::unique_ptr<Baker> baker;  // borrows the mesh
    std::unique_ptr<GlWorker> gl;  // the same; of MapMaker::Gl only
};

template <class Element>
Result<std::vector<Element>> elementsOf(const wire::Blob& blob) {
    if (blob.data.elementSize() != sizeof(Element))
        return badInput(fmt::format("a part of the mesh has elements of {} bytes, {} were expected",
                                    blob.data.elementSize(), sizeof(Element)));
    std::vector<Element> elements(blob.data.size());
    blob.data.read(0, std::as_writable_bytes(std::span(elements)));
    return elements;
}

// Few enough that a server that also draws can pause: some milliseconds on a graphics card, and software rendering at
// idle priority gives way by itself.
constexpr std::uint32_t kRowsDrawnPerSlice = 32;

// Empty when goOn said no.
Result<std::vector<visibility::EncodedBlock>> drawnBlock(const Prepared& prepared, std::uint32_t rowBlock,
                                                         const std::function<bool()>& goOn) {
    const visibility::Mapping& mapping = prepared.baker->header().mapping;
    const std::size_t bytes = visibility::maskBytes(visibility::pixelCount(mapping));
    const std::uint32_t rows = prepared.baker->rowsInBlock(rowBlock);
    std::vector<std::uint8_t> masks(rows * bytes);
    for (std::uint32_t row = 0; row < rows; row += kRowsDrawnPerSlice) {
        if (!goOn()) return std::vector<visibility::EncodedBlock>{};
        const std::uint32_t count = std::min(kRowsDrawnPerSlice, rows - row);
        const auto drawn = prepared.gl->masks(rowBlock * kRowsPerBlock + row, count,
                                              std::span(masks).subspan(row * bytes, count * bytes));
        if (!drawn) return drawn.error();
    }
    return prepared.baker->blockOfMasks(rowBlock, masks, goOn);
}

class Workshop {
 public:
    Workshop(int slots, const gl::ContextOptions& context) : _slots(std::max(1, slots)), _context(context) {}

    Result<std::vector<std::byte>> prepare(JobWork& work) {
        const auto job = visibility::decodeBakeJob(work.payload());
        if (!job) return job.error();
        const auto ready = get(*job, work.blobs());
        if (!ready) return ready.error();
        const visibility::MapHeader& header = (*ready)->baker->header();
        return visibility::encodeReadiness(
            {header.bakeClass, static_cast<std::uint32_t>(_slots), header.meshHash, header.directionHash});
    }

    Result<std::vector<std::byte>> shard(JobWork& work) {
        const auto job = visibility::decodeBakeJob(work.payload());
        if (!job) return job.error();
        const auto ready = get(*job, work.blobs());
        if (!ready) return ready.error();
        const Baker& baker = *(*ready)->baker;
        const std::uint64_t total = (*ready)->mesh.rows.size();
        if (job->firstRow % kRowsPerBlock != 0 || job->firstRow >= total || job->rowCount == 0 ||
            job->rowCount > total - job->firstRow ||
            (job->rowCount % kRowsPerBlock != 0 && job->firstRow + job->rowCount != total))
            return badInput(
                fmt::format("rows {} to {} of {} are no shard", job->firstRow, job->firstRow + job->rowCount, total));
        const auto first = static_cast<std::uint32_t>(job->firstRow / kRowsPerBlock);
        const auto count = static_cast<std::uint32_t>((job->rowCount + kRowsPerBlock - 1) / kRowsPerBlock);
        // Maps are drawn by threads of GlWorker's and, in software, of the driver's.
        std::optional<ProcessMeter::Span> span;
        if ((*ready)->gl) span.emplace(_meter);
        std::vector<visibility::EncodedBlock> blocks;
        for (std::uint32_t i = 0; i < count; ++i) {
            const float progress = static_cast<float>(i) / static_cast<float>(count);
            const auto goOn = [&] { return work.alive(progress); };
            auto block = (*ready)->gl ? drawnBlock(**ready, first + i, goOn) : baker.block(first + i, goOn);
            if (!block) return block.error();
            if (block->empty()) return failure("the job was stopped");
            std::ranges::move(*block, std::back_inserter(blocks));
        }
        visibility::MapHeader header = baker.header();
        header.firstRow = job->firstRow;
        header.rowCount = job->rowCount;
        auto file = visibility::assembleShard(std::move(header), (*ready)->mesh.vertexRow, blocks);
        if (span) work.setProcessorTime(span->end());
        return file;
    }

 private:
    using Key = std::pair<visibility::Bytes, std::vector<Hash128>>;

    // What others made ready, or ready now; whoever needs the same meanwhile waits.
    Result<std::shared_ptr<const Prepared>> get(BakeJob job, std::span<const wire::Blob> blobs) {
        job.firstRow = job.rowCount = 0;
        Key key{visibility::encodeBakeJob(job), {}};
        for (const wire::Blob& blob : blobs) key.second.push_back(blob.ref.hash);
        const std::lock_guard lock(_mutex);
        if (_prepared && _key == key) return _prepared;
        _prepared.reset();  // never two meshes at once
        if (blobs.size() != 2) return badInput("a bake needs positions and indices of its mesh");
        auto positions = elementsOf<glm::vec3>(blobs[0]);
        if (!positions) return positions.error();
        auto indices = elementsOf<std::uint32_t>(blobs[1]);
        if (!indices) return indices.error();
        auto mesh = visibility::prepare({std::move(*positions), std::move(*indices)});
        if (!mesh) return mesh.error();
        if (mesh->hash != job.meshHash || visibility::directionHash(job.settings.mapping) != job.directionHash)
            return failure(
                "this server prepares the mesh or the directions differently: another version of Umbriel, or a "
                "processor that rounds differently");
        auto prepared = std::make_shared<Prepared>();
        prepared->mesh = std::move(*mesh);
        const bool draws = job.settings.maker == visibility::MapMaker::Gl;
        if (draws) {
            auto worker = GlWorker::create(prepared->mesh, job.settings.mapping,
                                           job.settings.farShare * prepared->mesh.diagonal, _context);
            if (!worker) return worker.error();
            prepared->gl = std::move(*worker);
        }
        auto baker = draws ? Baker::createForMasks(prepared->mesh, job.settings, prepared->gl->renderer())
                           : Baker::create(prepared->mesh, job.settings, _slots);
        if (!baker) return baker.error();
        prepared->baker = std::move(*baker);
        _prepared = std::move(prepared);
        _key = std::move(key);
        return _prepared;
    }

    int _slots;
    gl::ContextOptions _context;
    ProcessMeter _meter;
    std::mutex _mutex;
    Key _key;
    std::shared_ptr<const Prepared> _prepared;
};

}  // namespace

std::map<std::string, JobHandler> visibilityJobs(int slots, const gl::ContextOptions& context) {
    const auto workshop = std::make_shared<Workshop>(slots, context);
    return {{visibility::kPrepareJob, [workshop](JobWork& work) { return workshop->prepare(work); }},
            {visibility::kShardJob, [workshop](JobWork& work) { return workshop->shard(work); }}};
}

}  // namespace umbriel
