#include "client/import/photometric_ies.h"

#include <fmt/format.h>

#include <array>

#include "client/import/photometric_planes.h"
#include "common/image/printable.h"

namespace umbriel {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
constexpr std::string_view kBetween = " \t\r\n\v\f,";

// The next line without its end, taken from `rest`.
std::string_view takeLine(std::string_view& rest) {
    const std::size_t end = rest.find_first_of("\r\n");
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (end != std::string_view::npos && rest.starts_with('\n') && line.data()[line.size()] == '\r') {
        rest.remove_prefix(1);
    }
    return line;
}

std::string_view trimmed(std::string_view text) {
    const std::size_t first = text.find_first_not_of(kBetween);
    return first == std::string_view::npos ? std::string_view()
                                           : text.substr(first, text.find_last_not_of(kBetween) - first + 1);
}

struct Header {
    bool hasBallastLampFactor = false;  // 1986 and 1991
    std::string name;
    std::string_view tilt;  // behind "TILT="
};

// Takes everything up to and including the TILT line.
Result<Header> takeHeader(std::string_view& rest) {
    if (rest.starts_with(kByteOrderMark)) {
        rest.remove_prefix(kByteOrderMark.size());
    }
    Header header;
    bool first = true;
    while (!rest.empty()) {
        const std::string_view line = trimmed(takeLine(rest));
        if (line.starts_with("TILT=")) {
            header.tilt = trimmed(line.substr(5));
            return header;
        }
        if (first) {
            const bool named = line.starts_with("IES");
            header.hasBallastLampFactor = !named || line.starts_with("IESNA91");
            header.name = named ? "" : printable(line);
        }
        if (line.starts_with("[LUMINAIRE]") && header.name.empty()) {
            header.name = printable(trimmed(line.substr(11)));
        }
        first = false;
    }
    return badInput("it has no TILT= line, so it is no IES LM-63 file or is cut off");
}

// Numbers separated by blanks, commas or line ends, wherever.
class Numbers {
 public:
    explicit Numbers(std::string_view text) : _rest(text) {}

    // `what` says what the number is, for the message.
    Result<double> next(std::string_view what) {
        const std::string_view word = takeWord();
        if (word.empty()) {
            return badInput(fmt::format("the file ends where {} should follow", what));
        }
        const std::optional<double> number = numberIn(word);
        if (!number) {
            return badInput(fmt::format("'{}' is no number, yet {} should follow", printable(word), what));
        }
        return *number;
    }

    Result<std::vector<double>> list(std::size_t count, std::string_view what) {
        std::vector<double> numbers;
        // Two bytes a number at least: a lying count allocates no more than the file is long.
        numbers.reserve(std::min(count, _rest.size() / 2 + 1));
        while (numbers.size() < count) {
            const Result<double> number = next(fmt::format("{} {} of {}", what, numbers.size() + 1, count));
            if (!number) {
                return number.error();
            }
            numbers.push_back(*number);
        }
        return numbers;
    }

    bool atEnd() { return trimmed(_rest).empty(); }

 private:
    std::string_view takeWord() {
        const std::size_t first = std::min(_rest.find_first_not_of(kBetween), _rest.size());
        _rest.remove_prefix(first);
        const std::string_view word = _rest.substr(0, _rest.find_first_of(kBetween));
        _rest.remove_prefix(word.size());
        return word;
    }

