#include "server/bake/visibility_jobs.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

#include "common/visibility/bake.h"
#include "common/visibility/bake_job.h"
#include "common/visibility/mesh.h"

namespace umbriel {
namespace {

using visibility::BakeJob;
using visibility::Baker;
using visibility::kRowsPerBlock;

struct Prepared {
    visibility::BakeMesh mesh;
    std::unique_ptr<Baker> baker;  // borrows the mesh
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

class Workshop {
 public:
    explicit Workshop(int slots) : _slots(std::max(1, slots)) {}

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
            return badInput(fmt::format("rows {} to {} of {} are no shard", job->firstRow,
                                        job->firstRow + job->rowCount, total));
        const auto first = static_cast<std::uint32_t>(job->firstRow / kRowsPerBlock);
        const auto count = static_cast<std::uint32_t>((job->rowCount + kRowsPerBlock - 1) / kRowsPerBlock);
        std::vector<visibility::EncodedBlock> blocks;
        for (std::uint32_t i = 0; i < count; ++i) {
            const float progress = static_cast<float>(i) / static_cast<float>(count);
            auto block = baker.block(first + i, [&] { return work.alive(progress); });
            if (block.empty()) return failure("the job was stopped");
            std::ranges::move(block, std::back_inserter(blocks));
        }
        visibility::MapHeader header = baker.header();
        header.firstRow = job->firstRow;
        header.rowCount = job->rowCount;
        return visibility::assembleShard(std::move(header), (*ready)->mesh.vertexRow, blocks);
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
            return failure("this server prepares the mesh or the directions differently: another version of Umbriel, or a "
                           "processor that rounds differently");
        auto prepared = std::make_shared<Prepared>();
        prepared->mesh = std::move(*mesh);
        auto baker = Baker::create(prepared->mesh, job.settings, _slots);
        if (!baker) return baker.error();
        prepared->baker = std::move(*baker);
        _prepared = std::move(prepared);
        _key = std::move(key);
        return _prepared;
    }

    int _slots;
    std::mutex _mutex;
    Key _key;
    std::shared_ptr<const Prepared> _prepared;
};

}  // namespace

std::map<std::string, JobHandler> visibilityJobs(int slots) {
    const auto workshop = std::make_shared<Workshop>(slots);
    return {{visibility::kPrepareJob, [workshop](JobWork& work) { return workshop->prepare(work); }},
            {visibility::kShardJob, [workshop](JobWork& work) { return workshop->shard(work); }}};
}

}  // namespace umbriel
