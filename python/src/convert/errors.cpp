#include "convert/errors.h"

#include <array>
#include <exception>
#include <string>

#include "hpsdf/app/failed.h"
#include "hpsdf/error.h"

namespace py = pybind11;

namespace hpsdf::python {
namespace {

/// The exception class for a kind of error. It derives from `Error` and from an exception of Python's own, so that code
/// that knows nothing of this module catches it too.
struct ErrorClass {
  ErrorKind kind;
  const char* name;
  PyObject* parent;  ///< of Python's own exceptions
  const char* doc;
};

PyObject* baseClass = nullptr;  // the module's classes live as long as the process
std::array<PyObject*, 6> classesByKind = {};
PyObject* expectationClass = nullptr;

PyObject* newClass(py::module_& module, const char* name, const char* doc, const py::tuple& parents) {
  const std::string fullName = std::string("hpsdf.") + name;
  PyObject* made = PyErr_NewExceptionWithDoc(fullName.c_str(), doc, parents.ptr(), nullptr);
  if (made == nullptr) throw py::error_already_set();
  module.add_object(name, py::reinterpret_borrow<py::object>(made));
  return made;
}

/// Raises an error of the library as an object of the class `raisedClass`, with the attribute `subject`.
void raise(const Error& error, PyObject* raisedClass) {
  const auto type = py::reinterpret_borrow<py::object>(raisedClass);
  const py::object raised = type(error.what());
  raised.attr("subject") = error.subject();
  PyErr_SetObject(type.ptr(), raised.ptr());
}

}  // namespace

void addErrors(py::module_& module) {
  baseClass = newClass(module, "Error",
                       "An error of the library. Its text is one line that says what is wrong, where, and what to do "
                       "about it.\n\n`subject` is the file, the option or the shape that the error is about, or ''.",
                       py::make_tuple(py::handle(PyExc_Exception)));
  const std::array classes = {
      ErrorClass{ErrorKind::option, "OptionError", PyExc_ValueError,
                 "An option, or a parameter of a shape, has a value that is not accepted."},
      ErrorClass{ErrorKind::file, "FileError", PyExc_OSError,
                 "A file cannot be read, is damaged, or cannot be written."},
      ErrorClass{ErrorKind::mesh, "MeshError", PyExc_ValueError, "A mesh or a shape cannot be used."},
      ErrorClass{ErrorKind::field, "FieldError", PyExc_ValueError,
                 "A field does not support the operation that the caller asks for."},
      ErrorClass{ErrorKind::limit, "LimitError", PyExc_MemoryError,
                 "The work would exceed the memory, or the largest count that the data structures can hold."}};
  classesByKind.fill(baseClass);
  for (const ErrorClass& row : classes)
    classesByKind[static_cast<std::size_t>(row.kind)] =
        newClass(module, row.name, row.doc, py::make_tuple(py::handle(baseClass), py::handle(row.parent)));
  expectationClass = newClass(module, "ExpectationError",
                              "A figure is not what a script expects, or exceeds a limit that the caller set.",
                              py::make_tuple(py::handle(baseClass), py::handle(PyExc_AssertionError)));
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const app::Failed& error) {
      raise(error, expectationClass);
    } catch (const Error& error) {
      raise(error, classesByKind[static_cast<std::size_t>(error.kind())]);
    }
  });
}

}  // namespace hpsdf::python
