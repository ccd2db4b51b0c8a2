#include "session.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "convert/waiting.h"
#include "hpsdf/app/interpreter.h"
#include "hpsdf/field.h"
#include "hpsdf/render/image.h"
#include "mesh.h"

namespace py = pybind11;
using namespace py::literals;

namespace hpsdf::python {
namespace {

using Words = std::vector<std::pair<std::string, std::string>>;

/// A session of the program's commands, which several threads of Python may call: one at a time works, others wait.
class Session {
 public:
  /// Returns the result of `work`, which is done while no other thread uses the interpreter.
  template <typename Work>
  auto alone(const py::object& progress, const Work& work) {
    return resultOf(progress, [&](const Progress& link) {
      std::unique_lock lock(mutex_, std::defer_lock);
      while (!lock.try_lock_for(std::chrono::milliseconds(50))) link.throwIfCancelled();
      return work(interpreter_, link);
    });
  }

 private:
  std::timed_mutex mutex_;
  app::Interpreter interpreter_;
};

std::vector<app::Option> optionsFrom(const Words& words) {
  std::vector<app::Option> options;
  for (const auto& [name, value] : words) options.push_back({name, value});
  return options;
}

void setField(Session& session, const std::shared_ptr<const Field>& field, const std::string& name) {
  session.alone(py::none(), [&](app::Interpreter& program, const Progress&) {
    program.setField(*field, name);
    return true;
  });
}

void setMesh(Session& session, const std::string& name, const py::object& object) {
  const auto mesh = meshOf(object);
  session.alone(py::none(), [&](app::Interpreter& program, const Progress&) {
    program.setMesh(name, *mesh);
    return true;
  });
}

std::shared_ptr<Field> currentField(Session& session) {
  return session.alone(py::none(), [](app::Interpreter& program, const Progress&) {
    return program.field() == nullptr ? nullptr : std::make_shared<Field>(*program.field());
  });
}

std::string performed(Session& session, const std::string& command, const Words& options, const py::object& progress) {
  return session.alone(progress, [&](app::Interpreter& program, const Progress& link) {
    return program.perform(command, optionsFrom(options), link);
  });
}

std::string ran(Session& session, const std::string& name, const std::string& script, const Words& variables, bool json,
                const py::object& progress) {
  return session.alone(progress, [&](app::Interpreter& program, const Progress& link) {
    return program.run(name, script, optionsFrom(variables), json, link);
  });
}

py::array drawn(Session& session, const std::string& command, const Words& options, const py::object& progress) {
  const render::Image image = session.alone(progress, [&](app::Interpreter& program, const Progress& link) {
    return program.draw(command, optionsFrom(options), link);
  });
  return py::array_t<std::uint8_t>({py::ssize_t{image.height}, py::ssize_t{image.width}, py::ssize_t{3}},
                                   image.pixels.data()->data());
}

std::string output(Session& session) {
  return session.alone(py::none(), [](app::Interpreter& program, const Progress&) { return program.takeOutput(); });
}

std::string notes(Session& session) {
  return session.alone(py::none(), [](app::Interpreter& program, const Progress&) { return program.takeNotes(); });
}

using Pixels = py::array_t<std::uint8_t, py::array::c_style>;

/// Returns the picture of an array of shape (height, width, 3).
render::Image imageOf(const Pixels& pixels) {
  if (pixels.ndim() != 3 || pixels.shape(2) != 3)
    throw py::value_error("pixels: expected an array of uint8 of shape (height, width, 3)");
  render::Image image(static_cast<int>(pixels.shape(1)), static_cast<int>(pixels.shape(0)), {});
  if (!image.pixels.empty()) std::copy_n(pixels.data(), pixels.size(), image.pixels.data()->data());
  return image;
}

/// Returns the bytes of a PNG file.
py::bytes pngOf(const Pixels& pixels) {
  const render::Image image = imageOf(pixels);
  const std::string bytes = [&] {
    const py::gil_scoped_release released;
    return render::pngBytes(image);
  }();
  return {bytes};
}

/// Writes a PNG file, whole or not at all.
void savedAsPng(const Pixels& pixels, const std::filesystem::path& path) {
  const render::Image image = imageOf(pixels);
  const py::gil_scoped_release released;
  render::savePng(image, path);
}

/// Returns (name, accepted values, default, help) for each option of a command.
py::list optionsOf(const std::string& command) {
  py::list rows;
  for (const app::OptionDescription& option : app::optionsOf(command))
    rows.append(py::make_tuple(option.name, option.values, option.defaultText, option.help));
  return rows;
}

}  // namespace

void addSession(py::module_& module) {
  py::class_<Session>(module, "Session", "The program's commands; the class hpsdf.Session is made of it.")
      .def(py::init<>())
      .def("set_field", &setField, "field"_a, "name"_a)
      .def("set_mesh", &setMesh, "name"_a, "mesh"_a)
      .def("field", &currentField)
      .def("perform", &performed, "command"_a, "options"_a, "progress"_a)
      .def("run", &ran, "name"_a, "script"_a, "variables"_a, "json"_a, "progress"_a)
      .def("draw", &drawn, "command"_a, "options"_a, "progress"_a)
      .def("take_output", &output)
      .def("take_notes", &notes);
  module.def("png_of", &pngOf, "pixels"_a);
  module.def("save_png", &savedAsPng, "pixels"_a, "path"_a);
  module.def("options_of", &optionsOf, "command"_a);
}

}  // namespace hpsdf::python
