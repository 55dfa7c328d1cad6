#include "common/image/exr_io.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTestFile.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "common/image/atomic_file.h"
#include "common/image/printable.h"

namespace umbriel {
namespace {

// Far beyond any wall; keeps what OpenEXR allocates from a header's word alone (line buffers, offset tables) small.
constexpr int kMaxDimension = 1 << 17;
constexpr int kMaxTileDimension = 1 << 13;
constexpr std::size_t kMaxNameBytes = 255;      // EXR's long names
constexpr std::size_t kMaxTextBytes = 1 << 16;  // of one attribute read

// zlib's documentation: deflate does not do better than 1032 : 1 (and run lengths not better than 64 : 1).
constexpr std::uint64_t kMaxDeflateRatio = 1032;

// OpenEXR's stream over our file: its own one loses what goes wrong when the file is closed.
class FileStream final : public Imf::OStream {
 public:
    FileStream(AtomicFile& file, const std::string& name) : Imf::OStream(name.c_str()), _file(file) {}

    // Errors are kept by the file and reported by its commit(): throwing here would come out of a destructor.
    void write(const char bytes[], int count) override {
        _file.write(std::as_bytes(std::span(bytes, static_cast<std::size_t>(count))));
    }
    uint64_t tellp() override { return _file.position(); }
    void seekp(uint64_t position) override { _file.seek(position); }

