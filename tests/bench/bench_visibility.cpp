// What `umbriel bake` costs beside the bare ray caster, in one run on the same meshes with the same directions: CPU
// seconds of rays, packing and files as the command reports them (after loading the mesh and building the tree), and of
// a plain loop over rtcOccluded8 here. Rounds are interleaved, figures are medians.
// Arguments: --json, --runs N, --rows N (at most, of large meshes), --peer FILE (embree_bench), --only NAME.
#include <embree3/rtcore.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "common/base/processor_time.h"
#include "common/visibility/map_file.h"
#include "common/visibility/mesh.h"
#include "tests/bench/measure.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/visibility/test_meshes.h"

extern char** environ;

namespace umbriel {
namespace {

namespace fs = std::filesystem;

using visibility::kRowsPerBlock;
const fs::path kPrograms = UMBRIEL_BIN_DIR;

double cpuSeconds() {
    return toSeconds(processorTime());
}

double seconds(const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

// The plain loop: offset 1e-4 of the diagonal along the normal, rows as they come, one thread.
class Bare {
 public:
    explicit Bare(const visibility::BakeMesh& mesh) : _device(rtcNewDevice("threads=1")), _scene(rtcNewScene(_device)) {
        rtcSetSceneBuildQuality(_scene, RTC_BUILD_QUALITY_HIGH);
        RTCGeometry g = rtcNewGeometry(_device, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* v = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size());
        std::copy(mesh.positions.begin(), mesh.positions.end(), static_cast<glm::vec3*>(v));
        auto* i = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size());
        std::copy(mesh.triangles.begin(), mesh.triangles.end(), static_cast<glm::uvec3*>(i));
        rtcCommitGeometry(g);
        rtcAttachGeometry(_scene, g);
        rtcReleaseGeometry(g);
        rtcCommitScene(_scene);
    }
    ~Bare() {
        rtcReleaseScene(_scene);
        rtcReleaseDevice(_device);
    }
    Bare(const Bare&) = delete;
    Bare& operator=(const Bare&) = delete;

    // CPU seconds.
    double run(const visibility::BakeMesh& mesh, const trace::DirectionPackets& set, std::uint32_t rows) const {
        const double start = cpuSeconds();
        std::size_t hits = 0;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
        alignas(32) int valid[8];
        std::fill_n(valid, 8, -1);
        for (std::uint32_t row = 0; row < rows; ++row) {
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
                rtcOccluded8(valid, _scene, &context, &ray);
                for (int i = 0; i < 8; ++i) hits += ray.tfar[i] < 0;
            }
        }
        if (hits == 0) std::fputs("bench_visibility: no ray hit anything\n", stderr);
        return cpuSeconds() - start;
    }

