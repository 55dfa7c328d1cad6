#include "client/session/shadow_warp.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace umbriel {

namespace {

// w varies by no more over a map: at 4096 a float's 24 bits leave 12 for the place in it.
constexpr double kMaxWidening = 256.0;

// Nor by so much that the map's border comes more than half the way to the warp's horizon, which is 1 / widening of the
// map beyond its far end: past it there is no map.
double mostWidening(const ShadowFitRequest& request) {
    return std::min(kMaxWidening, 0.5 / borderShare(request));
}

struct Corner {
    double x = 0.0, y = 0.0;  // across the light; y from 0 at the body's near end
};

// A place that is seen.
struct Seen {
    double y = 0.0;
    double depth = 0.0;  // from the eye, over what texels grow with: metres per unit across the light
    double weight = 0.0;
};

// The body in a frame whose y leads away from the eye.
struct TurnedBody {
    glm::dmat3 turnedFromAcross{1.0};
    double turn = 0.0;   // radians from the nearest quarter turn of the light's own axes: those make the same map
    double share = 0.0;  // of the turn, 0 to 1: how much that direction means
    std::vector<Corner> corners;
    std::vector<Seen> seen;
    double length = 0.0;  // largest y
    bool usable = false;
};

double smoothStep(double from, double to, double value) {
    const double t = std::clamp((value - from) / (to - from), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// Smallest value of a function with one minimum.
template <class Function>
double minimise(double lower, double upper, Function&& function) {
    constexpr double kGolden = 0.6180339887498949;
    double a = upper - kGolden * (upper - lower), b = lower + kGolden * (upper - lower);
    double fa = function(a), fb = function(b);
    for (int i = 0; i < 80; ++i) {
        if (fa <= fb) {
            upper = b;
            b = a;
            fb = fa;
            a = upper - kGolden * (upper - lower);
            fa = function(a);
        } else {
            lower = a;
            a = b;
            fa = fb;
            b = lower + kGolden * (upper - lower);
            fb = function(b);
        }
    }
    return 0.5 * (lower + upper);
}

// How depth grows across the light, by least squares over the places. What a warp should follow is how far away things
// are that lie at a place of the map. That is the view's direction as the light sees it only where they fill a volume
// evenly: on a ground that the light grazes the two are 40 degrees apart.
struct DepthSlope {
    glm::dvec2 gradient{0.0};  // per unit across the light
    double mean = 0.0;         // depth, over what texels grow with
    double explained = 0.0;    // of the depths' variance by the gradient, 0 to 1
};

double depthOf(const LightBody& body, const LightBody::Place& place) {
    return place.depth / (body.perspective ? -place.point.z : 1.0);
}

DepthSlope depthSlopeOf(const LightBody& body) {
    DepthSlope slope;
    double weight = 0.0;
    glm::dvec2 middle(0.0);
    for (const LightBody::Place& place : body.places) {
        weight += place.weight;
        middle += place.weight * body.across(place.point);
        slope.mean += place.weight * depthOf(body, place);
    }
    if (!(weight > 0.0)) return slope;
    middle /= weight;
    slope.mean /= weight;
    glm::dmat2 spread(0.0);
    glm::dvec2 together(0.0);
    double variance = 0.0;
    for (const LightBody::Place& place : body.places) {
        const glm::dvec2 off = body.across(place.point) - middle;
        const double deeper = depthOf(body, place) - slope.mean;
        spread += place.weight * glm::outerProduct(off, off);
        together += place.weight * deeper * off;
        variance += place.weight * deeper * deeper;
    }
    // Places that lie nearly on a line say nothing about the way across it.
    const double ridge = 5e-4 * (spread[0][0] + spread[1][1]);
    spread[0][0] += ridge;
    spread[1][1] += ridge;
    if (!(glm::determinant(spread) > 0.0 && variance > 0.0)) return slope;
    slope.gradient = glm::inverse(spread) * together;
    slope.explained = glm::dot(slope.gradient, together) / variance;
    return slope;
}

TurnedBody turned(const LightBody& body) {
    TurnedBody result;
    if (body.places.empty() || body.points.empty()) return result;
    const DepthSlope slope = depthSlopeOf(body);
    const double rise = glm::length(slope.gradient);
    if (!(rise > 0.0) || !std::isfinite(rise)) return result;
    const glm::dvec2 u = slope.gradient / rise;
    // Rows: the new x and y axes.
    result.turnedFromAcross = glm::transpose(glm::dmat3(u.y, -u.x, 0.0, u.x, u.y, 0.0, 0.0, 0.0, 1.0));
    const double angle = std::atan2(u.x, u.y);
    result.turn = angle - std::round(angle / 1.5707963267948966) * 1.5707963267948966;
    double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
    for (const glm::dvec3& point : body.points) {
        const glm::dvec3 t = result.turnedFromAcross * glm::dvec3(body.across(point), 1.0);
        result.corners.push_back({t.x, t.y});
        lowest = std::min(lowest, t.y);
        highest = std::max(highest, t.y);
    }
    for (Corner& corner : result.corners) corner.y -= lowest;
    result.length = highest - lowest;
    for (const LightBody::Place& place : body.places) {
        const double y = glm::dot(u, body.across(place.point)) - lowest;
        // Places may lie a little beyond what is seen of the box.
        result.seen.push_back({std::clamp(y, 0.0, result.length), depthOf(body, place), place.weight});
    }
    // A direction means nothing where depths hardly differ, and where they differ in every direction alike.
    result.share = smoothStep(0.02, 0.2, rise * result.length / slope.mean) * smoothStep(0.01, 0.25, slope.explained);
    glm::dmat3 shift(1.0);
    shift[2][1] = -lowest;
    result.turnedFromAcross = shift * result.turnedFromAcross;
    result.usable = result.length > body.smallest && result.share > 0.0;
    return result;
}

// w = 1 + steepness * y, with the centre of projection where the body's picture becomes narrowest.
glm::dmat3 warpOf(const TurnedBody& body, double steepness) {
    if (!(steepness * body.length > 1e-9)) return glm::dmat3(1.0);
    double left = std::numeric_limits<double>::infinity(), right = -left;
    for (const Corner& corner : body.corners) {
        left = std::min(left, corner.x);
        right = std::max(right, corner.x);
    }
    const double middle = 0.5 * (left + right), extent = std::max(right - left, body.length * 1e-9);
    const auto width = [&](double centre) {
        double lower = std::numeric_limits<double>::infinity(), upper = -lower;
        for (const Corner& corner : body.corners) {
            const double x = (corner.x - centre) / (1.0 + steepness * corner.y);
            lower = std::min(lower, x);
            upper = std::max(upper, x);
        }
        // Many centres may be as good, or nearly: a little weight on the middle makes one of them the best, and keeps
        // it from jumping from one end of them to the other.
        const double off = (centre - middle) / extent;
        return (upper - lower) + 0.1 * extent * off * off;
    };
    glm::dmat3 warp(1.0);
    warp[2][0] = -minimise(left, right, width);
    warp[1][2] = steepness;
    // The map turns into the view's direction only as far as that direction means something: seen along the light, and
    // where there is next to no warp, it stays as the uniform map is.
    const double back = body.turn * (1.0 - body.share * smoothStep(0.0, 0.5, steepness * body.length));
    const double c = std::cos(back), s = std::sin(back);
    return glm::dmat3(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0) * warp * body.turnedFromAcross;
}

// The steepness 1 / n of the light-space perspective: for which the mean over what is seen of a texel's length on the
// picture, (1 + s y)^2 / ((1 + s d) depth), is smallest. With A, B, C the weighted sums of 1, y, y^2 over depth that is
// (A + 2 B s + C s^2) / (1 + s d), and its derivative is 0 where C d s^2 + 2 C s = A d - 2 B.
double bestSteepness(const TurnedBody& body) {
    double a = 0.0, b = 0.0, c = 0.0;
    for (const Seen& seen : body.seen) {
        const double t = seen.y / body.length, weight = seen.weight / seen.depth;
        a += weight;
        b += weight * t;
        c += weight * t * t;
    }
    if (!(c > 0.0)) return kMaxWidening / body.length;
    const double gain = std::max(a - 2.0 * b, 0.0) / c;
    return std::min(body.share * gain / (1.0 + std::sqrt(1.0 + gain)), kMaxWidening) / body.length;
}

}  // namespace

glm::dmat3 lispWarp(const LightBody& body, const ShadowFitRequest& request) {
    const TurnedBody seen = turned(body);
    if (!seen.usable) return glm::dmat3(1.0);
    const double steepness = bestSteepness(seen) / static_cast<double>(request.lispFactor);
    return warpOf(seen, std::min(steepness, mostWidening(request) / seen.length));
}

glm::dmat3 trapezoidWarp(const LightBody& body, const ShadowFitRequest& request) {
    const TurnedBody seen = turned(body);
    if (!seen.usable) return glm::dmat3(1.0);
    constexpr double kXi = -0.6;
    const double lambda = seen.length;
    const double delta = static_cast<double>(request.range) * lambda;
    // 1 / eta, which is 0 at the 0.8 lambda where eta is infinite.
    double steepness = std::max(lambda - 2.0 * delta - lambda * kXi, 0.0) / (lambda * delta * (1.0 + kXi));
    // Where even the perspective that knows the eye's distances finds little to gain, there is no near end to favour.
    constexpr double kBeyondBest = 16.0;
    steepness = std::min({steepness, kBeyondBest * bestSteepness(seen), mostWidening(request) / lambda});
    // Sides that open too wide: the centre moves back until they do not.
    const double limit = std::tan(0.5 * std::clamp(static_cast<double>(request.maxSideAngle), 0.01, 3.0));
    double left = std::numeric_limits<double>::infinity(), right = -left;
    for (const Corner& corner : seen.corners) {
        left = std::min(left, corner.x);
        right = std::max(right, corner.x);
    }
    const auto opening = [&](double s) {
        double widest = 0.0;
        for (const Corner& corner : seen.corners)
            widest = std::max(widest, std::abs(corner.x - 0.5 * (left + right)) * s / (1.0 + s * corner.y));
        return widest;
    };
    if (opening(steepness) > limit) {
        double narrow = 0.0, wide = steepness;
        for (int i = 0; i < 80; ++i) {
            const double middle = 0.5 * (narrow + wide);
            (opening(middle) > limit ? wide : narrow) = middle;
        }
        steepness = narrow;
    }
    return warpOf(seen, steepness);
}

glm::dmat3 perspectiveWarp(const LightBody& body, const ShadowFitRequest&) {
    const glm::dmat3 identity(1.0);
    const double agreement = glm::length(body.axisLight);
    if (body.places.empty() || body.points.empty() || !(agreement > 1e-6)) return identity;
    const glm::dvec3 forward = body.axisLight / agreement;
    // Any frame around the axis that does not jump while it turns past the light: across it, the light's x.
    const glm::dvec3 side = std::abs(forward.x) < 0.99 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 up = glm::normalize(glm::cross(glm::cross(forward, side), forward));
    const glm::dvec3 right = glm::cross(forward, up);
    double farthest = 0.0, nearest = std::numeric_limits<double>::infinity();
    for (const glm::dvec3& point : body.points) {
        const double depth = glm::dot(point - body.eyeLight, forward);
        farthest = std::max(farthest, depth);
        nearest = std::min(nearest, depth);
    }
    if (!(farthest > 0.0)) return identity;
    nearest = std::max(nearest, kNearShare * farthest);
    const double behind = std::max(0.0, kNearShare * farthest);

    // The homography with the camera this far behind the eye, and how near the body comes to its horizon.
    const auto warpAt = [&](double slide, double& ratio) {
        const glm::dvec3 camera = body.eyeLight - slide * forward;
        const double n = nearest + slide, f = std::max(farthest + slide, n * 1.000001);
        double widestX = 0.0, widestY = 0.0;
        for (const glm::dvec3& point : body.points) {
            const glm::dvec3 p = point - camera;
            const double depth = std::max(glm::dot(p, forward), behind);
            widestX = std::max(widestX, std::abs(glm::dot(p, right)) / depth);
            widestY = std::max(widestY, std::abs(glm::dot(p, up)) / depth);
        }
        widestX = std::max(widestX, 1e-9);
        widestY = std::max(widestY, 1e-9);
        // Clip space of the camera, z from -1 at n to 1 at f, of a point or (w = 0) a direction.
        const auto clip = [&](const glm::dvec3& p, double w) {
            const glm::dvec3 relative = p - camera * w;
            const double depth = glm::dot(relative, forward);
            return glm::dvec4(glm::dot(relative, right) / widestX, glm::dot(relative, up) / widestY,
                              (depth * (f + n) - 2.0 * f * n * w) / (f - n), depth);
        };
        const glm::dvec4 light = body.perspective ? clip(glm::dvec3(0.0), 1.0) : clip({0.0, 0.0, 1.0}, 0.0);
        // From the light's image to the middle of the cube, in homogeneous coordinates: l' may be at infinity.
        glm::dvec3 axis = -glm::dvec3(light);
        const double length = glm::length(axis);
        glm::dmat3 warp(1.0);
        ratio = 0.0;
        if (!(length > 0.0)) return warp;
        axis /= length;
        const glm::dvec3 other = std::abs(axis.x) < 0.99 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1);
        const glm::dvec3 e1 = glm::normalize(other - glm::dot(other, axis) * axis);
        const glm::dvec3 e2 = glm::cross(axis, e1);
        // (q - l') in coordinates e1, e2 and axis, q being a point's image; linear in the point, nothing along the ray.
        const auto picture = [&](const glm::dvec4& q) {
            const glm::dvec3 v = glm::dvec3(q);
            return glm::dvec3(glm::dot(v, e1), glm::dot(v, e2),
                              (glm::dot(v, axis) * light.w - glm::dot(glm::dvec3(light), axis) * q.w) / length);
        };
        if (body.perspective) {
            warp[0] = picture(clip({1.0, 0.0, 0.0}, 0.0));
            warp[1] = picture(clip({0.0, 1.0, 0.0}, 0.0));
            warp[2] = picture(clip({0.0, 0.0, -1.0}, 0.0));
        } else {
            warp[0] = picture(clip({1.0, 0.0, 0.0}, 0.0));
            warp[1] = picture(clip({0.0, 1.0, 0.0}, 0.0));
            warp[2] = picture(clip({0.0, 0.0, 0.0}, 1.0));
        }
        double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
        for (const glm::dvec3& point : body.points) {
            const double w = (warp * glm::dvec3(body.across(point), 1.0)).z;
            lowest = std::min(lowest, w);
            highest = std::max(highest, w);
        }
        if (highest <= 0.0) {
            warp *= -1.0;
            std::swap(lowest, highest);
            lowest = -lowest;
            highest = -highest;
        }
        ratio = lowest > 0.0 ? lowest / highest : 0.0;
        if (lowest > 0.0) warp *= 1.0 / lowest;
        return warp;
    };
    // (f + n) / (f - n) >= 1.5 (Kozlov 2004), then the horizon.
    constexpr double kLeastRatio = 1.0 / 32.0;
    double slide = std::max(0.0, 0.25 * (farthest - 5.0 * nearest));
    double ratio = 0.0;
    glm::dmat3 warp = warpAt(slide, ratio);
    if (ratio >= kLeastRatio) return warp;
    double tooNear = slide;
    double enough = std::max(slide, farthest);
    for (int i = 0; i < 40 && ratio < kLeastRatio; ++i) {
        warp = warpAt(enough, ratio);
        if (ratio < kLeastRatio) {
            tooNear = enough;
            enough *= 2.0;
        }
    }
    if (ratio < kLeastRatio) return identity;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (tooNear + enough);
        warpAt(middle, ratio);
        (ratio < kLeastRatio ? tooNear : enough) = middle;
    }
    return warpAt(enough, ratio);
}

}  // namespace umbriel
