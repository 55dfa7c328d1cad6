#include "server/draw/draw_list.h"

namespace umbriel {

void DrawList::addCluster(std::uint32_t item, const Cluster& cluster, std::uint32_t index) {
    triangles += cluster.triangles;
    if (entries.empty() || entries.back().item != item)
        entries.push_back({item, static_cast<std::uint32_t>(commands.size()), 0});
    if (entries.back().count > 0) {
        Command& last = commands.back();
        if (last.firstIndex + last.count == cluster.firstTriangle * 3) {
            last.count += cluster.triangles * 3;
            return;
        }
    }
    commands.push_back({cluster.triangles * 3, 1, cluster.firstTriangle * 3, 0, index});
    ++entries.back().count;
}

namespace {

// Calls group(item, group) for every group of clusters that lies in the frustum, and cluster(item, cluster, overlap)
// for every cluster of the others that meets it.
template <class Group, class OneCluster>
void visitVisible(const ViewScene& scene, const Frustum& frustum, Group&& group, OneCluster&& cluster) {
    for (std::uint32_t i = 0; i < scene.items.size(); ++i) {
        const SurfaceItem& item = scene.items[i];
        const ObjectFrustum objectFrustum(frustum, item.relativeFromObject);
        const Overlap whole = objectFrustum.classify(item.geometry->box());
        if (whole == Overlap::Outside) continue;
        for (const ClusterGroup& one : item.geometry->groups()) {
            const Overlap part = whole == Overlap::Inside ? whole : objectFrustum.classify(one.box);
            if (part == Overlap::Inside) group(i, one);
            if (part != Overlap::Partial) continue;
            for (std::uint32_t c = one.firstCluster; c < one.firstCluster + one.clusters; ++c) {
                const Overlap overlap = objectFrustum.classify(item.geometry->clusters()[c].box);
                if (overlap != Overlap::Outside) cluster(i, c, overlap);
            }
        }
    }
}

}  // namespace

DrawList listVisible(const ViewScene& scene, const Frustum& frustum) {
    DrawList list;
    const auto add = [&](std::uint32_t item, std::uint32_t cluster) {
        list.addCluster(item, scene.items[item].geometry->clusters()[cluster], cluster);
        if (item < scene.opaqueItems) list.opaqueEntries = list.entries.size();
    };
    visitVisible(
        scene, frustum,
        [&](std::uint32_t item, const ClusterGroup& group) {
            for (std::uint32_t c = 0; c < group.clusters; ++c) add(item, group.firstCluster + c);
        },
        [&](std::uint32_t item, std::uint32_t cluster, Overlap) { add(item, cluster); });
    return list;
}

void markReceivers(const ViewScene& scene, const Frustum& frustum, std::span<CasterMask> masks) {
    const auto mark = [&](const SurfaceItem& item, const Box& box, bool isInside) {
        if (!has(item.features, Feature::Shadows) && !has(item.layerFeatures, Feature::Shadows)) return;
        for (CasterMask& mask : masks)
            if (mask.casters() != ShadowCasters::Fixed || !item.isInLightMap)
                mask.addReceiver(box, item.relativeFromObject, frustum, isInside);
    };
    visitVisible(
        scene, frustum,
        [&](std::uint32_t item, const ClusterGroup& group) { mark(scene.items[item], group.box, true); },
        [&](std::uint32_t item, std::uint32_t cluster, Overlap overlap) {
            const SurfaceItem& surface = scene.items[item];
            mark(surface, surface.geometry->clusters()[cluster].box, overlap == Overlap::Inside);
        });
}

DrawList listCasters(const ViewScene& scene, const CasterMask& mask, ShadowCasters casters) {
    DrawList list;
    if (mask.empty()) return list;
    for (std::uint32_t i = 0; i < scene.items.size(); ++i) {
        const SurfaceItem& item = scene.items[i];
        if (!item.castsShadow || !item.isAmong(casters)) continue;
        if (!mask.casts(item.geometry->box(), item.relativeFromObject)) continue;
        const std::span<const Cluster> clusters = item.geometry->clusters();
        const std::span<const ClusterGroup> groups = item.geometry->groups();
        for (const ClusterGroup& group : groups) {
            if (groups.size() > 1 && !mask.casts(group.box, item.relativeFromObject)) continue;
            for (std::uint32_t c = group.firstCluster; c < group.firstCluster + group.clusters; ++c)
                if (clusters.size() == 1 || mask.casts(clusters[c].box, item.relativeFromObject))
                    list.addCluster(i, clusters[c], c);
        }
    }
    list.opaqueEntries = list.entries.size();
    return list;
}

}  // namespace umbriel
