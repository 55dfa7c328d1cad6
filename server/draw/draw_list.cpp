#include "server/draw/draw_list.h"

#include "common/base/hash.h"
#include "server/shadow/map_module.h"

namespace umbriel {

void DrawList::addCluster(std::uint32_t item, const Cluster& cluster, std::uint32_t index, bool isSolid) {
    triangles += cluster.triangles;
    if (entries.empty() || entries.back().item != item)
        entries.push_back({item, static_cast<std::uint32_t>(commands.size()), 0, 0});
    if (joins && entries.back().count > 0 && isSolid == (entries.back().solid == entries.back().count)) {
        Command& last = commands.back();
        if (last.firstIndex + last.count == cluster.firstTriangle * 3) {
            last.count += cluster.triangles * 3;
            return;
        }
    }
    commands.push_back({cluster.triangles * 3, 1, cluster.firstTriangle * 3, 0, index});
    ++entries.back().count;
    if (isSolid) ++entries.back().solid;
}

namespace {

// Adds clusters item by item, those that hide their own backs first: they also hide what lies behind them.
class SolidsFirst {
 public:
    explicit SolidsFirst(DrawList& list) : _list(list) {}
    ~SolidsFirst() { flush(); }
    void add(std::uint32_t item, const Cluster& cluster, std::uint32_t index, bool isSolid) {
        if (item != _item) flush();
        _item = item;
        if (isSolid)
            _list.addCluster(item, cluster, index, true);
        else
            _others.emplace_back(&cluster, index);
    }

