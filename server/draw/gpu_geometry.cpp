#include "server/draw/gpu_geometry.h"

#include <algorithm>
#include <utility>

namespace umbriel {
namespace {

std::vector<glm::vec3> sanitisedPositions(const Geometry& geometry) {
    std::vector<glm::vec3> positions = geometry.positions.toVector();
    if (!positions.empty()) sanitise({&positions[0].x, positions.size() * 3});
    return positions;
}

// Part of a multi field of floats, with what is not finite removed.
std::vector<float> floatsOf(const MultiStorage& storage, std::size_t first, std::size_t count) {
    std::vector<float> values(count * storage.elementSize() / sizeof(float));
    storage.read(first, std::as_writable_bytes(std::span(values)));
    sanitise(values);
    return values;
}

glm::vec3 finite(glm::vec3 value) {
    sanitise({&value.x, 3});
    return value;
}

const MultiChange* changeOf(const Geometry& geometry, std::span<const MultiChange> changes, std::string_view field) {
    for (const MultiChange& change : changes)
        if (geometry.type().fields[change.field].name == field) return &change;
    return nullptr;
}

}  // namespace

BufferTexture::BufferTexture(const gl::Buffer& buffer, GLenum format) {
    GLuint id = 0;
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &id);
    _name = gl::Name<gl::deleteTexture>(id);
    glTextureBuffer(id, format, buffer.id());
}

void BufferTexture::bind(GLuint unit) const {
    glBindTextureUnit(unit, _name.id());
}

Result<GpuGeometry> GpuGeometry::upload(const Geometry& geometry, const Needs& needs) {
    GpuGeometry result;
    result._needs = needs;
    if (auto built = result.build(geometry); !built) return built.error();
    return result;
}

Result<gl::Buffer> GpuGeometry::bufferOf(const MultiStorage& storage) {
    const std::vector<float> values =
        inDrawnOrder(floatsOf(storage, 0, storage.size()), storage.elementSize() / sizeof(float));
    _uploadedBytes += values.size() * sizeof(float);
    return gl::Buffer::create(std::as_bytes(std::span(values)), GL_DYNAMIC_STORAGE_BIT);
}

template <class T>
std::vector<T> GpuGeometry::inDrawnOrder(std::vector<T> elements, std::size_t perVertex) const {
    if (_drawnVertices.empty()) return elements;
    std::vector<T> ordered(elements.size());
    for (std::size_t v = 0; v < _drawnVertices.size(); ++v)
        std::copy_n(elements.begin() + static_cast<std::ptrdiff_t>(v * perVertex), perVertex,
                    ordered.begin() + static_cast<std::ptrdiff_t>(_drawnVertices[v] * perVertex));
    return ordered;
}

void GpuGeometry::orderVertices(std::span<const std::uint32_t> indices) {
    _drawnVertices.clear();
    if (_needs.keepVertices || _primitives.empty()) return;
    constexpr std::uint32_t kNone = ~std::uint32_t{0};
    _drawnVertices.assign(_vertices, kNone);
    std::uint32_t next = 0;
    for (const std::uint32_t index : indices)
        if (_drawnVertices[index] == kNone) _drawnVertices[index] = next++;
    for (std::uint32_t& drawn : _drawnVertices)
        if (drawn == kNone) drawn = next++;
}

void GpuGeometry::attach(VertexLocation location, const gl::Buffer& buffer, GLint components) {
    const auto index = static_cast<GLuint>(location);
    _vertexArray.attribute({.location = index, .binding = index, .components = components});
    _vertexArray.vertexBuffer(index, buffer, 0, static_cast<std::size_t>(components) * sizeof(float));
}

