#pragma once

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

    // A box that is visible in the tile, placed by relativeFromObject; of a box that is only partly inside the tile's
    // frustum the inner part counts.
    void addReceiver(const Box& box, const glm::dmat4& relativeFromObject, const Frustum& frustum, bool isInside);
    // False when the box can darken nothing that was added.
    bool casts(const Box& box, const glm::dmat4& relativeFromObject) const;

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
        double nearest = 0.0;  // reversed depth: the largest
        double farthest = 0.0;
        enum class Kind { Projected, Everything, Nothing } kind = Kind::Nothing;
    };
    // Valid until the next call: there are thousands a frame, which share their memory.
    Footprint& footprintOf(std::span<const glm::dvec3> pointsRelative) const;
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
    bool _isAround = false;  // no projective map: its lookups are not told apart
};

}  // namespace umbriel
