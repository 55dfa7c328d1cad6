#include "common/image/radiance_map.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

namespace umbriel {
namespace {

constexpr std::size_t kChannels = 3;
constexpr int kWhiteCode = kCodes - 1;

// Eq. 4: 0 for black and white, which say only "at most" and "at least".
double hatWeight(int code) {
    return code <= kWhiteCode / 2 ? code : kWhiteCode - code;
}

// One pixel and channel over all photographs.
struct Sample {
    int code = 0;
    double logSeconds = 0.0;
    double weight = 0.0;  // squared
};

std::optional<Error> problemOf(std::span<const Exposure> exposures) {
    if (exposures.size() < 2) {
        return badInput(fmt::format("a response curve needs two photographs or more, not {}", exposures.size()));
    }
    bool timesDiffer = false;
    for (std::size_t i = 0; i < exposures.size(); ++i) {
        const Exposure& exposure = exposures[i];
        if (!(exposure.seconds > 0.0) || !std::isfinite(exposure.seconds)) {
            return badInput(fmt::format("photograph {}: an exposure time must be positive", i + 1));
        }
        if (exposure.width <= 0 || exposure.height <= 0 || exposure.width != exposures[0].width ||
            exposure.height != exposures[0].height) {
            return badInput(fmt::format("photograph {} has {} x {} pixels, the first one {} x {}", i + 1,
                                        exposure.width, exposure.height, exposures[0].width, exposures[0].height));
        }
        UMBRIEL_ASSERT(exposure.codes.size() ==
                           static_cast<std::size_t>(exposure.width) * static_cast<std::size_t>(exposure.height) * 3,
                       "codes do not fill the photograph");
        timesDiffer = timesDiffer || exposure.seconds != exposures[0].seconds;
    }
    if (!timesDiffer) {
        return badInput("all photographs have the same exposure time: a response curve needs different ones");
    }
    return std::nullopt;
}

// At most about `wanted` pixels, in rows and columns evenly over the picture, away from its edges.
std::vector<std::size_t> latticeOf(int width, int height, std::size_t wanted) {
    const double pixels = static_cast<double>(width) * static_cast<double>(height);
    const int step = std::max(
        1, static_cast<int>(std::ceil(std::sqrt(pixels / static_cast<double>(std::max<std::size_t>(wanted, 1))))));
    std::vector<std::size_t> lattice;
    for (int y = std::min(step / 2, height - 1); y < height; y += step) {
        for (int x = std::min(step / 2, width - 1); x < width; x += step) {
            lattice.push_back(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                              static_cast<std::size_t>(x));
        }
    }
    return lattice;
}

void samplesOf(std::span<const Exposure> exposures, const std::vector<double>& logSeconds, std::size_t pixel,
               std::size_t channel, std::vector<Sample>& samples) {
    samples.clear();
    for (std::size_t j = 0; j < exposures.size(); ++j) {
        const int code = exposures[j].codes[pixel * kChannels + channel];
        const double weight = hatWeight(code);
        if (weight > 0.0) {
            samples.push_back({code, logSeconds[j], weight * weight});
        }
    }
}

// Makes the curve rise: pool adjacent violators, the least-squares answer under weights.
int makeRising(LogResponse& curve) {
    struct Block {
        double sum;
        double weight;
        int codes;
        double mean() const { return sum / weight; }
    };
    std::vector<Block> blocks;
    for (int z = 0; z < kCodes; ++z) {
        const double weight = hatWeight(z) + 1.0;
        blocks.push_back({curve[static_cast<std::size_t>(z)] * weight, weight, 1});
        while (blocks.size() > 1 && blocks[blocks.size() - 2].mean() > blocks.back().mean()) {
            const Block last = blocks.back();
            blocks.pop_back();
            blocks.back().sum += last.sum;
            blocks.back().weight += last.weight;
            blocks.back().codes += last.codes;
        }
    }
    int moved = 0;
    std::size_t z = 0;
    for (const Block& block : blocks) {
        for (int i = 0; i < block.codes; ++i, ++z) {
            if (block.codes > 1) {
                curve[z] = block.mean();
                ++moved;
            }
        }
    }
    const double shift = curve[kMidCode];
    for (double& value : curve) {
        value -= shift;
    }
    return moved;
}

// The normal equations of eq. 3 for one channel. For given g, a pixel's best ln E is the weighted mean of
// g(z_j) - ln t_j; put in, what is left are the 256 values of g.
struct ResponseEquations {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(kCodes, kCodes);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(kCodes);
    std::uint64_t related = 0;  // pixels that relate two photographs

    void add(const std::vector<Sample>& samples) {
        double weights = 0.0;
        double weightedTime = 0.0;
        for (const Sample& s : samples) {
            weights += s.weight;
            weightedTime += s.weight * s.logSeconds;
        }
        if (samples.size() < 2) {
            return;  // says nothing about g
        }
        ++related;
        for (const Sample& s : samples) {
            matrix(s.code, s.code) += s.weight;
            right(s.code) += s.weight * (s.logSeconds - weightedTime / weights);
            for (const Sample& t : samples) {
                matrix(s.code, t.code) -= s.weight * t.weight / weights;
            }
        }
    }