 private:
    AtomicFile& _file;
};

std::string channelName(const std::string& layer, const std::string& channel) {
    return layer.empty() ? channel : layer + "." + channel;
}

template <class T>
constexpr Imf::PixelType kPixelType = std::is_same_v<T, float> ? Imf::FLOAT : Imf::UINT;

// The channel `index` of an interleaved image whose first sample stands for the corner (minX, minY).
template <class T>
Imf::Slice sliceOf(T* samples, int width, int channelCount, int index, const Imath::Box2i& window) {
    const std::size_t xStride = sizeof(T) * static_cast<std::size_t>(channelCount);
    const std::size_t yStride = xStride * static_cast<std::size_t>(width);
    return Imf::Slice::Make(kPixelType<T>, samples + index, window, xStride, yStride);
}

// Adds the channels of one image to header and frame buffer; an error message when a name cannot be used.
template <class T>
std::optional<std::string> addChannels(const BasicImage<T>& image, const std::string& layer, Imf::Header& header,
                                       Imf::FrameBuffer& buffer) {
    for (int i = 0; i < image.channelCount(); ++i) {
        const std::string& channel = image.channels()[static_cast<std::size_t>(i)];
        const std::string name = channelName(layer, channel);
        if (channel.empty() || name.size() > kMaxNameBytes || name.find('\0') != std::string::npos ||
            channel.find('.') != std::string::npos) {
            return fmt::format("channel '{}' of layer '{}': names are 1 to {} bytes, without NUL, channels without dot",
                               channel, layer.substr(0, 80), kMaxNameBytes);
        }
        if (header.channels().findChannel(name) != nullptr) {
            return fmt::format("two channels are called '{}'", name);
        }
        header.channels().insert(name, Imf::Channel(kPixelType<T>));
        // A frame buffer for writing is only read from.
        buffer.insert(name, sliceOf(const_cast<T*>(image.samples().data()), image.width(), image.channelCount(), i,
                                    header.dataWindow()));
    }
    return std::nullopt;
}

std::optional<std::string> addAttributes(const LayeredImage& image, Imf::Header& header) {
    const auto usable = [&header](const std::string& name) {
        return !name.empty() && name.size() <= kMaxNameBytes && name.find('\0') == std::string::npos &&
               header.find(name) == header.end();
    };
    for (const auto& [name, text] : image.texts) {
        if (!usable(name)) {
            return fmt::format("the attribute name '{}' cannot be used", name);
        }
        header.insert(name, Imf::StringAttribute(text));
    }
    for (const auto& [name, number] : image.numbers) {
        if (!usable(name)) {
            return fmt::format("the attribute name '{}' cannot be used", name);
        }
        header.insert(name, Imf::FloatAttribute(number));
    }
    return std::nullopt;
}

// Where a channel of the file goes.
struct ChannelPlace {
    std::string file;     // name in the file
    std::string layer;    // its part before the last dot
    std::string channel;  // its part after it
    bool isUint = false;
};

struct ExrPlan {
    Imath::Box2i window;
    int width = 0;
    int height = 0;
    bool grey = false;
    std::array<bool, 4> hasRgba{};
    std::vector<ChannelPlace> layered;  // sorted by layer, FLOAT before UINT, channel
};

int rgbaIndex(const std::string& name) {
    static constexpr std::string_view kNames = "RGBA";
    const std::size_t index = name.size() == 1 ? kNames.find(name[0]) : std::string_view::npos;
    return index == std::string_view::npos ? -1 : static_cast<int>(index);
}

// What the header asks for, or why it is refused. Nothing of the size of the picture is allocated.
Result<ExrPlan> planOf(const Imf::Header& header, const std::string& path, const ImageLimits& limits) {
    ExrPlan plan;
    plan.window = header.dataWindow();
    const std::int64_t width = std::int64_t{plan.window.max.x} - plan.window.min.x + 1;
    const std::int64_t height = std::int64_t{plan.window.max.y} - plan.window.min.y + 1;
    if (width <= 0 || height <= 0 || width > kMaxDimension || height > kMaxDimension ||
        static_cast<std::uint64_t>(width * height) > limits.pixels) {
        return badInput(fmt::format("cannot read '{}': {} x {} pixels are more than the limit of {} (or none)", path,
                                    width, height, limits.pixels));
    }
    plan.width = static_cast<int>(width);
    plan.height = static_cast<int>(height);
    int channels = 0;
    bool hasY = false;
    for (auto i = header.channels().begin(); i != header.channels().end(); ++i) {
        const Imf::Channel& channel = i.channel();
        const std::string name = i.name();
        if (++channels > limits.channels) {
            return badInput(fmt::format("cannot read '{}': more than {} channels", path, limits.channels));
        }
        if (channel.xSampling != 1 || channel.ySampling != 1) {
            return badInput(fmt::format("cannot read '{}': channel '{}' is subsampled", path, printable(name)));
        }
        if (rgbaIndex(name) >= 0 && channel.type != Imf::UINT) {
            plan.hasRgba[static_cast<std::size_t>(rgbaIndex(name))] = true;
            continue;
        }
        hasY = hasY || (name == "Y" && channel.type != Imf::UINT);
        const std::size_t dot = name.rfind('.');
        ChannelPlace place;
        place.file = name;
        place.layer = dot == std::string::npos ? "" : name.substr(0, dot);
        place.channel = dot == std::string::npos ? name : name.substr(dot + 1);
        place.isUint = channel.type == Imf::UINT;
        plan.layered.push_back(std::move(place));
    }
    plan.grey = hasY && !plan.hasRgba[0] && !plan.hasRgba[1] && !plan.hasRgba[2];
    if (plan.grey) {
        std::erase_if(plan.layered, [](const ChannelPlace& p) { return p.file == "Y" && !p.isUint; });
    }
    const std::uint64_t bytes = static_cast<std::uint64_t>(width * height) * (4 + plan.layered.size()) * sizeof(float);
    if (bytes > limits.bytes) {
        return badInput(fmt::format("cannot read '{}': {} x {} pixels of {} channels need {} MiB, the limit is {} MiB",
                                    path, width, height, channels, bytes >> 20, limits.bytes >> 20));
    }
    std::sort(plan.layered.begin(), plan.layered.end(), [](const ChannelPlace& a, const ChannelPlace& b) {
        return std::tie(a.layer, a.isUint, a.channel) < std::tie(b.layer, b.isUint, b.channel);
    });
    return plan;
}

// Channels of a layer come in alphabetical order, as EXR's own channel lists do.
void makeLayers(const ExrPlan& plan, LayeredImage& image) {
    for (std::size_t i = 0; i < plan.layered.size();) {
        const ChannelPlace& first = plan.layered[i];
        std::vector<std::string> channels;
        for (;
             i < plan.layered.size() && plan.layered[i].layer == first.layer && plan.layered[i].isUint == first.isUint;
             ++i) {
            channels.push_back(plan.layered[i].channel);
        }
        if (first.isUint) {
            image.layers.push_back({first.layer, UintImage(plan.width, plan.height, std::move(channels))});
        } else {
            image.layers.push_back({first.layer, FloatImage(plan.width, plan.height, std::move(channels))});
        }
    }
}

LayeredImage readPlanned(Imf::InputFile& file, const ExrPlan& plan) {
    LayeredImage image;
    image.rgba = makeRgbaImage(plan.width, plan.height);
    makeLayers(plan, image);
    Imf::FrameBuffer buffer;
    static constexpr std::array<const char*, 4> kNames{"R", "G", "B", "A"};
    for (int c = 0; c < 4; ++c) {
        const bool fromY = plan.grey && c == 0;
        if (plan.hasRgba[static_cast<std::size_t>(c)] || fromY) {
            buffer.insert(fromY ? "Y" : kNames[static_cast<std::size_t>(c)],
                          sliceOf(image.rgba.samples().data(), plan.width, 4, c, plan.window));
        }
    }
    for (ImageLayer& layer : image.layers) {
        std::visit(
            [&](auto& layerImage) {
                for (int c = 0; c < layerImage.channelCount(); ++c) {
                    const std::string& channel = layerImage.channels()[static_cast<std::size_t>(c)];
                    buffer.insert(channelName(layer.name, channel), sliceOf(layerImage.samples().data(), plan.width,
                                                                            layerImage.channelCount(), c, plan.window));
                }
            },
            layer.image);
    }
    file.setFrameBuffer(buffer);
    file.readPixels(plan.window.min.y, plan.window.max.y);

    float* samples = image.rgba.samples().data();
    for (std::size_t i = 0; i < image.rgba.pixelCount(); ++i, samples += 4) {
        if (plan.grey) {
            samples[1] = samples[0];
            samples[2] = samples[0];
        }
        if (!plan.hasRgba[3]) {
            samples[3] = 1.0F;
        }
    }
    return image;
}

// Whether a file of this size can hold its pixels. OpenEXR 3.1 does not notice a ZIP block that is too short for the
// window: it hands out what its buffer held before. This catches the gross lies.
bool canHold(const Imf::Header& header, const ExrPlan& plan, std::uint64_t fileBytes) {
    std::uint64_t pixelBytes = 0;
    for (auto i = header.channels().begin(); i != header.channels().end(); ++i) {
        pixelBytes += i.channel().type == Imf::HALF ? 2 : 4;
    }
    const std::uint64_t bytes =
        static_cast<std::uint64_t>(plan.width) * static_cast<std::uint64_t>(plan.height) * pixelBytes;
    switch (header.compression()) {
        case Imf::NO_COMPRESSION:
            return bytes <= fileBytes;
        case Imf::RLE_COMPRESSION:
        case Imf::ZIPS_COMPRESSION:
        case Imf::ZIP_COMPRESSION:
            return bytes / kMaxDeflateRatio <= fileBytes;
        default:
            return true;
    }
}

void readAttributes(const Imf::Header& header, LayeredImage& image) {
    if (Imf::hasEnvmap(header))
        image.texts[std::string(kEnvironmentKindText)] = Imf::envmap(header) == Imf::ENVMAP_CUBE ? "cube" : "latlong";
    static const std::set<std::string> kStandard{"pixelAspectRatio", "screenWindowWidth"};
    for (auto i = header.begin(); i != header.end(); ++i) {
        if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&i.attribute())) {
            if (text->value().size() <= kMaxTextBytes) {
                image.texts[i.name()] = text->value();
            }
        } else if (const auto* number = dynamic_cast<const Imf::FloatAttribute*>(&i.attribute())) {
            if (!kStandard.contains(i.name())) {
                image.numbers[i.name()] = number->value();
            }
        }
    }
}

