#include "client/import/import_child.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <csignal>
#include <new>

#include "client/import/gltf_import.h"
#include "client/import/import_answer.h"
#include "client/import/import_error.h"
#include "client/import/obj_import.h"
#include "client/import/scene_suffix.h"
#include "common/base/log.h"
#include "common/scene/core_types.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define UMBRIEL_SHADOW_MEMORY 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define UMBRIEL_SHADOW_MEMORY 1
#endif
#endif

namespace umbriel {
namespace {

constexpr std::size_t kArgumentCount = 9;

bool limitResource(__rlimit_resource resource, rlim_t soft, rlim_t hard) {
    rlimit now{};
    if (getrlimit(resource, &now) != 0) return false;
    const rlimit wanted{std::min(soft, now.rlim_max), std::min(hard, now.rlim_max)};
    return setrlimit(resource, &wanted) == 0;
}

// False when a limit cannot be set: then nothing is parsed.
bool confineProcess(const ImportLimits& limits, int answerDescriptor) {
    const rlim_t cpu = static_cast<rlim_t>(std::max<std::int64_t>(limits.cpuTime.count(), 1));
    bool confined = limitResource(RLIMIT_CPU, cpu, cpu + 1) && limitResource(RLIMIT_CORE, 0, 0) &&
                    limitResource(RLIMIT_NOFILE, 64, 64);
#ifndef UMBRIEL_SHADOW_MEMORY
    // Sanitizers reserve terabytes of address space for their shadows; builds without them have the limit.
    confined = confined && limitResource(RLIMIT_AS, limits.processBytes, limits.processBytes);
#endif
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0);
    // The client's files, sockets and GPU are none of the importer's business.
    syscall(SYS_close_range, static_cast<unsigned>(answerDescriptor) + 1, ~0u, 0);
    return confined;
}

template <class Number>
bool parse(const std::string& text, Number& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
}

void importInto(const std::string& file, const ImportLimits& limits, AnswerWriter& answer) {
    TypeRegistry types;
    registerCoreTypes(types);
    IdSource ids;
    Aspect scene(types, ids);
    ImportWarnings warnings;
    const Ref<LoadedScene> loaded =
        isObjFile(file) ? importObj(file, scene, limits, warnings) : importGltf(file, scene, limits, warnings);
    bool draws = false;
    for (const ContainerId id : scene.ids()) draws = draws || isA<Geometry>(*scene.find(id));
    if (!draws) warnings.add("there is nothing to draw");
    for (const std::string& text : warnings.texts()) answer.warning(text);
    answer.scene(scene, loaded);
}

}  // namespace

std::vector<std::string> importChildArguments(const std::string& file, const ImportLimits& limits,
                                              int answerDescriptor) {
    return {std::to_string(answerDescriptor), std::to_string(limits.fileBytes), std::to_string(limits.sceneBytes),
            std::to_string(limits.processBytes), std::to_string(limits.cpuTime.count()),
            std::to_string(limits.containers), std::to_string(limits.imageSide), std::to_string(limits.depth),
            // Never mistaken for an option, whatever the file is called.
            file.starts_with('/') ? file : "./" + file};
}

int runImportChild(const ImportChildOptions& options) {
    const std::vector<std::string>& arguments = options.arguments;
    ImportLimits limits;
    int descriptor = -1;
    std::int64_t cpuSeconds = 0;
    if (arguments.size() != kArgumentCount || !parse(arguments[0], descriptor) ||
        !parse(arguments[1], limits.fileBytes) || !parse(arguments[2], limits.sceneBytes) ||
        !parse(arguments[3], limits.processBytes) || !parse(arguments[4], cpuSeconds) ||
        !parse(arguments[5], limits.containers) || !parse(arguments[6], limits.imageSide) ||
        !parse(arguments[7], limits.depth) || fcntl(descriptor, F_GETFD) < 0) {
        log::error("import-child is started by umbriel itself, with a pipe for its answer");
        return 2;
    }
    limits.cpuTime = std::chrono::seconds(cpuSeconds);
    AnswerWriter answer(descriptor);
    if (!confineProcess(limits, descriptor)) {
        answer.error(failure("the limits of the import process cannot be set"));
        return 1;
    }
    // The client has asked whether the file can be read, so what is refused here is its content.
    try {
        importInto(arguments.back(), limits, answer);
        return 0;
    } catch (const std::bad_alloc&) {
        answer.error(failure("needs more memory than the " + std::to_string(limits.processBytes >> 20) +
                             " MiB that an import may take"));
    } catch (const std::exception& reason) {
        answer.error(badInput(reason.what()));
    }
    return 1;
}

}  // namespace umbriel
