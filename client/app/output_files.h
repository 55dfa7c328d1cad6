#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/image/image.h"
#include "common/image/tone_mapping.h"
#include "common/wall/tile_pixels.h"

namespace umbriel {

// Where the pictures of a run go. One --out: a file ending in .exr, .hdr or .png, a pattern with one %d or %0Nd for the
// frame number ("x.%04d.exr"), or an existing folder (then frame.%04d.exr in it).
class OutputFiles {
   public:
    // Checks everything that can be checked before drawing: suffix, pattern, that the folder exists and is writable,
    // that several frames do not go into one file.
    static Result<OutputFiles> plan(const std::vector<std::string>& outs, std::uint64_t frames);

    bool empty() const { return _patterns.empty(); }
    // No file holds more than 8 bits a channel: all are .png, or there is none.
    bool allShowBytes() const;
    // The files of one frame. suffix: goes before the file's ending with a dot, for one eye of two; may be empty.
    std::vector<std::filesystem::path> pathsFor(std::uint64_t frame, std::string_view suffix) const;
    // Writes the frame to all its files; each appears complete or not at all. exposure (EV) and the tone mapping apply to
    // .png only.
    Result<std::vector<std::filesystem::path>> write(std::uint64_t frame, std::string_view suffix, const LayeredImage& image,
                                                     double exposure, ToneMapping toneMapping) const;

   private:
    std::vector<std::string> _patterns;
};

// The wall as one eye sees it, from the tiles that cover it. Layers are matched by name; those of one tile that have the
// same name are numbered from the second on: "lamp", "lamp_2".
LayeredImage assembleWall(PixelSize wall, const std::vector<TilePixels>& tiles, Eye eye);

}  // namespace umbriel
