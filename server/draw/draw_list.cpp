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

// Calls visit(item index, cluster index, overlap) for every cluster that meets the frustum.
template <class Visit>
void visitVisible(const ViewScene& scene, const Frustum& frustum, Visit&& visit) {
    for (std::uint32_t i = 0; i < scene.items.size(); ++i) {
        const SurfaceItem& item = scene.items[i];
        const ObjectFrustum objectFrustum(frustum, item.relativeFromObject);
        const Overlap whole = objectFrustum.classify(item.geometry->box());
        if (whole == Overlap::Outside) continue;
        const std::span<const Cluster> clusters = item.geometry->clusters();
        for (std::uint32_t c = 0; c < clusters.size(); ++c) {
            const Overlap overlap = whole == Overlap::Inside ? whole : objectFrustum.classify(clusters[c].box);
            if (overlap != Overlap::Outside) visit(i, c, overlap);
        }
    }
}

}  // namespace

DrawList listVisible(const ViewScene& scene, const Frustum& frustum) {
    DrawList list;
    visitVisible(scene, frustum, [&](std::uint32_t item, std::uint32_t cluster, Overlap) {
        list.addCluster(item, scene.items[item].geometry->clusters()[cluster], cluster);
        if (item < scene.opaqueItems) list.opaqueEntries = list.entries.size();
    });
    return list;
}

void markReceivers(const ViewScene& scene, const Frustum& frustum, std::span<CasterMask> masks) {
    visitVisible(scene, frustum, [&](std::uint32_t index, std::uint32_t cluster, Overlap overlap) {
        const SurfaceItem& item = scene.items[index];
        if (!has(item.features, Feature::Shadows) && !has(item.layerFeatures, Feature::Shadows)) return;
        for (CasterMask& mask : masks)
            mask.addReceiver(item.geometry->clusters()[cluster].box, item.relativeFromObject, frustum,
                             overlap == Overlap::Inside);
    });
}

DrawList listCasters(const ViewScene& scene, const CasterMask& mask) {
    DrawList list;
    if (mask.empty()) return list;
    for (std::uint32_t i = 0; i < scene.items.size(); ++i) {
        const SurfaceItem& item = scene.items[i];
        if (!item.castsShadow || !mask.casts(item.geometry->box(), item.relativeFromObject)) continue;
        const std::span<const Cluster> clusters = item.geometry->clusters();
        for (std::uint32_t c = 0; c < clusters.size(); ++c)
            if (clusters.size() == 1 || mask.casts(clusters[c].box, item.relativeFromObject))
                list.addCluster(i, clusters[c], c);
    }
    list.opaqueEntries = list.entries.size();
    return list;
}

}  // namespace umbriel