// OpenEXR puts `... image file "name". ` before what it has to say; we name the file ourselves.
std::string reasonOf(const std::exception& e) {
    const std::string_view what = e.what();
    const std::size_t start = what.find("image file \"");
    const std::size_t end = what.rfind("\". ");
    return printable(
        start != std::string_view::npos && end != std::string_view::npos && end > start ? what.substr(end + 3) : what);
}

}  // namespace

Result<void> writeExr(const std::filesystem::path& path, const LayeredImage& image) {
    if (image.width() <= 0 || image.height() <= 0) {
        return badInput(fmt::format("cannot write '{}': the picture is empty", path.string()));
    }
    UMBRIEL_ASSERT(image.rgba.channels() == makeRgbaImage(0, 0).channels(), "a picture's colour is not R, G, B, A");
    try {
        Imf::Header header(image.width(), image.height());
        header.compression() = Imf::ZIP_COMPRESSION;
        Imf::FrameBuffer buffer;
        std::optional<std::string> problem = addChannels(image.rgba, "", header, buffer);
        for (const ImageLayer& layer : image.layers) {
            UMBRIEL_ASSERT(layer.width() == image.width() && layer.height() == image.height(),
                           "a layer has another size than its picture");
            if (!problem) {
                problem =
                    std::visit([&](const auto& i) { return addChannels(i, layer.name, header, buffer); }, layer.image);
            }
        }
        if (!problem) {
            problem = addAttributes(image, header);
        }
        if (problem) {
            return badInput(fmt::format("cannot write '{}': {}", path.string(), *problem));
        }
        Result<std::unique_ptr<AtomicFile>> file = AtomicFile::create(path);
        if (!file) {
            return file.error();
        }
        {
            FileStream stream(**file, path.string());
            Imf::OutputFile output(stream, header);
            output.setFrameBuffer(buffer);
            output.writePixels(image.height());
        }  // the destructor writes the line offset table
        return (*file)->commit();
    } catch (const std::exception& e) {
        return failure(fmt::format("cannot write '{}': {}", path.string(), e.what()));
    }
}

