#include "client/import/load_scene.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <unordered_map>

#include "client/import/import_answer.h"
#include "client/import/import_child.h"
#include "client/import/scene_suffix.h"
#include "client/import/validate.h"
#include "common/scene/core_types.h"

extern char** environ;

namespace umbriel {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

constexpr int kAnswerDescriptor = 3;

Result<void> checkFile(const std::string& file) {
    if (isPlyFile(file))
        return badInput(file + ": PLY files cannot be loaded in this version; convert it to OBJ or glTF");
    if (!isGltfFile(file) && !isObjFile(file))
        return badInput(file + ": the kind of file is not known; .gltf, .glb and .obj can be loaded");
    struct stat status {};
    if (stat(file.c_str(), &status) != 0) return badInput(file + ": cannot be read: " + std::strerror(errno));
    if (S_ISDIR(status.st_mode)) return badInput(file + ": is a directory");
    if (!S_ISREG(status.st_mode)) return badInput(file + ": is not a regular file");
    if (status.st_size == 0) return badInput(file + ": the file is empty");
    if (access(file.c_str(), R_OK) != 0) return badInput(file + ": cannot be read: " + std::strerror(errno));
    return {};
}

// The import process; ended and collected with this object.
class ChildProcess {
 public:
    ChildProcess() = default;
    ~ChildProcess() {
        if (_process > 0) end();
    }
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    // descriptor becomes kAnswerDescriptor in the process. 0, or an error number.
    int start(const std::vector<std::string>& command, int descriptor) {
        std::vector<char*> arguments;
        for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
        arguments.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
        posix_spawn_file_actions_adddup2(&actions, descriptor, kAnswerDescriptor);
        posix_spawnattr_t attributes;
        posix_spawnattr_init(&attributes);
        // Signals that the client handles or ignores get their usual meaning back.
        sigset_t none;
        sigset_t all;
        sigemptyset(&none);
        sigfillset(&all);
        posix_spawnattr_setsigmask(&attributes, &none);
        posix_spawnattr_setsigdefault(&attributes, &all);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
        const int error =
            posix_spawn(&_process, command.front().c_str(), &actions, &attributes, arguments.data(), environ);
        posix_spawnattr_destroy(&attributes);
        posix_spawn_file_actions_destroy(&actions);
        if (error != 0) _process = -1;
        return error;
    }

    // Waits for its end, but not past the deadline: then it is killed. The status as waitpid gives it.
    int wait(SteadyTime deadline) {
        int status = 0;
        pid_t collected = 0;
        while ((collected = waitpid(_process, &status, WNOHANG)) == 0 && std::chrono::steady_clock::now() < deadline)
            poll(nullptr, 0, 2);
        if (collected == 0) return end();
        _process = -1;
        return collected < 0 ? 0 : status;
    }

    int end() {
        int status = 0;
        kill(_process, SIGKILL);
        while (waitpid(_process, &status, 0) < 0 && errno == EINTR) {
        }
        _process = -1;
        return status;
    }

 private:
    pid_t _process = -1;
};

// Why the process ended without an answer.
Error endOf(int status, const std::string& file, const ImportLimits& limits) {
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
        return failure(file + ": the import was stopped after " + std::to_string(limits.cpuTime.count()) +
                       " s of processor time; the file is too large or made to be slow");
    if (WIFSIGNALED(status))
        return failure("the importer crashed (signal " + std::to_string(WTERMSIG(status)) + ") while reading " + file +
                       "; nothing of the file was loaded");
    return failure(file + ": the import process ended without an answer (exit code " +
                   std::to_string(WIFEXITED(status) ? WEXITSTATUS(status) : -1) + ")");
}

// Copies what an aspect holds into another one under fresh ids, as edits there. Large fields share their memory.
class SceneTransfer {
 public:
    SceneTransfer(const Aspect& from, Aspect& into, IdSource& ids) : _from(from), _into(into), _ids(ids) {}

    ContainerId run(ContainerId wanted) {
        RawEdit raw(_into);
        const std::vector<ContainerId> ids = _from.ids();
        for (const ContainerId id : ids) {
            _fresh[id] = _ids.next();
            const TypeDescriptor* type = _into.types().byName(_from.find(id)->type().name);
            UMBRIEL_ASSERT(type != nullptr, "the application's registry lacks a core type");
            UMBRIEL_ASSERT(raw.create(_fresh[id], *type), "a fresh id was taken");
        }
        for (const ContainerId id : ids) copy(raw, *_from.find(id));
        return fresh(wanted);
    }

