#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/scene/change_list.h"
#include "common/scene/nodes.h"
#include "server/draw/frame_plan.h"
#include "server/draw/backmost.h"
#include "server/draw/mesh_layout.h"
#include "server/gl/buffer.h"
#include "server/gl/vertex_array.h"
#include "server/shadow/shadow_volume.h"

namespace umbriel {

// Locations of the vertex attributes in shaders/stage.
enum class VertexLocation : GLuint {
    Position,
    Normal,
    Tangent,
    Colour,
    TexCoords0,
    TexCoords1,
    FirstTriangle,
    FaceNormal
};

// A buffer seen as a texture: texelFetch by index, beyond the size of a uniform block.
class BufferTexture {
 public:
    BufferTexture() = default;
    BufferTexture(const gl::Buffer& buffer, GLenum format);
    void bind(GLuint unit) const;
    explicit operator bool() const { return static_cast<bool>(_name); }

 private:
    gl::Name<gl::deleteTexture> _name;
};

// A geometry on the GPU. Triangles may be reordered once, when uploaded, and vertices then lie in the order in which
// triangles ask for them: fetched from all over, they cost llvmpipe more than their shading. With the first change vertices go
// back to the scene's numbering, for good, so that touched ranges go up as they are. Face normals are a table by triangle, not derivatives of the position: those depend
// on the window position (seams), and unsharing vertices would triple the vertex work.
class GpuGeometry {
 public:
    // What its users need beyond the scene's data; grows as users come.
    struct Needs {
        bool keepOrder = false;    // a blended surface: the order of its triangles is visible
        bool keepVertices = false;  // others know vertices by the scene's numbers
        bool faceNormals = false;  // shadows, flat shading or the normal layer
        bool tangents = false;     // a normal map
        std::uint32_t tangentSet = 0;
        bool primitives = false;  // the ids layer
        bool flatFaces = false;   // ShadingFrequency::FlatMean
    };

    // Error: the driver is out of memory.
    static Result<GpuGeometry> upload(const Geometry& geometry, const Needs& needs);
    // Follows a change; uploads and derives only what the touched ranges concern, everything after a change of size or
    // topology.
    Result<void> update(const Geometry& geometry, std::span<const MultiChange> changes);
    // Derives what a new user needs.
    Result<void> require(const Geometry& geometry, const Needs& needs);

    // VertexNormals, VertexTangents, VertexColours, TexCoords0, TexCoords1, FirstVertexNormals: what there is.
    FeatureSet attributes() const { return _attributes; }
    const Box& box() const { return _box; }
    std::span<const Cluster> clusters() const { return _clusters; }
    // Faces of the box that clusters lie flat on.
    BoxFaces flatBoxFaces() const { return _flatBoxFaces; }
    std::uint32_t vertices() const { return _vertices; }
    std::span<const ClusterGroup> groups() const { return _groups; }
    std::uint32_t triangles() const { return _triangles; }
    const gl::VertexArray& vertexArray() const { return _vertexArray; }
    const BufferTexture& faceNormals() const { return _faceNormalTexture; }
    const BufferTexture& primitives() const { return _primitiveTexture; }
    // Two texels a triangle: its centre and the mean of its normals, object space.
    const BufferTexture& flatFaces() const { return _flatFaceTexture; }
    // True when drawing needs the table of original triangle numbers (ids layer).
    bool isReordered() const { return !_primitives.empty(); }
    // By drawn triangle its number in the scene's geometry; empty: the same.
    std::span<const std::uint32_t> sceneTriangles() const { return _primitives; }
    // For what computes vertices on the GPU (deformer.h): empty buffers for what there is not.
    const gl::Buffer& positions() const { return _positions; }
    const gl::Buffer& normals() const { return _normals; }
    const gl::Buffer& tangents() const { return _tangents; }
    const gl::Buffer& indices() const { return _indices; }
    const gl::Buffer& faceNormalBuffer() const { return _faceNormals; }
    const gl::Buffer& flatFaceBuffer() const { return _flatFaces; }
    // The scene's vertex at a corner of a drawn triangle.
    std::uint32_t indexAt(const Geometry& geometry, std::size_t corner) const;
    // For shadow volumes: vertices and triangles as they are on the GPU, read back when first asked for after a change.
    std::shared_ptr<const CasterShape> casterShape();
    // Where the clusters are now, by cluster.
    void setClusterBoxes(std::span<const Box> boxes);
    std::uint64_t bytes() const;
    // Bytes sent to the GPU since creation: a test counts them.
    std::uint64_t uploadedBytes() const { return _uploadedBytes; }

 private:
    struct Triangle {
        glm::vec3 a, b, c;
    };
    Result<void> build(const Geometry& geometry);
    Result<void> buildFaceNormals(const Geometry& geometry);
    // Where all triangles that begin with the same vertex have the same normal, that vertex can hold it: to ask for a
    // triangle's number makes llvmpipe put triangles together one by one.
    Result<void> buildFirstVertexNormals(const Geometry& geometry, std::span<const glm::vec3> normals);
    Result<void> buildTangents(const Geometry& geometry);
    Result<void> buildPrimitives();
    Result<void> buildFlatFaces(const Geometry& geometry);
    Result<gl::Buffer> bufferOf(const MultiStorage& storage);
    // Elements by the scene's vertices, in the order in which they are drawn.
    template <class T>
    std::vector<T> inDrawnOrder(std::vector<T> elements, std::size_t perVertex) const;
    void orderVertices(std::span<const std::uint32_t> indices);
    void attach(VertexLocation location, const gl::Buffer& buffer, GLint components);
    void updateTriangles(const Geometry& geometry, const IndexRanges& vertices);
    // Of moved vertices nobody knows what they enclose, nor which way the triangles face that they begin.
    void forgetPlaces();
    bool _isMoved = false;
    void updateBounds();

    Needs _needs;
    FeatureSet _attributes = 0;
    std::uint32_t _vertices = 0;
    std::uint32_t _triangles = 0;
    Box _box;
    BoxFaces _flatBoxFaces = 0;
    std::vector<Cluster> _clusters;
    std::vector<ClusterGroup> _groups;
    std::vector<std::uint32_t> _primitives;  // drawn triangle -> the scene's; empty: the same
    std::vector<std::uint32_t> _drawnVertices;  // the scene's vertex -> that on the GPU; empty: the same
    // Built with the first partial change of positions: which triangles touch vertex v are
    // _trianglesOfVertex[_firstOfVertex[v] .. _firstOfVertex[v + 1]).
    std::vector<std::uint32_t> _firstOfVertex;
    std::vector<std::uint32_t> _trianglesOfVertex;
    gl::Buffer _positions, _normals, _tangents, _colours, _texCoords0, _texCoords1;
    gl::Buffer _indices, _firstTriangles, _faceNormals, _firstVertexNormals, _primitiveTable, _flatFaces;
    BufferTexture _faceNormalTexture, _primitiveTexture, _flatFaceTexture;
    gl::VertexArray _vertexArray;
    std::shared_ptr<const CasterShape> _casterShape;
    std::uint64_t _uploadedBytes = 0;
};

}  // namespace umbriel
