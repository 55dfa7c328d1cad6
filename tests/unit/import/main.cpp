#include <gtest/gtest.h>

#include <csignal>
#include <string_view>

#include "client/import/import_child.h"

// The test program is its own import process, as umbriel is.
int main(int argc, char** argv) {
    if (argc > 1 && std::string_view(argv[1]) == "import-child")
        return umbriel::runImportChild({std::vector<std::string>(argv + 2, argv + argc)});
    std::signal(SIGPIPE, SIG_IGN);  // a test may write to a reader that has seen enough
    testing::InitGoogleTest(&argc, argv);
    return RUN_ALL_TESTS();
}
