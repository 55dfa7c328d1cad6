#include "client/app/hdr_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <locale>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <ostream>
#include <sstream>
#include <string_view>
#include <utility>

#include "client/app/exit_code.h"
#include "common/image/display.h"
#include "common/image/exr_io.h"
#include "common/image/hdr_io.h"
#include "common/image/isolated_reader.h"
#include "common/image/png_io.h"
#include "common/image/printable.h"
#include "common/image/radiance_map.h"
#include "common/image/tone_mapping.h"

namespace umbriel {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMaxExposure = 126.0;  // EV, either way: beyond it every float is black or white
constexpr double kKey = 0.18;           // Reinhard et al. 2002, eq. 2: what the log-average is mapped to
constexpr std::uint64_t kMaxCodes = std::uint64_t{1} << 32;  // bytes of all photographs together
constexpr std::uint64_t kMaxTimesBytes = std::uint64_t{1} << 20;
constexpr double kSameSetting = 0.01;  // EXIF rounds apertures
constexpr std::array<const char*, 3> kColours{"red", "green", "blue"};

// One photograph as it was read.
struct Photograph {
    Exposure exposure;  // its time is 0 until it is known
    std::map<std::string, float> numbers;
};

struct Plan {
    MergeRule merge = MergeRule::Weighted;
    ToneMapping toneMapping = ToneMapping::Reinhard;
    std::vector<double> seconds;  // empty: from EXIF
};

// What was made, for the report.
struct Outcome {
    std::vector<Exposure> exposures;
    ResponseFit fit;
    RadianceMap map;
    double smallest = 0.0;  // luminance
    double largest = 0.0;
    double logAverage = 0.0;
    double exposure = 0.0;  // EV of the PNG files
    std::uint64_t hdrRepairs = 0;
};

// "0.25" or "1/30".
std::optional<double> secondsOf(std::string_view text) {
    const auto number = [](std::string_view part) -> std::optional<double> {
        std::istringstream stream{std::string(part)};
        stream.imbue(std::locale::classic());
        double value = 0.0;
        return stream >> value && stream.eof() ? std::optional(value) : std::nullopt;
    };
    const std::size_t slash = text.find('/');
    const std::optional<double> numerator = number(text.substr(0, slash));
    const std::optional<double> denominator =
        slash == std::string_view::npos ? std::optional(1.0) : number(text.substr(slash + 1));
    if (!numerator || !denominator) {
        return std::nullopt;
    }
    const double seconds = *numerator / *denominator;
    return seconds > 0.0 && std::isfinite(seconds) ? std::optional(seconds) : std::nullopt;
}

Result<std::vector<double>> timesFromList(const std::string& list, std::size_t count) {
    std::vector<double> times;
    std::istringstream stream(list);
    for (std::string word; std::getline(stream, word, ',');) {
        const std::optional<double> seconds = secondsOf(word);
        if (!seconds) {
            return badInput(fmt::format("--times: '{}' is no exposure time; expected seconds such as 0.5 or 1/30",
                                        printable(word)));
        }
        times.push_back(*seconds);
    }
    if (times.size() != count) {
        return badInput(fmt::format("--times: {} times for {} photographs", times.size(), count));
    }
    return times;
}

Result<std::vector<double>> timesFromFile(const std::filesystem::path& path,
                                          const std::vector<std::filesystem::path>& photographs) {
    std::error_code code;
    const std::uintmax_t size = std::filesystem::file_size(path, code);
    std::ifstream stream(path);
    if (code || !stream || size > kMaxTimesBytes) {
        return badInput(fmt::format("--times: cannot read '{}': {}", path.string(),
                                    code ? code.message() : "no readable text file of at most 1 MiB"));
    }
    std::map<std::string, double> secondsOfName;
    int number = 0;
    for (std::string line; std::getline(stream, line);) {
        ++number;
        std::istringstream words(line.substr(0, line.find('#')));
        std::string name;
        std::string time;
        if (!(words >> name)) {
            continue;
        }
        words >> time;
        const std::optional<double> seconds = secondsOf(time);
        if (!seconds) {
            return badInput(fmt::format("--times: '{}' line {}: expected a file's name and seconds such as 0.5 or 1/30",
                                        path.string(), number));
        }
        secondsOfName[name] = *seconds;
    }
    std::vector<double> times;
    for (const std::filesystem::path& photograph : photographs) {
        const auto found = secondsOfName.find(photograph.filename().string());
        if (found == secondsOfName.end()) {
            return badInput(
                fmt::format("--times: '{}' says nothing of '{}'", path.string(), photograph.filename().string()));
        }
        times.push_back(found->second);
    }
    return times;
}

// Everything that can be refused before pictures are read.
Result<Plan> planOf(const HdrOptions& options) {
    Plan plan;
    if (options.merge != "weighted" && options.merge != "nearest") {
        return badInput(fmt::format("--merge '{}': expected weighted or nearest", printable(options.merge)));
    }
    plan.merge = options.merge == "nearest" ? MergeRule::Nearest : MergeRule::Weighted;
    const std::optional<ToneMapping> toneMapping = toneMappingNamed(options.toneMapping);
    if (!toneMapping) {
        return badInput(
            fmt::format("--tone-mapping '{}': expected one of {}", printable(options.toneMapping), kToneMappingNames));
    }
    plan.toneMapping = *toneMapping;
    if (options.exposure && !(std::abs(*options.exposure) <= kMaxExposure)) {
        return badInput(fmt::format("the exposure must lie within +-{} EV", kMaxExposure));
    }
    for (const std::filesystem::path& path : options.outs) {
        const std::string suffix = path.extension().string();
        if (suffix != ".exr" && suffix != ".hdr" && suffix != ".png") {
            return badInput(fmt::format("--out '{}': expected a name ending in .exr, .hdr or .png", path.string()));
        }
    }
    if (options.photographs.size() < 2) {
        return badInput("a radiance map needs two photographs or more");
    }
    if (!options.times.empty()) {
        Result<std::vector<double>> times = options.times[0] == '@'
                                                ? timesFromFile(options.times.substr(1), options.photographs)
                                                : timesFromList(options.times, options.photographs.size());
        if (!times) {
            return times.error();
        }
        plan.seconds = *std::move(times);
    }
    return plan;
}

Result<Photograph> readPhotograph(const std::filesystem::path& path) {
    Result<LayeredImage> image = readImageIsolated(path);
    if (!image) {
        return image.error();
    }
    Photograph photograph;
    photograph.exposure.width = image->width();
    photograph.exposure.height = image->height();
    photograph.exposure.codes.reserve(image->rgba.pixelCount() * 3);
    const float* pixel = image->rgba.samples().data();
    for (std::size_t i = 0; i < image->rgba.pixelCount(); ++i, pixel += 4) {
        for (int c = 0; c < 3; ++c) {
            const std::uint8_t code = displayByte(pixel[c], 1.0);
            // The reader decoded the file's codes; this is the way back, and exact for 8 bits without transparency.
            if (linearFromSrgbByte(code) != pixel[c]) {
                return badInput(
                    fmt::format("'{}' is no photograph of 8 bits per channel without transparency", path.string()));
            }
            photograph.exposure.codes.push_back(code);
        }
    }
    photograph.numbers = std::move(image->numbers);
    return photograph;
}

// EXIF times are comparable under one aperture and sensitivity only.
Result<void> takeTimesFromExif(const HdrOptions& options, std::vector<Photograph>& photographs) {
    for (const auto& [name, meaning] : {std::pair("aperture", "aperture"), std::pair("isoSpeed", "ISO speed")}) {
        std::optional<float> first;
        for (std::size_t i = 0; i < photographs.size(); ++i) {
            const auto found = photographs[i].numbers.find(name);
            if (found == photographs[i].numbers.end()) {
                continue;
            }
            if (first && std::abs(found->second / *first - 1.0F) > kSameSetting) {
                return badInput(
                    fmt::format("'{}' was taken with another {} ({} instead of {}): give --times with the "
                                "relative exposures",
                                options.photographs[i].string(), meaning, found->second, *first));
            }
            first = first.value_or(found->second);
        }
    }
    for (std::size_t i = 0; i < photographs.size(); ++i) {
        const auto found = photographs[i].numbers.find("expTime");
        if (found == photographs[i].numbers.end() || !(found->second > 0.0F)) {
            return badInput(fmt::format("'{}' does not say its exposure time (EXIF): give --times 1/30,1/15,...",
                                        options.photographs[i].string()));
        }
        photographs[i].exposure.seconds = static_cast<double>(found->second);
    }
    return {};
}

// Of a still scene more time makes no darker picture. Times in another order than the photographs would give a map all
// the same: of the negative.
Result<void> checkOrder(const HdrOptions& options, const std::vector<Photograph>& photographs) {
    const auto bySeconds = [](const Photograph& a, const Photograph& b) {
        return a.exposure.seconds < b.exposure.seconds;
    };
    const auto [shortest, longest] = std::minmax_element(photographs.begin(), photographs.end(), bySeconds);
    const auto sumOf = [](const Photograph& one) {
        return std::accumulate(one.exposure.codes.begin(), one.exposure.codes.end(), std::uint64_t{0});
    };
    if (photographs.size() < 2 || !(shortest->exposure.seconds < longest->exposure.seconds) ||
        sumOf(*longest) >= sumOf(*shortest)) {
        return {};
    }
    const auto nameOf = [&](auto one) {
        return options.photographs[static_cast<std::size_t>(one - photographs.begin())].string();
    };
    return badInput(
        fmt::format("'{}' of {} s is darker than '{}' of {} s: are the times in the order of the photographs?",
                    nameOf(longest), longest->exposure.seconds, nameOf(shortest), shortest->exposure.seconds));
}

Result<std::vector<Exposure>> readSeries(const HdrOptions& options, const Plan& plan) {
    std::vector<Photograph> photographs;
    std::uint64_t codes = 0;
    for (std::size_t i = 0; i < options.photographs.size(); ++i) {
        Result<Photograph> photograph = readPhotograph(options.photographs[i]);
        if (!photograph) {
            return photograph.error();
        }
        const Exposure& exposure = photograph->exposure;
        if (i > 0 &&
            (exposure.width != photographs[0].exposure.width || exposure.height != photographs[0].exposure.height)) {
            return badInput(fmt::format("'{}' has {} x {} pixels, '{}' {} x {}", options.photographs[i].string(),
                                        exposure.width, exposure.height, options.photographs[0].string(),
                                        photographs[0].exposure.width, photographs[0].exposure.height));
        }
        codes += exposure.codes.size();
        if (codes > kMaxCodes) {
            return badInput("the photographs together are more than 4 GiB: scale them down or take fewer");
        }
        photographs.push_back(*std::move(photograph));
        if (!plan.seconds.empty()) {
            photographs.back().exposure.seconds = plan.seconds[i];
        }
    }
    if (plan.seconds.empty()) {
        if (const Result<void> taken = takeTimesFromExif(options, photographs); !taken) {
            return taken.error();
        }
    }
    if (const Result<void> ordered = checkOrder(options, photographs); !ordered) {
        return ordered.error();
    }
    std::vector<Exposure> exposures;
    for (Photograph& photograph : photographs) {
        exposures.push_back(std::move(photograph.exposure));
    }
    return exposures;
}

// Luminance of linear sRGB (Rec. 709 primaries).
double luminanceOf(const float* rgb) {
    return 0.2126 * static_cast<double>(rgb[0]) + 0.7152 * static_cast<double>(rgb[1]) +
           0.0722 * static_cast<double>(rgb[2]);
}

void measure(Outcome& outcome) {
    const FloatImage& rgba = outcome.map.rgba;
    double sum = 0.0;
    const float* pixel = rgba.samples().data();
    for (std::size_t i = 0; i < rgba.pixelCount(); ++i, pixel += 4) {
        const double luminance = luminanceOf(pixel);
        outcome.smallest = i == 0 ? luminance : std::min(outcome.smallest, luminance);
        outcome.largest = std::max(outcome.largest, luminance);
        sum += std::log(std::max(luminance, 1e-30));
    }
    outcome.logAverage = std::exp(sum / static_cast<double>(rgba.pixelCount()));
}

LayeredImage exrOf(const HdrOptions& options, const Outcome& outcome) {
    LayeredImage image;
    image.rgba = outcome.map.rgba;
    for (std::size_t c = 0; c < kColours.size(); ++c) {
        image.texts[fmt::format("umbriel.response.{}", kColours[c])] =
            fmt::format("{:.9g}", fmt::join(outcome.fit.response[c], " "));
    }
    std::vector<double> seconds;
    for (const Exposure& exposure : outcome.exposures) {
        seconds.push_back(exposure.seconds);
    }
    image.texts["umbriel.times"] = fmt::format("{:.9g}", fmt::join(seconds, " "));
    image.texts["umbriel.merge"] = options.merge;
    return image;
}

Result<void> writeAll(const HdrOptions& options, const Plan& plan, Outcome& outcome) {
    for (const std::filesystem::path& path : options.outs) {
        Result<void> written{};
        if (path.extension() == ".exr") {
            written = writeExr(path, exrOf(options, outcome));
        } else if (path.extension() == ".hdr") {
            const Result<HdrRepairs> repairs = writeHdr(path, outcome.map.rgba);
            if (!repairs) {
                return repairs.error();
            }
            outcome.hdrRepairs = repairs->negative + repairs->nan + repairs->tooLarge;
        } else {
            written = writePng(path, outcome.map.rgba, {.exposure = outcome.exposure, .toneMapping = plan.toneMapping});
        }
        if (!written) {
            return written.error();
        }
    }
    return {};
}

Json jsonOf(const HdrOptions& options, const Outcome& outcome) {
    Json json = {{"size", {outcome.map.rgba.width(), outcome.map.rgba.height()}}};
    for (std::size_t i = 0; i < outcome.exposures.size(); ++i) {
        json["photographs"].push_back(
            {{"file", options.photographs[i].string()}, {"seconds", outcome.exposures[i].seconds}});
    }
    json["merge"] = options.merge;
    json["smoothness"] = options.smoothness;
    json["pixels_used"] = outcome.fit.pixels;
    json["residual"] = outcome.fit.residual;
    json["raised_codes"] = outcome.fit.raisedCodes;
    json["white"] = outcome.map.white;
    json["black"] = outcome.map.black;
    json["radiance"] = {{"min", outcome.smallest}, {"max", outcome.largest}, {"log_average", outcome.logAverage}};
    json["exposure"] = outcome.exposure;
    json["hdr_repairs"] = outcome.hdrRepairs;
    json["files"] = Json::array();
    for (const std::filesystem::path& path : options.outs) {
        json["files"].push_back(path.string());
    }
    for (std::size_t c = 0; c < kColours.size(); ++c) {
        json["response"][kColours[c]] = outcome.fit.response[c];
    }
    return json;
}

void printSummary(const HdrOptions& options, const Outcome& outcome, std::ostream& out) {
    const FloatImage& rgba = outcome.map.rgba;
    const auto share = [&rgba](std::uint64_t pixels) {
        return 100.0 * static_cast<double>(pixels) / static_cast<double>(rgba.pixelCount());
    };
    out << fmt::format("{} photographs, {} x {} pixels, {} merge\n", outcome.exposures.size(), rgba.width(),
                       rgba.height(), options.merge);
    out << fmt::format(
        "response curve: residual {:.2f} / {:.2f} / {:.2f} % of exposure (red, green, blue), {} pixels "
        "used, {} codes raised\n",
        100.0 * outcome.fit.residual[0], 100.0 * outcome.fit.residual[1], 100.0 * outcome.fit.residual[2],
        outcome.fit.pixels, outcome.fit.raisedCodes[0] + outcome.fit.raisedCodes[1] + outcome.fit.raisedCodes[2]);
    out << fmt::format("luminance {:.4g} to {:.4g} ({:.1f} stops), logarithmic mean {:.4g}\n", outcome.smallest,
                       outcome.largest, std::log2(outcome.largest / outcome.smallest), outcome.logAverage);
    out << fmt::format("not measured: {:.3f} % white in every photograph, {:.3f} % black\n", share(outcome.map.white),
                       share(outcome.map.black));
    for (const std::filesystem::path& path : options.outs) {
        out << fmt::format(
            "wrote {}{}\n", path.string(),
            path.extension() == ".png" ? fmt::format(" ({}, {:+.2f} EV)", options.toneMapping, outcome.exposure) : "");
    }
}

Result<void> makeRadianceMap(const HdrOptions& options, std::ostream& out) {
    const Result<Plan> plan = planOf(options);
    if (!plan) {
        return plan.error();
    }
    Result<std::vector<Exposure>> exposures = readSeries(options, *plan);
    if (!exposures) {
        return exposures.error();
    }
    Outcome outcome;
    outcome.exposures = *std::move(exposures);
    Result<ResponseFit> fit = fitResponse(outcome.exposures, {.smoothness = options.smoothness});
    if (!fit) {
        return fit.error();
    }
    outcome.fit = *std::move(fit);
    outcome.map = mergeExposures(outcome.exposures, outcome.fit.response, plan->merge);
    measure(outcome);
    outcome.exposure = options.exposure.value_or(std::log2(kKey / outcome.logAverage));
    if (const Result<void> written = writeAll(options, *plan, outcome); !written) {
        return written.error();
    }
    if (options.json) {
        out << jsonOf(options, outcome).dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    } else {
        printSummary(options, outcome, out);
    }
    if (!out.flush()) {
        return failure("the result could not be written");
    }
    return {};
}

}  // namespace

int runHdr(const HdrOptions& options, std::ostream& out, std::ostream& err) {
    return endCommand("umbriel hdr", makeRadianceMap(options, out), err);
}

}  // namespace umbriel
