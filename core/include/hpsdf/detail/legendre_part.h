#pragma once
// Expresses the polynomial of a cell in the local coordinates of a part of the cell.

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "hpsdf/types.h"

namespace hpsdf::detail {

/// The coefficients row[i][a] that express Legendre polynomials L_i of a shifted and scaled argument: for each i,
/// L_i(shift + scale·t) = Σ_a row[i][a] L_a(t) over a ≤ i. Rows above the highest degree needed are not set.
using LegendreRows = std::array<std::array<double, kMaxDegree + 2>, kMaxDegree + 2>;

inline LegendreRows legendreOfPart(double shift, double scale, int degree) {
  LegendreRows row;
  row[0][0] = 1;
  for (int i = 0; i < degree; ++i) {
    std::array<double, kMaxDegree + 2> product;  // coefficients of u·L_i(u), u = shift + scale·t
    std::fill_n(product.begin(), i + 2, 0.0);
    for (int a = 0; a <= i; ++a) {
      product[a] += shift * row[i][a];
      product[a + 1] += scale * row[i][a] * (a + 1) / (2 * a + 1);
      if (a > 0) product[a - 1] += scale * row[i][a] * a / (2 * a + 1);
    }
    for (int a = 0; a <= i + 1; ++a)
      row[i + 1][a] = ((2 * i + 1) * product[a] - (a < i ? i * row[i - 1][a] : 0)) / (i + 1);
  }
  return row;
}

/// Converts the coefficients c of a cell's polynomial to the local coordinates of a part of the cell, along one axis.
/// `rows` is the result of `legendreOfPart` for the part along this axis. c is a cube of (degree + 1)³ numbers, z
/// fastest, with zeros above the total degree.
inline void restrictToPart(std::span<double> c, int degree, int axis, const LegendreRows& rows) {
  const int n = degree + 1;
  const std::array<std::size_t, 3> stride = {std::size_t(n) * n, std::size_t(n), 1};
  for (int j = 0; j < n; ++j)
    for (int k = 0; j + k < n; ++k) {
      double* const line = &c[j * stride[(axis + 1) % 3] + k * stride[(axis + 2) % 3]];
      for (int a = 0; a + j + k < n; ++a) {  // a ascends, because each sum reads the old coefficients from a upwards
        double sum = 0;
        for (int i = a; i + j + k < n; ++i) sum += line[i * stride[axis]] * rows[i][a];
        line[a * stride[axis]] = sum;
      }
    }
}

}  // namespace hpsdf::detail