 private:
    ContainerId fresh(ContainerId id) const { return id ? _fresh.at(id) : id; }

    void copy(RawEdit& raw, const Container& source) const {
        const ContainerId id = fresh(source.id());
        const auto& fields = source.type().fields;
        for (std::uint32_t i = 0; i < fields.size(); ++i) {
            if (fields[i].isMulti)
                copyMulti(raw, id, i, fields[i].kind, fields[i].multi(source));
            else if (fields[i].kind == ElementKind::String) {
                if (!fields[i].text(source).empty()) raw.setText(id, i, fields[i].text(source));
            } else
                copySingle(raw, id, i, fields[i], source);
        }
    }

    void copySingle(RawEdit& raw, ContainerId id, std::uint32_t index, const FieldDescriptor& field,
                    const Container& source) const {
        const std::size_t size = infoOf(field.kind).size;
        const void* value = field.address_(source);
        if (std::memcmp(value, field.address_(*source.type().prototype), size) == 0) return;
        ContainerId target;
        if (field.kind == ElementKind::Id) {
            std::memcpy(&target, value, sizeof(target));
            target = fresh(target);
            value = &target;
        }
        raw.setSingle(id, index, {static_cast<const std::byte*>(value), size});
    }

    void copyMulti(RawEdit& raw, ContainerId id, std::uint32_t index, ElementKind kind,
                   const MultiStorage& source) const {
        if (source.size() == 0) return;
        if (kind != ElementKind::Id) return raw.assignMulti(id, index, source);
        std::vector<ContainerId> targets(source.size());
        source.read(0, std::as_writable_bytes(std::span(targets)));
        for (ContainerId& target : targets) target = fresh(target);
        raw.resizeMulti(id, index, targets.size());
        raw.writeMulti(id, index, 0, std::as_bytes(std::span(targets)));
    }

    const Aspect& _from;
    Aspect& _into;
    IdSource& _ids;
    std::unordered_map<ContainerId, ContainerId> _fresh;
};

}  // namespace

Result<LoadedFile> loadScene(const std::string& file, Aspect& into, IdSource& ids, const ImportLimits& limits) {
    if (const Result<void> usable = checkFile(file); !usable) return usable.error();
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        return failure("cannot make a pipe to the import process: " + std::string(std::strerror(errno)));
    // dup2 onto itself would keep the close-on-exec flag.
    if (ends[1] == kAnswerDescriptor) {
        const int moved = fcntl(ends[1], F_DUPFD_CLOEXEC, kAnswerDescriptor + 1);
        close(ends[1]);
        ends[1] = moved;
    }
    const SteadyTime deadline = std::chrono::steady_clock::now() + limits.wallTime;
    AnswerReader answer(ends[0], deadline, limits.sceneBytes * 2 + (std::uint64_t{64} << 20));
    std::vector<std::string> command = limits.childCommand;
    for (std::string& argument : importChildArguments(file, limits, kAnswerDescriptor))
        command.push_back(std::move(argument));
    ChildProcess child;
    const int startError = child.start(command, ends[1]);
    close(ends[1]);
    if (startError != 0)
        return failure("cannot start the import process " + command.front() + ": " + std::strerror(startError));

    TypeRegistry types;
    registerCoreTypes(types);
    IdSource scratchIds;
    Aspect scratch(types, scratchIds);
    switch (answer.read(scratch, limits.containers * std::size_t{2})) {
        case AnswerReader::End::Done:
            break;
        case AnswerReader::End::Error: {
            Error error = answer.error();
            error.message = file + ": " + error.message;
            return error;
        }
        case AnswerReader::End::Late:
            return failure(file + ": the import was stopped after " + std::to_string(limits.wallTime.count()) +
                           " s; the file is too large or made to be slow");
        case AnswerReader::End::Malformed:
            return failure(file + ": the import process answered nonsense: " + answer.error().message);
        case AnswerReader::End::Closed:
            return endOf(child.wait(deadline), file, limits);
    }
    const Result<void> valid = validateLoadedScene(scratch, answer.scene(), treeLimits(limits));
    if (!valid)
        return failure(file + ": the import process answered with an impossible scene: " + valid.error().message);
    LoadedFile loaded;
    loaded.scene = Ref<LoadedScene>(SceneTransfer(scratch, into, ids).run(answer.scene()));
    loaded.warnings = answer.warnings();
    loaded.polygons = answer.polygons();
    return loaded;
}

}  // namespace umbriel
