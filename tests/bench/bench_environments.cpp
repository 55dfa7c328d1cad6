// What an environment costs the client once it is read and before servers can draw with it: CPU seconds (median of
// --runs, default 5) for filtering it by roughness and convolving it, and for the table of shares; by the columns of
// the panorama and the size of the cube's faces.
#include <cmath>

#include "client/import/environment_import.h"
#include "common/base/processor_time.h"
#include "common/light/environment.h"
#include "tests/bench/measure.h"

namespace umbriel {
namespace {

template <class Function>
double cpuSecondsOf(int runs, Function&& function) {
    std::vector<double> seconds;
    for (int i = 0; i < runs; ++i) {
        const Duration begin = processorTime();
        function();
        seconds.push_back(toSeconds(processorTime() - begin));
    }
    return bench::median(std::move(seconds));
}

// A sky that is brighter towards a small sun; its values do not matter to the time.
Panorama sky(int columns) {
    Panorama panorama{columns, columns / 2, {}};
    for (int row = 0; row < panorama.rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const float up = 1.0f - 2.0f * (static_cast<float>(row) + 0.5f) / static_cast<float>(panorama.rows);
            const bool isSun = row * 4 == panorama.rows && column * 3 < columns && column * 3 + 6 > columns;
            panorama.radiance.push_back(isSun ? glm::vec3(1e4f) : glm::vec3(0.2f, 0.3f, 0.5f) * (1.5f + up));
        }
    return panorama;
}

}  // namespace
}  // namespace umbriel

int main(int argc, char** argv) {
    using namespace umbriel;
    const bench::Report report(bench::hasFlag(argc, argv, "--json"));
    const int runs = std::max(1, std::atoi(bench::option(argc, argv, "--runs", "5").c_str()));
    const char* shared = std::getenv("UMBRIEL_SHARED");
    const std::string file =
        bench::option(argc, argv, "--file", shared ? std::string(shared) + "/data/envmap/venice_sunset_1k.hdr" : "");
    if (!file.empty()) {
        std::vector<std::string> notes;
        const auto panorama = loadPanorama(file, notes);
        if (panorama)
            report.figure(fmt::format("prefilter {} ({} columns), default faces", file.substr(file.rfind('/') + 1),
                                      panorama->columns),
                          cpuSecondsOf(runs, [&] { prefilter(*panorama); }), "s");
        else
            report.skipped("prefilter " + file, panorama.error().message);
    }
    for (const int columns : {256, 1024, 4096}) {
        const Panorama panorama = sky(columns);
        report.figure(fmt::format("prefilter a sky of {} columns, default faces", columns),
                      cpuSecondsOf(runs, [&] { prefilter(panorama); }), "s");
    }
    const Panorama panorama = sky(1024);
    for (const int faces : {32, 64, 128, 256})
        report.figure(fmt::format("prefilter a sky of 1024 columns, faces of {}", faces),
                      cpuSecondsOf(runs, [&] { prefilter(panorama, faces); }), "s");
    report.figure("table of shares", cpuSecondsOf(runs, [] { mirroredShares(); }), "s");
    return 0;
}
