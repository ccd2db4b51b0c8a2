#pragma once
// The orthonormal Legendre basis: the products √((2i+1)(2j+1)(2k+1)) L_i L_j L_k have a mean square of 1 over a cell.

#include <array>
#include <cstddef>

#include "hpsdf/types.h"

namespace hpsdf::basis {

/// The square roots √(2i+1), rounded alike by every compiler.
constexpr auto kRoot = [] {
  std::array<double, kMaxDegree + 1> roots{};
  for (int i = 0; i <= kMaxDegree; ++i) {
    double root = 1 + i;
    for (int step = 0; step < 12; ++step) root = (root + (2 * i + 1) / root) / 2;  // Newton's method
    roots[i] = root;
  }
  return roots;
}();

/// Returns √((2i+1)(2j+1)(2k+1)).
constexpr double norm(int i, int j, int k) { return kRoot[i] * kRoot[j] * kRoot[k]; }

/// Returns the number of terms of total degree `degree`.
constexpr int termsOfDegree(int degree) { return (degree + 1) * (degree + 2) / 2; }

/// Returns the position of the term (i, j, k) if all terms are ordered by total degree first, then lexicographically.
constexpr int placeByDegree(int i, int j, int k) {
  return coefficientCount(i + j + k - 1) + i * (i + j + k + 1) - i * (i - 1) / 2 + j;
}

/// For the terms of a polynomial of degree P in the order of `FieldData`: their positions by `placeByDegree`.
template <int P>
constexpr auto kPlaceByDegree = [] {
  std::array<int, std::size_t(coefficientCount(P))> places{};
  int index = 0;
  for (int i = 0; i <= P; ++i)
    for (int j = 0; j <= P - i; ++j)
      for (int k = 0; k <= P - i - j; ++k) places[index++] = placeByDegree(i, j, k);
  return places;
}();

}  // namespace hpsdf::basis
