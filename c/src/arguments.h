#pragma once
// From the arguments of C functions to the types of the library.

#include <cstddef>
#include <span>

#include "hpsdf.h"
#include "hpsdf/error.h"
#include "hpsdf/types.h"

namespace hpsdf::c {

static_assert(sizeof(Vector3) == 3 * sizeof(double), "an array of n times three numbers is an array of n vectors");

/// Throws `Error` of the kind `limit` if an array of so many elements would be larger than memory can be, and
/// `ArgumentError` if an array of any elements is NULL.
void requireArray(const void* array, std::size_t count, std::size_t elementBytes, const char* name);

/// Return the array of `count` elements that begins at a pointer.
template <typename T>
std::span<T> arrayOf(T* array, std::size_t count, const char* name) {
  requireArray(array, count, sizeof(T), name);
  return {array, count};
}

std::span<const Vector3> vectorsOf(const double* array, std::size_t count, const char* name);
std::span<Vector3> vectorsOf(double* array, std::size_t count, const char* name);

/// Returns the progress that calls the caller's functions, which `given` points to unless it is NULL.
Progress progressOf(const hpsdf_progress* given);

}  // namespace hpsdf::c
