#include "gl/egl_context.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <functional>
#include <string_view>
#include <vector>

#include "hpsdf/error.h"

namespace hpsdf::render {
namespace {

/// An EGL display to try, with its name.
struct Candidate {
  std::string name;  ///< name of the device for messages
  std::function<EGLDisplay()> display;
};

/// Returns true if `list` contains the extension `name`. `list` is null, or names separated by spaces.
bool hasExtension(const char* list, const std::string& name) {
  return (" " + std::string(list == nullptr ? "" : list) + " ").find(" " + name + " ") != std::string::npos;
}

std::string eglErrorText() {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "EGL error 0x%04x", static_cast<unsigned>(eglGetError()));
  return buffer;
}

bool isSoftware(std::string_view renderer) {
  for (const std::string_view name : {"llvmpipe", "softpipe", "swrast", "Software Rasterizer"})
    if (renderer.find(name) != std::string_view::npos) return true;
  return false;
}

/// Returns a message that names the missing OpenGL library, or an empty text if none is missing. libepoxy ends the
/// program if it does not find a library.
std::string missingLibraries() {
  const auto opens = [](const char* name) {
    void* library = dlopen(name, RTLD_LAZY | RTLD_LOCAL);
    if (library != nullptr) dlclose(library);
    return library != nullptr;
  };
  if (!opens("libEGL.so.1")) return "libEGL.so.1 is not installed";
  if (!opens("libOpenGL.so.0") && !opens("libGL.so.1")) return "neither libOpenGL.so.0 nor libGL.so.1 is installed";
  return {};
}

/// Adds the software devices or the hardware devices to `candidates`. If it finds none, it adds the reason to
/// `tried`.
void addDevices(const char* clientExtensions, bool software, std::vector<Candidate>& candidates, std::string& tried) {
  const char* kind = software ? "software" : "hardware";
  const bool enumerates = hasExtension(clientExtensions, "EGL_EXT_device_base") ||
                          (hasExtension(clientExtensions, "EGL_EXT_device_enumeration") &&
                           hasExtension(clientExtensions, "EGL_EXT_device_query"));
  if (!enumerates || !hasExtension(clientExtensions, "EGL_EXT_platform_base") ||
      !hasExtension(clientExtensions, "EGL_EXT_platform_device")) {
    tried += std::string("; ") + kind + " devices: EGL cannot list devices";
    return;
  }
  std::array<EGLDeviceEXT, 64> devices;
  EGLint count = 0;
  if (!eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count)) count = 0;
  int found = 0;
  for (EGLint i = 0; i < count; ++i) {
    EGLDeviceEXT device = devices[i];
    const char* extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
    if (hasExtension(extensions, "EGL_MESA_device_software") != software) continue;
    ++found;
    candidates.push_back({std::string(kind) + " device " + std::to_string(i),
                          [device] { return eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr); }});
  }
  if (found == 0) tried += std::string("; ") + kind + " devices: none among " + std::to_string(count);
}

/// The EGL displays to try for a choice, in the order that docs/rendering.md states.
std::vector<Candidate> candidatesFor(GlChoice choice, std::string& tried) {
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  std::vector<Candidate> candidates;
  if (choice != GlChoice::software) addDevices(client, false, candidates, tried);
  if (choice != GlChoice::hardware) addDevices(client, true, candidates, tried);
  if (hasExtension(client, "EGL_EXT_platform_base") && hasExtension(client, "EGL_MESA_platform_surfaceless"))
    candidates.push_back(
        {"surfaceless Mesa",
         [] { return eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr); }});
  else
    tried += "; surfaceless Mesa: not offered by EGL";
  candidates.push_back({"default display", [] { return eglGetDisplay(EGL_DEFAULT_DISPLAY); }});
  return candidates;
}

