#include "server/draw/deformer.h"

#include <algorithm>
#include <cmath>

#include "shaders/structs_cpp.h"

namespace umbriel {
namespace {

constexpr GLuint kGroupSize = 64;  // as in stage/deform.comp.glsl and stage/face_normals.comp.glsl

GpuGeometry::Needs unionOf(GpuGeometry::Needs a, const GpuGeometry::Needs& b) {
    if (!a.tangents) a.tangentSet = b.tangentSet;
    a.keepOrder |= b.keepOrder;
    a.faceNormals |= b.faceNormals;
    a.tangents |= b.tangents;
    a.primitives |= b.primitives;
    a.flatFaces |= b.flatFaces;
    return a;
}

bool covers(const GpuGeometry::Needs& have, const GpuGeometry::Needs& want) {
    return (have.keepOrder || !want.keepOrder) && (have.faceNormals || !want.faceNormals) &&
           (have.tangents || !want.tangents) && (have.primitives || !want.primitives) &&
           (have.flatFaces || !want.flatFaces);
}

glm::vec3 finite(glm::vec3 value) {
    sanitise({&value.x, 3});
    return value;
}

// A buffer is never empty: GL has none.
template <class T>
Result<gl::Buffer> bufferOf(const std::vector<T>& values, const char* what) {
    GLint64 limit = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
    const std::size_t bytes = values.size() * sizeof(T);
    if (bytes > static_cast<std::size_t>(limit))
        return failure("a deformed geometry has " + std::to_string(bytes) + " bytes of " + what +
                       ", and this driver allows " + std::to_string(limit) + "; split it into smaller ones");
    if (values.empty()) return gl::Buffer::create(16);
    return gl::Buffer::create(std::as_bytes(std::span(values)), GL_DYNAMIC_STORAGE_BIT);
}

// Joints mirror when the first that has a volume does.
bool mirrors(std::span<const Affine> maps) {
    for (const Affine& map : maps)
        if (const double determinant = glm::determinant(map.linear); determinant != 0.0) return determinant < 0.0;
    return false;
}

Box floatBox(const Box3d& box) {
    Box result;
    if (box.empty()) return result;
    // Outwards: half a unit in the last place is less than this.
    const glm::dvec3 margin = glm::max(glm::abs(box.lower), glm::abs(box.upper)) * 0x1p-23;
    result.add(glm::vec3(box.lower - margin));
    result.add(glm::vec3(box.upper + margin));
    return result;
}

}  // namespace

void Deformer::changed(ContainerId id) {
    std::erase_if(_entries, [&](const auto& entry) {
        return entry.first == id || entry.second.geometry == id || entry.second.skin == id;
    });
}

Deformer::Size Deformer::sizeOf(ContainerId core) const {
    const auto found = _entries.find(core);
    if (found == _entries.end()) return {};
    return {found->second.vertices, found->second.jointCount, found->second.targets};
}

Result<Deformer::Drawn> Deformer::prepare(const Aspect& scene, const SceneTree& tree, ContainerId core,
                                          const Placement& nodeWorld, const GpuGeometry::Needs& needs,
                                          ShaderLibrary& shaders) {
    const DeformedGeometry* deformed = scene.findAs<DeformedGeometry>(core);
    const Geometry* geometry = deformed ? scene.find(deformed->geometry.get()) : nullptr;
    if (!geometry) return Drawn{};
    const Skin* skin = scene.find(deformed->skin.get());
    const std::size_t jointCount = skin ? skin->joints.size() : 0;

    auto [found, isNew] = _entries.try_emplace(core);
    Entry& entry = found->second;
    if (isNew || !covers(entry.needs, needs)) {
        const GpuGeometry::Needs wanted = isNew ? needs : unionOf(entry.needs, needs);
        entry = {};
        entry.needs = wanted;
        entry.geometry = geometry->id();
        entry.skin = deformed->skin.get().id;
        if (auto built = build(entry, *geometry, jointCount); !built) {
            _entries.erase(found);
            return built.error();
        }
    }
    if (entry.drawn.triangles() == 0) return Drawn{};

    Drawn drawn;
    drawn.geometry = &entry.drawn;
    std::vector<Affine> maps(1);
    drawn.world = nodeWorld;
    if (jointCount > 0) {
        std::vector<Affine> worldFromJoint(jointCount);
        for (std::size_t i = 0; i < jointCount; ++i) {
            const Placement placement = tree.placementOf(scene, skin->joints[i].id).value_or(Placement{});
            worldFromJoint[i] = {placement.linear, placement.translation};
        }
        // World axes around the first joint: what is left to float is the size of the figure.
        drawn.world = {glm::dmat3(1.0), worldFromJoint[0].translation};
        maps = jointMapsOf(*skin, worldFromJoint, worldFromJoint[0].translation);
    }
    std::vector<float> weights = morphWeightsOf(scene, *deformed, entry.targets);
    if (entry.maps != maps || entry.weights != weights) {
        entry.maps = std::move(maps);
        entry.weights = std::move(weights);
        entry.isMirrored = jointCount > 0 && mirrors(entry.maps);
        if (auto done = deform(entry, shaders); !done) return done.error();
    }
    drawn.isMirrored = entry.isMirrored;
    return drawn;
}

Result<void> Deformer::build(Entry& entry, const Geometry& geometry, std::size_t jointCount) {
    GpuGeometry::Needs needs = entry.needs;
    needs.keepVertices = true;  // joints and targets know them so
    auto uploaded = GpuGeometry::upload(geometry, needs);
    if (!uploaded) return uploaded.error();
    entry.drawn = std::move(*uploaded);
    entry.vertices = static_cast<std::uint32_t>(geometry.positions.size());
    if (entry.drawn.triangles() == 0) return {};
    entry.jointCount = static_cast<std::uint32_t>(jointCount);
    entry.targets = static_cast<std::uint32_t>(morphTargetsOf(geometry));
    if (auto built = buildRest(entry, geometry); !built) return built;

    const std::vector<VertexJoints> joints = vertexJointsOf(geometry, jointCount);
    std::vector<gpu::GpuInfluence> influences(jointCount > 0 ? entry.vertices : 0,
                                              gpu::GpuInfluence{glm::uvec4(0), glm::vec4(1, 0, 0, 0)});
    for (std::size_t v = 0; v < std::min(influences.size(), joints.size()); ++v)
        for (int k = 0; k < static_cast<int>(kJointsPerVertex); ++k) {
            influences[v].joints[k] = joints[v].joints[k];
            influences[v].weights[k] = joints[v].weights[k];
        }
    auto influenceBuffer = bufferOf(influences, "joints");
    if (!influenceBuffer) return influenceBuffer.error();
    entry.influences = std::move(*influenceBuffer);

    // What bounds each cluster in every pose.
    const std::vector<glm::vec3> positions = geometry.positions.toVector();
    const std::vector<glm::vec3> deltas =
        entry.targets > 0 ? geometry.morphPositions.toVector() : std::vector<glm::vec3>();
    for (const Cluster& cluster : entry.drawn.clusters()) {
        DeformedBounds bounds;
        for (std::uint32_t i = cluster.firstTriangle * 3; i < (cluster.firstTriangle + cluster.triangles) * 3; ++i) {
            const std::uint32_t vertex = entry.drawn.indexAt(geometry, i);
            bounds.include(finite(positions[vertex]), joints.empty() ? nullptr : &joints[vertex]);
            for (std::size_t t = 0; t < entry.targets && !deltas.empty(); ++t)
                bounds.includeDelta(t, finite(deltas[t * positions.size() + vertex]));
        }
        entry.clusterBounds.push_back(std::move(bounds));
    }
    return {};
}

Result<void> Deformer::buildRest(Entry& entry, const Geometry& geometry) {
    const FeatureSet attributes = entry.drawn.attributes();
    const std::size_t vertices = entry.vertices;
    const std::size_t positionBytes = vertices * sizeof(glm::vec3);
    const std::size_t normalBytes = has(attributes, Feature::VertexNormals) ? positionBytes : 0;
    const std::size_t tangentBytes = has(attributes, Feature::VertexTangents) ? vertices * sizeof(glm::vec4) : 0;
    entry.restNormals = static_cast<std::uint32_t>(positionBytes / sizeof(float));
    entry.restTangents = static_cast<std::uint32_t>((positionBytes + normalBytes) / sizeof(float));
    // Tangents may be derived ones, which only the GPU has: so everything is copied there.
    auto rest = gl::Buffer::create(positionBytes + normalBytes + tangentBytes);
    if (!rest) return rest.error();
    entry.rest = std::move(*rest);
    const auto copy = [&](const gl::Buffer& from, std::size_t to, std::size_t bytes) {
        if (bytes > 0)
            glCopyNamedBufferSubData(from.id(), entry.rest.id(), 0, static_cast<GLintptr>(to),
                                     static_cast<GLsizeiptr>(bytes));
    };
    copy(entry.drawn.positions(), 0, positionBytes);
    copy(entry.drawn.normals(), positionBytes, normalBytes);
    copy(entry.drawn.tangents(), positionBytes + normalBytes, tangentBytes);

    // Target after target, each as long as what it changes: positions, normals, the directions of tangents.
    std::vector<float> morphs;
    const auto append = [&](const Multi<glm::vec3>& field, std::size_t target) {
        const std::size_t first = morphs.size();
        morphs.resize(first + vertices * 3, 0.0f);
        if (field.size() != entry.targets * vertices) return;
        field.storage().read(target * vertices, std::as_writable_bytes(std::span(morphs.data() + first, vertices * 3)));
    };
    for (std::size_t t = 0; t < entry.targets; ++t) {
        append(geometry.morphPositions, t);
        if (normalBytes > 0) append(geometry.morphNormals, t);
        if (tangentBytes > 0) append(geometry.morphTangents, t);
    }
    sanitise(morphs);
    auto buffer = bufferOf(morphs, "morph targets");
    if (!buffer) return buffer.error();
    entry.morphs = std::move(*buffer);
    return gl::checkError("the rest pose of a deformed geometry");
}

Result<void> Deformer::deform(Entry& entry, ShaderLibrary& shaders) {
    std::vector<gpu::GpuJoint> joints;
    for (const Affine& map : entry.maps)
        joints.push_back({glm::vec4(glm::vec3(map.linear[0]), 0), glm::vec4(glm::vec3(map.linear[1]), 0),
                          glm::vec4(glm::vec3(map.linear[2]), 0), glm::vec4(glm::vec3(map.translation), 1)});
    const auto put = [](gl::Buffer& buffer, std::span<const std::byte> bytes) -> Result<void> {
        if (!buffer) {
            auto made = gl::Buffer::create(std::max<std::size_t>(bytes.size(), 16));
            if (!made) return made.error();
            buffer = std::move(*made);
        }
        if (!bytes.empty()) buffer.write(0, bytes);
        return {};
    };
    if (auto done = put(entry.joints, std::as_bytes(std::span(joints))); !done) return done;
    if (auto done = put(entry.morphWeights, std::as_bytes(std::span(entry.weights))); !done) return done;

    const FeatureSet attributes = entry.drawn.attributes();
    std::vector<gl::ShaderDefine> defines;
    if (entry.jointCount > 0) defines.push_back({"DEFORM_SKIN"});
    if (entry.targets > 0) defines.push_back({"DEFORM_MORPHS"});
    if (has(attributes, Feature::VertexNormals)) defines.push_back({"DEFORM_NORMALS"});
    if (has(attributes, Feature::VertexTangents)) defines.push_back({"DEFORM_TANGENTS"});
    auto program = shaders.compute("stage/deform.comp.glsl", defines);
    if (!program) return program.error();
    const auto bind = [](GLuint index, const gl::Buffer& buffer) {
        if (buffer) buffer.bindBase(GL_SHADER_STORAGE_BUFFER, index);
    };
    bind(0, entry.rest);
    bind(1, entry.influences);
    bind(2, entry.joints);
    bind(3, entry.morphs);
    bind(4, entry.morphWeights);
    bind(5, entry.drawn.positions());
    bind(6, entry.drawn.normals());
    bind(7, entry.drawn.tangents());
    (*program)->use();
    (*program)->set(0, glm::uvec4(entry.vertices, entry.targets, entry.restNormals, entry.restTangents));
    glDispatchCompute((entry.vertices + kGroupSize - 1) / kGroupSize, 1, 1);
    _deformedVertices += entry.vertices;

    // Flat faces lie in a buffer only when the geometry has vertex normals.
    const bool flatFaces = static_cast<bool>(entry.drawn.flatFaceBuffer());
    if (entry.needs.faceNormals) {
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        std::vector<gl::ShaderDefine> faceDefines;
        if (flatFaces) faceDefines.push_back({"DEFORM_FLAT_FACES"});
        auto faces = shaders.compute("stage/face_normals.comp.glsl", faceDefines);
        if (!faces) return faces.error();
        bind(0, entry.drawn.positions());
        bind(1, entry.drawn.indices());
        bind(2, entry.drawn.faceNormalBuffer());
        bind(3, entry.drawn.normals());
        bind(4, entry.drawn.flatFaceBuffer());
        (*faces)->use();
        (*faces)->set(0, entry.drawn.triangles());
        (*faces)->set(1, entry.isMirrored ? -1.0f : 1.0f);
        glDispatchCompute((entry.drawn.triangles() + kGroupSize - 1) / kGroupSize, 1, 1);
    }
    glMemoryBarrier(GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);

    std::vector<Box> boxes;
    for (const DeformedBounds& bounds : entry.clusterBounds)
        boxes.push_back(floatBox(bounds.of(entry.maps, entry.weights)));
    entry.drawn.setClusterBoxes(boxes);
    return gl::checkError("deforming a geometry");
}

}  // namespace umbriel
