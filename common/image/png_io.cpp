#include "common/image/png_io.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

#include "common/image/atomic_file.h"
#include "common/image/display.h"
#include "common/image/printable.h"

namespace umbriel {
namespace {

constexpr png_uint_32 kMaxDimension = 1U << 17;
constexpr png_alloc_size_t kMaxChunkBytes = 8U << 20;  // text and colour profiles, which we do not even use
constexpr png_uint_32 kMaxChunks = 1000;
constexpr int kCompressionLevel = 6;

// What libpng's callbacks reach; the message outlives the jump.
struct PngContext {
    std::jmp_buf jump{};
    char message[160] = "";
    std::FILE* input = nullptr;
    AtomicFile* output = nullptr;
    std::vector<std::uint8_t>* memory = nullptr;  // instead of a file
};

void onError(png_structp png, png_const_charp message) {
    auto* context = static_cast<PngContext*>(png_get_error_ptr(png));
    std::snprintf(context->message, sizeof context->message, "%s", message);
    std::longjmp(context->jump, 1);
}

void onWarning(png_structp, png_const_charp) {}  // libpng goes on with a sound reading

void onWrite(png_structp png, png_bytep bytes, png_size_t count) {
    auto* context = static_cast<PngContext*>(png_get_io_ptr(png));
    if (context->memory != nullptr) {
        context->memory->insert(context->memory->end(), bytes, bytes + count);
        return;
    }
    if (!context->output->write(std::as_bytes(std::span(bytes, count)))) {
        png_error(png, "write failed");  // commit() knows why
    }
}

void onFlush(png_structp) {}

void onRead(png_structp png, png_bytep bytes, png_size_t count) {
    auto* context = static_cast<PngContext*>(png_get_io_ptr(png));
    if (std::fread(bytes, 1, count, context->input) != count) {
        png_error(png, "the file ends early");
    }
}

// Only plain C data lives between setjmp and longjmp here and in the functions below: no destructor is jumped over.
bool writeRows(png_structp png, png_infop info, PngContext& context, int width, int height, int channels,
               const std::uint8_t* samples) {
    if (setjmp(context.jump) != 0) {
        return false;
    }
    png_set_write_fn(png, &context, onWrite, onFlush);
    png_set_user_limits(png, kMaxDimension, kMaxDimension);
    png_set_compression_level(png, kCompressionLevel);
    png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
                 channels == 4 ? PNG_COLOR_TYPE_RGBA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_RELATIVE);
    png_write_info(png, info);
    const std::size_t rowBytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
    for (int y = 0; y < height; ++y) {
        png_write_row(png, samples + static_cast<std::size_t>(y) * rowBytes);
    }
    png_write_end(png, info);
    return true;
}

struct PngSize {
    png_uint_32 width = 0;
    png_uint_32 height = 0;
    int bytesPerSample = 1;
};

// After this, rows are RGBA of 8 or 16 bits (in this machine's byte order).
bool readHeader(png_structp png, png_infop info, PngContext& context, PngSize& size) {
    if (setjmp(context.jump) != 0) {
        return false;
    }
    png_set_read_fn(png, &context, onRead);
    png_set_user_limits(png, kMaxDimension, kMaxDimension);
    png_set_chunk_malloc_max(png, kMaxChunkBytes);
    png_set_chunk_cache_max(png, kMaxChunks);
    png_read_info(png, info);
    size.width = png_get_image_width(png, info);
    size.height = png_get_image_height(png, info);
    png_set_expand(png);  // palettes, 1 to 4 bits, tRNS
    png_set_gray_to_rgb(png);
    png_set_add_alpha(png, 0xffff, PNG_FILLER_AFTER);
    if (png_get_bit_depth(png, info) == 16) {
        size.bytesPerSample = 2;
        png_set_swap(png);
    }
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    return true;
}

bool readRows(png_structp png, PngContext& context, std::uint8_t* const* rows) {
    if (setjmp(context.jump) != 0) {
        return false;
    }
    png_read_image(png, const_cast<png_bytepp>(rows));
    png_read_end(png, nullptr);
    return true;
}

struct ReadStructs {
    png_structp png = nullptr;
    png_infop info = nullptr;
    explicit ReadStructs(PngContext& context)
        : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, &context, onError, onWarning)),
          info(png != nullptr ? png_create_info_struct(png) : nullptr) {}
    ~ReadStructs() { png_destroy_read_struct(&png, &info, nullptr); }
    ReadStructs(const ReadStructs&) = delete;
    ReadStructs& operator=(const ReadStructs&) = delete;
};

struct WriteStructs {
    png_structp png = nullptr;
    png_infop info = nullptr;
    explicit WriteStructs(PngContext& context)
        : png(png_create_write_struct(PNG_LIBPNG_VER_STRING, &context, onError, onWarning)),
          info(png != nullptr ? png_create_info_struct(png) : nullptr) {}
    ~WriteStructs() { png_destroy_write_struct(&png, &info); }
    WriteStructs(const WriteStructs&) = delete;
    WriteStructs& operator=(const WriteStructs&) = delete;
};

