#pragma once

#include <cstddef>

#include "hpsdf/build.h"

namespace hpsdf {

/// Throws `Error` for the first setting or domain that is out of range; for a base grid that memory cannot hold, too.
void checkBuild(const Box& domain, const BuildOptions& options);

/// The degree with which base cells start.
int startDegree(const BuildOptions& options);

/// L, by which τ is scaled (see `BuildOptions::targetError`). Throws `Error` for a surface without extent.
double referenceLength(const Source& source, const Box& domain);

/// τ in the field's own units^5. Throws `Error` where that is no number that a double holds.
double scaledTarget(const BuildOptions& options, double referenceLength);

/// Throws `Error` where a tree of so many nodes and coefficients would not fit into the machine's memory.
void checkFitsMemory(std::size_t nodes, std::size_t coefficients);

}  // namespace hpsdf
