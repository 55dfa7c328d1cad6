#include "common/light/environment.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/assert.h"
#include "shaders/formula_cpp.h"

namespace umbriel {
namespace {

namespace f = formula_f64;

constexpr double kPi = 3.14159265358979323846;
constexpr int kLargestFace = 256;
constexpr int kLargestColumns = 4 * 2048;

// Halves by averages over solid angle: rows near the poles count for less.
Panorama halved(const Panorama& source) {
    Panorama result{std::max(1, source.columns / 2), std::max(1, source.rows / 2), {}};
    result.radiance.resize(static_cast<std::size_t>(result.columns) * static_cast<std::size_t>(result.rows));
    for (int row = 0; row < result.rows; ++row)
        for (int column = 0; column < result.columns; ++column) {
            glm::dvec3 sum(0.0);
            double weights = 0.0;
            for (int y = row * source.rows / result.rows; y < (row + 1) * source.rows / result.rows; ++y) {
                const double weight = f::latLongTexelSolidAngle(y, source.columns, source.rows);
                for (int x = column * source.columns / result.columns; x < (column + 1) * source.columns / result.columns;
                     ++x) {
                    sum += weight * glm::dvec3(source.at(x, y));
                    weights += weight;
                }
            }
            result.radiance[static_cast<std::size_t>(row * result.columns + column)] = glm::vec3(sum / weights);
        }
    return result;
}

// Wraps around, and over the poles to the other side.
const glm::vec3& texel(const Panorama& panorama, int column, int row) {
    if (row < 0 || row >= panorama.rows) {
        row = row < 0 ? -1 - row : 2 * panorama.rows - 1 - row;
        row = std::clamp(row, 0, panorama.rows - 1);
        column += panorama.columns / 2;
    }
    column %= panorama.columns;
    return panorama.at(column < 0 ? column + panorama.columns : column, row);
}

glm::dvec3 bilinear(const Panorama& panorama, const glm::dvec2& place) {
    const double x = place.x * panorama.columns - 0.5;
    const double y = place.y * panorama.rows - 0.5;
    const int column = static_cast<int>(std::floor(x));
    const int row = static_cast<int>(std::floor(y));
    const double across = x - column;
    const double down = y - row;
    const auto at = [&](int dx, int dy) { return glm::dvec3(texel(panorama, column + dx, row + dy)); };
    return glm::mix(glm::mix(at(0, 0), at(1, 0), across), glm::mix(at(0, 1), at(1, 1), across), down);
}

class Pyramid {
 public:
    explicit Pyramid(const Panorama& panorama) {
        _levels.push_back(panorama);
        while (_levels.back().columns > kLargestColumns) _levels.assign(1, halved(_levels.back()));
        while (_levels.back().rows > 4) _levels.push_back(halved(_levels.back()));
    }
    const Panorama& base() const { return _levels.front(); }
    // The level with about so many columns.
    const Panorama& withColumns(int columns) const {
        for (const Panorama& level : _levels)
            if (level.columns <= columns) return level;
        return _levels.back();
    }
    // Averaged over about so many steradians.
    glm::dvec3 average(const glm::dvec3& direction, double solidAngle) const {
        const double texelAngle = 4.0 * kPi / (double(base().columns) * base().rows);
        const double level = std::clamp(0.5 * std::log2(solidAngle / texelAngle), 0.0, double(_levels.size() - 1));
        const auto lower = static_cast<std::size_t>(level);
        const std::size_t upper = std::min(lower + 1, _levels.size() - 1);
        const glm::dvec2 place = f::latLongFromDirection(direction);
        return glm::mix(bilinear(_levels[lower], place), bilinear(_levels[upper], place), level - double(lower));
    }