Result<void> GpuGeometry::build(const Geometry& geometry) {
    const std::vector<glm::vec3> positions = sanitisedPositions(geometry);
    _vertices = static_cast<std::uint32_t>(positions.size());
    _firstOfVertex.clear();
    _trianglesOfVertex.clear();
    _faceNormals = {};
    _faceNormalTexture = {};
    _primitiveTable = {};
    _primitiveTexture = {};
    _flatFaces = {};
    _flatFaceTexture = {};
    _casterShape.reset();
    _firstVertexNormals = {};
    _isMoved = false;
    _attributes = 0;
    _vertexArray = gl::VertexArray::create();

    TriangleOrder order = orderTriangles(geometry.indices.toVector(), positions, !_needs.keepOrder);
    // Where the order of triangles is visible, so are back faces.
    SolidParts solids = _needs.keepOrder ? SolidParts() : solidPartsOf(order.indices, positions);
    moveSolidsFirst(order, solids);
    const std::vector<std::uint32_t> sizes = sortSolidsByFacing(order, solids, positions);
    _triangles = positions.empty() ? 0 : static_cast<std::uint32_t>(order.indices.size() / 3);
    _primitives = order.primitives;
    _clusters = clustersOf(order.indices, positions, sizes);
    markSolids(_clusters, solids, order.indices, positions);
    updateBounds();
    if (_triangles == 0) return {};

    orderVertices(order.indices);
    if (!_drawnVertices.empty())
        for (std::uint32_t& index : order.indices) index = _drawnVertices[index];
    auto indices = gl::Buffer::create(std::as_bytes(std::span(order.indices)));
    if (!indices) return indices.error();
    _indices = std::move(*indices);
    _vertexArray.elementBuffer(_indices);
    _uploadedBytes += order.indices.size() * sizeof(std::uint32_t);

    // One number per cluster, advanced by the base instance of a draw command: the first triangle of the command, from
    // which gl_PrimitiveID counts.
    std::vector<std::uint32_t> firstTriangles(_clusters.size());
    for (std::size_t i = 0; i < _clusters.size(); ++i) firstTriangles[i] = _clusters[i].firstTriangle;
    auto first = gl::Buffer::create(std::as_bytes(std::span(firstTriangles)));
    if (!first) return first.error();
    _firstTriangles = std::move(*first);
    const auto firstLocation = static_cast<GLuint>(VertexLocation::FirstTriangle);
    _vertexArray.attribute({.location = firstLocation,
                            .binding = firstLocation,
                            .components = 1,
                            .type = GL_UNSIGNED_INT,
                            .integer = true});
    _vertexArray.vertexBuffer(firstLocation, _firstTriangles, 0, sizeof(std::uint32_t), 1);

    struct Source {
        const MultiStorage& storage;
        gl::Buffer& buffer;
        VertexLocation location;
        GLint components;
        FeatureSet feature;
    };
    const Source sources[] = {
        {geometry.positions.storage(), _positions, VertexLocation::Position, 3, 0},
        {geometry.normals.storage(), _normals, VertexLocation::Normal, 3, bit(Feature::VertexNormals)},
        {geometry.tangents.storage(), _tangents, VertexLocation::Tangent, 4, bit(Feature::VertexTangents)},
        {geometry.colours.storage(), _colours, VertexLocation::Colour, 4, bit(Feature::VertexColours)},
        {geometry.texCoords0.storage(), _texCoords0, VertexLocation::TexCoords0, 2, bit(Feature::TexCoords0)},
        {geometry.texCoords1.storage(), _texCoords1, VertexLocation::TexCoords1, 2, bit(Feature::TexCoords1)},
    };
    for (const Source& source : sources) {
        source.buffer = {};
        // An attribute of another length is not one of these vertices: absent.
        if (source.storage.size() != _vertices) continue;
        auto buffer = bufferOf(source.storage);
        if (!buffer) return buffer.error();
        source.buffer = std::move(*buffer);
        attach(source.location, source.buffer, source.components);
        _attributes |= source.feature;
    }
    if (auto built = buildTangents(geometry); !built) return built;
    if (auto built = buildFaceNormals(geometry); !built) return built;
    if (auto built = buildFlatFaces(geometry); !built) return built;
    return buildPrimitives();
}

Result<void> GpuGeometry::buildTangents(const Geometry& geometry) {
    if (!_needs.tangents || _triangles == 0 || geometry.tangents.size() == _vertices) return {};
    const auto& texCoords = _needs.tangentSet == 0 ? geometry.texCoords0 : geometry.texCoords1;
    if (texCoords.size() != _vertices) return {};
    const std::vector<std::uint32_t> indices =
        orderTriangles(geometry.indices.toVector(), sanitisedPositions(geometry), false).indices;
    std::vector<glm::vec3> normals;
    if (has(_attributes, Feature::VertexNormals)) {
        normals = geometry.normals.toVector();
        sanitise({&normals[0].x, normals.size() * 3});
    }
    std::vector<glm::vec2> coordinates = texCoords.toVector();
    sanitise({&coordinates[0].x, coordinates.size() * 2});
    const std::vector<glm::vec4> tangents =
        inDrawnOrder(deriveTangents(indices, sanitisedPositions(geometry), normals, coordinates), 1);
    auto buffer = gl::Buffer::create(std::as_bytes(std::span(tangents)));
    if (!buffer) return buffer.error();
    _tangents = std::move(*buffer);
    _uploadedBytes += tangents.size() * sizeof(glm::vec4);
    attach(VertexLocation::Tangent, _tangents, 4);
    _attributes |= bit(Feature::VertexTangents);
    return {};
}

