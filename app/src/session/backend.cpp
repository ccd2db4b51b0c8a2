#include "session/backend.h"

#include <fmt/format.h>

#include "hpsdf/error.h"

namespace hpsdf::app {

std::unique_ptr<render::Renderer> makeRenderer(const Field& field, const Backend& backend) {
  // OpenGL would need all coefficients in memory.
  const bool onCpu = backend.cpu || (field.isMapped() && backend.gl == render::GlChoice::automatic);
  return onCpu ? render::makeCpuRenderer(field) : render::makeGlRenderer(field, backend.gl);
}

std::vector<Parameter> backendParameters() {
  return {{"cpu", flag().under(kPicture),
           "Draws in double precision on the CPU, without OpenGL. It is slow; use it as the reference, or where there "
           "is no OpenGL."},
          {"gl", choice({"auto", "software", "hardware"}).byDefault("auto").under(kPicture).advanced(),
           "Selects the OpenGL device. auto takes a graphics card where there is one, else software."}};
}

render::GlChoice glChoice(const Arguments& arguments) {
  const std::string gl = arguments.text("gl");
  if (gl == "auto") return render::GlChoice::automatic;
  return gl == "software" ? render::GlChoice::software : render::GlChoice::hardware;
}

Backend backend(const Arguments& arguments) {
  if (arguments.flag("cpu") && arguments.given("gl"))
    throw Error(fmt::format("cpu excludes gl ({}): give one or the other", arguments.text("gl")));
  return {arguments.flag("cpu"), glChoice(arguments)};
}

}  // namespace hpsdf::app
