#include "client/app/window.h"

#include <dlfcn.h>
#include <epoxy/gl.h>
#include <fmt/format.h>
// GLFW must not bring its own GL declarations beside libepoxy's.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <utility>

namespace umbriel {
namespace {

std::string lastGlfwError() {
    const char* description = nullptr;
    glfwGetError(&description);
    return description ? description : "unknown reason";
}

// GLFW's process-wide state; windows live inside it.
class GlfwLibrary {
   public:
    static Result<std::unique_ptr<GlfwLibrary>> start() {
        // libepoxy ends the process when it finds neither; say it in words instead.
        void* gl = ::dlopen("libOpenGL.so.0", RTLD_LAZY);
        if (!gl) gl = ::dlopen("libGL.so.1", RTLD_LAZY);
        if (!gl) return failure("neither libOpenGL.so.0 nor libGL.so.1 is installed; install libopengl0");
        if (glfwInit() != GLFW_TRUE) return failure(fmt::format("no window can be opened: {}", lastGlfwError()));
        return std::unique_ptr<GlfwLibrary>(new GlfwLibrary);
    }
    ~GlfwLibrary() { glfwTerminate(); }
    GlfwLibrary(const GlfwLibrary&) = delete;
    GlfwLibrary& operator=(const GlfwLibrary&) = delete;