/// Creates an OpenGL context on a display. Throws `Error` with the reason if that fails.
EGLContext createContext(EGLDisplay display) {
  if (display == EGL_NO_DISPLAY) throw Error("no such display");
  // The display is initialised but never terminated: it belongs to the whole process, EGL does not count its
  // initialisations, and another part of the program may use it.
  if (!eglInitialize(display, nullptr, nullptr)) throw Error("does not initialise, " + eglErrorText());
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  for (const char* needed : {"EGL_KHR_no_config_context", "EGL_KHR_surfaceless_context", "EGL_KHR_create_context"})
    if (!hasExtension(extensions, needed)) throw Error(std::string("lacks ") + needed);
  if (!eglBindAPI(EGL_OPENGL_API)) throw Error("has no desktop OpenGL");
  constexpr EGLint kAttributes[] = {
      EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  const EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kAttributes);
  if (context == EGL_NO_CONTEXT) throw Error("gives no OpenGL 4.5 core context, " + eglErrorText());
  return context;
}

const char* choiceText(GlChoice choice) {
  if (choice == GlChoice::automatic) return "on any device";
  return choice == GlChoice::software ? "on a software device" : "on a hardware device";
}

[[noreturn]] void noContext(GlChoice choice, std::string_view tried) {
  const char* advice = choice == GlChoice::hardware ? "install the graphics driver, choose software or automatic"
                                                    : "install libegl-mesa0 and libgl1-mesa-dri";
  throw GlError(std::string("no OpenGL 4.5 through EGL ") + choiceText(choice) + " (tried " + std::string(tried) +
                "): " + advice);
}

}  // namespace

struct EglContext::Current::Before {
  EGLDisplay display;
  EGLContext context;
  EGLSurface draw, read;
  EGLenum api;
  EGLDisplay ours;
};

EglContext::Current::Current(const EglContext& context)
    : before_(new Before{eglGetCurrentDisplay(), eglGetCurrentContext(), eglGetCurrentSurface(EGL_DRAW),
                         eglGetCurrentSurface(EGL_READ), eglQueryAPI(), context.display_}) {
  if (context.process_ != getpid())
    throw Error("this renderer belongs to the process from which this one was forked: make a new one");
  eglBindAPI(EGL_OPENGL_API);
  if (!eglMakeCurrent(context.display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context.context_)) {
    const std::string reason = eglErrorText();
    eglBindAPI(before_->api);
    throw Error("the OpenGL context cannot be made current (" + reason + "): use a renderer on one thread at a time");
  }
}

EglContext::Current::~Current() {
  if (before_->context == EGL_NO_CONTEXT)
    eglMakeCurrent(before_->ours, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  else
    eglMakeCurrent(before_->display, before_->draw, before_->read, before_->context);
  eglBindAPI(before_->api);
}

EglContext::EglContext(GlChoice choice) : process_(getpid()) {
  static const int first = process_;
  if (process_ != first)
    throw GlError("OpenGL was used before this process was forked, and would hang: start processes anew (\"spawn\")");
  const std::string missing = missingLibraries();
  if (!missing.empty()) noContext(choice, missing);
  std::string tried;
  for (const Candidate& candidate : candidatesFor(choice, tried)) {
    try {
      open(candidate.display(), choice);
      return;
    } catch (const Error& error) {
      tried += "; " + candidate.name + ": " + error.what();
    }
  }
  noContext(choice, std::string_view(tried).substr(2));
}

void EglContext::open(void* display, GlChoice choice) {
  display_ = display;
  context_ = createContext(display_);
  try {
    const Current current(*this);
    renderer_ = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    if (choice != GlChoice::automatic && isSoftware(renderer_) != (choice == GlChoice::software))
      throw Error("\"" + renderer_ + "\" is " + (choice == GlChoice::software ? "not " : "") + "a software renderer");
  } catch (const Error&) {
    eglDestroyContext(display_, context_);
    throw;
  }
}

EglContext::~EglContext() {
  if (process_ == getpid()) eglDestroyContext(display_, context_);
}

}  // namespace hpsdf::render
