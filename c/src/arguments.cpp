#include "arguments.h"

#include <cstdint>
#include <string>
#include <string_view>

#include "call.h"

namespace hpsdf::c {

void requireArray(const void* array, std::size_t count, std::size_t elementBytes, const char* name) {
  if (count > PTRDIFF_MAX / elementBytes)
    throw Error(ErrorKind::limit, name, "an array of " + std::to_string(count) + " elements fits into no memory");
  if (count > 0) requirePointer(array, name);
}

std::span<const Vector3> vectorsOf(const double* array, std::size_t count, const char* name) {
  return arrayOf(reinterpret_cast<const Vector3*>(array), count, name);
}

std::span<Vector3> vectorsOf(double* array, std::size_t count, const char* name) {
  return arrayOf(reinterpret_cast<Vector3*>(array), count, name);
}

Progress progressOf(const hpsdf_progress* given) {
  if (given == nullptr) return {};
  Progress progress;
  if (given->report != nullptr)
    progress.report = [given](std::string_view task, double fraction) {
      given->report(given->user, std::string(task).c_str(), fraction);
    };
  if (given->cancelled != nullptr) progress.cancelled = [given] { return given->cancelled(given->user) != 0; };
  return progress;
}

}  // namespace hpsdf::c
