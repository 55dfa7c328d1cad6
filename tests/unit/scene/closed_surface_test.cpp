#include "common/scene/closed_surface.h"

#include <gtest/gtest.h>

#include <vector>

namespace umbriel {
namespace {

TEST(ClosedSurface, IsOneWhoseEdgesAllHaveTwoSides) {
    std::vector<glm::vec3> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    std::vector<std::uint32_t> tetrahedron = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    EXPECT_TRUE(isClosedSurface(corners, tetrahedron));
    EXPECT_TRUE(isClosedSurface(corners, {}));
    EXPECT_FALSE(isClosedSurface(corners, std::span(tetrahedron).first(9)));
    // Vertices of their own for each triangle, as flat shading needs: places count, -0 is 0.
    std::vector<glm::vec3> apart;
    std::vector<std::uint32_t> order;
    for (const std::uint32_t index : tetrahedron) {
        order.push_back(static_cast<std::uint32_t>(apart.size()));
        apart.push_back(apart.size() % 2 ? corners[index] : corners[index] * glm::vec3(1, 1, 1));
        if (apart.back().x == 0.0f) apart.back().x = apart.size() % 2 ? 0.0f : -0.0f;
    }
    EXPECT_TRUE(isClosedSurface(apart, order));
    // One turned round; one twice; one beyond the vertices; one that is a line.
    std::vector<std::uint32_t> turned = tetrahedron;
    std::swap(turned[0], turned[1]);
    EXPECT_FALSE(isClosedSurface(corners, turned));
    std::vector<std::uint32_t> twice = tetrahedron;
    twice.insert(twice.end(), {0, 2, 1});
    EXPECT_FALSE(isClosedSurface(corners, twice));
    std::vector<std::uint32_t> beyond = tetrahedron;
    beyond.insert(beyond.end(), {0, 1, 77, 2, 2, 3});
    EXPECT_TRUE(isClosedSurface(corners, beyond));
}

}  // namespace
}  // namespace umbriel
