// Evaluation of polynomials at single points and at batches of points. The template parameter `Number` is double or a
// SIMD vector of doubles; the coefficients are double or float. Like legendre-inl.h, this file is included inside a
// namespace, once for each instruction set.

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

template <typename Number, typename T, typename Degree>
Number evaluatePolynomial(const T* c, Degree degree, const std::array<Number, 3>& local) {
  Number x[kDegreeCount<Degree>], y[kDegreeCount<Degree>], z[kDegreeCount<Degree>];
  legendreValues(local[0], degree, x);
  legendreValues(local[1], degree, y);
  legendreValues(local[2], degree, z);
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
template <typename Number, typename T, typename Degree>
std::array<Number, 4> evaluatePolynomialWithGradient(const T* c, Degree degree, const std::array<Number, 3>& local) {
  Number x[kDegreeCount<Degree>], y[kDegreeCount<Degree>], z[kDegreeCount<Degree>];
  Number dx[kDegreeCount<Degree>], dy[kDegreeCount<Degree>], dz[kDegreeCount<Degree>];
  legendreValuesAndDerivatives(local[0], degree, x, dx);
  legendreValuesAndDerivatives(local[1], degree, y, dy);
  legendreValuesAndDerivatives(local[2], degree, z, dz);
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
