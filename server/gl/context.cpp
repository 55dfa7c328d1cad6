#include "server/gl/context.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <cstdlib>
#include <string_view>
#include <utility>

#include "common/base/log.h"

namespace umbriel::gl {
namespace {

// Extension strings decide, never pointers: eglGetProcAddress of Mesa returns non-null for functions that do not exist.
bool hasExtension(const char* extensions, std::string_view name) {
    if (!extensions) return false;
    std::string_view rest(extensions);
    while (!rest.empty()) {
        const size_t end = rest.find(' ');
        if (rest.substr(0, end) == name) return true;
        if (end == std::string_view::npos) break;
        rest.remove_prefix(end + 1);
    }
    return false;
}

const char* eglErrorName(EGLint error) {
    switch (error) {
        case EGL_NOT_INITIALIZED:
            return "EGL_NOT_INITIALIZED";
        case EGL_BAD_ACCESS:
            return "EGL_BAD_ACCESS";
        case EGL_BAD_ALLOC:
            return "EGL_BAD_ALLOC";
        case EGL_BAD_ATTRIBUTE:
            return "EGL_BAD_ATTRIBUTE";
        case EGL_BAD_CONFIG:
            return "EGL_BAD_CONFIG";
        case EGL_BAD_CONTEXT:
            return "EGL_BAD_CONTEXT";
        case EGL_BAD_DISPLAY:
            return "EGL_BAD_DISPLAY";
        case EGL_BAD_MATCH:
            return "EGL_BAD_MATCH";
        case EGL_BAD_PARAMETER:
            return "EGL_BAD_PARAMETER";
        case EGL_CONTEXT_LOST:
            return "EGL_CONTEXT_LOST";
        default:
            return "an unknown EGL error";
    }
}

std::string lastEglError() {
    const EGLint error = eglGetError();
    return fmt::format("{} (0x{:x})", eglErrorName(error), error);
}

template <class Function>
Function eglFunction(const char* name) {
    return reinterpret_cast<Function>(eglGetProcAddress(name));
}

bool canLoad(const char* library) {
    void* handle = dlopen(library, RTLD_LAZY | RTLD_LOCAL);
    if (handle) dlclose(handle);
    return handle != nullptr;
}

// libepoxy ends the process when it does not find them, so we look first.
Result<void> requireLibraries() {
    if (!canLoad("libEGL.so.1")) return failure("EGL: libEGL.so.1 is not installed; install the package libegl1");
    if (!canLoad("libOpenGL.so.0") && !canLoad("libGL.so.1"))
        return failure("OpenGL: neither libOpenGL.so.0 nor libGL.so.1 is installed; install the package libopengl0");
    return {};
}

std::vector<EGLDeviceEXT> devices() {
    if (!canLoad("libEGL.so.1")) return {};
    const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (!hasExtension(extensions, "EGL_EXT_device_enumeration") && !hasExtension(extensions, "EGL_EXT_device_base"))
        return {};
    const auto query = eglFunction<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
    EGLint count = 0;
    if (!query || !query(0, nullptr, &count) || count <= 0) return {};
    std::vector<EGLDeviceEXT> list(static_cast<size_t>(count));
    if (!query(count, list.data(), &count)) return {};
    list.resize(static_cast<size_t>(count));
    return list;
}

const char* deviceString(EGLDeviceEXT device, EGLint name) {
    const auto query = eglFunction<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT");
    return query ? query(device, name) : nullptr;
}

bool isSoftwareDevice(EGLDeviceEXT device) {
    return hasExtension(deviceString(device, EGL_EXTENSIONS), "EGL_MESA_device_software");
}

EGLDisplay platformDisplay(EGLenum platform, void* native) {
    const auto get = eglFunction<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
    return get ? get(platform, native, nullptr) : EGL_NO_DISPLAY;
}

Result<EGLDisplay> surfacelessDisplay() {
    if (!hasExtension(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS), "EGL_MESA_platform_surfaceless"))
        return failure(
            "EGL: no driver here draws without a window system (EGL_MESA_platform_surfaceless); install libegl-mesa0 "
            "or "
            "the GPU's driver");
    const EGLDisplay display = platformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY);
    if (display == EGL_NO_DISPLAY) return failure("EGL: no surfaceless display: " + lastEglError());
    return display;
}

Result<EGLDisplay> deviceDisplay(int index) {
    const std::vector<EGLDeviceEXT> list = devices();
    if (index < 0 || static_cast<size_t>(index) >= list.size())
        return badInput(fmt::format("EGL: there is no device {}; this machine has {} (`umbriel doctor` lists them)",
                                    index, list.size()));
    const EGLDisplay display = platformDisplay(EGL_PLATFORM_DEVICE_EXT, list[static_cast<size_t>(index)]);
    if (display == EGL_NO_DISPLAY)
        return failure(fmt::format("EGL: no display on device {}: {}", index, lastEglError()));
    return display;
}

