#pragma once
// The kinds of files that `export` writes.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "language/registry.h"
#include "session/session.h"
#include "text/json.h"

namespace hpsdf::app {

/// The figures that `export` reports about a file that it wrote.
struct ExportReport {
  Json figures;          ///< all but the name and the size of the file
  std::string contents;  ///< what the file holds, such as "33 x 33 x 33 points"
  std::string rows;      ///< further lines of the report, or ""
};

/// A kind of file.
struct ExportKind {
  std::string_view extension;         ///< such as ".cdf"
  std::string_view name;              ///< such as "a cubic grid"
  std::vector<std::string> settings;  ///< names of the parameters that have an effect on files of this kind
  /// Throws `Error` if the arguments cannot be used, or if the program cannot write files of this kind. May be empty.
  std::function<void(const Arguments&)> check;
  /// Writes the current field to the file, without committing it.
  std::function<ExportReport(const Session&, const Arguments&, OutputFile&)> write;
};

/// Returns the kind `.cdf`.
ExportKind cubicGridKind();
/// Returns the kinds of VTK and NumPy: `.vti`, `.vtu`, `.npy`.
std::vector<ExportKind> gridKinds();
/// Returns the kinds of OpenVDB and NanoVDB: `.vdb`, `.nvdb`. A program that was built without these libraries refuses
/// to write them.
std::vector<ExportKind> levelSetKinds();

/// Returns the length that the argument `voxel` gives, or a 256th of the longest side of the domain.
double voxelOf(const Arguments& arguments, const Box& domain);

}  // namespace hpsdf::app
