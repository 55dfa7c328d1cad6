#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/unit/import/gltf_maker.h"

// What happens around the parser: files that cannot be had, and an import process that misbehaves.

namespace umbriel::test {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kHasMemoryLimit = false;
#else
constexpr bool kHasMemoryLimit = true;
#endif

ImportLimits withChild(const std::string& script) {
    ImportLimits limits;
    limits.childCommand = {"/bin/sh", "-c", script};
    return limits;
}

void expectError(const Loaded& loaded, Error::Kind kind, const std::string& reason) {
    ASSERT_FALSE(loaded.file);
    EXPECT_EQ(loaded.file.error().kind, kind) << loaded.error();
    EXPECT_NE(loaded.error().find(reason), std::string::npos) << loaded.error();
    EXPECT_EQ(loaded.scene->containerCount(), 0u);
}

class ImportProcess : public testing::Test {
 protected:
    TempFolder _folder;
    std::string _file = _folder.write("scene.glb", triangle().glb());
};

TEST_F(ImportProcess, FilesThatCannotBeHadAreBadInput) {
    const auto bad = Error::Kind::BadInput;
    expectError(Loaded(_folder.path("absent.glb")), bad, "absent.glb: cannot be read: No such file");
    mkdir(_folder.path("folder.gltf").c_str(), 0700);
    expectError(Loaded(_folder.path("folder.gltf")), bad, "folder.gltf: is a directory");
    expectError(Loaded(_folder.write("empty.obj", "")), bad, "empty.obj: the file is empty");
    expectError(Loaded(_folder.write("scene.fbx", "x")), bad, ".gltf, .glb and .obj can be loaded");
    expectError(Loaded(_folder.write("noSuffix", "x")), bad, "not known");
    expectError(Loaded(_folder.write("mesh.ply", "ply")), bad, "PLY files cannot be loaded in this version");
    mkfifo(_folder.path("pipe.glb").c_str(), 0600);
    expectError(Loaded(_folder.path("pipe.glb")), bad, "is not a regular file");
    if (geteuid() != 0) {  // root reads everything
        chmod(_file.c_str(), 0);
        expectError(Loaded(_file), bad, "cannot be read");
    }
}

TEST_F(ImportProcess, NamesThatLookLikeOptionsAndUpperCaseSuffixesLoad) {
    ASSERT_EQ(chdir(_folder.path("").c_str()), 0);
    _folder.write("--help.GLB", triangle().glb());
    const Loaded loaded("--help.GLB");
    EXPECT_TRUE(loaded.file) << loaded.error();
    ASSERT_EQ(chdir("/"), 0);
}

TEST_F(ImportProcess, ACrashIsOneErrorThatNamesTheFile) {
    expectError(Loaded(_file, withChild("kill -SEGV $$")), Error::Kind::Failure,
                "the importer crashed (signal 11) while reading " + _file);
}

TEST_F(ImportProcess, AHangEndsAtTheDeadline) {
    ImportLimits limits = withChild("exec sleep 30");
    limits.wallTime = std::chrono::seconds(1);
    expectError(Loaded(_file, limits), Error::Kind::Failure, "was stopped after 1 s");
    // One that has closed the pipe and lives on does not hold us up either.
    limits = withChild("exec 3>&-; exec sleep 30");
    limits.wallTime = std::chrono::seconds(1);
    expectError(Loaded(_file, limits), Error::Kind::Failure, "while reading " + _file);
}

TEST_F(ImportProcess, AnEndWithoutAnswerIsAnError) {
    expectError(Loaded(_file, withChild("exit 3")), Error::Kind::Failure, "without an answer (exit code 3)");
    ImportLimits limits;
    limits.childCommand = {_folder.path("absent-program")};
    expectError(Loaded(_file, limits), Error::Kind::Failure, "cannot start the import process");
}

TEST_F(ImportProcess, NonsenseIsAnError) {
    expectError(Loaded(_file, withChild("printf 'hello, this is no answer at all' >&3")), Error::Kind::Failure,
                "answered nonsense");
    // Length 2^63 is refused before anything is allocated.
    expectError(Loaded(_file, withChild("printf '\\003\\0\\0\\0\\0\\0\\0\\0\\200' >&3; exec sleep 30")),
                Error::Kind::Failure, "larger than the limit");
    expectError(Loaded(_file, withChild("printf '\\011\\0\\0\\0\\0\\0\\0\\0\\0' >&3; exec sleep 30")),
                Error::Kind::Failure, "no known kind");
    // Done, and no scene has come.
    expectError(Loaded(_file, withChild("printf '\\004\\010\\0\\0\\0\\0\\0\\0\\0\\007\\0\\0\\0\\0\\0\\0\\0' >&3")),
                Error::Kind::Failure, "there is no loaded scene");
}

TEST_F(ImportProcess, MemoryBeyondTheLimitIsAnErrorAndNotTheEndOfTheClient) {
    if (!kHasMemoryLimit) GTEST_SKIP() << "sanitizers need all the address space there is";
    GltfMaker maker = triangle();
    maker.document["accessors"][0].erase("bufferView");
    maker.document["accessors"][0]["count"] = 20'000'000;
    ImportLimits limits;
    limits.processBytes = 200 << 20;
    expectError(Loaded(_folder.write("big.glb", maker.glb()), limits), Error::Kind::Failure,
                "needs more memory than the 200 MiB");
}

TEST_F(ImportProcess, AFileBeyondTheLimitIsNotRead) {
    ImportLimits limits;
    limits.fileBytes = 100;
    expectError(Loaded(_file, limits), Error::Kind::BadInput, "would take more than");
}

TEST_F(ImportProcess, LoadingTwiceGivesEqualScenesUnderOtherIds) {
    TypeRegistry types;
    registerCoreTypes(types);
    IdSource ids;
    Aspect scene(types, ids);
    const auto first = loadScene(_file, scene, ids);
    const std::size_t containers = scene.containerCount();
    const auto second = loadScene(_file, scene, ids);
    ASSERT_TRUE(first && second);
    EXPECT_NE(first->scene, second->scene);
    EXPECT_EQ(scene.containerCount(), 2 * containers);
    EXPECT_EQ(scene.commit().created.size(), 2 * containers) << "what was loaded is what the next commit ships";
}

}  // namespace
}  // namespace umbriel::test