bool rendersInSoftware(std::string_view renderer) {
    for (const char* name : {"llvmpipe", "softpipe", "SwiftShader", "swrast", "Software Rasterizer"})
        if (renderer.find(name) != std::string_view::npos) return true;
    return false;
}

std::string glString(GLenum name) {
    const GLubyte* text = glGetString(name);
    return text ? reinterpret_cast<const char*>(text) : "";
}

int glInteger(GLenum name) {
    GLint value = 0;
    glGetIntegerv(name, &value);
    return value;
}

ContextInfo queryInfo(const std::string& platform) {
    ContextInfo info;
    info.renderer = glString(GL_RENDERER);
    info.vendor = glString(GL_VENDOR);
    info.version = glString(GL_VERSION);
    info.shadingLanguageVersion = glString(GL_SHADING_LANGUAGE_VERSION);
    info.platform = platform;
    info.isSoftware = rendersInSoftware(info.renderer);
    GLint viewport[2] = {0, 0};
    glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport);
    info.limits = {.maxTextureSize = glInteger(GL_MAX_TEXTURE_SIZE),
                   .maxArrayLayers = glInteger(GL_MAX_ARRAY_TEXTURE_LAYERS),
                   .maxViewportWidth = viewport[0],
                   .maxViewportHeight = viewport[1],
                   .maxSamples = glInteger(GL_MAX_SAMPLES),
                   .maxColourAttachments = glInteger(GL_MAX_COLOR_ATTACHMENTS),
                   .maxTextureUnits = glInteger(GL_MAX_TEXTURE_IMAGE_UNITS),
                   .maxUniformBlockBytes = glInteger(GL_MAX_UNIFORM_BLOCK_SIZE),
                   .maxStorageBlockBytes = glInteger(GL_MAX_SHADER_STORAGE_BLOCK_SIZE)};
    return info;
}

void onDebugMessage(GLenum, GLenum type, GLuint id, GLenum severity, GLsizei length, const GLchar* message,
                    const void*) {
    if (type != GL_DEBUG_TYPE_ERROR && severity != GL_DEBUG_SEVERITY_HIGH) return;
    const std::string_view text =
        length < 0 ? std::string_view(message) : std::string_view(message, static_cast<size_t>(length));
    log::error(fmt::format("OpenGL {}: {}", id, text));
}

}  // namespace

HeadlessContext::HeadlessContext(void* display, void* context, void* surface)
    : _display(display), _context(context), _surface(surface) {}

HeadlessContext::HeadlessContext(HeadlessContext&& other) noexcept
    : _display(std::exchange(other._display, nullptr)),
      _context(std::exchange(other._context, nullptr)),
      _surface(std::exchange(other._surface, nullptr)),
      _info(std::move(other._info)) {}

HeadlessContext& HeadlessContext::operator=(HeadlessContext&& other) noexcept {
    if (this != &other) {
        destroy();
        _display = std::exchange(other._display, nullptr);
        _context = std::exchange(other._context, nullptr);
        _surface = std::exchange(other._surface, nullptr);
        _info = std::move(other._info);
    }
    return *this;
}

HeadlessContext::~HeadlessContext() {
    destroy();
}

void HeadlessContext::destroy() {
    if (!_context) return;
    if (isCurrent()) releaseCurrent();
    eglDestroyContext(_display, _context);
    if (_surface) eglDestroySurface(_display, _surface);
    // No eglTerminate: the display is one per process and platform, and another context may live on it.
    _context = nullptr;
}

bool HeadlessContext::isCurrent() const {
    return _context && eglGetCurrentContext() == _context;
}

Result<void> HeadlessContext::makeCurrent() {
    const EGLSurface surface = _surface ? _surface : EGL_NO_SURFACE;
    if (!eglMakeCurrent(_display, surface, surface, _context))
        return failure("EGL: the context cannot be made current on this thread: " + lastEglError());
    return {};
}

