#pragma once

#include <atomic>
#include <cstring>
#include <functional>

#include "server/draw/renderer.h"

namespace umbriel::test {

// Draws nothing: a tile's colour layer says which tile and frame it is, and how many containers the scene has.
class FakeRenderer final : public Renderer {
 public:
    std::function<void()> whileDrawing;  // on the drawing thread
    std::atomic<int> framesDrawn = 0;
    std::atomic<std::size_t> containers = 0;
    std::string failWith;

    void sceneChanged(const ChangeList&, const Aspect& scene) override { containers = scene.containerCount(); }

    Result<DrawStatistics> draw(const Aspect&, const WallViews&, std::span<const TileAssignment> tiles, double time) override {
        if (whileDrawing) whileDrawing();
        if (!failWith.empty()) return failure(failWith);
        _tiles.assign(tiles.begin(), tiles.end());
        _time = time;
        ++framesDrawn;
        DrawStatistics statistics;
        statistics.drawMilliseconds = 1.25;
        statistics.triangles = 1000 + tiles.size();
        return statistics;
    }

    Result<std::vector<TilePixels>> readTiles() override {
        std::vector<TilePixels> result;
        for (const TileAssignment& tile : _tiles) {
            TilePixels pixels;
            pixels.tile = tile;
            TileLayer layer;
            layer.name = "colour";
            const auto count = static_cast<std::size_t>(tile.pixels.area()) * 4;
            layer.pixels.resize(count * 4);
            for (std::size_t i = 0; i < count; ++i) {
                const float values[4] = {static_cast<float>(tile.tile), static_cast<float>(_time),
                                         static_cast<float>(containers.load()), static_cast<float>(i)};
                std::memcpy(layer.pixels.data() + i * 4, &values[i % 4], 4);
            }
            pixels.layers.push_back(std::move(layer));
            result.push_back(std::move(pixels));
        }
        return result;
    }

    std::string explain() const override { return "a fake plan"; }

 private:
    std::vector<TileAssignment> _tiles;
    double _time = 0.0;
};

}  // namespace umbriel::test
