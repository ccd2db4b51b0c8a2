#pragma once

#include "hpsdf/types.h"

namespace hpsdf::detail {

/// Returns the single-precision number nearest to x. The number goes through memory, because GCC 12 removes both
/// conversions, from double to float and back, where it handles two numbers at a time.
inline double inSinglePrecision(double x) {
  const volatile float single = static_cast<float>(x);
  return single;
}

inline Vector3 inSinglePrecision(const Vector3& x) {
  return {inSinglePrecision(x.x()), inSinglePrecision(x.y()), inSinglePrecision(x.z())};
}

}  // namespace hpsdf::detail