    std::string_view _rest;
};

// The factor of the luminaire as it hangs straight down.
Result<double> takeTilt(std::string_view tilt, Numbers& numbers, std::vector<std::string>& repairs) {
    if (tilt == "NONE") {
        return 1.0;
    }
    if (tilt != "INCLUDE") {
        return badInput(fmt::format(
            "TILT={} names a file; only NONE and INCLUDE are read: put its lines into this file", printable(tilt)));
    }
    constexpr std::size_t kMaxPairs = 10000;
    if (const Result<double> geometry = numbers.next("the lamp's geometry"); !geometry) {
        return geometry.error();
    }
    const Result<double> number = numbers.next("the number of tilt angles");
    if (!number) {
        return number.error();
    }
    const Result<std::size_t> count = countIn(*number, "tilt angles", kMaxPairs);
    if (!count) {
        return count.error();
    }
    const Result<std::vector<double>> angles = numbers.list(*count, "tilt angle");
    if (!angles) {
        return angles.error();
    }
    const Result<std::vector<double>> factors = numbers.list(*count, "tilt factor");
    if (!factors) {
        return factors.error();
    }
    if (const Result<void> rising = expectRising(*angles, "tilt"); !rising) {
        return rising.error();
    }
    for (std::size_t i = 0; i < angles->size(); ++i) {
        if ((*angles)[i] == 0.0 && (*factors)[i] > 0.0) {
            repairs.push_back(fmt::format(
                "TILT=INCLUDE: the factor of 0 degrees ({}) applies, other mountings are not followed", (*factors)[i]));
            return (*factors)[i];
        }
    }
    return badInput("TILT=INCLUDE has no positive factor for 0 degrees");
}

// By the first and last angle; planes in between are free.
Result<PhotometricSymmetry> symmetryOf(const std::vector<double>& horizontal, std::vector<std::string>& repairs) {
    if (horizontal.size() == 1) {
        return PhotometricSymmetry::Rotational;
    }
    if (const Result<void> rising = expectRising(horizontal, "horizontal"); !rising) {
        return rising.error();
    }
    const double first = horizontal.front();
    const double last = horizontal.back();
    if (first == 0.0 && last == 90.0) {
        return PhotometricSymmetry::Quadrant;
    }
    if (first == 0.0 && last == 180.0) {
        return PhotometricSymmetry::AcrossC0;
    }
    if (first == 90.0 && last == 270.0) {
        return PhotometricSymmetry::AcrossC90;
    }
    if (first == 0.0 && last == 360.0) {
        return PhotometricSymmetry::None;
    }
    if (first == 0.0 && last > 270.0 && last < 360.0) {
        repairs.push_back(fmt::format("the planes end at {} degrees; the circle was closed with the first", last));
        return PhotometricSymmetry::None;
    }
    return badInput(
        fmt::format("horizontal angles from {} to {} are no symmetry of type C photometry (0 to 90, 180 or "
                    "360, or 90 to 270)",
                    first, last));
}

// The ten numbers of the line after TILT and the three of the next, as far as they matter.
struct Dimensions {
    std::size_t vertical = 0;
    std::size_t horizontal = 0;
    double factor = 1.0;
    double lampLumens = 0.0;
};

Result<Dimensions> takeDimensions(Numbers& numbers, const Header& header, const PhotometricLimits& limits,
                                  std::vector<std::string>& repairs) {
    static constexpr std::array<const char*, 13> kNames{"the number of lamps",
                                                        "the lumens per lamp",
                                                        "the candela multiplier",
                                                        "the number of vertical angles",
                                                        "the number of horizontal angles",
                                                        "the photometric type",
                                                        "the units",
                                                        "the width",
                                                        "the length",
                                                        "the height",
                                                        "the ballast factor",
                                                        "the ballast-lamp factor",
                                                        "the input watts"};
    std::array<double, kNames.size()> value{};
    for (std::size_t i = 0; i < value.size(); ++i) {
        const Result<double> number = numbers.next(kNames[i]);
        if (!number) {
            return number.error();
        }
        value[i] = *number;
    }
    if (value[5] != 1.0) {
        return badInput(fmt::format("photometry of type {} is not supported, only C (type 1)",
                                    value[5] == 2.0   ? "B (2)"
                                    : value[5] == 3.0 ? "A (3)"
                                                      : fmt::format("{}", value[5])));
    }
    const Result<std::size_t> vertical = countIn(value[3], "vertical angles", limits.angles);
    if (!vertical) {
        return vertical.error();
    }
    const Result<std::size_t> horizontal = countIn(value[4], "horizontal angles", limits.angles);
    if (!horizontal) {
        return horizontal.error();
    }
    if (*vertical * *horizontal > limits.values) {
        return badInput(
            fmt::format("{} x {} candela values are more than the limit of {}", *vertical, *horizontal, limits.values));
    }
    if (!(value[2] > 0.0)) {
        return badInput(fmt::format("the candela multiplier is {}, not positive", value[2]));
    }
    double ballast = value[10];
    double ballastLamp = header.hasBallastLampFactor ? value[11] : 1.0;
    for (double* factor : {&ballast, &ballastLamp}) {
        if (*factor < 0.0) {
            return badInput(fmt::format("a ballast factor is {}, not positive", *factor));
        }
        if (*factor == 0.0) {
            repairs.push_back("a ballast factor of 0 was taken as 1");
            *factor = 1.0;
        }
    }
    const double lumens = value[1] > 0.0 && value[0] > 0.0 ? value[0] * value[1] : 0.0;
    return Dimensions{*vertical, *horizontal, value[2] * ballast * ballastLamp, lumens};
}

}  // namespace

Result<PhotometricImport> parseIes(std::string_view text, const PhotometricLimits& limits) {
    std::string_view rest = text;
    const Result<Header> header = takeHeader(rest);
    if (!header) {
        return header.error();
    }
    PhotometricImport import;
    import.name = header->name;
    Numbers numbers(rest);
    const Result<double> tilt = takeTilt(header->tilt, numbers, import.repairs);
    if (!tilt) {
        return tilt.error();
    }
    const Result<Dimensions> dimensions = takeDimensions(numbers, *header, limits, import.repairs);
    if (!dimensions) {
        return dimensions.error();
    }
    import.lampLumens = dimensions->lampLumens;
    PhotometricTable table;
    table.candelaPerValue = dimensions->factor * *tilt;
    const auto take = [&numbers](std::vector<double>& to, std::size_t count, const char* what) -> Result<void> {
        Result<std::vector<double>> list = numbers.list(count, what);
        if (!list) {
            return list.error();
        }
        to = *std::move(list);
        return {};
    };
    if (const auto taken = take(table.vertical, dimensions->vertical, "vertical angle"); !taken) {
        return taken.error();
    }
    if (const auto taken = take(table.horizontal, dimensions->horizontal, "horizontal angle"); !taken) {
        return taken.error();
    }
    if (const auto taken = take(table.values, dimensions->vertical * dimensions->horizontal, "candela value"); !taken) {
        return taken.error();
    }
    const Result<PhotometricSymmetry> symmetry = symmetryOf(table.horizontal, import.repairs);
    if (!symmetry) {
        return symmetry.error();
    }
    table.symmetry = *symmetry;
    if (!numbers.atEnd()) {
        import.repairs.push_back("words behind the last candela value were ignored");
    }
    Result<PhotometricWeb> web = webOf(table, import.repairs);
    if (!web) {
        return web.error();
    }
    import.web = *std::move(web);
    return import;
}

}  // namespace umbriel
