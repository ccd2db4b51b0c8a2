#pragma once

#include <cstdint>
#include <optional>

#include "field/build/limits.h"
#include "field/cells/build_tree.h"
#include "field/cells/exact_leaves.h"
#include "field/tolerance/tolerance_fit.h"
#include "hpsdf/build_options.h"
#include "hpsdf/detail/field_data.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"

namespace hpsdf::detail {

/// The objects that decide about the cells of a construction within a tolerance. It keeps references to the arguments
/// of its constructor.
struct ToleranceSetup {
  ToleranceSetup(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                 const Progress& progress);

  double referenceLength;
  BuildTree tree;  ///< without nodes
  ToleranceFitter fitter;
  ByteBudget budget;
  std::optional<ExactCells> exact;
  std::uint32_t maxDepth;  ///< greatest depth at which cell indices are whole numbers of 32 bits
};

/// Builds a field within `BuildOptions::tolerance`, and seeks the one that takes the fewest bytes. Its coefficients are
/// rounded, and its bounds computed, as the options ask for. Makes a forecast early: after a tenth of the work if this
/// takes long, and after a third of it at the latest. Throws `Error` if the field does not fit into the allowed memory:
/// at the latest when the forecast is made if that shows it.
FieldData buildWithinTolerance(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                               const Progress& progress);

}  // namespace hpsdf::detail
