// Evaluation of polynomials at single points and at batches of points. The template parameter `Number` is double or a
// SIMD vector of doubles; the coefficients are double, float or of type `Number`. Like legendre-inl.h, this file is
// included inside a namespace, once for each instruction set.

/// Calls f(0) to f(last).
template <typename F>
[[gnu::always_inline]] inline void forEachUpTo(int last, F&& f) {
  for (int i = 0; i <= last; ++i) f(i);
}
template <int Last, typename F>
[[gnu::always_inline]] inline void forEachUpTo(Constant<Last>, F&& f) {
  [&]<int... I>(std::integer_sequence<int, I...>) __attribute__((always_inline)) { (f(Constant<I>()), ...); }
  (std::make_integer_sequence<int, Last + 1>());
}

/// Adapts the values of Legendre polynomials to the basis of the coefficients. There is nothing to do for arrays of
/// coefficients.
template <typename T, typename Degree, typename Number>
[[gnu::always_inline]] inline void toBasisOf(const T* /*coefficients*/, Degree, Number* /*values*/) {}

/// `c` is a pointer to the coefficients, or an object that is used like one.
template <typename Number, typename Coefficients, typename Degree>
Number evaluatePolynomial(Coefficients c, Degree degree, const std::array<Number, 3>& local) {
  Number x[kDegreeCount<Degree>], y[kDegreeCount<Degree>], z[kDegreeCount<Degree>];
  legendreValues(local[0], degree, x);
  legendreValues(local[1], degree, y);
  legendreValues(local[2], degree, z);
  for (Number* values : {x, y, z}) toBasisOf(c, degree, values);
  Number value(0);
  forEachUpTo(
      degree, [&](auto i) __attribute__((always_inline)) {
        Number plane(0);
        forEachUpTo(
            minus(degree, i), [&](auto j) __attribute__((always_inline)) {
              Number line(0);
              forEachUpTo(
                  minus(minus(degree, i), j), [&](auto k)
                                                  __attribute__((always_inline)) { line += Number(*c++) * z[k]; });
              plane += line * y[j];
            });
        value += plane * x[i];
      });
  return value;
}

/// Returns the value and the three components of the gradient in local coordinates.
template <typename Number, typename Coefficients, typename Degree>
std::array<Number, 4> evaluatePolynomialWithGradient(Coefficients c, Degree degree,
                                                     const std::array<Number, 3>& local) {
  Number x[kDegreeCount<Degree>], y[kDegreeCount<Degree>], z[kDegreeCount<Degree>];
  Number dx[kDegreeCount<Degree>], dy[kDegreeCount<Degree>], dz[kDegreeCount<Degree>];
  legendreValuesAndDerivatives(local[0], degree, x, dx);
  legendreValuesAndDerivatives(local[1], degree, y, dy);
  legendreValuesAndDerivatives(local[2], degree, z, dz);
  for (Number* values : {x, y, z, dx, dy, dz}) toBasisOf(c, degree, values);
  Number value(0), gx(0), gy(0), gz(0);
  forEachUpTo(
      degree, [&](auto i) __attribute__((always_inline)) {
        Number plane(0), planeDy(0), planeDz(0);
        forEachUpTo(
            minus(degree, i), [&](auto j) __attribute__((always_inline)) {
              Number line(0), lineDz(0);
              forEachUpTo(
                  minus(minus(degree, i), j), [&](auto k) __attribute__((always_inline)) {
                    const Number coefficient(*c++);
                    line += coefficient * z[k];
                    lineDz += coefficient * dz[k];
                  });
              plane += line * y[j];
              planeDy += line * dy[j];
              planeDz += lineDz * y[j];
            });
        value += plane * x[i];
        gx += plane * dx[i];
        gy += planeDy * x[i];
        gz += planeDz * x[i];
      });
  return {value, gx, gy, gz};
}
