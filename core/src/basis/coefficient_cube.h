#pragma once
// The coefficients of a polynomial as a cube of numbers, in which they can be converted axis by axis to the coordinates
// of a part of the cell (`restrictToPart`).

#include <array>
#include <cstddef>
#include <vector>

#include "basis/projection.h"
#include "hpsdf/detail/legendre_part.h"

namespace hpsdf::basis {

/// Index of a coefficient in a cube of (degree + 1)³ numbers.
inline std::size_t cubeIndex(int i, int j, int k, int degree) {
  return (std::size_t(i) * (degree + 1) + j) * (degree + 1) + k;
}

/// Arranges the coefficients of a polynomial of degree `own` as a cube of (degree + 1)³ numbers. `degree` is at least
/// `own`.
template <typename T>
std::vector<double> cubeFrom(const T* coefficients, int own, int degree) {
  std::vector<double> cube(cubeIndex(degree, degree, degree, degree) + 1, 0.0);
  forEachCoefficient(own,
                     [&](int i, int j, int k, int index) { cube[cubeIndex(i, j, k, degree)] = coefficients[index]; });
  return cube;
}

/// Transforms the coefficients of a polynomial, as a cube, to the coordinates of a part of its cell, one axis at a
/// time.
inline std::vector<double> partCoefficients(std::vector<double> cube, int degree,
                                            const std::array<const detail::LegendreRows*, 3>& rows) {
  for (int axis = 0; axis < 3; ++axis) detail::restrictToPart(cube, degree, axis, *rows[axis]);
  return cube;
}

}  // namespace hpsdf::basis