std::uint32_t GpuGeometry::indexAt(const Geometry& geometry, std::size_t corner) const {
    const std::size_t triangle = corner / 3;
    const std::size_t original = _primitives.empty() ? triangle : _primitives[triangle];
    std::uint32_t corners[3];
    for (std::size_t k = 0; k < 3; ++k) corners[k] = geometry.indices[original * 3 + k];
    const bool valid = corners[0] < _vertices && corners[1] < _vertices && corners[2] < _vertices;
    return valid ? corners[corner % 3] : 0;
}

Result<void> GpuGeometry::buildFaceNormals(const Geometry& geometry) {
    if (!_needs.faceNormals || _triangles == 0) return {};
    const std::vector<glm::vec3> positions = sanitisedPositions(geometry);
    std::vector<glm::vec3> normals(_triangles);
    for (std::uint32_t i = 0; i < _triangles; ++i)
        normals[i] = faceNormal(positions[indexAt(geometry, 3 * i)], positions[indexAt(geometry, 3 * i + 1)],
                                positions[indexAt(geometry, 3 * i + 2)]);
    auto buffer = gl::Buffer::create(std::as_bytes(std::span(normals)), GL_DYNAMIC_STORAGE_BIT);
    if (!buffer) return buffer.error();
    _faceNormals = std::move(*buffer);
    _uploadedBytes += normals.size() * sizeof(glm::vec3);
    _faceNormalTexture = BufferTexture(_faceNormals, GL_RGB32F);
    if (auto built = buildFirstVertexNormals(geometry, normals); !built) return built;
    return gl::checkError("a table of face normals");
}

Result<void> GpuGeometry::buildFirstVertexNormals(const Geometry& geometry, std::span<const glm::vec3> normals) {
    if (_isMoved) return {};
    std::vector<glm::vec3> ofVertices(_vertices, glm::vec3(0.0f));  // 0: none yet, as normals are unit
    for (std::uint32_t i = 0; i < _triangles; ++i) {
        glm::vec3& held = ofVertices[indexAt(geometry, 3 * std::size_t{i})];
        if (held != glm::vec3(0.0f) && held != normals[i]) return {};
        held = normals[i];
    }
    ofVertices = inDrawnOrder(std::move(ofVertices), 1);
    auto buffer = gl::Buffer::create(std::as_bytes(std::span(ofVertices)));
    if (!buffer) return buffer.error();
    _firstVertexNormals = std::move(*buffer);
    _uploadedBytes += ofVertices.size() * sizeof(glm::vec3);
    attach(VertexLocation::FaceNormal, _firstVertexNormals, 3);
    _attributes |= bit(Feature::FirstVertexNormals);
    return {};
}

Result<void> GpuGeometry::buildFlatFaces(const Geometry& geometry) {
    if (!_needs.flatFaces || _triangles == 0 || geometry.normals.size() != _vertices) return {};
    const std::vector<glm::vec3> positions = sanitisedPositions(geometry);
    std::vector<glm::vec3> normals = geometry.normals.toVector();
    sanitise({&normals[0].x, normals.size() * 3});
    std::vector<glm::vec3> faces;
    faces.reserve(std::size_t{_triangles} * 2);
    for (std::size_t i = 0; i < _triangles; ++i) {
        glm::dvec3 centre(0.0);
        glm::dvec3 normal(0.0);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t vertex = indexAt(geometry, 3 * i + k);
            centre += glm::dvec3(positions[vertex]) / 3.0;
            normal += glm::dvec3(normals[vertex]) / 3.0;
        }
        faces.push_back(glm::vec3(centre));
        faces.push_back(glm::vec3(normal));
    }
    auto buffer = gl::Buffer::create(std::as_bytes(std::span(faces)));
    if (!buffer) return buffer.error();
    _flatFaces = std::move(*buffer);
    _uploadedBytes += faces.size() * sizeof(glm::vec3);
    _flatFaceTexture = BufferTexture(_flatFaces, GL_RGB32F);
    return gl::checkError("a table of flat faces");
}

