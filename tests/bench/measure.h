#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace umbriel::bench {

inline double median(std::vector<double> values) {
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

inline double secondsNow() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

template <class Function>
double secondsOf(Function&& function) {
    const double start = secondsNow();
    function();
    return secondsNow() - start;
}

// Interleaved repetitions: every round runs each of the functions once, so that a machine that is busy elsewhere slows
// them all. What each returned (seconds), round by round.
class Rounds {
 public:
    explicit Rounds(std::vector<std::vector<double>> seconds) : _seconds(std::move(seconds)) {}
    std::size_t size() const { return _seconds.size(); }
    // Of one function.
    double operator[](std::size_t function) const { return median(_seconds[function]); }
    // The median of what was found within one round.
    double ratio(std::vector<std::size_t> numerators, std::size_t denominator) const {
        std::vector<double> ratios;
        for (std::size_t round = 0; round < _seconds[denominator].size(); ++round) {
            double sum = 0.0;
            for (const std::size_t numerator : numerators) sum += _seconds[numerator][round];
            ratios.push_back(sum / _seconds[denominator][round]);
        }
        return median(std::move(ratios));
    }

 private:
    std::vector<std::vector<double>> _seconds;
};

template <class... Functions>
Rounds interleaved(int rounds, Functions&&... functions) {
    std::vector<std::vector<double>> seconds(sizeof...(functions));
    for (int round = 0; round < rounds; ++round) {
        std::size_t i = 0;
        (seconds[i++].push_back(functions()), ...);
    }
    return Rounds(std::move(seconds));
}

// One figure: a line for people, or an object of a JSON array's line. bound 0: none is set.
class Report {
 public:
    explicit Report(bool json) : _json(json) {}
    void figure(const std::string& name, double value, const std::string& unit, double bound = 0.0) const {
        if (_json) {
            fmt::print("{{\"name\": \"{}\", \"value\": {:.6g}, \"unit\": \"{}\", \"bound\": {:.6g}}}\n", name, value,
                       unit, bound);
        } else if (bound > 0.0) {
            fmt::print("{:<58} {:>10.4g} {:<6} {} {:.4g}\n", name, value, unit, value <= bound ? "within" : "BEYOND",
                       bound);
        } else {
            fmt::print("{:<58} {:>10.4g} {}\n", name, value, unit);
        }
        std::fflush(stdout);
    }
    void skipped(const std::string& name, const std::string& reason) const {
        if (_json)
            fmt::print("{{\"name\": \"{}\", \"skipped\": \"{}\"}}\n", name, reason);
        else
            fmt::print("{:<58} SKIPPED: {}\n", name, reason);
        std::fflush(stdout);
    }

 private:
    bool _json;
};

// What a benchmark cannot do without.
template <class T>
T need(Result<T> result) {
    if (result) return std::move(*result);
    std::fprintf(stderr, "bench: %s\n", result.error().message.c_str());
    std::exit(1);
}

inline bool hasFlag(int argc, char** argv, const std::string& flag) {
    return std::any_of(argv + 1, argv + argc, [&](const char* argument) { return argument == flag; });
}
inline std::string option(int argc, char** argv, const std::string& name, const std::string& otherwise) {
    for (int i = 1; i + 1 < argc; ++i)
        if (argv[i] == name) return argv[i + 1];
    return otherwise;
}

}  // namespace umbriel::bench
