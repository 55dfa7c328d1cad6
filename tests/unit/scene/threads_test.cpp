#include <gtest/gtest.h>

#include <barrier>
#include <thread>

#include "common/scene/aspect.h"
#include "common/scene/core_types.h"
#include "common/scene/digest.h"
#include "common/scene/nodes.h"

namespace umbriel {
namespace {

// One thread edits, one draws, a loader works on an aspect of its own and is merged when done. They meet at barriers
// only: between two of them nobody reads while another thread writes the same aspect, and chunks are shared all the
// time. What this shows, it shows under the thread sanitizer; elsewhere, that everybody sees what they should.
TEST(Threads, editDrawAndLoadWithoutLocks) {
    constexpr int kFrames = 200;
    constexpr int kLoadedAt = 100;
    constexpr std::size_t kVertices = 20'000;
    TypeRegistry types;
    registerCoreTypes(types);
    IdSource ids;
    Aspect application(types, ids);
    Aspect drawing(types, ids);
    Aspect loading(types, ids);
    const auto geometry = application.create<Geometry>();
    application.edit(geometry).assign<&Geometry::positions>(std::vector<glm::vec3>(kVertices));
    drawing.apply(application.commit(), application);
    loading.apply(application.snapshot(), application);

    std::barrier frameStart(3);
    std::barrier frameEnd(3);
    ChangeList loaded;
    std::vector<float> drawn;
    // Each keeps digests of its own: of what is shared, whoever comes first keeps the hashes.
    StateDigest applicationDigest;
    StateDigest drawingDigest;
    StateDigest loadingDigest;
    applicationDigest.update(application.snapshot(), application);
    const ChangeList first = drawing.snapshot();

    std::thread drawer([&] {
        drawingDigest.update(first, drawing);
        for (int frame = 0; frame < kFrames; ++frame) {
            frameStart.arrive_and_wait();
            const auto& positions = drawing.get(geometry).positions;
            float sum = 0.0f;
            for (std::size_t i = 0; i < positions.size(); i += 97) sum += positions[i].x;
            // A drawing aspect may keep notes of its own in what it shares: a copy on write on this thread.
            drawing.edit(geometry).setElement<&Geometry::positions>(1, glm::vec3(float(frame)));
            drawingDigest.update(drawing.commit(), drawing);
            drawn.push_back(sum);
            frameEnd.arrive_and_wait();
        }
    });
    std::thread loader([&] {
        loadingDigest.update(loading.snapshot(), loading);
        for (int frame = 0; frame < kFrames; ++frame) {
            frameStart.arrive_and_wait();
            if (frame < kLoadedAt) {
                const auto node = loading.create<Node>("loaded");
                loading.edit(geometry).append<&Geometry::texCoords0>(glm::vec2(float(frame)));
                loading.edit(node).set<&Node::core>(geometry);
                if (frame == kLoadedAt - 1) loaded = loading.commit();
            }
            frameEnd.arrive_and_wait();
        }
    });
    for (int frame = 0; frame < kFrames; ++frame) {
        frameStart.arrive_and_wait();
        {
            auto edit = application.edit(geometry);
            for (std::size_t i = 0; i < kVertices; i += 97)
                edit.setElement<&Geometry::positions>(i, glm::vec3(float(frame + 1)));
        }
        frameEnd.arrive_and_wait();
        // From here until everybody is at the next start, this thread alone runs.
        if (frame == kLoadedAt - 1) application.merge(loaded, loading);
        const ChangeList changes = application.commit();
        drawing.apply(changes, application);
        applicationDigest.update(changes, application);
        drawingDigest.update(changes, drawing);
    }
    drawer.join();
    loader.join();
    for (int frame = 0; frame < kFrames; ++frame)
        ASSERT_EQ(drawn[static_cast<std::size_t>(frame)], float(frame) * (kVertices / 97 + 1)) << "frame " << frame;
    EXPECT_TRUE(drawing.equals(application));
    EXPECT_EQ(drawingDigest.total(), applicationDigest.total());
    EXPECT_EQ(drawing.containerCount(), 1u + kLoadedAt);
    EXPECT_EQ(drawing.get(geometry).texCoords0.size(), std::size_t{kLoadedAt});
}

}  // namespace
}  // namespace umbriel
