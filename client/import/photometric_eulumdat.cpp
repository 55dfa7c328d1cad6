#include "client/import/photometric_eulumdat.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/import/photometric_planes.h"
#include "common/image/printable.h"

namespace umbriel {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
constexpr std::size_t kMaxLampSets = 20;  // the format's own limit
constexpr std::size_t kLinesOfLampSet = 6;
constexpr std::size_t kDirectRatios = 10;

// Lines of a file by their place; fields of the format are lines.
class Lines {
 public:
    explicit Lines(std::string_view text) : _rest(text) {
        if (_rest.starts_with(kByteOrderMark)) {
            _rest.remove_prefix(kByteOrderMark.size());
        }
    }

    bool usedDecimalComma() const { return _usedDecimalComma; }

    Result<std::string_view> text(std::string_view what) {
        if (_rest.empty()) {
            return badInput(fmt::format("the file ends after {} lines, where {} should follow", _number, what));
        }
        ++_number;
        const std::size_t end = _rest.find('\n');
        std::string_view line = _rest.substr(0, end);
        _rest.remove_prefix(end == std::string_view::npos ? _rest.size() : end + 1);
        const std::size_t first = line.find_first_not_of(" \t\r");
        return first == std::string_view::npos ? std::string_view()
                                               : line.substr(first, line.find_last_not_of(" \t\r") - first + 1);
    }

    Result<double> number(std::string_view what) {
        const Result<std::string_view> line = text(what);
        if (!line) {
            return line.error();
        }
        std::string word(*line);
        if (std::count(word.begin(), word.end(), ',') == 1) {
            std::replace(word.begin(), word.end(), ',', '.');
            _usedDecimalComma = true;
        }
        const std::optional<double> number = numberIn(word);
        if (!number) {
            return badInput(
                fmt::format("line {} is '{}', no number, where {} should be", _number, printable(*line), what));
        }
        return *number;
    }

    Result<void> skip(std::size_t count, std::string_view what) {
        for (std::size_t i = 0; i < count; ++i) {
            if (const Result<std::string_view> line = text(what); !line) {
                return line.error();
            }
        }
        return {};
    }

    Result<std::vector<double>> list(std::size_t count, std::string_view what) {
        std::vector<double> numbers;
        numbers.reserve(
            std::min(count, _rest.size() / 2 + 1));  // a lying count allocates no more than the file is long
        while (numbers.size() < count) {
            const Result<double> next = number(what);
            if (!next) {
                return next.error();
            }
            numbers.push_back(*next);
        }
        return numbers;
    }