void HeadlessContext::releaseCurrent() {
    eglMakeCurrent(_display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

Result<HeadlessContext> HeadlessContext::createOn(void* display, const std::string& platform, bool debug) {
    EGLint major = 0;
    EGLint minor = 0;
    if (!eglInitialize(display, &major, &minor))
        return failure(fmt::format("EGL: {} cannot be initialised: {}; install libgl1-mesa-dri or the GPU's driver",
                                   platform, lastEglError()));
    const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
    if (!eglBindAPI(EGL_OPENGL_API))
        return failure(
            fmt::format("EGL: {} offers no desktop OpenGL; install libgl1-mesa-dri or the GPU's driver", platform));

    // Without EGL_PBUFFER_BIT the default asks for window surfaces, which no headless configuration has.
    const EGLint configAttributes[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                       EGL_NONE};
    EGLConfig config = nullptr;
    EGLint configCount = 0;
    if (!eglChooseConfig(display, configAttributes, &config, 1, &configCount) || configCount < 1)
        return failure(fmt::format("EGL: {} has no configuration for desktop OpenGL", platform));

    const EGLint contextAttributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                        4,
                                        EGL_CONTEXT_MINOR_VERSION,
                                        5,
                                        EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                        EGL_CONTEXT_OPENGL_DEBUG,
                                        debug ? EGL_TRUE : EGL_FALSE,
                                        EGL_NONE};
    const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, contextAttributes);
    if (context == EGL_NO_CONTEXT)
        return failure(fmt::format("EGL: {} refuses an OpenGL 4.5 core context: {}", platform, lastEglError()));

    EGLSurface surface = EGL_NO_SURFACE;
    if (!hasExtension(extensions, "EGL_KHR_surfaceless_context")) {
        const EGLint surfaceAttributes[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
        surface = eglCreatePbufferSurface(display, config, surfaceAttributes);
        if (surface == EGL_NO_SURFACE) {
            const std::string reason = lastEglError();
            eglDestroyContext(display, context);
            return failure(fmt::format("EGL: {} gives no pbuffer: {}", platform, reason));
        }
    }
    HeadlessContext result(display, context, surface);
    if (auto current = result.makeCurrent(); !current) return current.error();
    // A broken installation lets all of the above pass and then knows nothing.
    if (!glGetString(GL_VERSION))
        return failure(fmt::format(
            "OpenGL: {} made a context that answers nothing; the driver is not installed completely", platform));
    result._info = queryInfo(platform);
    if (debug) {
        glEnable(GL_DEBUG_OUTPUT);
        glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
        glDebugMessageCallback(onDebugMessage, nullptr);
    }
    return result;
}

Result<HeadlessContext> HeadlessContext::create(const ContextOptions& options) {
    if (auto libraries = requireLibraries(); !libraries) return libraries.error();

    const auto onDevice = [&](int index) -> Result<HeadlessContext> {
        auto display = deviceDisplay(index);
        if (!display) return display.error();
        return createOn(*display, fmt::format("device {}", index), options.debug);
    };
    if (options.deviceIndex) return onDevice(*options.deviceIndex);
    if (options.platform == ContextOptions::Platform::Device) return onDevice(0);

    const auto onSurfaceless = [&]() -> Result<HeadlessContext> {
        auto display = surfacelessDisplay();
        if (!display) return display.error();
        return createOn(*display, "surfaceless", options.debug);
    };
    auto surfaceless = onSurfaceless();
    if (options.platform == ContextOptions::Platform::Surfaceless) return surfaceless;
    if (surfaceless && !surfaceless->info().isSoftware) return surfaceless;

    // With several vendors installed, Mesa may take the surfaceless platform and draw in software beside an idle GPU.
    const std::vector<EGLDeviceEXT> list = devices();
    const bool softwareAllowed = !surfaceless;
    const bool softwareWanted = std::getenv("LIBGL_ALWAYS_SOFTWARE") != nullptr && surfaceless;
    if (!softwareWanted)
        for (size_t i = 0; i < list.size(); ++i) {
            if (isSoftwareDevice(list[i]) && !softwareAllowed) continue;
            auto device = onDevice(static_cast<int>(i));
            if (device && (softwareAllowed || !device->info().isSoftware)) return device;
        }
    // A failed or refused attempt above may have left the thread without a current context.
    if (surfaceless)
        if (auto current = surfaceless->makeCurrent(); !current) return current.error();
    return surfaceless;
}

std::vector<std::string> listDevices() {
    std::vector<std::string> names;
    for (const EGLDeviceEXT device : devices()) {
        const char* file = nullptr;
        if (hasExtension(deviceString(device, EGL_EXTENSIONS), "EGL_EXT_device_drm"))
            file = deviceString(device, EGL_DRM_DEVICE_FILE_EXT);
        if (isSoftwareDevice(device))
            names.push_back("software");
        else
            names.push_back(file ? file : "GPU");
    }
    return names;
}

std::vector<std::string> report(const ContextInfo& info) {
    const ContextLimits& limits = info.limits;
    return {fmt::format("OpenGL {}", info.version),
            fmt::format("renderer {}{}", info.renderer, info.isSoftware ? " (software)" : ""),
            fmt::format("vendor {}", info.vendor),
            fmt::format("GLSL {}", info.shadingLanguageVersion),
            fmt::format("EGL platform {}", info.platform),
            fmt::format("largest texture {}, viewport {}x{}, samples {}", limits.maxTextureSize,
                        limits.maxViewportWidth, limits.maxViewportHeight, limits.maxSamples)};
}

}  // namespace umbriel::gl
