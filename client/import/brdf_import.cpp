#include "client/import/brdf_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <system_error>
#include <utility>

namespace umbriel {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{64} << 20;
constexpr std::size_t kMaxRows = 1'000'000;
// The angles of a line of text, and the largest, degrees.
constexpr std::array<std::pair<const char*, double>, 3> kAngles = {
    {{"theta_in", 90.0}, {"theta_out", 90.0}, {"phi", 180.0}}};
constexpr double kAngleRounding = 0.05;  // measured tables write the last one with few digits

// MERL's grid over the angle of the half vector (finer towards 0), the light's angle to it, and its azimuth about it.
constexpr int kMerlHalf = 90;
constexpr int kMerlDifference = 90;
constexpr int kMerlAzimuth = 180;
constexpr std::size_t kMerlCount = std::size_t{kMerlHalf} * kMerlDifference * kMerlAzimuth;
constexpr std::size_t kMerlHeader = 3 * sizeof(std::int32_t);
// What the database's values are in 1/sr (its BRDFRead.cpp).
constexpr double kMerlScale[3] = {1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0};

glm::dvec3 direction(double theta, double phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

std::size_t merlIndex(const glm::dvec3& in, const glm::dvec3& out) {
    const glm::dvec3 h = glm::normalize(in + out);
    const double sine = std::hypot(h.x, h.y);
    const double thetaHalf = std::atan2(sine, h.z);
    // The frame in which the half vector is up and the normal in the plane of x: in turned by -phi about z, then by
    // -theta about y.
    const double c = sine > 0.0 ? h.x / sine : 1.0;
    const double s = sine > 0.0 ? h.y / sine : 0.0;
    const glm::dvec3 turned(in.x * c + in.y * s, in.y * c - in.x * s, in.z);
    const glm::dvec3 difference(turned.x * h.z - turned.z * sine, turned.y, turned.x * sine + turned.z * h.z);
    const double thetaDifference = std::atan2(std::hypot(difference.x, difference.y), difference.z);
    double azimuth = std::atan2(difference.y, difference.x);
    if (azimuth < 0.0) azimuth += kPi;  // reciprocity
    const auto clamped = [](double value, int count) {
        return static_cast<std::size_t>(std::clamp(static_cast<int>(value), 0, count - 1));
    };
    const std::size_t half = clamped(std::sqrt(thetaHalf / (0.5 * kPi)) * kMerlHalf, kMerlHalf);
    const std::size_t diff = clamped(thetaDifference / (0.5 * kPi) * kMerlDifference, kMerlDifference);
    return (half * kMerlDifference + diff) * kMerlAzimuth + clamped(azimuth / kPi * kMerlAzimuth, kMerlAzimuth);
}

std::vector<double> steps(int count, double last) {
    std::vector<double> axis;
    for (int i = 0; i < count; ++i) axis.push_back(last * i / (count - 1));
    return axis;
}

// The place of a value among rising ones; -1 when it is none of them.
std::ptrdiff_t indexOf(const std::vector<double>& axis, double value) {
    const auto found = std::lower_bound(axis.begin(), axis.end(), value);
    return found != axis.end() && *found == value ? found - axis.begin() : -1;
}

void sortDistinct(std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
}

}  // namespace

Result<BrdfTable> parseMerl(std::string_view bytes, std::vector<std::string>& notes) {
    std::int32_t sizes[3] = {};
    if (bytes.size() >= kMerlHeader) std::memcpy(sizes, bytes.data(), kMerlHeader);
    if (sizes[0] != kMerlHalf || sizes[1] != kMerlDifference || sizes[2] != kMerlAzimuth)
        return badInput("does not begin with the sizes 90 90 180 of a MERL table");
    if (bytes.size() != kMerlHeader + 3 * kMerlCount * sizeof(double))
        return badInput(fmt::format("has {} bytes, a MERL table has {}", bytes.size(),
                                    kMerlHeader + 3 * kMerlCount * sizeof(double)));
    BrdfTable table;
    // Beyond 80 degrees the measurements are extrapolated, and a fit takes as long as there are directions.
    table.thetaIn = table.thetaOut = steps(12, 82.5 / 180.0 * kPi);
    table.phi = steps(19, kPi);
    std::uint64_t missing = 0;
    for (const double in : table.thetaIn)
        for (const double out : table.thetaOut)
            for (const double azimuth : table.phi) {
                const std::size_t index = merlIndex(direction(in, 0.0), direction(out, azimuth));
                glm::dvec3 value(0.0);
                bool isMissing = false;
                for (std::size_t channel = 0; channel < 3; ++channel) {
                    double stored = 0.0;
                    std::memcpy(&stored, bytes.data() + kMerlHeader + (channel * kMerlCount + index) * sizeof(double),
                                sizeof(double));
                    isMissing |= !(stored >= 0.0) || !std::isfinite(stored);
                    value[static_cast<int>(channel)] = stored * kMerlScale[channel];
                }
                missing += isMissing;
                table.values.push_back(isMissing ? glm::dvec3(0.0) : value);
            }
    if (missing > 0)
        notes.push_back(fmt::format("{} of {} directions were not measured; they count as 0", missing,
                                    table.values.size()));
    if (const auto checked = checkBrdfTable(table); !checked) return checked.error();
    return table;
}

Result<BrdfTable> parseBrdfText(std::string_view text) {
    using Row = std::array<double, 6>;
    std::vector<Row> rows;
    std::size_t number = 0;
    while (!text.empty()) {
        ++number;
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        line = line.substr(0, line.find('#'));
        Row row{};
        std::size_t count = 0;
        const char* at = line.data();
        const char* const stop = line.data() + line.size();
        while (true) {
            while (at != stop && (*at == ' ' || *at == '\t' || *at == '\r' || *at == ',')) ++at;
            if (at == stop) break;
            double value = 0.0;
            const auto [rest, problem] = std::from_chars(at, stop, value);
            if (problem != std::errc() || count == row.size() || !std::isfinite(value))
                return badInput(fmt::format("line {}: expected six finite numbers, theta_in theta_out phi r g b", number));
            row[count++] = value;
            at = rest;
        }
        if (count == 0) continue;
        if (count != row.size())
            return badInput(fmt::format("line {}: has {} numbers; expected theta_in theta_out phi r g b", number, count));
        for (std::size_t axis = 0; axis < kAngles.size(); ++axis) {
            const auto& [name, last] = kAngles[axis];
            if (row[axis] >= 0.0 && row[axis] <= last + kAngleRounding) continue;
            return badInput(
                fmt::format("line {}: {} of {} degrees; expected 0 to {} degrees", number, name, row[axis], last));
        }
        if (rows.size() == kMaxRows) return badInput(fmt::format("line {}: more than {} rows", number, kMaxRows));
        rows.push_back(row);
    }
    std::array<std::vector<double>, 3> axes;
    for (const Row& row : rows)
        for (std::size_t axis = 0; axis < 3; ++axis) axes[axis].push_back(row[axis]);
    for (std::vector<double>& axis : axes) sortDistinct(axis);
    const std::size_t cells = axes[0].size() * axes[1].size() * axes[2].size();
    if (rows.empty() || cells != rows.size())
        return badInput(fmt::format("{} rows for a grid of {} x {} x {} angles: each pair of directions once", rows.size(),
                                    axes[0].size(), axes[1].size(), axes[2].size()));
    BrdfTable table;
    table.values.assign(cells, glm::dvec3(-1.0));
    for (const Row& row : rows) {
        std::size_t index = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            index = index * axes[axis].size() + static_cast<std::size_t>(indexOf(axes[axis], row[axis]));
        if (table.values[index] != glm::dvec3(-1.0))
            return badInput(fmt::format("the directions {} {} {} are there twice", row[0], row[1], row[2]));
        table.values[index] = {row[3], row[4], row[5]};
    }
    for (std::vector<double>& axis : axes)
        for (double& angle : axis) angle *= kPi / 180.0;
    table.thetaIn = std::move(axes[0]);
    table.thetaOut = std::move(axes[1]);
    table.phi = std::move(axes[2]);
    if (const auto checked = checkBrdfTable(table); !checked) return checked.error();
    return table;
}

Result<BrdfTable> loadBrdf(const std::string& file, std::vector<std::string>& notes) {
    const auto refused = [&](const std::string& reason) { return badInput(fmt::format("{}: {}", file, reason)); };
    std::error_code code;
    if (!std::filesystem::is_regular_file(file, code)) return refused("there is no such file");
    const std::uintmax_t size = std::filesystem::file_size(file, code);
    if (code) return refused(code.message());
    if (size > kMaxFileBytes) return refused(fmt::format("is larger than {} MiB", kMaxFileBytes >> 20));
    std::ifstream stream(file, std::ios::binary);
    std::string bytes(static_cast<std::size_t>(size), '\0');
    if (!stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) return refused("cannot be read");
    std::vector<std::string> said;
    auto table = std::filesystem::path(file).extension() == ".binary" ? parseMerl(bytes, said) : parseBrdfText(bytes);
    if (!table) return refused(table.error().message);
    for (const std::string& note : said) notes.push_back(fmt::format("{}: {}", file, note));
    return table;
}

}  // namespace umbriel
