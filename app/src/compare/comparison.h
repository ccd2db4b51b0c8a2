#pragma once
// Measures several fields of one surface at the same random points.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "console/console.h"
#include "construction/reference_surface.h"
#include "hpsdf/field.h"
#include "hpsdf/verify.h"
#include "session/current_field.h"

namespace hpsdf::app {

struct CompareOptions {
  std::size_t points = 1'000'000;  ///< number of points, half uniform in the domain, half near the surface
  std::uint64_t seed = 1;
  double near = 0;        ///< greatest distance of points near the surface; 0: 1 % of the surface's longest side
  double band = 0;        ///< greatest |Φ| of the uniform points; 0: the narrowest band of the fields, else no limit
  std::size_t worst = 5;  ///< number of worst places of each field
  int threads = 0;
  bool times = true;  ///< measures the time of queries, which differs from run to run
};

/// Errors at the points of a range of |Φ|.
struct ErrorBin {
  double from, to;  ///< the range of |Φ|
  std::size_t points;
  double rms, max;

  double middle() const;  ///< geometric mean of the range
};

/// Seconds that a query of the value takes at a random point of the domain, on one thread.
struct QueryTimes {
  double single, batched;
};

/// A place at which the error of field number `field` is among its greatest, with the values of all fields there.
struct WorstPlace {
  std::size_t field;
  Vector3 point;
  double exact;                ///< Φ
  std::vector<double> values;  ///< f of each field
};

struct FieldFigures {
  std::string letter;  ///< "A" for the first field
  std::string file;
  std::size_t fileBytes;
  FieldStatistics counts;
  ErrorFigures near = {}, domain = {};
  std::size_t wrongSigns = 0;    ///< number of points, of both kinds, at which f and Φ have different signs
  double farthestWrongSign = 0;  ///< greatest |Φ| of these points
  double tornShare = 0;          ///< share of the surface that jumps tear (`tornShare`)
  std::vector<ErrorBin> bins = {};
  std::optional<QueryTimes> times = {};
};

struct FieldComparison {
  std::string surface;
  std::string unit;        ///< unit of all lengths: "mesh units" or "normalized units"
  CompareOptions options;  ///< with the `near` and the `band` that were used
  Box domain;              ///< part of space in which all fields are defined
  std::vector<FieldFigures> fields;
  std::vector<WorstPlace> worst;  ///< the worst places of the first field, then of the second, and so on
};

/// Returns the part of space in which all fields are defined. Throws `Error` if there is none.
Box commonDomain(const std::vector<CurrentField>& fields);

/// Measures the fields. The points are those of `verify` if all fields have the same domain. Otherwise they lie where
/// all domains overlap. All figures but times are the same for any number of threads. Throws `Error` if the domains do
/// not overlap, and `Cancelled` after Ctrl-C.
FieldComparison compareFields(const Console& console, const std::vector<CurrentField>& fields,
                              const ReferenceSurface& reference, const CompareOptions& options);

/// Measures the time of queries. Queries of all fields alternate, and the minimum of many repetitions counts, so that
/// other work of the machine changes the ratios little. `progress` may cancel the measurement.
std::vector<QueryTimes> queryTimes(const std::vector<CurrentField>& fields, const Box& domain, std::uint64_t seed,
                                   const Progress& progress);

}  // namespace hpsdf::app