 private:
    RTCDevice _device;
    RTCScene _scene;
};

struct Child {
    std::string out;
    double wall = 0.0, cpu = 0.0;
    double peakMiB = 0.0;  // of its memory; that of its import process if that was larger
};

int spawn(const std::string& program, std::vector<std::string> arguments, const fs::path& output) {
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (std::string& a : arguments) argv.push_back(a.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    pid_t process = -1;
    const int error = posix_spawn(&process, program.c_str(), &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error == 0) return process;
    std::fprintf(stderr, "bench: %s cannot be started\n", program.c_str());
    std::exit(1);
}

// A process of this program's that only starts another, so that the peak of its memory is not that of this one: Linux
// counts what the process held before it became another program.
int measure(int argc, char** argv) {
    const std::string output = argv[2];
    const double start = bench::secondsNow();
    const int process = spawn(argv[3], {argv + 4, argv + argc}, output);
    int status = 0;
    rusage usage{};
    ::wait4(process, &status, 0, &usage);
    fmt::print("{} {} {}\n", bench::secondsNow() - start, seconds(usage.ru_utime) + seconds(usage.ru_stime),
               static_cast<double>(usage.ru_maxrss) / 1024.0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

Child runProgram(const std::string& program, std::vector<std::string> arguments, const fs::path& output) {
    arguments.insert(arguments.begin(), {"--measure", output.string(), program});
    const fs::path figures = output.string() + ".figures";
    const int process = spawn((kPrograms / "bench_visibility").string(), std::move(arguments), figures);
    int status = 0;
    ::waitpid(process, &status, 0);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        std::fprintf(stderr, "bench: %s failed\n", program.c_str());
        std::exit(1);
    }
    Child child;
    std::ifstream(figures) >> child.wall >> child.cpu >> child.peakMiB;
    std::ostringstream text;
    text << std::ifstream(output).rdbuf();
    child.out = text.str();
    return child;
}

struct Subject {
    std::string name;
    visibility::Mesh mesh;
    bool bounded = true;  // the project promises its speed
};

void writeObj(const fs::path& path, const visibility::Mesh& mesh) {
    std::ofstream file(path);
    for (const glm::vec3& p : mesh.positions) file << fmt::format("v {} {} {}\n", p.x, p.y, p.z);
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        file << fmt::format("f {} {} {}\n", mesh.indices[i] + 1, mesh.indices[i + 1] + 1, mesh.indices[i + 2] + 1);
    }
}

class Bench {
 public:
    Bench(bench::Report report, int runs, std::uint32_t mostRows, std::string peer)
        : _report(report), _runs(runs), _mostRows(mostRows), _peer(std::move(peer)) {}

    // 64 x 16 directions with each guard, one thread.
    void compare(const Subject& subject) {
        const fs::path obj = _folder / (subject.name + ".obj");
        writeObj(obj, subject.mesh);
        const auto mesh = visibility::prepare(subject.mesh);
        if (!mesh) {
            std::fprintf(stderr, "bench: %s: %s\n", subject.name.c_str(), mesh.error().message.c_str());
            std::exit(1);
        }
        // Large meshes: a part, cut as the command cuts it.
        const auto blocks = static_cast<std::uint32_t>((mesh->rows.size() + kRowsPerBlock - 1) / kRowsPerBlock);
        const std::uint32_t parts = std::clamp<std::uint32_t>(
            static_cast<std::uint32_t>((mesh->rows.size() + _mostRows - 1) / _mostRows), 1, blocks);
        const auto rows = static_cast<std::uint32_t>(
            std::min<std::size_t>(std::size_t{blocks / parts} * kRowsPerBlock, mesh->rows.size()));
        const trace::DirectionPackets set = visibility::directionPackets({visibility::MappingKind::HemiSphere, 32});
        const Bare bare(*mesh);
        const auto bake = [&](const std::string& guard, const std::string& size) {
            std::vector<std::string> arguments{"bake",    obj.string(), "--size",    size,
                                               "--guard", guard,        "--threads", "1",
                                               "--json",  "--quiet",    "--out",     (_folder / "maps.umvis").string()};
            if (parts > 1) arguments.insert(arguments.end(), {"--shard", fmt::format("0/{}", parts)});
            return runProgram((kPrograms / "umbriel").string(), arguments, _folder / "out.json");
        };
        std::vector<std::vector<double>> cpu(3), whole(3);
        std::vector<double> peak;
        std::uint64_t rays = 0;
        for (int run = 0; run < _runs; ++run) {
            cpu[0].push_back(bare.run(*mesh, set, rows));
            for (const auto& [at, guard] : {std::pair{1, "fast"}, std::pair{2, "exact"}}) {
                const Child child = bake(guard, "32");
                const auto json = nlohmann::json::parse(child.out);
                cpu[at].push_back(json["cpu_seconds"].get<double>());
                whole[at].push_back(child.cpu);
                rays = json["rays"].get<std::uint64_t>();
                peak.push_back(child.peakMiB);
            }
        }
        if (rays != std::uint64_t{rows} * 1024) {
            std::fprintf(stderr, "bench: %s: the command traced %llu rays, not %u x 1024\n", subject.name.c_str(),
                         static_cast<unsigned long long>(rays), rows);
            std::exit(1);
        }
        const std::string at = fmt::format("{} ({} of {} rows)", subject.name, rows, mesh->rows.size());
        const bench::Rounds rounds(cpu);
        _report.figure(at + ": bare rtcOccluded8", 1e-6 * static_cast<double>(rays) / rounds[0], "M rays/core-s");
        for (const auto& [i, guard, bound] : {std::tuple{1, "fast", 1.0 / 0.80}, std::tuple{2, "exact", 1.0 / 0.65}}) {
            const double ratio = rounds.ratio({std::size_t(i)}, 0);
            _report.figure(fmt::format("{}: {}, of the bare rate", at, guard), 100.0 / ratio, "%");
            _report.figure(fmt::format("{}: {}, CPU over bare", at, guard), ratio, "x", subject.bounded ? bound : 0.0);
            _report.figure(fmt::format("{}: {}, whole command", at, guard), bench::median(whole[i]), "CPU s");
        }
        // Mesh, tree and program are there with four directions, too.
        _report.figure(at + ": peak memory", bench::median(peak), "MiB");
        _report.figure(at + ": of it beyond a bake of 4 directions", bench::median(peak) - bake("exact", "2").peakMiB,
                       "MiB");
        if (!_peer.empty()) peer(obj, at);
    }

    // Beside the times of the thesis: its resolutions, all of this machine.
    void thesis(const Subject& subject) {
        const fs::path obj = _folder / (subject.name + ".obj");
        writeObj(obj, subject.mesh);
        for (const auto& [size, then] : {std::pair{"32", 59.3}, std::pair{"64", 234.7}}) {
            for (const std::string guard : {"fast", "exact"}) {
                std::vector<double> wall, cpu, whole;
                for (int run = 0; run < std::min(_runs, 3); ++run) {
                    const Child child = runProgram((kPrograms / "umbriel").string(),
                                                   {"bake", obj.string(), "--size", size, "--guard", guard, "--json",
                                                    "--quiet", "--out", (_folder / "maps.umvis").string()},
                                                   _folder / "out.json");
                    const auto json = nlohmann::json::parse(child.out);
                    wall.push_back(json["seconds"].get<double>());
                    cpu.push_back(json["cpu_seconds"].get<double>());
                    whole.push_back(child.wall);
                }
                const std::string at = fmt::format("{} HemiSphere {}x{}, {}", subject.name, 2 * std::atoi(size),
                                                   std::atoi(size) / 2, guard);
                _report.figure(at, bench::median(wall), "s");
                _report.figure(at + ", of processors", bench::median(cpu), "CPU s");
                _report.figure(at + ", whole command", bench::median(whole), "s");
                _report.figure(at + ", in the thesis", then, "s");
            }
        }
    }

 private:
    // Its own line for eight rays at once, not robust, stratified directions.
    void peer(const fs::path& obj, const std::string& at) {
        const Child child = runProgram(_peer, {obj.string(), "1024", "1", "20000"}, _folder / "peer.txt");
        std::istringstream lines(child.out);
        for (std::string line; std::getline(lines, line);) {
            if (line.find("robust=1") != std::string::npos) break;
            const auto rate = line.rfind(" cpu ");
            if (line.find("occluded8") == std::string::npos || rate == std::string::npos) continue;
            const auto comma = line.find("s ", rate);
            std::string name = line.substr(0, line.find(" rays "));
            name.erase(0, name.find_first_not_of(' '));
            name.erase(name.find_last_not_of(' ') + 1);
            _report.figure(fmt::format("{}: peer, {}", at, name), std::atof(line.c_str() + comma + 1), "M rays/core-s");
        }
    }

    bench::Report _report;
    int _runs;
    std::uint32_t _mostRows;
    std::string _peer;
    test::TemporaryFolder _folder;
};

}  // namespace
}  // namespace umbriel

