#include "client/import/import_child.h"

#include <fcntl.h>

#include <charconv>
#include <new>

#include "client/import/confine.h"
#include "client/import/gltf_import.h"
#include "client/import/import_answer.h"
#include "client/import/import_error.h"
#include "client/import/obj_import.h"
#include "client/import/scene_suffix.h"
#include "common/base/log.h"
#include "common/scene/core_types.h"

namespace umbriel {
namespace {

constexpr std::size_t kArgumentCount = 13;

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
    if (warnings.polygons() > 0) answer.polygons(warnings.polygons());
    answer.scene(scene, loaded);
}

}  // namespace

std::vector<std::string> importChildArguments(const std::string& file, const ImportLimits& limits,
                                              int answerDescriptor) {
    return {std::to_string(answerDescriptor), std::to_string(limits.fileBytes), std::to_string(limits.sceneBytes),
            std::to_string(limits.processBytes), std::to_string(limits.cpuTime.count()),
            std::to_string(limits.containers), std::to_string(limits.imageSide), std::to_string(limits.depth),
            std::to_string(limits.lights), std::to_string(limits.stepsUp), std::to_string(limits.faceCorners),
            limits.verticesAsWritten ? "1" : "0",
            // Never mistaken for an option, whatever the file is called.
            file.starts_with('/') ? file : "./" + file};
}

int runImportChild(const ImportChildOptions& options) {
    const std::vector<std::string>& arguments = options.arguments;
    ImportLimits limits;
    int descriptor = -1;
    std::int64_t cpuSeconds = 0;
    int asWritten = 0;
    if (arguments.size() != kArgumentCount || !parse(arguments[0], descriptor) ||
        !parse(arguments[1], limits.fileBytes) || !parse(arguments[2], limits.sceneBytes) ||
        !parse(arguments[3], limits.processBytes) || !parse(arguments[4], cpuSeconds) ||
        !parse(arguments[5], limits.containers) || !parse(arguments[6], limits.imageSide) ||
        !parse(arguments[7], limits.depth) || !parse(arguments[8], limits.lights) ||
        !parse(arguments[9], limits.stepsUp) || !parse(arguments[10], limits.faceCorners) ||
        !parse(arguments[11], asWritten) || fcntl(descriptor, F_GETFD) < 0) {
        log::error("import-child is started by umbriel itself, with a pipe for its answer");
        return 2;
    }
    limits.cpuTime = std::chrono::seconds(cpuSeconds);
    limits.verticesAsWritten = asWritten != 0;
    AnswerWriter answer(descriptor);
    if (const Result<void> confined = confineProcess(limits, arguments.back(), descriptor); !confined) {
        answer.error(confined.error());
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
