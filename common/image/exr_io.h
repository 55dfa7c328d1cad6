#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "common/image/image.h"

namespace umbriel {

// Writes R, G, B, A as FLOAT and every layer as FLOAT or UINT channels `layer.channel`; scan lines, ZIP compression,
// data window = display window = (0, 0)..(width - 1, height - 1). The same picture gives the same bytes (of one OpenEXR
// and zlib version): no date, no host. The file appears by rename (atomic_file.h).
// Bad input: an empty picture, a channel name that is empty, longer than 255 bytes (layer included), holds a NUL or a
// dot or occurs twice, an attribute named like one of EXR's own. Failure: the disk.
Result<void> writeExr(const std::filesystem::path& path, const LayeredImage& image);

// Reads the first level of a single-part scan-line or tiled file; HALF becomes float, exactly. The picture is the data
// window. R, G, B, A at the top level become `rgba` (missing colours 0, missing A 1; a lone Y is grey), everything else
// becomes layers: `a.b.X` is channel X of layer "a.b"; a layer of mixed types becomes a FLOAT and a UINT layer of one
// name. String and float attributes that are not EXR's own are kept.
// Deep, multi-part, incomplete and chroma-subsampled files are refused, as are sizes beyond the limits, before samples
// are allocated.
//
// OpenEXR 3.1 has known memory errors on hostile files and no bound on time: files that others made go through
// readImageIsolated() (isolated_reader.h).
Result<LayeredImage> readExr(const std::filesystem::path& path, const ImageLimits& limits = {});

}  // namespace umbriel
