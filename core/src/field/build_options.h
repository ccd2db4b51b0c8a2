#pragma once

#include "hpsdf/build.h"

namespace hpsdf {

/// Throws `Error` for the first setting or domain that is out of range; for a base grid that memory cannot hold, too.
void checkBuild(const Box& domain, const BuildOptions& options);

/// The degree with which base cells start.
int startDegree(const BuildOptions& options);

/// L, by which τ is scaled (see `BuildOptions::targetError`). Throws `Error` for a surface without extent.
double referenceLength(const Source& source, const Box& domain);

}  // namespace hpsdf
