// The functions of legendre.h that work on a number or on a SIMD vector of numbers (type `Number`). legendre.h
// includes this file for plain numbers. Files with SIMD code include this file once more for each instruction
// set, because Highway compiles the code for an instruction set within a namespace of its own.

/// Computes values[i] = L_i(t) for i = 0..degree by the three-term recurrence (Koschier et al. 2016, eq. 4) in
/// the form L_{i+1} = t L_i + (t L_i - L_{i-1}) i/(i+1). The ratios i/(i+1) are tabulated, because divisions
/// would take most of the time.
template <typename Number>
inline void legendreValues(std::type_identity_t<Number> t, int degree, Number* values) {
  values[0] = Number(1);
  if (degree == 0) return;
  values[1] = t;
  for (int i = 1; i < degree; ++i) {
    const Number product = t * values[i];
    values[i + 1] = product + (product - values[i - 1]) * Number(hpsdf::basis::kLegendreRatio[i]);
  }
}

/// Computes values[i] = L_i(t) and derivatives[i] = L_i'(t) for i = 0..degree. The derivatives follow from the
/// recurrence L_i' = L_{i-2}' + (2i-1) L_{i-1}, which also holds at t = ±1.
template <typename Number>
inline void legendreValuesAndDerivatives(std::type_identity_t<Number> t, int degree, Number* values,
                                         Number* derivatives) {
  legendreValues(t, degree, values);
  derivatives[0] = Number(0);
  if (degree == 0) return;
  derivatives[1] = Number(1);
  for (int i = 2; i <= degree; ++i) derivatives[i] = derivatives[i - 2] + Number(2 * i - 1) * values[i - 1];
}