Result<void> GpuGeometry::buildPrimitives() {
    if (!_needs.primitives || _primitives.empty()) return {};
    auto buffer = gl::Buffer::create(std::as_bytes(std::span(_primitives)));
    if (!buffer) return buffer.error();
    _primitiveTable = std::move(*buffer);
    _uploadedBytes += _primitives.size() * sizeof(std::uint32_t);
    _primitiveTexture = BufferTexture(_primitiveTable, GL_R32UI);
    return gl::checkError("a table of triangle numbers");
}

Result<void> GpuGeometry::require(const Geometry& geometry, const Needs& needs) {
    const bool reorder = needs.keepOrder && !_needs.keepOrder && !_primitives.empty();
    const bool faceNormals = needs.faceNormals && !_needs.faceNormals;
    const bool tangents = needs.tangents && !_needs.tangents;
    const bool primitives = needs.primitives && !_needs.primitives;
    const bool renumber = needs.keepVertices && !_needs.keepVertices && !_drawnVertices.empty();
    _needs.keepOrder |= needs.keepOrder;
    _needs.keepVertices |= needs.keepVertices;
    _needs.faceNormals |= needs.faceNormals;
    _needs.primitives |= needs.primitives;
    const bool flatFaces = needs.flatFaces && !_needs.flatFaces;
    _needs.flatFaces |= needs.flatFaces;
    if (tangents) {
        _needs.tangents = true;
        _needs.tangentSet = needs.tangentSet;
    }
    if (reorder || renumber) return build(geometry);
    if (tangents)
        if (auto built = buildTangents(geometry); !built) return built;
    if (faceNormals)
        if (auto built = buildFaceNormals(geometry); !built) return built;
    if (flatFaces)
        if (auto built = buildFlatFaces(geometry); !built) return built;
    if (primitives) return buildPrimitives();
    return {};
}

Result<void> GpuGeometry::update(const Geometry& geometry, std::span<const MultiChange> changes) {
    if (changes.empty()) return {};
    _needs.keepVertices = true;
    if (!_drawnVertices.empty()) return build(geometry);
    struct Target {
        std::string_view field;
        const MultiStorage& storage;
        gl::Buffer& buffer;
        bool present;
    };
    const Target targets[] = {
        {"positions", geometry.positions.storage(), _positions, true},
        {"normals", geometry.normals.storage(), _normals, has(_attributes, Feature::VertexNormals)},
        {"tangents", geometry.tangents.storage(), _tangents, has(_attributes, Feature::VertexTangents)},
        {"colours", geometry.colours.storage(), _colours, has(_attributes, Feature::VertexColours)},
        {"texCoords0", geometry.texCoords0.storage(), _texCoords0, has(_attributes, Feature::TexCoords0)},
        {"texCoords1", geometry.texCoords1.storage(), _texCoords1, has(_attributes, Feature::TexCoords1)},
    };
    bool rebuild = changeOf(geometry, changes, "indices") != nullptr || geometry.positions.size() != _vertices;
    for (const Target& target : targets)
        if (changeOf(geometry, changes, target.field))
            rebuild |= !target.present || target.storage.size() != _vertices || target.buffer.size() == 0;
    // Derived tangents depend on everything else.
    rebuild |= _needs.tangents && geometry.tangents.size() != _vertices;
    if (rebuild) return build(geometry);

    for (const Target& target : targets) {
        const MultiChange* change = changeOf(geometry, changes, target.field);
        if (!change) continue;
        for (const IndexRange& range : change->touched.ranges()) {
            if (range.first >= _vertices) continue;
            const std::size_t count = std::min(range.count, _vertices - range.first);
            const std::vector<float> values = floatsOf(target.storage, range.first, count);
            target.buffer.write(range.first * target.storage.elementSize(), std::as_bytes(std::span(values)));
            _uploadedBytes += values.size() * sizeof(float);
        }
    }
    if (const MultiChange* moved = changeOf(geometry, changes, "positions")) updateTriangles(geometry, moved->touched);
    if (auto built = buildFlatFaces(geometry); !built) return built;
    return gl::checkError("changed vertices");
}

