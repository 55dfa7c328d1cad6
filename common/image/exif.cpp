#include "common/image/exif.h"

#include <libexif/exif-data.h>

#include <cmath>
#include <memory>

namespace umbriel {
namespace {

struct Unref {
    void operator()(ExifData* data) const { exif_data_unref(data); }
};

std::optional<float> positiveNumber(ExifData& data, ExifTag tag) {
    ExifContent* content = data.ifd[EXIF_IFD_EXIF];
    const ExifEntry* entry = content != nullptr ? exif_content_get_entry(content, tag) : nullptr;
    if (entry == nullptr || entry->data == nullptr || entry->components < 1) {
        return std::nullopt;
    }
    const ExifByteOrder order = exif_data_get_byte_order(&data);
    double value = 0.0;
    if (entry->format == EXIF_FORMAT_RATIONAL && entry->size >= 8) {
        const ExifRational rational = exif_get_rational(entry->data, order);
        value = rational.denominator == 0 ? 0.0 : static_cast<double>(rational.numerator) / rational.denominator;
    } else if (entry->format == EXIF_FORMAT_SHORT && entry->size >= 2) {
        value = exif_get_short(entry->data, order);
    } else if (entry->format == EXIF_FORMAT_LONG && entry->size >= 4) {
        value = exif_get_long(entry->data, order);
    }
    const auto number = static_cast<float>(value);
    return number > 0.0F && std::isfinite(number) ? std::optional(number) : std::nullopt;
}

}  // namespace

ExposureTags readExposureTags(const std::filesystem::path& path) {
    const std::unique_ptr<ExifData, Unref> data(exif_data_new_from_file(path.c_str()));
    if (!data) {
        return {};
    }
    return {positiveNumber(*data, EXIF_TAG_EXPOSURE_TIME), positiveNumber(*data, EXIF_TAG_FNUMBER),
            positiveNumber(*data, EXIF_TAG_ISO_SPEED_RATINGS)};
}

}  // namespace umbriel
