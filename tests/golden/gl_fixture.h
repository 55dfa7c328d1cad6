#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "server/gl/context.h"
#include "server/gl/framebuffer.h"
#include "server/gl/program.h"
#include "server/gl/vertex_array.h"

namespace umbriel::gl {

// A current context for the duration of a test.
class GlTest : public ::testing::Test {
 protected:
    void SetUp() override {
        auto created = HeadlessContext::create({.debug = true});
        ASSERT_TRUE(created) << created.error().message;
        context.emplace(std::move(*created));
    }

    // Ends the test on an error: nothing useful can follow.
    template <class T>
    static T require(Result<T> result) {
        if (!result) ADD_FAILURE() << result.error().message;
        return std::move(result).value();
    }

    std::optional<HeadlessContext> context;
};

}  // namespace umbriel::gl