 private:
    std::string_view _rest;
    std::size_t _number = 0;
    bool _usedDecimalComma = false;
};

struct Head {
    std::string name;
    int symmetry = 0;        // Isym
    std::size_t planes = 0;  // Mc
    std::size_t angles = 0;  // Ng
    double conversion = 1.0;
    double lumens = 0.0;
    std::size_t lampSets = 0;
};

// Which planes of the list of C angles have values.
struct GivenPlanes {
    PhotometricSymmetry symmetry = PhotometricSymmetry::None;
    std::size_t first = 0;
    std::size_t count = 0;
};

Result<GivenPlanes> givenPlanesOf(const Head& head) {
    const std::size_t planes = head.planes;
    const auto expectMultiple = [&](std::size_t of) -> Result<void> {
        if (planes % of != 0) {
            return badInput(fmt::format("{} planes do not fit symmetry {}, which needs a multiple of {}", planes,
                                        head.symmetry, of));
        }
        return {};
    };
    switch (head.symmetry) {
        case 0:
            return GivenPlanes{PhotometricSymmetry::None, 0, planes};
        case 1:
            return GivenPlanes{PhotometricSymmetry::Rotational, 0, 1};
        case 2:
            if (const auto fits = expectMultiple(2); !fits) {
                return fits.error();
            }
            return GivenPlanes{PhotometricSymmetry::AcrossC0, 0, planes / 2 + 1};
        case 3:
            if (const auto fits = expectMultiple(4); !fits) {
                return fits.error();
            }
            return GivenPlanes{PhotometricSymmetry::AcrossC90, 3 * planes / 4, planes / 2 + 1};
        default:
            if (const auto fits = expectMultiple(4); !fits) {
                return fits.error();
            }
            return GivenPlanes{PhotometricSymmetry::Quadrant, 0, planes / 4 + 1};
    }
}

// Lines 1 to 26 and the sets of lamps.
Result<Head> takeHead(Lines& lines, const PhotometricLimits& limits, std::vector<std::string>& repairs) {
    Head head;
    Result<void> step = lines.skip(2, "the head of the file");  // company, type of light source
    const auto number = [&](double& to, std::string_view what) {
        if (step) {
            const Result<double> read = lines.number(what);
            read ? void(to = *read) : void(step = read.error());
        }
    };
    const auto skip = [&](std::size_t count) {
        if (step) {
            step = lines.skip(count, "the head of the file");
        }
    };
    const auto count = [&](std::size_t& to, std::string_view what, std::size_t limit) {
        double value = 0.0;
        number(value, what);
        if (step) {
            const Result<std::size_t> read = countIn(value, what, limit);
            read ? void(to = *read) : void(step = read.error());
        }
    };
    double symmetry = 0.0;
    double lamps = 0.0;
    number(symmetry, "the symmetry");
    count(head.planes, "C planes", limits.angles);
    skip(1);  // distance between them: the angles follow
    count(head.angles, "intensities in a plane", limits.angles);
    skip(2);  // distance, report's number
    if (step) {
        const Result<std::string_view> name = lines.text("the luminaire's name");
        name ? void(head.name = printable(*name)) : void(step = name.error());
    }
    skip(14);  // number, file, date, sizes, downward flux fraction, light output ratio
    number(head.conversion, "the conversion factor");
    skip(1);  // tilt during the measurement
    count(head.lampSets, "sets of lamps", kMaxLampSets);
    number(lamps, "the number of lamps");
    skip(1);  // type of the lamps
    number(head.lumens, "the luminous flux of the lamps");
    skip(3 + (head.lampSets - 1) * kLinesOfLampSet + kDirectRatios);  // colour, its rendering, power; other sets
    if (!step) {
        return step.error();
    }
    if (symmetry != 0.0 && symmetry != 1.0 && symmetry != 2.0 && symmetry != 3.0 && symmetry != 4.0) {
        return badInput(fmt::format("symmetry {} is none of 0 to 4", symmetry));
    }
    head.symmetry = static_cast<int>(symmetry);
    if (!(head.lumens > 0.0)) {
        return badInput(fmt::format(
            "the luminous flux of the lamps is {} lm, not positive: intensities are per 1000 lm", head.lumens));
    }
    if (head.conversion == 0.0) {
        repairs.push_back("a conversion factor of 0 was taken as 1");
        head.conversion = 1.0;
    }
    if (!(head.conversion > 0.0)) {
        return badInput(fmt::format("the conversion factor is {}, not positive", head.conversion));
    }
    if (head.lampSets > 1) {
        repairs.push_back(fmt::format("the first of {} sets of lamps was taken", head.lampSets));
    }
    return head;
}

}  // namespace

Result<PhotometricImport> parseEulumdat(std::string_view text, const PhotometricLimits& limits) {
    PhotometricImport import;
    Lines lines(text);
    const Result<Head> head = takeHead(lines, limits, import.repairs);
    if (!head) {
        return head.error();
    }
    import.name = head->name;
    import.lampLumens = head->lumens;
    const Result<GivenPlanes> given = givenPlanesOf(*head);
    if (!given) {
        return given.error();
    }
    if (given->count * head->angles > limits.values) {
        return badInput(fmt::format("{} x {} intensities are more than the limit of {}", given->count, head->angles,
                                    limits.values));
    }
    const Result<std::vector<double>> planes = lines.list(head->planes, "an angle C");
    if (!planes) {
        return planes.error();
    }
    if (const Result<void> rising = expectRising(*planes, "C"); !rising) {
        return rising.error();
    }
    if (planes->front() < 0.0 || planes->back() > 360.0) {
        return badInput(fmt::format("angles C from {} to {} leave 0 to 360 degrees", planes->front(), planes->back()));
    }
    PhotometricTable table;
    table.symmetry = given->symmetry;
    table.candelaPerValue = head->conversion * head->lumens / 1000.0;
    for (std::size_t i = 0; i < given->count; ++i) {
        table.horizontal.push_back((*planes)[(given->first + i) % planes->size()]);
    }
    Result<std::vector<double>> vertical = lines.list(head->angles, "an angle G");
    if (!vertical) {
        return vertical.error();
    }
    table.vertical = *std::move(vertical);
    Result<std::vector<double>> values = lines.list(given->count * head->angles, "an intensity");
    if (!values) {
        return values.error();
    }
    table.values = *std::move(values);
    if (lines.usedDecimalComma()) {
        import.repairs.push_back("decimal commas were read as points");
    }
    Result<PhotometricWeb> web = webOf(table, import.repairs);
    if (!web) {
        return web.error();
    }
    import.web = *std::move(web);
    return import;
}

}  // namespace umbriel
