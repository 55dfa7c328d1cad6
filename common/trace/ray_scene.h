#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/trace/direction_packets.h"
#include "common/trace/triangles.h"

namespace umbriel::trace {

// How a ray that leaves the surface is kept from hitting what it left.
enum class Guard : std::uint8_t {
    // The limit of visibility from P + delta n, delta -> 0+, decided in double: own triangles are skipped by identity
    // and
    // the fan they form is tested analytically (fan.h). The same on every instruction set.
    Exact = 0,
    // The ray leaves from P + 1e-6 of the diagonal along n, all in single precision.
    Fast = 1,
    // Fast, and the fan on top: saves its rays and removes the errors near P.
    FastFan = 2,
};

// Rays against triangles through Embree, in packets of eight. Immutable after create(); rays may be traced from any
// thread, and what they find does not depend on the number of threads.
//
// Exact works on triangles enlarged by 2e-5 of the diagonal, which no rounding in Embree can miss (measured: the share
// of rays nearly parallel to a triangle that could still slip by is below 1e-9). A hit well inside is accepted in
// single precision, any other is decided by hitDistance() in double.
class RayScene {
 public:
    // Triangles are copied. threads: for building the tree; 0 takes all. instructionSet: the widest that Embree may use
    // ("sse2", "sse4.2", "avx", "avx2"); AVX-512 brings nothing to packets of eight (measured: 3 %), and one bake class
    // for old and new machines is worth more. Failure when Embree cannot allocate.
    static Result<std::unique_ptr<RayScene>> create(const Triangles& triangles, Guard guard, int threads,
                                                    std::string_view instructionSet = "avx2");
    ~RayScene();
    RayScene(const RayScene&) = delete;
    RayScene& operator=(const RayScene&) = delete;

    Guard guard() const;
    // Of the box, in units of the positions.
    double diagonal() const;
    // "Embree 3.13.5 avx2": what the last bits of Fast depend on.
    std::string description() const;

    // Scratch memory and the fan, one for each thread.
    class Tracer {
     public:
        explicit Tracer(const RayScene& scene);
        ~Tracer();
        Tracer(const Tracer&) = delete;
        Tracer& operator=(const Tracer&) = delete;

        // Bit i of blocked[k]: a triangle meets lane 8 k + i of the directions within farDistance (positions' units,
        // infinity for all; own triangles block at any distance). `own`: the triangles that have the origin as a
        // corner. Lanes without a pixel read as 0.
        void blocked(const Origin& origin, std::span<const std::uint32_t> own, const DirectionPackets& directions,
                     double farDistance, std::span<std::uint8_t> blocked);
        // Distance to the nearest hit of each lane, in positions' units: 0 where the fan blocks, infinity where nothing
        // does.
        void distances(const Origin& origin, std::span<const std::uint32_t> own, const DirectionPackets& directions,
                       double farDistance, std::span<float> distances);

     private:
        struct State;
        std::unique_ptr<State> _state;
    };

 private:
    struct Scene;
    explicit RayScene(std::unique_ptr<Scene> scene);
    std::unique_ptr<Scene> _scene;
};

}  // namespace umbriel::trace
