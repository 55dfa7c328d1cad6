#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/image/image.h"
#include "common/math/pixel_rect.h"

namespace umbriel {

// What the user did since the last poll.
struct WindowInput {
    bool closed = false;
    bool resized = false;
    bool animationToggled = false;
    bool panelToggled = false;
    int panelField = 0;  // fields further down
    int panelSteps = 0;  // of its value
    std::string typed;   // characters, after which came:
    bool erased = false;
    bool entered = false;
    double orbitX = 0.0;  // pixels the pointer moved while orbiting, right and up
    double orbitY = 0.0;
    double panX = 0.0;    // and while panning
    double panY = 0.0;
    double wheel = 0.0;   // notches, away from the user is positive
};

// One window of the desktop that shows pictures. Lives on the main thread.
class DisplayWindow {
   public:
    // Errors: no display, no OpenGL 4.5.
    static Result<std::unique_ptr<DisplayWindow>> open(PixelSize size, const std::string& title);
    virtual ~DisplayWindow() = default;

    virtual PixelSize size() const = 0;  // in pixels; 0x0 while minimised
    virtual WindowInput poll() = 0;
    // Shows a linear picture, clamped and sRGB encoded; its size need not be the window's (while resizing).
    virtual void show(const FloatImage& rgba) = 0;
    virtual void setTitle(const std::string& title) = 0;
};

// "GLFW 3.3.8 X11 ..., OpenGL ..." when a window can be opened here.
Result<std::string> probeWindows();

}  // namespace umbriel
