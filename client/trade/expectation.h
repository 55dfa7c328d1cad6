#pragma once

#include <string>

namespace umbriel {

// What an experiment is expected to show, and whether it does.
struct Expectation {
    enum class State { Met, NotMet, Open };
    std::string text;
    State state = State::Open;
    std::string figures;  // "2.3 % against 3.1 %"; of an open one what it waits for
    std::string why;      // what the figures come from; may be empty
};
// "met", "NOT MET", "open".
const char* nameOf(Expectation::State state);

}  // namespace umbriel