int main(int argc, char** argv) {
    using namespace umbriel;
    if (argc > 3 && std::string_view(argv[1]) == "--measure") return measure(argc, argv);
    const bench::Report report(bench::hasFlag(argc, argv, "--json"));
    const std::string only = bench::option(argc, argv, "--only", "");
    Bench bench(report, std::atoi(bench::option(argc, argv, "--runs", "5").c_str()),
                static_cast<std::uint32_t>(std::atoi(bench::option(argc, argv, "--rows", "20000").c_str())),
                bench::option(argc, argv, "--peer", ""));
    const auto shared = [&](const std::string& name, const std::string& file, bool bounded) -> std::optional<Subject> {
        if (auto mesh = visibility::test::loadShared(file)) return Subject{name, std::move(*mesh), bounded};
        report.skipped(name, "UMBRIEL_SHARED does not lead to data/" + file);
        return std::nullopt;
    };
    const auto wanted = [&](const std::string& name) { return only.empty() || only == name; };
    for (const auto& [name, file, bounded] : {std::tuple{"tshirt-2k", "cloth/tshirt1900-triFolded.obj", false},
                                              std::tuple{"skirt-4k", "cloth/skirt7271.obj", false},
                                              std::tuple{"dress-5k", "cloth/dress-v5k-f10k.obj", true},
                                              std::tuple{"dress-7k", "cloth/dress-v7k-f14k.obj", true},
                                              std::tuple{"dress-17k", "cloth/dress-v17k-f34k.obj", true},
                                              std::tuple{"dragon-177k", "mesh/dragon_348k.ply", true}}) {
        if (!wanted(name)) continue;
        if (const auto subject = shared(name, file, bounded)) bench.compare(*subject);
    }
    if (wanted("cloth-3k")) bench.compare({"cloth-3k", visibility::test::cloth(80, 40), false});
    if (wanted("cloth-174k")) bench.compare({"cloth-174k", visibility::test::cloth(600, 290), true});
    if (wanted("thesis")) {
        if (const auto subject = shared("dress-7k", "cloth/dress-v7k-f14k.obj", false)) bench.thesis(*subject);
    }
    return 0;
}