 private:
    void flush() {
        for (const auto& [cluster, index] : _others) _list.addCluster(_item, *cluster, index);
        _others.clear();
    }
    DrawList& _list;
    std::uint32_t _item = 0;
    std::vector<std::pair<const Cluster*, std::uint32_t>> _others;
};

// Calls group(item, group, frustum) for every group of clusters that lies in the frustum, and cluster(item, cluster,
// frustum, overlap) for every cluster of the others that meets it; the frustum is the item's.
template <class Group, class OneCluster>
void visitVisible(const ViewScene& scene, const Frustum& frustum, Group&& group, OneCluster&& cluster) {
    for (std::uint32_t i = 0; i < scene.items.size(); ++i) {
        const SurfaceItem& item = scene.items[i];
        const ObjectFrustum objectFrustum(frustum, item.relativeFromObject);
        const Overlap whole = objectFrustum.classify(item.geometry->box());
        if (whole == Overlap::Outside) continue;
        for (const ClusterGroup& one : item.geometry->groups()) {
            const Overlap part = whole == Overlap::Inside ? whole : objectFrustum.classify(one.box);
            if (part == Overlap::Inside) group(i, one, objectFrustum);
            if (part != Overlap::Partial) continue;
            for (std::uint32_t c = one.firstCluster; c < one.firstCluster + one.clusters; ++c) {
                const Overlap overlap = objectFrustum.classify(item.geometry->clusters()[c].box);
                if (overlap != Overlap::Outside) cluster(i, c, objectFrustum, overlap);
            }
        }
    }
}

}  // namespace

DrawList listVisible(const ViewScene& scene, const Frustum& frustum) {
    DrawList list;
    {
        SolidsFirst adder(list);
        std::uint32_t facedItem = UINT32_MAX;
        FacingTest facing;
        const auto isTurnedAway = [&](std::uint32_t item, const Cluster& cluster) {
            const SurfaceItem& surface = scene.items[item];
            if (item != facedItem)
                facing = FacingTest::ofView(*scene.view, surface.relativeFromObject, surface.geometry->box(),
                                            surface.isMirrored);
            facedItem = item;
            return facing.isTurnedAway(cluster.box, cluster.normals);
        };
        // What the near plane cuts open shows its backs. The plane is the view's, so all tiles draw the same.
        visitVisible(
            scene, frustum,
            [&](std::uint32_t item, const ClusterGroup& group, const ObjectFrustum& itemFrustum) {
                const SurfaceItem& surface = scene.items[item];
                const bool allBeyond = surface.hidesBacks && itemFrustum.isBeyondNear(group.solids);
                for (std::uint32_t c = group.firstCluster; c < group.firstCluster + group.clusters; ++c) {
                    const Cluster& cluster = surface.geometry->clusters()[c];
                    const bool isSolid = allBeyond ? !cluster.solids.empty()
                                                   : surface.hidesBacks && itemFrustum.isBeyondNear(cluster.solids);
                    if (isSolid && isTurnedAway(item, cluster)) continue;
                    adder.add(item, cluster, c, isSolid);
                }
            },
            [&](std::uint32_t item, std::uint32_t c, const ObjectFrustum& itemFrustum, Overlap) {
                const SurfaceItem& surface = scene.items[item];
                const Cluster& cluster = surface.geometry->clusters()[c];
                const bool isSolid = surface.hidesBacks && itemFrustum.isBeyondNear(cluster.solids);
                if (isSolid && isTurnedAway(item, cluster)) return;
                adder.add(item, cluster, c, isSolid);
            });
    }
    while (list.opaqueEntries < list.entries.size() && list.entries[list.opaqueEntries].item < scene.opaqueItems)
        ++list.opaqueEntries;
    return list;
}

void markReceivers(const ViewScene& scene, const Frustum& frustum, std::span<CasterMask> masks) {
    std::vector<CasterMask::Placed> placed(masks.size());  // the item at hand
    std::uint32_t placedItem = UINT32_MAX;
    std::vector<glm::dvec3> points;
    const auto mark = [&](std::uint32_t number, const Box& box, bool isInside) {
        const SurfaceItem& item = scene.items[number];
        if (!has(item.features, Feature::Shadows) && !has(item.layerFeatures, Feature::Shadows)) return;
        if (isInside && number != placedItem) {
            placedItem = number;
            for (std::size_t i = 0; i < masks.size(); ++i) placed[i] = masks[i].place(item.relativeFromObject);
        }
        if (!isInside) hullOfIntersection(box, item.relativeFromObject, frustum, points);
        for (std::size_t i = 0; i < masks.size(); ++i) {
            if (masks[i].casters() == ShadowCasters::Fixed && item.isInLightMap) continue;
            if (isInside)
                masks[i].addReceiver(box, placed[i]);
            else
                masks[i].addReceiver(points);
        }
    };
    visitVisible(
        scene, frustum,
        [&](std::uint32_t item, const ClusterGroup& group, const ObjectFrustum&) { mark(item, group.box, true); },
        [&](std::uint32_t item, std::uint32_t cluster, const ObjectFrustum&, Overlap overlap) {
            mark(item, scene.items[item].geometry->clusters()[cluster].box, overlap == Overlap::Inside);
        });
}

namespace {

BoxFaces backmostOf(const ViewScene& scene, const SurfaceItem& item, const ShadowFit& fit) {
    if (scene.isMapShown()) return 0;
    return backmostFaces(item.geometry->flatBoxFaces(), item.geometry->box(), item.worldFromObject, scene.boxWorld, fit);
}

}  // namespace

std::uint64_t backmostState(const ViewScene& scene, const ShadowFit& fit) {
    std::vector<std::uint64_t> state;
    for (const SurfaceItem& item : scene.items)
        if (const BoxFaces faces = backmostOf(scene, item, fit); faces != 0) {
            state.push_back(item.node.value);
            state.push_back(faces);
        }
    return hash64(std::as_bytes(std::span(state)));
}

DrawList listCasters(const ViewScene& scene, const CasterMask& mask, const ShadowFit& fit) {
    DrawList list;
    if (mask.empty()) return list;
    // A parallel light stands outside of everything, and no near plane cuts what it shines on.
    const bool isOutside = !fit.perspective && fit.shape == ShadowShape::Single;
    list.isMirrored = isOutside && isMapMirrored(fit);
    // What is tessellated is drawn cluster by cluster: Mesa's software renderers number all vertices that a draw makes
    // of its patches with 16 bits, and beyond 65536 triangles get corners of other patches. A patch divided into 64
    // parts has 3169, so a cluster of 16 has at most 50704.
    list.joins = fit.shape != ShadowShape::Hemisphere;
    for (std::uint32_t i = 0; i < scene.items.size(); ++i) {
        const SurfaceItem& item = scene.items[i];
        if (!item.castsShadow || !item.isAmong(fit.casters)) continue;
        using Casting = CasterMask::Casting;
        const CasterMask::Placed placed = mask.place(item.relativeFromObject);
        const Casting whole = mask.castingWithin(item.geometry->box(), placed);
        if (whole == Casting::False) continue;
        const bool hidesBacks = isOutside && item.casterFeatures == 0;
        const BoxFaces backmost = backmostOf(scene, item, fit);
        const FacingTest facing = hidesBacks ? FacingTest::ofMap(fit, item.worldFromObject, item.geometry->box(),
                                                                 item.isMirrored != list.isMirrored)
                                             : FacingTest();
        SolidsFirst adder(list);
        const std::span<const Cluster> clusters = item.geometry->clusters();
        const std::span<const ClusterGroup> groups = item.geometry->groups();
        for (const ClusterGroup& group : groups) {
            const Casting together =
                groups.size() > 1 && whole == Casting::Unknown ? mask.castingWithin(group.box, placed) : whole;
            if (together == Casting::False) continue;
            for (std::uint32_t c = group.firstCluster; c < group.firstCluster + group.clusters; ++c) {
                if (backmost != 0 && (backmost & faceUnder(clusters[c].box, item.geometry->box())) != 0) continue;
                const bool isSolid = hidesBacks && !clusters[c].solids.empty();
                if (isSolid && facing.isTurnedAway(clusters[c].box, clusters[c].normals)) continue;
                if (clusters.size() == 1 || together == Casting::True || mask.casts(clusters[c].box, placed))
                    adder.add(i, clusters[c], c, isSolid);
            }
        }
    }
    list.opaqueEntries = list.entries.size();
    return list;
}

}  // namespace umbriel
