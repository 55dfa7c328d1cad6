#include "client/import/photometric_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <system_error>

#include "client/import/photometric_eulumdat.h"
#include "client/import/photometric_ies.h"

namespace umbriel {
namespace {

std::string lowerSuffix(const std::filesystem::path& path) {
    std::string suffix = path.extension().string();
    std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return suffix;
}

}  // namespace

Result<PhotometricImport> readPhotometricFile(const std::filesystem::path& path, const PhotometricLimits& limits) {
    const auto refused = [&path](const std::string& reason) {
        return badInput(fmt::format("cannot read '{}': {}", path.string(), reason));
    };
    std::error_code code;
    const std::filesystem::file_status status = std::filesystem::status(path, code);
    if (!std::filesystem::exists(status)) {
        return refused("no such file");
    }
    if (!std::filesystem::is_regular_file(status)) {
        return refused("it is not a regular file");
    }
    const std::uintmax_t size = std::filesystem::file_size(path, code);
    if (code || size > limits.fileBytes) {
        return refused(code ? code.message() : fmt::format("larger than {} bytes", limits.fileBytes));
    }
    std::ifstream stream(path, std::ios::binary);
    std::string text(static_cast<std::size_t>(size), '\0');
    if (!stream.read(text.data(), static_cast<std::streamsize>(text.size()))) {
        return refused("it cannot be opened or changed while it was read");
    }
    const std::string suffix = lowerSuffix(path);
    const bool isIes = suffix == ".ies" || (suffix != ".ldt" && text.find("TILT=") != std::string::npos);
    Result<PhotometricImport> import = isIes ? parseIes(text, limits) : parseEulumdat(text, limits);
    if (!import) {
        return refused(import.error().message);
    }
    return import;
}

}  // namespace umbriel