    // lambda w(z) g''(z), and g(kMidCode) = 0, which the rest leaves open.
    void regularise(double smoothness) {
        for (int z = 1; z < kCodes - 1; ++z) {
            const double weight = smoothness * hatWeight(z);
            static constexpr std::array<double, 3> kSecondDifference{1.0, -2.0, 1.0};
            for (int i = 0; i < 3; ++i) {
                for (int j = 0; j < 3; ++j) {
                    matrix(z - 1 + i, z - 1 + j) += weight * weight * kSecondDifference[static_cast<std::size_t>(i)] *
                                                    kSecondDifference[static_cast<std::size_t>(j)];
                }
            }
        }
        // Of the size of the other entries, for the sake of rounding; the solution does not depend on it.
        matrix(kMidCode, kMidCode) += matrix.diagonal().maxCoeff();
    }
};

double residualOf(const std::vector<Sample>& samples, const LogResponse& curve, double& weightSum) {
    double weights = 0.0;
    double mean = 0.0;
    for (const Sample& s : samples) {
        weights += s.weight;
        mean += s.weight * (curve[static_cast<std::size_t>(s.code)] - s.logSeconds);
    }
    if (samples.size() < 2) {
        return 0.0;
    }
    mean /= weights;
    double sum = 0.0;
    for (const Sample& s : samples) {
        const double off = curve[static_cast<std::size_t>(s.code)] - s.logSeconds - mean;
        sum += s.weight * off * off;
    }
    weightSum += weights;
    return sum;
}

std::vector<double> logSecondsOf(std::span<const Exposure> exposures) {
    std::vector<double> result;
    for (const Exposure& exposure : exposures) {
        result.push_back(std::log(exposure.seconds));
    }
    return result;
}

// ln E of one pixel and channel; `isBound` when no photograph measures it.
double logRadianceOf(std::span<const Exposure> exposures, const std::vector<double>& logSeconds,
                     const LogResponse& curve, std::size_t index, MergeRule rule, bool& isBound) {
    double sum = 0.0;
    double weights = 0.0;
    std::size_t best = 0;
    int bestDistance = kCodes;
    for (std::size_t j = 0; j < exposures.size(); ++j) {
        const int code = exposures[j].codes[index];
        const double weight = hatWeight(code);
        sum += weight * (curve[static_cast<std::size_t>(code)] - logSeconds[j]);
        weights += weight;
        // White in the shortest and black in the longest photograph are the tightest bounds.
        const int distance = std::abs(2 * code - kWhiteCode);
        const bool sooner = code == kWhiteCode ? logSeconds[j] < logSeconds[best] : logSeconds[j] > logSeconds[best];
        if (distance < bestDistance || (distance == bestDistance && sooner)) {
            best = j;
            bestDistance = distance;
        }
    }
    isBound = weights == 0.0;
    if (rule == MergeRule::Weighted && !isBound) {
        return sum / weights;
    }
    return curve[exposures[best].codes[index]] - logSeconds[best];
}

}  // namespace

Result<ResponseFit> fitResponse(std::span<const Exposure> exposures, const ResponseOptions& options) {
    if (const std::optional<Error> problem = problemOf(exposures)) {
        return *problem;
    }
    if (!(options.smoothness > 0.0) || !std::isfinite(options.smoothness)) {
        return badInput("the smoothness must be positive");
    }
    const std::vector<std::size_t> lattice = latticeOf(exposures[0].width, exposures[0].height, options.pixels);
    const std::vector<double> logSeconds = logSecondsOf(exposures);
    ResponseFit fit;
    fit.pixels = lattice.size();
    std::vector<Sample> samples;
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        ResponseEquations equations;
        for (const std::size_t pixel : lattice) {
            samplesOf(exposures, logSeconds, pixel, channel, samples);
            equations.add(samples);
        }
        if (equations.related == 0) {
            return badInput("no pixel is neither black nor white in two photographs: their times lie too far apart");
        }
        equations.regularise(options.smoothness);
        const Eigen::VectorXd solution = equations.matrix.ldlt().solve(equations.right);
        LogResponse& curve = fit.response[channel];
        for (int z = 0; z < kCodes; ++z) {
            curve[static_cast<std::size_t>(z)] = solution(z);
        }
        if (!solution.allFinite()) {
            return failure("the equations of the response curve could not be solved: more smoothness may help");
        }
        fit.raisedCodes[channel] = makeRising(curve);
        double sum = 0.0;
        double weights = 0.0;
        for (const std::size_t pixel : lattice) {
            samplesOf(exposures, logSeconds, pixel, channel, samples);
            sum += residualOf(samples, curve, weights);
        }
        fit.residual[channel] = std::sqrt(sum / weights);
    }
    return fit;
}

RadianceMap mergeExposures(std::span<const Exposure> exposures, const CameraResponse& response, MergeRule rule) {
    UMBRIEL_ASSERT(!problemOf(exposures), "the photographs do not fit together");
    const std::vector<double> logSeconds = logSecondsOf(exposures);
    RadianceMap map;
    map.rgba = makeRgbaImage(exposures[0].width, exposures[0].height);
    float* to = map.rgba.samples().data();
    for (std::size_t pixel = 0; pixel < map.rgba.pixelCount(); ++pixel, to += 4) {
        bool white = false;
        bool black = false;
        for (std::size_t c = 0; c < kChannels; ++c) {
            const std::size_t index = pixel * kChannels + c;
            bool isBound = false;
            to[c] =
                static_cast<float>(std::exp(logRadianceOf(exposures, logSeconds, response[c], index, rule, isBound)));
            white = white || (isBound && exposures[0].codes[index] == kWhiteCode);
            black = black || (isBound && exposures[0].codes[index] == 0);
        }
        to[3] = 1.0F;
        map.white += white ? 1 : 0;
        map.black += black ? 1 : 0;
    }
    return map;
}

}  // namespace umbriel