Result<LayeredImage> readExr(const std::filesystem::path& path, const ImageLimits& limits) {
    const std::string name = path.string();
    try {
        // Process-wide in OpenEXR, and always these values.
        Imf::Header::setMaxImageSize(kMaxDimension, kMaxDimension);
        Imf::Header::setMaxTileSize(kMaxTileDimension, kMaxTileDimension);
        bool isTiled = false;
        bool isDeep = false;
        bool isMultiPart = false;
        if (!Imf::isOpenExrFile(name.c_str(), isTiled, isDeep, isMultiPart)) {
            return badInput(fmt::format("cannot read '{}': it is no OpenEXR file", name));
        }
        if (isDeep || isMultiPart) {
            return badInput(fmt::format("cannot read '{}': {} OpenEXR files are not supported", name,
                                        isDeep ? "deep" : "multi-part"));
        }
        Imf::InputFile file(name.c_str());
        const Result<ExrPlan> plan = planOf(file.header(), name, limits);
        if (!plan) {
            return plan.error();
        }
        if (!file.isComplete() || !canHold(file.header(), *plan, std::filesystem::file_size(path))) {
            return badInput(fmt::format("cannot read '{}': the file is incomplete", name));
        }
        LayeredImage image = readPlanned(file, *plan);
        readAttributes(file.header(), image);
        return image;
    } catch (const std::bad_alloc&) {
        return failure(fmt::format("cannot read '{}': not enough memory", name));
    } catch (const std::exception& e) {
        return badInput(fmt::format("cannot read '{}': {}", name, reasonOf(e)));
    }
}

}  // namespace umbriel