 private:
    std::vector<Panorama> _levels;
};

// Calls fill(unit direction) for every texel of a cube.
template <class Fill>
void fillCube(int size, std::vector<glm::vec3>& texels, Fill&& fill) {
    for (int face = 0; face < 6; ++face)
        for (int row = 0; row < size; ++row)
            for (int column = 0; column < size; ++column)
                texels.push_back(glm::vec3(fill(face, column, row)));
}

glm::dvec3 unitCubeDirection(int face, double column, double row, int size) {
    return glm::normalize(f::directionFromCube(face, {column / size, row / size}));
}

// The texel's average: 2 x 2 lookups, no farther apart than the texels of the level they read.
glm::dvec3 mirrored(const Pyramid& pyramid, int face, int column, int row, int size) {
    constexpr int kSub = 2;
    glm::dvec3 sum(0.0);
    const double solidAngle = 4.0 * kPi / (6.0 * size * size * kSub * kSub);
    for (int y = 0; y < kSub; ++y)
        for (int x = 0; x < kSub; ++x)
            sum += pyramid.average(unitCubeDirection(face, column + (x + 0.5) / kSub, row + (y + 0.5) / kSub, size),
                                   solidAngle);
    return sum / double(kSub * kSub);
}

// van der Corput's sequence.
double reversedBits(std::uint32_t i) {
    std::uint32_t reversed = 0;
    for (int bit = 0; bit < 32; ++bit) reversed |= ((i >> bit) & 1u) << (31 - bit);
    return reversed * 0x1p-32;
}

// Normals distributed as GGX times cosine, about +z (Walter et al. 2007, eq. 35, 36).
struct LobeSample {
    glm::dvec3 toLight;   // mirrored at the sampled normal, seen along +z
    double solidAngle = 0.0;  // that the sample stands for
};

std::vector<LobeSample> lobeSamples(double roughness, int count) {
    const double alpha = f::alphaFromRoughness(roughness);
    std::vector<LobeSample> samples;
    for (int i = 0; i < count; ++i) {
        const double u = (i + 0.5) / count;
        const double azimuth = 2.0 * kPi * reversedBits(static_cast<std::uint32_t>(i));
        const double cosine = std::sqrt((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u));
        const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
        const glm::dvec3 h(sine * std::cos(azimuth), sine * std::sin(azimuth), cosine);
        const glm::dvec3 toLight(2.0 * cosine * h.x, 2.0 * cosine * h.y, 2.0 * cosine * cosine - 1.0);
        if (!(toLight.z > 0.0)) continue;
        const double density = 0.25 * f::ggxDistribution(cosine, sine * sine, alpha);
        samples.push_back({toLight, 1.0 / (count * density)});
    }
    return samples;
}

// Karis 2013: weighted by the cosine with the light; filtered as Krivanek & Colbert 2008 so that few samples do.
glm::dvec3 lobeAverage(const Pyramid& pyramid, const glm::dvec3& axis, const std::vector<LobeSample>& samples) {
    const glm::dvec3 helper = std::abs(axis.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
    const glm::dvec3 x = glm::normalize(glm::cross(helper, axis));
    const glm::dvec3 y = glm::cross(axis, x);
    glm::dvec3 sum(0.0);
    double weights = 0.0;
    for (const LobeSample& sample : samples) {
        const glm::dvec3 toLight = x * sample.toLight.x + y * sample.toLight.y + axis * sample.toLight.z;
        // Twice as wide: neighbouring samples overlap instead of leaving gaps.
        sum += sample.toLight.z * pyramid.average(toLight, 2.0 * sample.solidAngle);
        weights += sample.toLight.z;
    }
    return sum / weights;
}

std::vector<glm::vec3> convolve(const Panorama& coarse, int size) {
    struct Source {
        glm::dvec3 direction;
        glm::dvec3 radiance;
        double solidAngle;
    };
    std::vector<Source> sources;
    for (int row = 0; row < coarse.rows; ++row)
        for (int column = 0; column < coarse.columns; ++column)
            sources.push_back(
                {f::directionFromLatLong({(column + 0.5) / coarse.columns, (row + 0.5) / coarse.rows}),
                 glm::dvec3(coarse.at(column, row)), f::latLongTexelSolidAngle(row, coarse.columns, coarse.rows)});
    std::vector<glm::vec3> texels;
    fillCube(size, texels, [&](int face, int column, int row) {
        const glm::dvec3 normal = unitCubeDirection(face, column + 0.5, row + 0.5, size);
        glm::dvec3 sum(0.0);
        double weights = 0.0;
        for (const Source& source : sources) {
            const double weight = f::diffuseConvolutionWeight(normal, source.direction, source.solidAngle);
            sum += weight * source.radiance;
            weights += weight;
        }
        return sum / weights;  // the weights sum to 1 but for the coarse grid
    });
    return texels;
}

}  // namespace

glm::vec3 cubeDirection(int face, const glm::vec2& place) {
    return glm::vec3(f::directionFromCube(face, glm::dvec2(place)));
}

PanoramaRepairs repair(Panorama& panorama) {
    PanoramaRepairs repairs;
    for (glm::vec3& texel : panorama.radiance)
        for (int channel = 0; channel < 3; ++channel) {
            float& value = texel[channel];
            if (!std::isfinite(value)) {
                ++repairs.notFinite;
                value = value > 0.0f ? kLargestRadiance : 0.0f;
            } else if (value < 0.0f) {
                ++repairs.negative;
                value = 0.0f;
            } else if (value > kLargestRadiance) {
                ++repairs.tooLarge;
                value = kLargestRadiance;
            }
        }
    return repairs;
}

Panorama halfTurned(const Panorama& panorama) {
    Panorama result = panorama;
    for (int row = 0; row < panorama.rows; ++row) {
        const auto first = result.radiance.begin() + static_cast<std::ptrdiff_t>(row) * panorama.columns;
        // An odd number of columns has no middle; half a texel is what a panorama of that size can say.
        std::rotate(first, first + (panorama.columns + 1) / 2, first + panorama.columns);
    }
    return result;
}

Panorama panoramaFromFaces(const std::vector<std::vector<glm::vec3>>& faces, int side) {
    UMBRIEL_ASSERT(faces.size() == 6 && side > 0, "a cube has six faces");
    Panorama result{4 * side, 2 * side, {}};
    const auto at = [&](int face, int column, int row) {
        const std::size_t index = static_cast<std::size_t>(std::clamp(row, 0, side - 1)) * static_cast<std::size_t>(side) +
                                  static_cast<std::size_t>(std::clamp(column, 0, side - 1));
        return glm::dvec3(faces[static_cast<std::size_t>(face)][index]);
    };
    for (int row = 0; row < result.rows; ++row)
        for (int column = 0; column < result.columns; ++column) {
            const glm::dvec3 direction =
                f::directionFromLatLong({(column + 0.5) / result.columns, (row + 0.5) / result.rows});
            const int face = f::cubeFace(direction);
            const glm::dvec2 place = f::cubePlace(direction) * double(side) - 0.5;
            const glm::dvec2 cell = glm::floor(place);
            const glm::dvec2 part = place - cell;
            const int x = static_cast<int>(cell.x);
            const int y = static_cast<int>(cell.y);
            result.radiance.push_back(
                glm::vec3(glm::mix(glm::mix(at(face, x, y), at(face, x + 1, y), part.x),
                                   glm::mix(at(face, x, y + 1), at(face, x + 1, y + 1), part.x), part.y)));
        }
    return result;
}

PrefilteredEnvironment prefilter(const Panorama& panorama, int faceSize) {
    UMBRIEL_ASSERT(panorama.columns > 0 && panorama.rows > 0 &&
                       panorama.radiance.size() ==
                           static_cast<std::size_t>(panorama.columns) * static_cast<std::size_t>(panorama.rows),
                   "a panorama's size is not that of its texels");
    const Pyramid pyramid(panorama);
    PrefilteredEnvironment result;
    result.levels = kEnvironmentLevels;
    result.faceSize = faceSize > 0 ? faceSize
                                   : static_cast<int>(std::bit_floor(static_cast<unsigned>(
                                         std::clamp(panorama.columns / 4, 32, kLargestFace))));
    for (int level = 0; level < result.levels; ++level) {
        const int size = result.faceSize >> level;
        if (level == 0) {
            fillCube(size, result.radiance,
                     [&](int face, int column, int row) { return mirrored(pyramid, face, column, row, size); });
            continue;
        }
        const std::vector<LobeSample> samples =
            lobeSamples(double(level) / (result.levels - 1), level == 1 ? 64 : 128);
        fillCube(size, result.radiance, [&](int face, int column, int row) {
            return lobeAverage(pyramid, unitCubeDirection(face, column + 0.5, row + 0.5, size), samples);
        });
    }
    result.diffuseSize = kDiffuseFaceSize;
    result.convolved = convolve(pyramid.withColumns(128), result.diffuseSize);
    return result;
}

namespace {

// Over the hemisphere by cosine.
double averageRise(const glm::dvec3& toEye) {
    constexpr int kSamples = 1024;
    double sum = 0.0;
    for (int i = 0; i < kSamples; ++i) {
        const double sine = std::sqrt((i + 0.5) / kSamples);
        const double azimuth = 2.0 * kPi * reversedBits(static_cast<std::uint32_t>(i));
        const glm::dvec3 toLight(sine * std::cos(azimuth), sine * std::sin(azimuth), std::sqrt(1.0 - sine * sine));
        sum += std::pow(1.0 - glm::dot(toEye, glm::normalize(toLight + toEye)), 5.0);
    }
    return sum / kSamples;
}

}  // namespace

std::vector<glm::vec3> mirroredShares() {
    // At grazing angles 256 are off by 0.03, these by 0.002.
    constexpr int kSamples = 4096;
    std::vector<glm::dvec2> around;  // the azimuths of the samples
    for (int i = 0; i < kSamples; ++i) {
        const double azimuth = 2.0 * kPi * reversedBits(static_cast<std::uint32_t>(i));
        around.push_back({std::cos(azimuth), std::sin(azimuth)});
    }
    std::vector<double> rises;  // by column
    for (int column = 0; column < kReflectanceSide; ++column) {
        const double cosEye = (column + 0.5) / kReflectanceSide;
        rises.push_back(averageRise({std::sqrt(1.0 - cosEye * cosEye), 0.0, cosEye}));
    }
    std::vector<glm::vec3> shares;
    for (int row = 0; row < kReflectanceSide; ++row) {
        const double alpha = f::alphaFromRoughness((row + 0.5) / kReflectanceSide);
        std::vector<glm::dvec3> halves;
        for (int i = 0; i < kSamples; ++i) {
            const double u = (i + 0.5) / kSamples;
            const double cosine = std::sqrt((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u));
            const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
            halves.push_back({around[static_cast<std::size_t>(i)] * sine, cosine});
        }
        for (int column = 0; column < kReflectanceSide; ++column) {
            const double cosEye = (column + 0.5) / kReflectanceSide;
            const glm::dvec3 toEye(std::sqrt(1.0 - cosEye * cosEye), 0.0, cosEye);
            glm::dvec2 sum(0.0);
            for (const glm::dvec3& h : halves) {
                const double eyeHalf = glm::dot(toEye, h);
                const double cosLight = 2.0 * eyeHalf * h.z - cosEye;
                if (!(cosLight > 0.0) || !(eyeHalf > 0.0)) continue;
                // BRDF * cosine / density of the sample: D cancels.
                const double seen = 4.0 * f::ggxVisibility(cosLight, cosEye, alpha) * eyeHalf * cosLight / h.z;
                const double squared = (1.0 - eyeHalf) * (1.0 - eyeHalf);
                const double rise = squared * squared * (1.0 - eyeHalf);
                sum += glm::dvec2(1.0 - rise, rise) * seen;
            }
            shares.push_back({glm::vec2(sum / double(kSamples)), rises[static_cast<std::size_t>(column)]});
        }
    }
    return shares;
}

}  // namespace umbriel
