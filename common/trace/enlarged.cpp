#include "common/trace/enlarged.h"

#include <algorithm>

namespace umbriel::trace {
namespace {

// Corners may run this many margins away from where they were before the triangle is taken for a needle.
constexpr double kLongestTip = 20.0;

void append(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, std::uint32_t original, double sure,
            Enlarged& out) {
    out.corners.insert(out.corners.end(), {glm::vec3(a), glm::vec3(b), glm::vec3(c)});
    out.original.push_back(original);
    out.sure.push_back(static_cast<float>(sure));
}

}  // namespace

void appendEnlarged(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, std::uint32_t original,
                    double margin, Enlarged& out) {
    const double la = glm::length(c - b), lb = glm::length(a - c), lc = glm::length(b - a);
    const double perimeter = la + lb + lc;
    const double area2 = glm::length(glm::cross(b - a, c - a));
    const double longest = std::max({la, lb, lc});
    const double inradius = area2 / perimeter;
    const glm::dvec3 incentre = (a * la + b * lb + c * lc) / perimeter;
    // About the incentre all edges move by the same distance.
    const double factor = 1.0 + margin / inradius;
    if (inradius > 0.0 && longest * (factor - 1.0) <= kLongestTip * margin) {
        const auto moved = [&](const glm::dvec3& p) { return incentre + (p - incentre) * factor; };
        // Two margins from the enlarged edge, as a share of the smallest height.
        append(moved(a), moved(b), moved(c), original, 2.0 * margin * longest / (area2 * factor), out);
        return;
    }
    // A rectangle about the longest edge.
    glm::dvec3 from = a, to = b, tip = c;
    if (la == longest) {
        from = b, to = c, tip = a;
    } else if (lb == longest) {
        from = c, to = a, tip = b;
    }
    const glm::dvec3 along = (to - from) / longest;
    glm::dvec3 up = (tip - from) - along * glm::dot(tip - from, along);
    const double height = glm::length(up);
    up = height > 0.0 ? up / height : glm::dvec3(0.0);
    const glm::dvec3 p0 = from - (along + up) * margin, p1 = to + (along - up) * margin;
    const glm::dvec3 p2 = to + along * margin + up * (height + margin),
                     p3 = from - along * margin + up * (height + margin);
    append(p0, p1, p2, original, 2.0, out);
    append(p0, p2, p3, original, 2.0, out);
}

}  // namespace umbriel::trace
