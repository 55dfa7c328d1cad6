#pragma once

#include <map>
#include <string>

#include "server/bake/job_queue.h"
#include "server/gl/context.h"

namespace umbriel {

// The jobs of a bake (common/visibility/bake_job.h), by kind. A mesh and its tree are kept until another bake comes, so
// that a client that was killed finds them. slots: shards at once, as many as the queue has threads. context: of the
// rasteriser (MapMaker::Gl), which opens one of its own when it is first asked for.
std::map<std::string, JobHandler> visibilityJobs(int slots, const gl::ContextOptions& context = {});

}  // namespace umbriel
