#include "tests/unit/visibility/closed_forms.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace umbriel::visibility::test {
namespace {

using std::numbers::pi;

// In [0, 1), the same on every machine (Steele et al. 2014, SplitMix64).
class Sequence {
 public:
    double next() {
        std::uint64_t z = (_state += 0x9e3779b97f4a7c15ull);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
    }

 private:
    std::uint64_t _state = 1;
};

struct Sample {
    glm::dvec3 direction;  // z is the normal
    double weight;
};

std::vector<Sample> samples(const Mapping& m) {
    std::vector<Sample> result;
    glm::dmat3 normalFrame(1.0);
    if (directionFrame(m) == DirectionFrame::Object) {
        const glm::dvec3 z = glm::normalize(glm::dvec3(1, 2, 3)),
                         x = glm::normalize(glm::cross(z, glm::dvec3(0, 0, 1)));
        normalFrame = glm::transpose(glm::dmat3(x, glm::cross(z, x), z));
    }
    double total = 0.0;
    for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
        const glm::dvec3 d = normalFrame * direction(m, p);
        if (!(d.z > 0.0)) continue;
        const double weight = directionFrame(m) == DirectionFrame::Object
                                  ? std::max((normalFrame * vectorWeight(m, p)).z, 0.0)
                                  : cosineWeight(m, p);
        result.push_back({d, weight});
        total += weight;
    }
    for (Sample& s : result) s.weight /= total;
    return result;
}

}  // namespace

FormErrors formErrors(const Mapping& mapping, std::uint32_t occluders) {
    const std::vector<Sample> set = samples(mapping);
    Sequence random;
    double wall = 0.0, cap = 0.0;
    for (std::uint32_t i = 0; i < occluders; ++i) {
        const double k = std::tan(0.5 * pi * random.next()), side = 2.0 * pi * random.next();
        const glm::dvec3 towards(std::cos(side), std::sin(side), 0.0);
        double hidden = 0.0;
        for (const Sample& s : set) {
            const double reach = glm::dot(s.direction, towards);
            if (reach > 0.0 && s.direction.z < k * reach) hidden += s.weight;
        }
        const double wallError = hidden - 0.5 * (1.0 - 1.0 / std::sqrt(1.0 + k * k));
        wall += wallError * wallError;

        const double theta = std::acos(random.next()), sigma = (0.5 * pi - theta) * random.next();
        const double turn = 2.0 * pi * random.next(), cosine = std::cos(sigma);
        const glm::dvec3 middle(std::sin(theta) * std::cos(turn), std::sin(theta) * std::sin(turn), std::cos(theta));
        hidden = 0.0;
        for (const Sample& s : set) {
            if (glm::dot(s.direction, middle) > cosine) hidden += s.weight;
        }
        const double capError = hidden - std::sin(sigma) * std::sin(sigma) * std::cos(theta);
        cap += capError * capError;
    }
    return {std::sqrt(wall / occluders), std::sqrt(cap / occluders)};
}

}  // namespace umbriel::visibility::test