LayeredImage linearFromRows(const PngSize& size, const std::vector<std::uint8_t>& raw) {
    LayeredImage image;
    image.rgba = makeRgbaImage(static_cast<int>(size.width), static_cast<int>(size.height));
    float* to = image.rgba.samples().data();
    const std::uint8_t* from = raw.data();
    for (std::size_t i = 0; i < image.rgba.pixelCount(); ++i, to += 4) {
        if (size.bytesPerSample == 1) {
            to[3] = static_cast<float>(from[3]) / 255.0F;
            for (int c = 0; c < 3; ++c) {
                to[c] = linearFromSrgbByte(from[c]) * to[3];
            }
            from += 4;
        } else {
            std::uint16_t codes[4];
            std::copy_n(from, sizeof codes, reinterpret_cast<std::uint8_t*>(codes));
            to[3] = static_cast<float>(codes[3]) / 65535.0F;
            for (int c = 0; c < 3; ++c) {
                to[c] = static_cast<float>(linearFromSrgb(codes[c] / 65535.0)) * to[3];
            }
            from += sizeof codes;
        }
    }
    return image;
}

}  // namespace

Result<void> writePngBytes(const std::filesystem::path& path, int width, int height, int channels,
                           std::span<const std::uint8_t> samples) {
    UMBRIEL_ASSERT(channels == 3 || channels == 4, "a PNG of ours has three or four channels");
    if (width <= 0 || height <= 0) {
        return badInput(fmt::format("cannot write '{}': the picture is empty", path.string()));
    }
    UMBRIEL_ASSERT(samples.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                                         static_cast<std::size_t>(channels),
                   "samples do not fill the picture");
    Result<std::unique_ptr<AtomicFile>> file = AtomicFile::create(path);
    if (!file) {
        return file.error();
    }
    PngContext context;
    context.output = file->get();
    const WriteStructs structs(context);
    if (structs.info == nullptr) {
        return failure(fmt::format("cannot write '{}': not enough memory", path.string()));
    }
    const bool written = writeRows(structs.png, structs.info, context, width, height, channels, samples.data());
    Result<void> committed = written || (*file)->failed()
                                 ? (*file)->commit()
                                 : failure(fmt::format("cannot write '{}': {}", path.string(), context.message));
    return committed;
}

Result<std::vector<std::uint8_t>> encodePng(int width, int height, int channels, std::span<const std::uint8_t> samples) {
    UMBRIEL_ASSERT(channels == 3 || channels == 4, "a PNG of ours has three or four channels");
    UMBRIEL_ASSERT(width > 0 && height > 0 && samples.size() == static_cast<std::size_t>(width) *
                                                                    static_cast<std::size_t>(height) *
                                                                    static_cast<std::size_t>(channels),
                   "samples do not fill the picture");
    std::vector<std::uint8_t> bytes;
    PngContext context;
    context.memory = &bytes;
    const WriteStructs structs(context);
    if (structs.info == nullptr || !writeRows(structs.png, structs.info, context, width, height, channels, samples.data())) {
        return failure(fmt::format("cannot encode a PNG: {}", context.message));
    }
    return bytes;
}

Result<void> writePng(const std::filesystem::path& path, const FloatImage& rgba, const PngOptions& options) {
    UMBRIEL_ASSERT(rgba.channelCount() == 4, "a picture's colour is not R, G, B, A");
    const double scale = exposureScale(options.exposure);
    const int channels = options.alpha ? 4 : 3;
    std::vector<std::uint8_t> bytes(rgba.pixelCount() * static_cast<std::size_t>(channels));
    const float* from = rgba.samples().data();
    std::uint8_t* to = bytes.data();
    for (std::size_t i = 0; i < rgba.pixelCount(); ++i, from += 4, to += channels) {
        const float alpha = from[3];
        for (int c = 0; c < 3; ++c) {
            const float straight = !options.alpha ? from[c] : alpha > 0.0F ? from[c] / alpha : 0.0F;
            to[c] = options.toneMapping == ToneMapping::Clamp
                        ? displayByte(straight, scale)
                        : displayByte(static_cast<float>(toneMapped(options.toneMapping, straight * scale)), 1.0);
        }
        if (options.alpha) {
            to[3] = alphaByte(alpha);
        }
    }
    return writePngBytes(path, rgba.width(), rgba.height(), channels, bytes);
}

Result<LayeredImage> readPng(const std::filesystem::path& path, const ImageLimits& limits) {
    const std::string name = path.string();
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(name.c_str(), "rbe"), &std::fclose);
    if (!file) {
        return badInput(fmt::format("cannot read '{}': {}", name, std::strerror(errno)));
    }
    PngContext context;
    context.input = file.get();
    const ReadStructs structs(context);
    if (structs.info == nullptr) {
        return failure(fmt::format("cannot read '{}': not enough memory", name));
    }
    PngSize size;
    if (!readHeader(structs.png, structs.info, context, size)) {
        return badInput(fmt::format("cannot read '{}': {}", name, printable(context.message)));
    }
    const std::uint64_t pixels = std::uint64_t{size.width} * size.height;
    const std::uint64_t rowBytes = std::uint64_t{size.width} * 4 * static_cast<unsigned>(size.bytesPerSample);
    if (pixels > limits.pixels || pixels * 4 * sizeof(float) + rowBytes * size.height > limits.bytes) {
        return badInput(fmt::format("cannot read '{}': {} x {} pixels are more than the limit of {} pixels or {} MiB",
                                    name, size.width, size.height, limits.pixels, limits.bytes >> 20));
    }
    try {
        std::vector<std::uint8_t> raw(rowBytes * size.height);
        std::vector<std::uint8_t*> rows(size.height);
        for (std::size_t y = 0; y < rows.size(); ++y) {
            rows[y] = raw.data() + y * rowBytes;
        }
        if (!readRows(structs.png, context, rows.data())) {
            return badInput(fmt::format("cannot read '{}': {}", name, printable(context.message)));
        }
        return linearFromRows(size, raw);
    } catch (const std::bad_alloc&) {
        return failure(fmt::format("cannot read '{}': not enough memory", name));
    }
}

}  // namespace umbriel
