#include "common/scene/aspect.h"

#include <gtest/gtest.h>

#include "common/scene/core_types.h"
#include "common/scene/digest.h"
#include "common/scene/nodes.h"
#include "common/scene/print.h"

namespace umbriel {
namespace {

struct AspectTest : testing::Test {
    AspectTest() { registerCoreTypes(types); }
    TypeRegistry types;
    IdSource ids;
};

TEST_F(AspectTest, aSecondAspectFollowsByChangeLists) {
    Aspect application(types, ids);
    Aspect drawing(types, ids);
    StateDigest applicationDigest;
    StateDigest drawingDigest;
    const auto follow = [&] {
        const ChangeList changes = application.commit();
        drawing.apply(changes, application);
        applicationDigest.update(changes, application);
        drawingDigest.update(changes, drawing);
        EXPECT_TRUE(drawing.equals(application));
        EXPECT_EQ(drawingDigest.total(), applicationDigest.total());
        return changes.entryCount();
    };
    const auto node = application.create<Node>("root");
    const auto transform = application.create<Transform>();
    application.edit(node).set<&Node::core>(Ref<Container>(transform));
    application.edit(transform).set<&Transform::translation>({1.0, 2.0, 3.0});
    const auto geometry = application.create<Geometry>();
    application.edit(geometry).assign<&Geometry::positions>({glm::vec3(1), glm::vec3(2)});
    follow();
    EXPECT_EQ(describe(drawing.get(transform)), "Transform #2 {translation: (1, 2, 3)}");
    application.edit(geometry).append<&Geometry::positions>(glm::vec3(3)).resize<&Geometry::indices>(7);
    EXPECT_EQ(follow(), 1u);
    application.edit(geometry).resize<&Geometry::positions>(1);
    EXPECT_EQ(follow(), 1u);
    application.destroy(geometry);
    EXPECT_EQ(follow(), 1u);
    EXPECT_EQ(follow(), 0u);
}

}  // namespace
}  // namespace umbriel
