#pragma once

#include <span>
#include <utility>
#include <vector>

#include "server/draw/culling.h"
#include "server/shadow/shadow_module.h"

namespace umbriel {

// Which parts of a light's map the visible surfaces of one tile can sample, and how deep: so that only casters that can
// darken something in this tile are drawn. Coarse and conservative: a map drawn with fewer casters holds the same bits
// in every texel that the tile samples, up to texels whose caster lies behind everything they are compared with.
class CasterMask {
 public:
    static constexpr int kCells = 256;  // along each side of the map

    CasterMask(const ShadowFit& fit, const glm::dvec3& eyeWorld);

    // Where an object lies, worked out once for all of its boxes.
    struct Placed {
        glm::dmat4 relativeFromObject{1.0};
        glm::dmat4 mapFromObject{1.0};  // of a plain map of parallel light: to cells, cells, depth
    };
    Placed place(const glm::dmat4& relativeFromObject) const;

    // A box all of which is visible in the tile.
    void addReceiver(const Box& box, const Placed& placed);
    // What lies between some points is.
    void addReceiver(std::span<const glm::dvec3> pointsRelative);
    // Of a box that is only partly inside the tile's frustum the inner part counts.
    void addReceiver(const Box& box, const glm::dmat4& relativeFromObject, const Frustum& frustum, bool isInside);
    // False when the box can darken nothing that was added.
    bool casts(const Box& box, const Placed& placed) const;
    bool casts(const Box& box, const glm::dmat4& relativeFromObject) const {
        return casts(box, place(relativeFromObject));
    }
    // The same about all boxes in a box: True that they cast, False that they do not.
    enum class Casting { False, Unknown, True };
    Casting castingWithin(const Box& box, const Placed& placed) const;

    bool empty() const { return _marked.empty(); }
    // Of the fit.
    ShadowCasters casters() const { return _casters; }
    // As if every place of the map were looked up, however deep.
    void markEverything();
    bool isEverything() const { return _isEverything; }
    // True when a map drawn for this mask holds what other's lookups need. Both of the same fit.
    bool covers(const CasterMask& other) const;
    // What was marked, in texels of the map.
    PixelRect texels() const;

 private:
    struct Footprint {
        std::vector<glm::dvec2> points;  // in cells
        std::vector<glm::dvec2> hull;
        std::vector<std::pair<double, double>> ranges;  // of x, by row
        double nearest = 0.0;  // reversed depth: the largest
        double farthest = 0.0;
        enum class Kind { Projected, Everything, Nothing } kind = Kind::Nothing;
    };
    // Of cells, both ends included; depths as in Footprint.
    struct Range {
        int left, right, bottom, top;
        double nearest, farthest;
        bool isWhole;  // all of it lies on the map
        // Of a few cells the hull leaves out less than finding it costs.
        bool isFew() const { return right - left <= 4 || top - bottom <= 4; }
    };
    static Range rangeBetween(const glm::dvec2& minimum, const glm::dvec2& maximum);
    // Of a projected one.
    static Range rangeOf(const Footprint& footprint, double dilation);
    // On a plain map of parallel light.
    Range rangeOf(const Box& box, const Placed& placed, double dilation) const;
    // Valid until the next call: there are thousands a frame, which share their memory.
    Footprint& footprintOf(std::span<const glm::dvec3> pointsRelative) const;
    void addFootprint(Footprint& footprint);
    // What is kept of a receiver's depth.
    float depthBehind(double farthest) const;
    void mark(int y, int from, int to, float depth);
    template <class Visit>
    void visitRows(Footprint& footprint, double dilation, Visit&& visit) const;

    glm::dmat4 _clipFromRelative;
    glm::dvec3 _unwarp;  // undistorted depth = z / w / dot(unwarp, (x, y, 1))
    std::uint32_t _mapSize;  // 0: no map, nothing is marked
    ShadowCasters _casters;
    bool _isAnyDepth;  // filters compare with the receiver's plane, beside it also with what lies deeper than all receivers
    double _dilation;              // cells
    std::vector<float> _farthest;  // reversed depth of the farthest receiver by cell; 2: none
    PixelRect _marked;             // cells
    mutable Footprint _footprint;
    bool _isEverything = false;
    bool _isParallel = false;  // and not warped: places on the map depend on those in the world linearly
    bool _isAround = false;  // no projective map: its lookups are not told apart
};

}  // namespace umbriel