   private:
    GlfwLibrary() = default;
};

class GlfwDisplayWindow final : public DisplayWindow {
   public:
    GlfwDisplayWindow(std::unique_ptr<GlfwLibrary> library, GLFWwindow* window)
        : _library(std::move(library)), _window(window) {
        glfwSetWindowUserPointer(window, this);
        glfwSetFramebufferSizeCallback(window, [](GLFWwindow* w, int, int) { self(w)._input.resized = true; });
        glfwSetScrollCallback(window, [](GLFWwindow* w, double, double y) { self(w)._input.wheel += y; });
        glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) { self(w).pointerMoved(x, y); });
        glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int) {
            if (action == GLFW_RELEASE) return;
            WindowInput& input = self(w)._input;
            if (key == GLFW_KEY_UP) --input.panelField;
            if (key == GLFW_KEY_DOWN) ++input.panelField;
            if (key == GLFW_KEY_LEFT) --input.panelSteps;
            if (key == GLFW_KEY_RIGHT) ++input.panelSteps;
            if (key == GLFW_KEY_BACKSPACE) input.erased = true;
            if (action != GLFW_PRESS) return;
            if (key == GLFW_KEY_TAB) input.panelToggled = true;
            if (key == GLFW_KEY_ENTER || key == GLFW_KEY_KP_ENTER) input.entered = true;
            if (key == GLFW_KEY_ESCAPE) glfwSetWindowShouldClose(w, GLFW_TRUE);
            if (key == GLFW_KEY_SPACE) self(w)._input.animationToggled = true;
        });
        glfwSetCharCallback(window, [](GLFWwindow* w, unsigned code) {
            if (code < 128) self(w)._input.typed += static_cast<char>(code);
        });
        glfwGetCursorPos(window, &_pointerX, &_pointerY);
    }

    ~GlfwDisplayWindow() override {
        releaseTargets();
        glfwDestroyWindow(_window);
    }

    PixelSize size() const override {
        PixelSize size;
        glfwGetFramebufferSize(_window, &size.width, &size.height);
        return size;
    }

    WindowInput poll() override {
        glfwPollEvents();
        WindowInput input = std::exchange(_input, {});
        input.closed = glfwWindowShouldClose(_window) == GLFW_TRUE;
        return input;
    }

    void show(const FloatImage& rgba) override {
        const PixelSize window = size();
        if (window.width <= 0 || window.height <= 0 || rgba.width() <= 0 || rgba.height() <= 0) return;
        allocateTargets({rgba.width(), rgba.height()});
        glTextureSubImage2D(_linear, 0, 0, 0, rgba.width(), rgba.height(), GL_RGBA, GL_FLOAT, rgba.samples().data());
        // Encoding is the driver's: linear floats into an sRGB target, then its bytes as they are into the window. The
        // picture's first row is the top one, so it is turned over on the way.
        glEnable(GL_FRAMEBUFFER_SRGB);
        glBlitNamedFramebuffer(_linearBuffer, _encodedBuffer, 0, 0, rgba.width(), rgba.height(), 0, rgba.height(), rgba.width(), 0,
                               GL_COLOR_BUFFER_BIT, GL_NEAREST);
        glDisable(GL_FRAMEBUFFER_SRGB);
        glBlitNamedFramebuffer(_encodedBuffer, 0, 0, 0, rgba.width(), rgba.height(), 0, 0, window.width, window.height,
                               GL_COLOR_BUFFER_BIT, GL_NEAREST);
        glfwSwapBuffers(_window);
    }

    void setTitle(const std::string& title) override { glfwSetWindowTitle(_window, title.c_str()); }

   private:
    static GlfwDisplayWindow& self(GLFWwindow* window) {
        return *static_cast<GlfwDisplayWindow*>(glfwGetWindowUserPointer(window));
    }

    void pointerMoved(double x, double y) {
        const double dx = x - std::exchange(_pointerX, x);
        const double dy = std::exchange(_pointerY, y) - y;
        const bool left = glfwGetMouseButton(_window, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS;
        const bool right = glfwGetMouseButton(_window, GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS;
        const bool shift = glfwGetKey(_window, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS;
        if (right || (left && shift)) {
            _input.panX += dx;
            _input.panY += dy;
        } else if (left) {
            _input.orbitX += dx;
            _input.orbitY += dy;
        }
    }

    void allocateTargets(PixelSize size) {
        if (size == _targetSize) return;
        releaseTargets();
        _targetSize = size;
        const auto make = [&](GLenum format, GLuint& texture, GLuint& framebuffer) {
            glCreateTextures(GL_TEXTURE_2D, 1, &texture);
            glTextureStorage2D(texture, 1, format, size.width, size.height);
            glCreateFramebuffers(1, &framebuffer);
            glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, texture, 0);
        };
        make(GL_RGBA32F, _linear, _linearBuffer);
        make(GL_SRGB8_ALPHA8, _encoded, _encodedBuffer);
    }

    void releaseTargets() {
        const GLuint framebuffers[] = {std::exchange(_linearBuffer, 0), std::exchange(_encodedBuffer, 0)};
        const GLuint textures[] = {std::exchange(_linear, 0), std::exchange(_encoded, 0)};
        glDeleteFramebuffers(2, framebuffers);
        glDeleteTextures(2, textures);
        _targetSize = {};
    }

    std::unique_ptr<GlfwLibrary> _library;
    GLFWwindow* _window;
    WindowInput _input;
    double _pointerX = 0.0;
    double _pointerY = 0.0;
    PixelSize _targetSize;
    GLuint _linear = 0;
    GLuint _linearBuffer = 0;
    GLuint _encoded = 0;
    GLuint _encodedBuffer = 0;
};

Result<GLFWwindow*> createWindow(PixelSize size, const char* title, bool visible) {
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_VISIBLE, visible ? GLFW_TRUE : GLFW_FALSE);
    GLFWwindow* window = glfwCreateWindow(size.width, size.height, title, nullptr, nullptr);
    if (!window) return failure(fmt::format("no window with OpenGL 4.5 can be opened: {}", lastGlfwError()));
    glfwMakeContextCurrent(window);
    return window;
}

}  // namespace

Result<std::unique_ptr<DisplayWindow>> DisplayWindow::open(PixelSize size, const std::string& title) {
    auto library = GlfwLibrary::start();
    if (!library) return library.error();
    const auto window = createWindow(size, title.c_str(), true);
    if (!window) return window.error();
    glfwSwapInterval(1);
    return std::unique_ptr<DisplayWindow>(new GlfwDisplayWindow(std::move(*library), *window));
}

Result<std::string> probeWindows() {
    auto library = GlfwLibrary::start();
    if (!library) return library.error();
    const auto window = createWindow({64, 64}, "umbriel doctor", false);
    if (!window) return window.error();
    const auto text = [](GLenum name) { return reinterpret_cast<const char*>(glGetString(name)); };
    std::string found = fmt::format("GLFW {}; OpenGL {}; {}", glfwGetVersionString(), text(GL_VERSION), text(GL_RENDERER));
    glfwDestroyWindow(*window);
    return found;
}

}  // namespace umbriel
