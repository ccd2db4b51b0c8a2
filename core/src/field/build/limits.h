#pragma once

#include <cstddef>

#include "field/nearness.h"
#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"

namespace hpsdf {

/// The degree with which base cells start.
int startDegree(const BuildOptions& options);

/// L, by which τ is scaled (see `BuildOptions::targetError`). Throws `Error` for a surface without extent.
double referenceLength(const Source& source, const Box& domain);

/// What is asked for, in the field's own units.
ErrorGoal errorGoal(const BuildOptions& options, double referenceLength);

/// Bytes of a coefficient as it will be kept, where a limit of bytes must know.
double coefficientBytes(const BuildOptions& options);

/// What has grown so far, and how many times as much there will be.
struct Growth {
  std::size_t nodes = 0, coefficients = 0;
  double times = 1;      ///< 1 where there is no telling
  std::size_t held = 0;  ///< bytes besides, which do not grow
};

/// Throws `Error` where a tree like this, and what is held besides, does not fit into the memory that is allowed, or
/// will not in the end.
void checkFitsMemory(const Growth& growth, const BuildOptions& options);

/// Throws `Error` for the first setting or domain that is out of range, see `checkBuild`.
void checkOptions(const Box& domain, const BuildOptions& options);

}  // namespace hpsdf
