#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "client/import/import_error.h"

namespace umbriel {

// The folder of the imported file: the only place files are read from. Names are relative, without "..", and neither
// they nor symbolic links lead out of it.
class SourceFolder {
 public:
    // The folder that holds file. Throws ImportRefused.
    SourceFolder(const std::string& file, ByteBudget& fileBytes);
    ~SourceFolder();
    SourceFolder(const SourceFolder&) = delete;
    SourceFolder& operator=(const SourceFolder&) = delete;

    // The name of the file itself, without its folder.
    const std::string& fileName() const { return _fileName; }
    // The file itself.
    std::vector<std::byte> readMain();
    // A file named in the main one; place says where. Percent signs are decoded when uri is set. Throws ImportRefused.
    std::vector<std::byte> read(std::string_view name, std::string_view place, bool uri);

 private:
    std::vector<std::byte> readAll(int descriptor, const std::string& name, std::string_view place);

    std::string _file;
    std::string _fileName;
    ByteBudget& _fileBytes;
    int _folder = -1;
};

}  // namespace umbriel
