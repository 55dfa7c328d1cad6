#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace umbriel::gl {

// What the driver allows; pixels, texels or counts.
struct ContextLimits {
    int maxTextureSize = 0;
    int maxArrayLayers = 0;
    int maxViewportWidth = 0;
    int maxViewportHeight = 0;
    int maxSamples = 0;
    int maxColourAttachments = 0;
    int maxTextureUnits = 0;  // per fragment shader
    int maxUniformBlockBytes = 0;
    int maxStorageBlockBytes = 0;
};

// Who draws. The strings are the driver's own.
struct ContextInfo {
    std::string renderer;
    std::string vendor;
    std::string version;
    std::string shadingLanguageVersion;
    std::string platform;  // how EGL was opened: "surfaceless" or "device 0"
    bool isSoftware = false;
    ContextLimits limits;
};

// One line per fact, for `umbriel doctor` and the server's hello.
std::vector<std::string> report(const ContextInfo& info);

// Which OpenGL a headless context draws with.
struct ContextOptions {
    enum class Platform {
        Auto,         // surfaceless; when that draws in software although a GPU is there, the first GPU
        Surfaceless,  // EGL_MESA_platform_surfaceless
        Device        // EGL_EXT_platform_device
    };

    Platform platform = Platform::Auto;
    // Index into the EGL device list (`umbriel doctor` prints it). Implies Platform::Device.
    std::optional<int> deviceIndex = {};
    // Driver errors go to the log as they happen (KHR_debug). Costs speed on some drivers.
    bool debug = false;
};

// An OpenGL 4.5 core context without a window system.
//
// Lives on one thread: where it was created or last made current. It must outlive every GL object made in it. Several
// contexts may exist in one process, one current per thread.
class HeadlessContext {
 public:
    // Opens EGL, creates the context and makes it current on this thread. Errors: no EGL, no such device, a driver
    // without OpenGL 4.5, libOpenGL missing (libepoxy would end the process at the first GL call otherwise).
    static Result<HeadlessContext> create(const ContextOptions& options = {});

    HeadlessContext(HeadlessContext&& other) noexcept;
    HeadlessContext& operator=(HeadlessContext&& other) noexcept;
    HeadlessContext(const HeadlessContext&) = delete;
    HeadlessContext& operator=(const HeadlessContext&) = delete;
    ~HeadlessContext();

    // Binds the context to the calling thread; no other thread may have it current. Errors: the driver refuses.
    Result<void> makeCurrent();
    // Unbinds it, so that another thread can take it over.
    void releaseCurrent();
    bool isCurrent() const;

    const ContextInfo& info() const { return _info; }

 private:
    HeadlessContext(void* display, void* context, void* surface);
    static Result<HeadlessContext> createOn(void* display, const std::string& platform, bool debug);
    void destroy();

    void* _display = nullptr;  // EGLDisplay
    void* _context = nullptr;  // EGLContext
    void* _surface = nullptr;  // EGLSurface; only where the driver cannot do without one
    ContextInfo _info;
};

// The names of the EGL devices, in the order of ContextOptions::deviceIndex. Empty when EGL cannot list them.
std::vector<std::string> listDevices();

}  // namespace umbriel::gl
