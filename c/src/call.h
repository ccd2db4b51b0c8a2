#pragma once
// Every function of the C interface runs in `guarded`: no exception leaves it, and its error becomes a status and a
// message.

#include <stdexcept>
#include <string>

#include "hpsdf.h"

namespace hpsdf::c {

/// Thrown for an argument of a C function that it cannot use.
class ArgumentError : public std::runtime_error {
 public:
  ArgumentError(const char* name, const char* problem) : std::runtime_error(std::string(name) + ": " + problem) {}
};

/// Thrown where a function of the caller's has returned an error.
class CallbackError : public std::runtime_error {
 public:
  explicit CallbackError(int code)
      : std::runtime_error("the function of the distance has returned " + std::to_string(code)) {}
};

/// Keeps the message of the exception that is being handled, for `hpsdf_last_error`, and returns its status.
hpsdf_status statusOfException() noexcept;

/// Calls `body`, which may throw anything, and returns the status.
template <typename Body>
hpsdf_status guarded(const Body& body) noexcept {
  try {
    body();
    return HPSDF_OK;
  } catch (...) {
    return statusOfException();
  }
}

/// Throws `ArgumentError` if the argument `name` is NULL.
template <typename T>
void requirePointer(const T* pointer, const char* name) {
  if (pointer == nullptr) throw ArgumentError(name, "expected a pointer, got NULL");
}

/// Makes the object to which `*made` shall point from what `make` returns. On an error, `*made` is NULL.
template <typename Object, typename Make>
hpsdf_status create(Object** made, const char* name, const Make& make) noexcept {
  return guarded([&] {
    requirePointer(made, name);
    *made = nullptr;
    *made = new Object{make()};
  });
}

}  // namespace hpsdf::c
