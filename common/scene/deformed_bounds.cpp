#include "common/scene/deformed_bounds.h"

#include <algorithm>
#include <cmath>

namespace umbriel {

std::vector<VertexJoints> vertexJointsOf(const Geometry& geometry, std::size_t jointCount) {
    const std::size_t vertices = geometry.positions.size();
    if (vertices == 0 || geometry.joints.size() != vertices * kJointsPerVertex ||
        geometry.jointWeights.size() != vertices)
        return {};
    const std::vector<std::uint16_t> joints = geometry.joints.toVector();
    const std::vector<glm::vec4> weights = geometry.jointWeights.toVector();
    std::vector<VertexJoints> result(vertices);
    for (std::size_t v = 0; v < vertices; ++v) {
        double sum = 0.0;
        double used[kJointsPerVertex] = {};
        for (std::size_t k = 0; k < kJointsPerVertex; ++k) {
            const double weight = weights[v][static_cast<int>(k)];
            if (!(weight > 0.0) || !std::isfinite(weight) || joints[v * kJointsPerVertex + k] >= jointCount) continue;
            used[k] = weight;
            sum += weight;
        }
        if (!(sum > 0.0)) continue;
        for (std::size_t k = 0; k < kJointsPerVertex; ++k) {
            result[v].joints[k] = used[k] > 0.0 ? joints[v * kJointsPerVertex + k] : std::uint16_t{0};
            result[v].weights[k] = static_cast<float>(used[k] / sum);
        }
    }
    return result;
}

std::size_t morphTargetsOf(const Geometry& geometry) {
    const std::size_t vertices = geometry.positions.size();
    if (vertices == 0) return 0;
    const std::size_t numbers =
        std::max({geometry.morphPositions.size(), geometry.morphNormals.size(), geometry.morphTangents.size()});
    for (const std::size_t size :
         {geometry.morphPositions.size(), geometry.morphNormals.size(), geometry.morphTangents.size()})
        if (size != 0 && size != numbers) return 0;
    return numbers % vertices == 0 ? numbers / vertices : 0;
}

std::vector<float> morphWeightsOf(const Aspect& scene, const DeformedGeometry& core, std::size_t targets) {
    std::vector<float> weights(targets, 0.0f);
    const MorphWeights* given = scene.find(core.morph.get());
    for (std::size_t i = 0; given && i < std::min(targets, given->weights.size()); ++i)
        if (std::isfinite(given->weights[i])) weights[i] = given->weights[i];
    return weights;
}

void DeformedBounds::include(const glm::vec3& rest, const VertexJoints* joints) {
    const auto add = [&](std::uint16_t joint) {
        auto part = std::lower_bound(_parts.begin(), _parts.end(), joint,
                                     [](const Part& p, std::uint16_t j) { return p.joint < j; });
        if (part == _parts.end() || part->joint != joint) part = _parts.insert(part, {joint, {}});
        part->box.include(glm::dvec3(rest));
    };
    if (!joints) return add(0);
    for (std::size_t k = 0; k < kJointsPerVertex; ++k)
        if (joints->weights[k] > 0.0f) add(joints->joints[k]);
}

void DeformedBounds::includeDelta(std::size_t target, const glm::vec3& delta) {
    if (target >= _deltas.size()) _deltas.resize(target + 1);
    _deltas[target].include(glm::dvec3(delta));
}

Box3d DeformedBounds::of(std::span<const Affine> maps, std::span<const float> morphWeights) const {
    // The morphs add an interval to every coordinate.
    Box3d morph{glm::dvec3(0.0), glm::dvec3(0.0)};
    glm::dvec3 morphReach(0.0);
    for (std::size_t t = 0; t < std::min(_deltas.size(), morphWeights.size()); ++t) {
        if (_deltas[t].empty() || morphWeights[t] == 0.0f) continue;
        const double weight = morphWeights[t];
        const glm::dvec3 a = _deltas[t].lower * weight;
        const glm::dvec3 b = _deltas[t].upper * weight;
        morph.lower += glm::min(a, b);
        morph.upper += glm::max(a, b);
        morphReach += glm::max(glm::abs(a), glm::abs(b));
    }
    Box3d result;
    glm::dvec3 reach(0.0);
    for (const Part& part : _parts) {
        if (part.joint >= maps.size()) continue;
        const Affine& map = maps[part.joint];
        result.include(transformed(map, {part.box.lower + morph.lower, part.box.upper + morph.upper}));
        const glm::dvec3 largest = glm::max(glm::abs(part.box.lower), glm::abs(part.box.upper)) + morphReach;
        glm::dvec3 terms = glm::abs(map.translation);
        for (int column = 0; column < 3; ++column) terms += glm::abs(map.linear[column]) * largest[column];
        reach = glm::max(reach, terms);
    }
    if (result.empty()) return result;
    // Maps rounded to float (1 rounding), four weighted and summed (8), times the vertex and summed (7), weights that
    // sum to 1 but for 4, and two for each target: each moves a coordinate by at most 2^-24 of its terms.
    const glm::dvec3 margin = reach * ((24.0 + 2.0 * static_cast<double>(_deltas.size())) * 0x1p-24);
    return {result.lower - margin, result.upper + margin};
}

DeformedBounds deformedBoundsOf(const Geometry& geometry, std::size_t jointCount) {
    DeformedBounds bounds;
    const std::vector<VertexJoints> joints =
        jointCount > 0 ? vertexJointsOf(geometry, jointCount) : std::vector<VertexJoints>();
    const std::vector<glm::vec3> positions = geometry.positions.toVector();
    for (std::size_t v = 0; v < positions.size(); ++v)
        if (isFinite(glm::dvec3(positions[v]))) bounds.include(positions[v], joints.empty() ? nullptr : &joints[v]);
    if (morphTargetsOf(geometry) == 0) return bounds;
    const std::vector<glm::vec3> deltas = geometry.morphPositions.toVector();
    for (std::size_t i = 0; i < deltas.size(); ++i)
        if (isFinite(glm::dvec3(deltas[i]))) bounds.includeDelta(i / positions.size(), deltas[i]);
    return bounds;
}

std::vector<glm::dvec3> deformedPositions(const Aspect& scene, const DeformedGeometry& core,
                                          std::span<const Affine> maps) {
    const Geometry* geometry = scene.find(core.geometry.get());
    if (!geometry || maps.empty()) return {};
    const std::size_t vertices = geometry->positions.size();
    const std::vector<VertexJoints> joints = vertexJointsOf(*geometry, maps.size());
    const std::vector<float> weights = morphWeightsOf(scene, core, morphTargetsOf(*geometry));
    std::vector<glm::dvec3> result;
    for (std::size_t v = 0; v < vertices; ++v) {
        glm::dvec3 rest(geometry->positions[v]);
        for (std::size_t t = 0; t < weights.size() && !geometry->morphPositions.empty(); ++t)
            rest += glm::dvec3(geometry->morphPositions[t * vertices + v]) * double(weights[t]);
        const VertexJoints& held = joints.empty() ? VertexJoints{} : joints[v];
        glm::dvec3 place(0.0);
        for (std::size_t k = 0; k < kJointsPerVertex; ++k)
            if (held.weights[k] > 0.0f) place += maps[held.joints[k]].point(rest) * double(held.weights[k]);
        result.push_back(place);
    }
    return result;
}

std::vector<Affine> jointMapsOf(const Skin& skin, std::span<const Affine> worldFromJoint, const glm::dvec3& anchor) {
    std::vector<Affine> maps(worldFromJoint.size());
    for (std::size_t i = 0; i < maps.size(); ++i) {
        Affine inverseBind;
        if (i < skin.inverseBinds.size()) {
            const glm::dmat4 matrix(skin.inverseBinds[i]);
            inverseBind = {glm::dmat3(matrix), glm::dvec3(matrix[3])};
        }
        const Affine relative{worldFromJoint[i].linear, worldFromJoint[i].translation - anchor};
        const Affine map = relative * inverseBind;
        // Beyond float there is no vertex either.
        const auto fits = [](const glm::dvec3& v) {
            return isFinite(v) && glm::all(glm::lessThan(glm::abs(v), glm::dvec3(1e30)));
        };
        if (fits(map.linear[0]) && fits(map.linear[1]) && fits(map.linear[2]) && fits(map.translation)) maps[i] = map;
    }
    return maps;
}

}  // namespace umbriel
