#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/scene/aspect.h"
#include "common/scene/windows.h"

namespace umbriel {

// The viewer's panel: every shadow field of the window's viewports that can be written as text, as lines over the
// picture. The chosen one is stepped, or set to what was typed; the same fields as --shadow-set, by the same text.
class ShadowPanel {
 public:
    // The fields of `viewport` are shown; changes go to all viewports of the window.
    ShadowPanel(Aspect& scene, Ref<Window> window, Ref<Viewport> viewport);

    void toggle();
    bool isOpen() const { return _isOpen; }
    // Chooses a field further down (up: negative); the first follows the last.
    void choose(int fields);
    // Steps the chosen field: truth values turn, enums and modes go to the next that this version has, whole numbers
    // count (texels double), others grow and shrink by a quarter, from 0 on by a hundredth.
    void step(int steps);
    // Typed characters wait until they are set as the chosen field's value; erase() takes the last one back.
    void type(std::string_view characters);
    void erase();
    void set();
    // The last change cannot be drawn: takes it back and says why.
    void refuse(const std::string& why);

    std::string_view field() const { return _fields[_chosen]; }
    const std::string& message() const { return _message; }
    // Brings the lines up to date; before each frame.
    void show();

 private:
    void change(std::string_view value);

    Aspect& _scene;
    Ref<Window> _window;
    Ref<Viewport> _viewport;
    std::vector<std::string> _fields;
    std::vector<Ref<TextForeground>> _lines;
    std::size_t _chosen = 0;
    bool _isOpen = false;
    std::string _typed;
    std::string _message;
    std::string _lastField;  // of the last change, and what it was before; empty: none
    std::string _lastValue;
};

}  // namespace umbriel
