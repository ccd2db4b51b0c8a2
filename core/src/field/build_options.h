#pragma once

#include <cstddef>

#include "field/nearness.h"
#include "hpsdf/build.h"

namespace hpsdf {

/// The degree with which base cells start.
int startDegree(const BuildOptions& options);

/// L, by which τ is scaled (see `BuildOptions::targetError`). Throws `Error` for a surface without extent.
double referenceLength(const Source& source, const Box& domain);

/// What is asked for, in the field's own units.
ErrorGoal errorGoal(const BuildOptions& options, double referenceLength);

/// Bytes of a coefficient as it will be kept, where a limit of bytes must know.
double coefficientBytes(const BuildOptions& options);

/// Throws `Error` where a tree of so many nodes and coefficients would not fit into the machine's memory.
void checkFitsMemory(std::size_t nodes, std::size_t coefficients);

}  // namespace hpsdf
