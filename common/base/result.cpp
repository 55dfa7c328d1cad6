#include "common/base/result.h"

#include <utility>

#include "common/base/assert.h"

namespace umbriel {

Error badInput(std::string message) { return {Error::Kind::BadInput, std::move(message)}; }

Error failure(std::string message) { return {Error::Kind::Failure, std::move(message)}; }

void throw_exception_from_error(const Error& error, const boost::source_location& location) {
    assertionFailed("result.has_value()", error.message.c_str(), location.file_name(), static_cast<int>(location.line()));
}

}  // namespace umbriel
