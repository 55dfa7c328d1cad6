#include "common/wire/view_codec.h"

#include <fmt/format.h>

namespace umbriel::wire {
namespace {

constexpr std::int32_t kMaxPixels = 1 << 24;
constexpr std::uint32_t kAllLayers = static_cast<std::uint32_t>(Layer::LightFactors) * 2 - 1;
// The smallest encodings, for refusing counts before anything is reserved.
constexpr std::size_t kMinFitBytes = 8 + 1 + 1 + 1 + 1 + 1 + 72 + 24 + 128 + 16 + 12 + 8 + 3 + 8 + 2 + 36 + 2;
constexpr std::size_t kMinViewBytes = 8 + 1 + 4 + 24 + 72 + 128 + 8 + 1 + 1;

template <class Matrix>
void writeMatrix(Writer& writer, const Matrix& matrix) {
    for (int column = 0; column < Matrix::length(); ++column)
        for (int row = 0; row < Matrix::col_type::length(); ++row) writer.f64(matrix[column][row]);
}

template <class Matrix>
Matrix readMatrix(Reader& reader) {
    Matrix matrix;
    for (int column = 0; column < Matrix::length(); ++column)
        for (int row = 0; row < Matrix::col_type::length(); ++row) matrix[column][row] = reader.finiteF64();
    return matrix;
}

std::int32_t readPixels(Reader& reader) {
    return static_cast<std::int32_t>(reader.bounded(kMaxPixels, "a pixel count is too large"));
}

void writeFit(Writer& writer, const ShadowFit& fit) {
    writer.u64(fit.light.value);
    writer.varint(static_cast<std::uint32_t>(fit.mode));
    writer.varint(static_cast<std::uint32_t>(fit.shape));
    writer.varint(fit.part);
    writer.varint(fit.mapSize);
    writer.u8(fit.perspective ? 1 : 0);
    writeMatrix(writer, fit.worldFromLight);
    for (int i = 0; i < 3; ++i) writer.f64(fit.positionWorld[i]);
    writeMatrix(writer, fit.clipFromWorld);
    writer.f64(fit.texelSize);
    writer.f64(fit.depthRange);
    writer.f32(fit.constantBias);
    writer.f32(fit.slopeBias);
    writer.f32(fit.normalOffset);
    writer.f32(fit.filter.widthTexels);
    writer.f32(fit.filter.widthMetres);
    writer.varint(fit.filter.samplesPerRow);
    writer.varint(fit.filter.blockerSamples);
    writer.varint(fit.filter.filterSamples);
    writer.f32(fit.filter.lightSize);
    writer.f32(fit.filter.maxTexels);
    for (int i = 0; i < 4; ++i) writer.f64(fit.planeWorld[i]);
    writer.f32(fit.blobSize);
    writer.u8(fit.filter.nearestBlocker ? 1 : 0);
    writer.u8(fit.filter.bilinear ? 1 : 0);
    writer.varint(fit.filter.boundsBlock);
    writer.varint(static_cast<std::uint32_t>(fit.casters));
    writer.varint(fit.layer);
}

ShadowFit readFit(Reader& reader) {
    ShadowFit fit;
    fit.light.value = reader.u64();
    fit.mode = static_cast<ShadowMode>(reader.bounded(kEnumCount<ShadowMode> - 1, "unknown shadow mode"));
    fit.shape = static_cast<ShadowShape>(reader.bounded(2, "unknown shape of a shadow map"));
    fit.part = static_cast<std::uint32_t>(reader.bounded(5, "a shadow map has no such part"));
    fit.mapSize = static_cast<std::uint32_t>(reader.bounded(1 << 16, "the shadow map is too large"));
    fit.perspective = reader.boolean();
    fit.worldFromLight = readMatrix<glm::dmat3>(reader);
    for (int i = 0; i < 3; ++i) fit.positionWorld[i] = reader.finiteF64();
    fit.clipFromWorld = readMatrix<glm::dmat4>(reader);
    fit.texelSize = reader.finiteF64();
    fit.depthRange = reader.finiteF64();
    fit.constantBias = reader.finiteF32();
    fit.slopeBias = reader.finiteF32();
    fit.normalOffset = reader.finiteF32();
    const auto samples = [&] { return static_cast<std::uint32_t>(reader.bounded(64, "too many shadow samples")); };
    fit.filter.widthTexels = reader.finiteF32();
    fit.filter.widthMetres = reader.finiteF32();
    fit.filter.samplesPerRow = samples();
    fit.filter.blockerSamples = samples();
    fit.filter.filterSamples = samples();
    fit.filter.lightSize = reader.finiteF32();
    fit.filter.maxTexels = reader.finiteF32();
    for (int i = 0; i < 4; ++i) fit.planeWorld[i] = reader.finiteF64();
    fit.blobSize = reader.finiteF32();
    fit.filter.nearestBlocker = reader.boolean();
    fit.filter.bilinear = reader.boolean();
    fit.filter.boundsBlock = static_cast<std::uint32_t>(reader.bounded(1 << 12, "the blocks of a map are too large"));
    fit.casters = static_cast<ShadowCasters>(reader.bounded(2, "unknown casters"));
    fit.layer = static_cast<std::uint32_t>(reader.bounded(1 << 16, "a light map has no such layer"));
    return fit;
}

void writeView(Writer& writer, const View& view) {
    writer.u64(view.viewport.value);
    writer.varint(static_cast<std::uint32_t>(view.eye));
    writer.varint(static_cast<std::uint32_t>(view.region.x));
    writer.varint(static_cast<std::uint32_t>(view.region.y));
    writer.varint(static_cast<std::uint32_t>(view.region.width));
    writer.varint(static_cast<std::uint32_t>(view.region.height));
    for (int i = 0; i < 3; ++i) writer.f64(view.eyeWorld[i]);
    writeMatrix(writer, view.viewFromWorld);
    writeMatrix(writer, view.clipFromView);
    writer.f64(view.nearDistance);
    writer.u8(view.unwrapped ? 2 : view.orthographic ? 1 : 0);
    writer.varint(view.fits.size());
    for (const ShadowFit& fit : view.fits) writeFit(writer, fit);
}

View readView(Reader& reader, PixelSize wall) {
    View view;
    view.viewport.value = reader.u64();
    view.eye = static_cast<Eye>(reader.bounded(kEnumCount<Eye> - 1, "unknown eye"));
    view.region.x = readPixels(reader);
    view.region.y = readPixels(reader);
    view.region.width = readPixels(reader);
    view.region.height = readPixels(reader);
    if (view.region.x + view.region.width > wall.width || view.region.y + view.region.height > wall.height)
        reader.fail("a view's region is not on the wall");
    for (int i = 0; i < 3; ++i) view.eyeWorld[i] = reader.finiteF64();
    view.viewFromWorld = readMatrix<glm::dmat3>(reader);
    view.clipFromView = readMatrix<glm::dmat4>(reader);
    view.nearDistance = reader.finiteF64();
    const std::uint8_t kind = reader.u8();
    if (kind > 2) reader.fail("unknown kind of a view");
    view.orthographic = kind == 1;
    view.unwrapped = kind == 2;
    const std::size_t fits = reader.count(kMinFitBytes, kMaxFits);
    view.fits.reserve(fits);
    for (std::size_t i = 0; i < fits && reader.ok(); ++i) view.fits.push_back(readFit(reader));
    return view;
}

}  // namespace

Bytes encodeViews(const WallViews& views) {
    Bytes bytes;
    Writer writer(bytes);
    writer.varint(static_cast<std::uint32_t>(views.wall.width));
    writer.varint(static_cast<std::uint32_t>(views.wall.height));
    writer.varint(static_cast<std::uint32_t>(views.tiles));
    writer.varint(views.samples);
    writer.varint(views.layers);
    writer.varint(static_cast<std::uint32_t>(views.colourPrecision));
    writer.varint(views.views.size());
    for (const View& view : views.views) writeView(writer, view);
    return bytes;
}

Result<WallViews> decodeViews(std::span<const std::byte> bytes) {
    Reader reader(bytes);
    WallViews views;
    views.wall.width = readPixels(reader);
    views.wall.height = readPixels(reader);
    views.tiles = static_cast<TileMode>(reader.bounded(1, "unknown tile mode"));
    views.samples = static_cast<std::uint32_t>(reader.bounded(16, "too many samples"));
    if (views.samples == 0) reader.fail("no samples");
    views.layers = static_cast<std::uint32_t>(reader.bounded(kAllLayers, "unknown layers"));
    views.colourPrecision = static_cast<ColourPrecision>(
        reader.bounded(static_cast<std::uint32_t>(ColourPrecision::Byte), "unknown precision of colours"));
    const std::size_t count = reader.count(kMinViewBytes, kMaxViews);
    views.views.reserve(count);
    for (std::size_t i = 0; i < count && reader.ok(); ++i) views.views.push_back(readView(reader, views.wall));
    if (!reader.ok()) return failure(fmt::format("the views cannot be read: {}", reader.reason()));
    if (!reader.atEnd()) return failure("the views cannot be read: bytes are left over");
    return views;
}

}  // namespace umbriel::wire