void GpuGeometry::updateTriangles(const Geometry& geometry, const IndexRanges& vertices) {
    _casterShape.reset();
    forgetPlaces();
    std::vector<std::uint32_t> touched;
    if (vertices.elementCount() * 4 > _vertices) {
        touched.resize(_triangles);
        for (std::uint32_t i = 0; i < _triangles; ++i) touched[i] = i;
    } else {
        if (_firstOfVertex.empty()) {
            _firstOfVertex.assign(_vertices + 1, 0);
            for (std::size_t i = 0; i < std::size_t{_triangles} * 3; ++i) ++_firstOfVertex[indexAt(geometry, i) + 1];
            for (std::size_t i = 0; i < _vertices; ++i) _firstOfVertex[i + 1] += _firstOfVertex[i];
            _trianglesOfVertex.resize(std::size_t{_triangles} * 3);
            std::vector<std::uint32_t> next(_firstOfVertex.begin(), _firstOfVertex.end() - 1);
            for (std::size_t i = 0; i < std::size_t{_triangles} * 3; ++i)
                _trianglesOfVertex[next[indexAt(geometry, i)]++] = static_cast<std::uint32_t>(i / 3);
        }
        for (const IndexRange& range : vertices.ranges())
            for (std::size_t v = range.first; v < std::min<std::size_t>(range.first + range.count, _vertices); ++v)
                touched.insert(touched.end(), _trianglesOfVertex.begin() + _firstOfVertex[v],
                               _trianglesOfVertex.begin() + _firstOfVertex[v + 1]);
        std::sort(touched.begin(), touched.end());
        touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    }

    std::size_t lastCluster = SIZE_MAX;
    for (const std::uint32_t triangle : touched) {
        const auto next = std::upper_bound(
            _clusters.begin(), _clusters.end(), triangle,
            [](std::uint32_t number, const Cluster& cluster) { return number < cluster.firstTriangle; });
        const auto index = static_cast<std::size_t>(next - _clusters.begin()) - 1;
        if (index == lastCluster) continue;
        lastCluster = index;
        Cluster& cluster = _clusters[index];
        cluster.box = {};
        for (std::size_t i = std::size_t{cluster.firstTriangle} * 3;
             i < (std::size_t{cluster.firstTriangle} + cluster.triangles) * 3; ++i)
            cluster.box.add(finite(geometry.positions[indexAt(geometry, i)]));
    }
    updateBounds();
    if (!_faceNormalTexture) return;
    // Runs of neighbouring triangles go up together.
    for (std::size_t begin = 0; begin < touched.size();) {
        std::size_t end = begin + 1;
        while (end < touched.size() && touched[end] == touched[end - 1] + 1) ++end;
        std::vector<glm::vec3> normals;
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t corner = std::size_t{touched[i]} * 3;
            normals.push_back(faceNormal(finite(geometry.positions[indexAt(geometry, corner)]),
                                         finite(geometry.positions[indexAt(geometry, corner + 1)]),
                                         finite(geometry.positions[indexAt(geometry, corner + 2)])));
        }
        _faceNormals.write(touched[begin] * sizeof(glm::vec3), std::as_bytes(std::span(normals)));
        _uploadedBytes += normals.size() * sizeof(glm::vec3);
        begin = end;
    }
}

void GpuGeometry::forgetPlaces() {
    for (Cluster& cluster : _clusters) cluster.solids = {};
    _isMoved = true;
    _attributes &= ~bit(Feature::FirstVertexNormals);
}

void GpuGeometry::updateBounds() {
    _box = {};
    _groups = groupsOf(_clusters);
    for (const ClusterGroup& group : _groups) _box.add(group.box);
    _flatBoxFaces = flatFacesOf(_clusters, _box);
}

std::shared_ptr<const CasterShape> GpuGeometry::casterShape() {
    if (_casterShape) return _casterShape;
    auto shape = std::make_shared<CasterShape>();
    if (_triangles > 0) {
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);  // vertices may come from a shader
        shape->positions.resize(_vertices);
        _positions.read(0, std::as_writable_bytes(std::span(shape->positions)));
        std::vector<std::uint32_t> indices(std::size_t{_triangles} * 3);
        _indices.read(0, std::as_writable_bytes(std::span(indices)));
        shape->topology = casterTopology(shape->positions, indices);
    }
    _casterShape = std::move(shape);
    return _casterShape;
}

void GpuGeometry::setClusterBoxes(std::span<const Box> boxes) {
    _casterShape.reset();
    forgetPlaces();
    for (std::size_t i = 0; i < std::min(boxes.size(), _clusters.size()); ++i) _clusters[i].box = boxes[i];
    updateBounds();
}

std::uint64_t GpuGeometry::bytes() const {
    return _positions.size() + _normals.size() + _tangents.size() + _colours.size() + _texCoords0.size() +
           _texCoords1.size() + _indices.size() + _firstTriangles.size() + _faceNormals.size() +
           _firstVertexNormals.size() + _primitiveTable.size() + _flatFaces.size();
}

}  // namespace umbriel
