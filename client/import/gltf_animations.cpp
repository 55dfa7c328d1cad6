#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>

#include "client/import/gltf_builder.h"
#include "client/import/import_error.h"

namespace umbriel {

std::vector<Ref<Animation>> GltfAnimations::build() {
    std::vector<Ref<Animation>> animations;
    const auto& sources = _context.model().animations;
    for (std::size_t i = 0; i < sources.size(); ++i) {
        std::vector<Ref<AnimationChannel>> channels;
        double duration = 0.0;
        for (std::size_t k = 0; k < sources[i].channels.size(); ++k) {
            const std::string place = gltfPlace("animations", i) + "." + gltfPlace("channels", k);
            const Ref<AnimationChannel> made = channel(sources[i], sources[i].channels[k], place, duration);
            if (made) channels.push_back(made);
        }
        if (channels.empty()) continue;
        const Ref<Animation> animation = _context.scene.create<Animation>(
            sources[i].name.empty() ? "animation " + std::to_string(i) : sources[i].name);
        auto edit = _context.scene.edit(animation);
        edit.assign<&Animation::channels>(channels);
        edit.set<&Animation::duration>(duration);
        animations.push_back(animation);
    }
    return animations;
}

Ref<AnimationChannel> GltfAnimations::channel(const tinygltf::Animation& animation,
                                              const tinygltf::AnimationChannel& source, const std::string& place,
                                              double& duration) {
    if (static_cast<std::size_t>(source.sampler) >= animation.samplers.size())
        throw ImportRefused(place + ".sampler", "sampler " + std::to_string(source.sampler) + " does not exist");
    const tinygltf::AnimationSampler& sampler = animation.samplers[static_cast<std::size_t>(source.sampler)];
    const std::size_t components = componentsOf(source, place);
    if (components == 0) return {};
    const bool isRotation = source.target_path == "rotation";
    const bool isWeights = source.target_path == "weights";

    if (!_context.accessors.hasData(sampler.input) || !_context.accessors.hasData(sampler.output)) {
        _context.warnings.add(place + ": its data is not in the file (a buffer without uri) and it is ignored");
        return {};
    }
    const std::vector<float> keys = times(sampler.input, place + ".sampler.input");
    const bool cubic = sampler.interpolation == "CUBICSPLINE";
    const std::string outputPlace = place + ".sampler.output";
    if (_context.accessors.components(sampler.output) != (isWeights ? 1 : static_cast<int>(components)))
        throw ImportRefused(outputPlace, "accessor " + std::to_string(sampler.output) + " is not of type " +
                                             (isWeights    ? "SCALAR"
                                              : isRotation ? "VEC4"
                                                           : "VEC3"));
    const std::size_t expected = keys.size() * (cubic ? 3 : 1) * (isWeights ? components : 1);
    if (_context.accessors.count(sampler.output) != expected)
        throw ImportRefused(outputPlace, "has " + std::to_string(_context.accessors.count(sampler.output)) +
                                             " elements where " + std::to_string(expected) + " are needed");
    std::vector<float> values = _context.accessors.floats(sampler.output);
    for (std::size_t i = 0; i < values.size(); ++i)
        if (!std::isfinite(values[i]))
            throw ImportRefused(outputPlace,
                                "element " + std::to_string(i / (isWeights ? 1 : components)) + " is not finite");
    if (isRotation) normaliseRotations(values, cubic, outputPlace);
    duration = std::max(duration, static_cast<double>(keys.back()));

    const Ref<AnimatedPose> target = isWeights ? Ref<AnimatedPose>() : pose(source.target_node);
    const Ref<AnimationChannel> made = _context.scene.create<AnimationChannel>();
    auto edit = _context.scene.edit(made);
    edit.set<&AnimationChannel::pose>(target);
    if (isWeights) edit.set<&AnimationChannel::morph>(_nodes.morphWeightsOf(source.target_node));
    edit.set<&AnimationChannel::path>(isWeights                             ? AnimationPath::Weights
                                      : isRotation                          ? AnimationPath::Rotation
                                      : source.target_path == "translation" ? AnimationPath::Translation
                                                                            : AnimationPath::Scale);
    edit.set<&AnimationChannel::interpolation>(cubic                             ? AnimationInterpolation::CubicSpline
                                               : sampler.interpolation == "STEP" ? AnimationInterpolation::Step
                                                                                 : AnimationInterpolation::Linear);
    edit.assign<&AnimationChannel::times>(keys);
    edit.assign<&AnimationChannel::values>(values);
    return made;
}

std::size_t GltfAnimations::componentsOf(const tinygltf::AnimationChannel& source, const std::string& place) {
    const std::string& path = source.target_path;
    if (path != "translation" && path != "rotation" && path != "scale" && path != "weights") {
        _context.warnings.add(place + ".target.path: " + path + " is not animated in this version");
        return 0;
    }
    if (source.target_node < 0) {
        _context.warnings.add(place + ".target: names no node and is ignored");
        return 0;
    }
    if (!_nodes.transformOf(source.target_node)) return 0;  // a node of another scene
    const tinygltf::Node& node = _context.model().nodes[static_cast<std::size_t>(source.target_node)];
    if (path == "weights") {
        const MorphWeights* weights = _context.scene.find(_nodes.morphWeightsOf(source.target_node));
        if (weights) return weights->weights.size();
        _context.warnings.add(place + ".target.node: the node has no morph targets that are drawn");
        return 0;
    }
    if (!node.matrix.empty()) {
        _context.warnings.add(place + ".target.node: the node has a matrix and cannot be animated");
        return 0;
    }
    return path == "rotation" ? 4 : 3;
}

Ref<AnimatedPose> GltfAnimations::pose(int index) {
    const auto known = _poses.find(index);
    if (known != _poses.end()) return known->second;
    const tinygltf::Node& node = _context.model().nodes[static_cast<std::size_t>(index)];
    const Ref<AnimatedPose> made = _context.scene.create<AnimatedPose>(node.name);
    auto edit = _context.scene.edit(made);
    edit.set<&AnimatedPose::target>(_nodes.transformOf(index));
    if (!node.translation.empty())
        edit.set<&AnimatedPose::translation>(glm::dvec3(node.translation[0], node.translation[1], node.translation[2]));
    if (!node.rotation.empty()) {
        glm::vec4 rotation;
        for (int i = 0; i < 4; ++i) rotation[i] = static_cast<float>(node.rotation[static_cast<std::size_t>(i)]);
        normaliseQuaternion(&rotation[0], gltfPlace("nodes", static_cast<std::size_t>(index)) + ".rotation",
                            _context.warnings);
        edit.set<&AnimatedPose::rotation>(rotation);
    }
    if (!node.scale.empty()) {
        glm::vec3 scale;
        for (int i = 0; i < 3; ++i) scale[i] = static_cast<float>(node.scale[static_cast<std::size_t>(i)]);
        edit.set<&AnimatedPose::scale>(scale);
    }
    return _poses[index] = made;
}

std::vector<float> GltfAnimations::times(int accessor, const std::string& place) {
    if (_context.accessors.components(accessor) != 1 || !_context.accessors.isFloat(accessor))
        throw ImportRefused(place, "accessor " + std::to_string(accessor) + " does not hold float SCALARs");
    std::vector<float> keys = _context.accessors.floats(accessor);
    for (std::size_t i = 0; i < keys.size(); ++i)
        if (!std::isfinite(keys[i]) || keys[i] < 0.0f || (i > 0 && keys[i] <= keys[i - 1]))
            throw ImportRefused(place, "key " + std::to_string(i) + " is not a time later than the one before");
    return keys;
}

// Of a cubic spline only the middle of in-tangent, value, out-tangent is a rotation.
void GltfAnimations::normaliseRotations(std::vector<float>& values, bool cubic, const std::string& place) {
    const std::size_t step = cubic ? 12 : 4;
    for (std::size_t i = cubic ? 4 : 0; i < values.size(); i += step)
        normaliseQuaternion(&values[i], place, _context.warnings);
}

}  // namespace umbriel
