// Part of legendre.h that works on a number or on a vector of numbers (`Number`): included within a namespace, by
// legendre.h and, as code for an instruction set must stand where that set is chosen, again for each set that has
// vectors.

/// values[i] = L_i(t) for i = 0..degree, by the three-term recurrence (paper, eq. 4), here as
/// L_{i+1} = t L_i + (t L_i - L_{i-1}) i/(i+1): a division a degree would take longer than all the rest.
template <typename Number>
inline void legendreValues(std::type_identity_t<Number> t, int degree, Number* values) {
  values[0] = Number(1);
  if (degree == 0) return;
  values[1] = t;
  for (int i = 1; i < degree; ++i) {
    const Number product = t * values[i];
    values[i + 1] = product + (product - values[i - 1]) * Number(kLegendreRatio[i]);
  }
}

/// Also derivatives[i] = L_i'(t), by L_i' = L_{i-2}' + (2i-1) L_{i-1}, which holds at the ends of the interval too.
template <typename Number>
inline void legendreValuesAndDerivatives(std::type_identity_t<Number> t, int degree, Number* values,
                                         Number* derivatives) {
  legendreValues(t, degree, values);
  derivatives[0] = Number(0);
  if (degree == 0) return;
  derivatives[1] = Number(1);
  for (int i = 2; i <= degree; ++i) derivatives[i] = derivatives[i - 2] + Number(2 * i - 1) * values[i - 1];
}
